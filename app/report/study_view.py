"""What is shown of a study: sentences, tables and curves, by the window and when it is reopened."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dearig.analysis.outcomes import Comparison, DiagnoseOutcome, IdentifyOutcome
from dearig.report.as_json import diagnosis_json, outcome_json
from dearig.report.text import diagnosis, diagnosis_tables, sentences, tables
from dearig.report.text.channels import channel_errors, channel_table
from dearig.report.text.estimates import effect_table
from dearig.report.text.tables import Table
from dearig.units import readable

if TYPE_CHECKING:
    from dearig.analysis.study import Residual, Study

__all__ = ["Pair", "StudyView", "view_of"]

#: A recording with the first model, and with the final one where that is another.
Pair = tuple[Comparison, Comparison | None]
#: Sentences and tables, in the order in which they are shown.
Pieces = tuple[str | Table, ...]


@dataclass(frozen=True)
class StudyView:
    """A study as it is shown.

    ``folder`` holds its files, ``made`` is the ISO time of its end. ``about`` are names and values
    of its task. ``result``, ``ranking`` and ``experiment`` are the pages of a study; the last two
    are empty for an identification. ``sequence`` is the proposed experiment as TOML, "" without
    one. ``numbers`` is the result as JSON.
    """

    folder: Path
    made: str
    diagnosed: bool
    kind: str
    headline: str
    about: tuple[tuple[str, str], ...]
    result: Pieces
    warnings: tuple[str, ...]
    ranking: Pieces
    experiment: Pieces
    sequence: str
    pairs: tuple[Pair, ...]
    residuals: tuple[Residual, ...]
    numbers: dict[str, Any]

    @property
    def model(self) -> Path:
        """The model file."""
        return self.folder / "model.toml"

    @property
    def report(self) -> Path:
        """The report."""
        return self.folder / "report.html"

    @property
    def label(self) -> str:
        """Name, time and training recordings of the study, in one line."""
        when = self.made[:16].replace("T", " ")
        return f"{self.folder.name}, {when}: {dict(self.about).get('trained on', '')}"


def view_of(study: Study) -> StudyView:
    """Return what is shown of ``study``, which has just been made."""
    outcome = study.outcome
    diagnosed = isinstance(outcome, DiagnoseOutcome)
    last = outcome.after if isinstance(outcome, DiagnoseOutcome) else outcome
    common: dict[str, Any] = {
        "folder": study.model.parent,
        "made": datetime.now().astimezone().isoformat(timespec="seconds"),
        "diagnosed": diagnosed,
        "kind": outcome.kind,
        "about": (
            ("work", "diagnosis" if diagnosed else "identification"),
            ("trained on", sentences.listed(c.marked_name for c in last.train)),
            (
                "validated on",
                sentences.listed(c.marked_name for c in last.validation) or "no recording",
            ),
            ("branches", str(study.task.branches)),
            ("driven by", study.task.drive),
        ),
        "residuals": study.residuals,
    }
    if isinstance(outcome, DiagnoseOutcome):
        return StudyView(**common, **_diagnosis(outcome))
    return StudyView(**common, **_fit(outcome))


def _diagnosis(outcome: DiagnoseOutcome) -> dict[str, Any]:
    finding = outcome.finding
    pieces: list[str | Table] = list(diagnosis.summary(outcome))
    for heading, before, after in (
        ("Validation recordings", outcome.before.validation, outcome.after.validation),
        ("Training recordings", outcome.before.train, outcome.after.train),
    ):
        if before and after:
            pieces.append(diagnosis_tables.before_after_table(heading, before, after, outcome.kind))
    channels = channel_table(outcome)
    if channels is not None:
        pieces.append(channels)
    pieces.append(diagnosis_tables.step_table(outcome))
    if finding.steps:
        pieces.append(effect_table(outcome))
    rounds = diagnosis_tables.rankings(outcome) or (diagnosis.untried_text(outcome),)
    dropped = diagnosis_tables.dropped_effects(outcome)
    proposal: list[str | Table] = [readable(f"{outcome.experiment_text.rstrip('.')}.")]
    considered = diagnosis_tables.experiment_table(outcome)
    if considered is not None:
        proposal.append(considered)
    both = bool(finding.steps)
    return {
        "headline": diagnosis.headline(outcome),
        "result": tuple(pieces),
        "warnings": diagnosis.warnings(outcome),
        "ranking": (*rounds, dropped) if dropped else tuple(rounds),
        "experiment": tuple(proposal),
        "sequence": "" if outcome.experiment is None else outcome.experiment.sequence,
        "pairs": (
            *_pairs(outcome.before.validation, outcome.after.validation if both else ()),
            *_pairs(outcome.before.train, outcome.after.train if both else ()),
        ),
        "numbers": diagnosis_json(outcome),
    }


def _fit(outcome: IdentifyOutcome) -> dict[str, Any]:
    pieces: list[str | Table] = [
        *sentences.identify_summary(outcome),
        tables.parameter_table(outcome.fit, sentences.fit_is_rejected(outcome)),
        tables.error_table("Training", outcome.train),
    ]
    if outcome.validation:
        pieces += [
            tables.error_table(title, members)
            for title, members in tables.by_thesis_table(outcome.validation, "Validation")
        ]
    channels = channel_errors("Voltage monitor and current", (*outcome.train, *outcome.validation))
    if channels is not None:
        pieces.append(channels)
    return {
        "headline": outcome.title,
        "result": tuple(pieces),
        "warnings": sentences.warnings_of(outcome),
        "ranking": (),
        "experiment": (),
        "sequence": "",
        "pairs": (*_pairs(outcome.validation, ()), *_pairs(outcome.train, ())),
        "numbers": outcome_json(outcome),
    }


def _pairs(before: tuple[Comparison, ...], after: tuple[Comparison, ...]) -> tuple[Pair, ...]:
    last = {c.name: c for c in after}
    return tuple((_marked(c), last.get(c.name)) for c in before)


def _marked(comparison: Comparison) -> Comparison:
    return replace(comparison, name=comparison.marked_name, ended=None)
