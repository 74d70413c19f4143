"""HTML report of a diagnosis: errors before and after, and the evidence."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from dearig.report.figures import diagnosis as drawn
from dearig.report.figures.channels import channel_figure, evidence_figure
from dearig.report.figures.recordings import comparison_figure
from dearig.report.figures.residual import residual_panels
from dearig.report.pages.head import head_of, origins_of
from dearig.report.pages.html import (
    Picture,
    band_caption,
    fitted_rows,
    picture,
    prefixes,
    write_page,
)
from dearig.report.pages.laws import LawView, law_view
from dearig.report.text.channels import channel_table, channel_title
from dearig.report.text.diagnosis import (
    family_label,
    headline,
    signatures_of,
    step_label,
    summary,
    untried_text,
    warnings,
)
from dearig.report.text.diagnosis_tables import (
    before_after_table,
    dropped_effects,
    experiment_table,
    rankings,
    step_table,
    thesis_before_after_table,
)
from dearig.report.text.estimates import condition_text, effect_table, estimate_table
from dearig.report.text.laws import place_text
from dearig.report.text.numbers import seconds, significant
from dearig.report.text.sentences import describe_model
from dearig.report.text.tables import Table
from dearig.units import SHOWN, readable

if TYPE_CHECKING:
    from dearig.analysis.outcomes import Comparison, DiagnoseOutcome
    from dearig.model.residual import MissingStress, Signature

__all__ = ["diagnosis_contents", "write_diagnosis_report"]

_Of = TypeVar("_Of", "Signature", "MissingStress")

#: Recordings whose residuals are drawn; more would make the page long.
_DRAWN_MAX = 2
_VALIDATION_MAX = 6


@dataclass(frozen=True)
class RecordSection:
    """Section of one recording: sentences, wide figures, small figures."""

    name: str
    words: tuple[str, ...]
    wide: tuple[Picture, ...]
    small: tuple[Picture, ...]


@dataclass(frozen=True)
class FoundEffect:
    """Section of one effect."""

    title: str
    about: str
    evidence: tuple[str, ...]
    law: LawView | None = None
    curves: tuple[Picture, ...] = ()


@dataclass(frozen=True)
class DiagnosisPage:
    """Values of the template; empty tuples leave their sections out."""

    headline: str
    summary: tuple[str, ...]
    warnings: tuple[str, ...]
    errors: tuple[Table, ...]
    thesis_errors: tuple[Table, ...]
    bars: tuple[Picture, ...]
    step_table: Table
    pictures: tuple[Picture, ...]
    steps: tuple[FoundEffect, ...]
    effects: Table
    unnamed: tuple[str, ...]
    channels: tuple[Table, ...]
    channel_pictures: tuple[Picture, ...]
    denied: tuple[str, ...]
    residuals: tuple[RecordSection, ...]
    missing: tuple[RecordSection, ...]
    rankings: tuple[tuple[Table, Table], ...]
    untried: str
    dropped_effects: str
    after: tuple[tuple[str, tuple[str, ...]], ...]
    after_pictures: tuple[Picture, ...]
    experiment_text: str
    experiments: tuple[Table, ...]
    sequence: str
    parameters: Table
    provenance: tuple[tuple[str, tuple[str, ...]], ...]
    film: bool


def write_diagnosis_report(outcome: DiagnoseOutcome, path: str | Path) -> Path:
    """Write the report of a diagnosis to ``path``. Raises ``InputError``."""
    return write_page(path, "diagnosis.html.j2", diagnosis_contents(outcome), (outcome,))


def diagnosis_contents(outcome: DiagnoseOutcome) -> Callable[[], dict[str, Any]]:
    """Return what makes the values of the page of a diagnosis."""

    def contents() -> dict[str, Any]:
        return {
            "d": _page(outcome, prefixes()),
            "title": f"Missing effects: {outcome.title}",
            "lead": "Diagnosis",
            "head": head_of(origins_of((*outcome.after.train, *outcome.after.validation))),
        }

    return contents


def _page(outcome: DiagnoseOutcome, names: Iterator[str]) -> DiagnosisPage:
    finding, kind = outcome.finding, outcome.kind
    changed = bool(finding.steps)
    errors, theirs = [], []
    for heading, before, after in (
        ("Validation recordings", outcome.before.validation, outcome.after.validation),
        ("Training recordings", outcome.before.train, outcome.after.train),
    ):
        if before and after:
            errors.append(before_after_table(heading, before, after, kind))
            by_thesis = f"{heading}, by the thesis's formulas"
            theirs.append(thesis_before_after_table(by_thesis, before, after, kind))
    pairs = [
        *_paired(outcome.before.validation, outcome.after.validation),
        *_paired(outcome.before.train, outcome.after.train),
    ]
    bars: tuple[Picture, ...] = ()
    if not changed:
        pairs = [(after, after) for _, after in pairs]
    with_effects = " (before) and with the effects found (after)" if changed else ""
    if pairs:
        bars = (
            picture(
                drawn.bars_figure(pairs, kind),
                names,
                f"RMS error of every recording with the thesis model{with_effects}. An error at "
                f"the noise floor of its recording is noise alone.",
            ),
        )
    experiments = experiment_table(outcome)
    channels = channel_table(outcome)
    before_it, after_it = signatures_of(outcome)
    worst = sorted(before_it, key=lambda s: -s.rms / s.noise)[:_DRAWN_MAX]
    return DiagnosisPage(
        headline=headline(outcome),
        summary=summary(outcome),
        warnings=warnings(outcome),
        errors=tuple(errors),
        thesis_errors=tuple(theirs),
        bars=bars,
        step_table=step_table(outcome),
        pictures=_validation_pictures(outcome, changed, names),
        steps=_steps(outcome, names),
        effects=effect_table(outcome),
        unnamed=_unnamed(outcome),
        channels=() if channels is None else (channels,),
        channel_pictures=_channel_pictures(outcome, changed, names),
        denied=tuple(readable(_with_full_stop(_capitalised(d.text))) for d in finding.denials),
        residuals=tuple(_residual(s, outcome, changed, names) for s in worst),
        missing=tuple(
            _missing(m, outcome, changed, names)
            for m in finding.missing_before
            if any(m.record == s.record for s in worst)
        ),
        rankings=_rankings(outcome),
        untried=untried_text(outcome),
        dropped_effects=_capitalised(dropped_effects(outcome)),
        after=tuple(
            (s.record, tuple(readable(_with_full_stop(_capitalised(w))) for w in s.words))
            for s in after_it
        ),
        after_pictures=_after_pictures(outcome, worst, names),
        experiment_text=readable(_with_full_stop(outcome.experiment_text)),
        experiments=() if experiments is None else (experiments,),
        sequence="" if outcome.experiment is None else outcome.experiment.sequence.strip(),
        parameters=estimate_table(finding.final, condition_text(outcome)),
        provenance=_provenance(outcome),
        film=kind == "film",
    )


def _paired(
    before: tuple[Comparison, ...], after: tuple[Comparison, ...]
) -> list[tuple[Comparison, Comparison]]:
    first = {c.name: c for c in before}
    return [(first[c.name], c) for c in after if c.name in first]


def _steps(outcome: DiagnoseOutcome, names: Iterator[str]) -> tuple[FoundEffect, ...]:
    from dearig.model.effects import EFFECTS

    found = []
    for step in outcome.finding.steps:
        about = _with_full_stop(EFFECTS[step.effect].summary)
        against: tuple[str, ...] = ()
        if step.indistinguishable_from:
            others = ", ".join(family_label(f) for f in step.indistinguishable_from)
            against = (f"Evidence against: {others} would explain these data equally well.",)
        curves: tuple[Picture, ...] = ()
        if (curve := step.curve) is not None:
            curves = (picture(drawn.curve_figure(curve), names, "The form that was found."),)
        found.append(
            FoundEffect(
                _capitalised(step_label(step)),
                _capitalised(about),
                (*(readable(_with_full_stop(_capitalised(w))) for w in step.evidence), *against),
                law_view(EFFECTS[step.effect]),
                curves,
            )
        )
    return tuple(found)


def _rankings(outcome: DiagnoseOutcome) -> tuple[tuple[Table, Table], ...]:
    """Return for each round the table of the leading candidates, and that of all others."""
    found = []
    for table, made in zip(rankings(outcome), outcome.finding.rounds, strict=True):
        leads = [c.verdict in ("chosen", "indistinguishable") for c in made.candidates]
        sides = [
            tuple(row for row, lead in zip(table.rows, leads, strict=True) if lead is wanted)
            for wanted in (True, False)
        ]
        found.append((replace(table, rows=sides[0]), replace(table, rows=sides[1], note="")))
    return tuple(found)


def _unnamed(outcome: DiagnoseOutcome) -> tuple[str, ...]:
    unnamed = outcome.finding.unnamed
    if unnamed is None:
        return ()
    said = [f"It acts {place_text(unnamed.acts_on)}."]
    if unnamed.signature:
        said.append(_with_full_stop(_capitalised(unnamed.signature)))
    if unnamed.expression:
        said.append(f"As a formula: {unnamed.expression}")
    return tuple(readable(s) for s in said)


def _residual(
    before: Signature, outcome: DiagnoseOutcome, changed: bool, names: Iterator[str]
) -> RecordSection:
    kind = outcome.kind
    after = _same(signatures_of(outcome)[1], before.record) if changed else None
    words = [*before.words, _tests_text(before)]
    if after is not None:
        words += [f"after: {word}" for word in (*after.words, _tests_text(after))]
    when = "before and after, each on its own scale" if after is not None else "over time"
    wide = (
        picture(
            drawn.residual_time_figure(before, after, kind),
            names,
            f"{before.record}: measured minus model, {when}. Dashed lines are the noise floor.",
        ),
        picture(
            drawn.spectra_figure(before, after, kind),
            names,
            f"{before.record}: amplitude density of the residual. White noise would follow the "
            f"dashed line.",
        ),
    )
    small = tuple(
        picture(
            drawn.dependence_figure(d, kind),
            names,
            f"Residual before, against {d.quantity}, which alone explains "
            f"{significant(100.0 * d.explained, 2)} % of its variance.",
        )
        for d in before.dependences
    )
    return RecordSection(
        before.record, tuple(readable(_with_full_stop(_capitalised(w))) for w in words), wide, small
    )


def _tests_text(signature: Signature) -> str:
    """Return how probable the colour of a residual is by noise alone."""
    return (
        f"the correlation time of the residual is {_duration(signature.correlation_time)}; noise "
        f"alone is as correlated with probability {_probability(signature.ljung_box_p)} "
        f"(Ljung-Box test), and changes its sign as seldom with probability "
        f"{_probability(signature.runs_p)} (runs test)"
    )


def _missing(
    missing: MissingStress, outcome: DiagnoseOutcome, changed: bool, names: Iterator[str]
) -> RecordSection:
    after = _same(outcome.finding.missing_after, missing.record) if changed else None
    size = math.sqrt(float(np.mean(missing.stress**2)))
    what = "Maxwell stress" if outcome.kind == "actuator" else "measured stress"
    words = [
        f"The missing stress is {significant(size)} Pa RMS, "
        f"{significant(100.0 * size / missing.scale, 2)} % of the {what} "
        f"({significant(missing.scale)} Pa RMS)."
    ]
    if after is not None:
        left = math.sqrt(float(np.mean(after.stress**2)))
        words.append(f"With the effects found, {significant(left)} Pa RMS remain.")
    wide = (
        picture(
            drawn.missing_time_figure(missing, after),
            names,
            f"{missing.record}: missing stress over time, low-pass filtered at "
            f"{significant(missing.band, 2)} Hz.",
        ),
    )
    small = tuple(
        picture(figure, names, f"Missing stress before, against {name}.")
        for name, figure in drawn.missing_figures(missing, outcome.kind)
    )
    return RecordSection(missing.record, tuple(words), wide, small)


def _validation_pictures(
    outcome: DiagnoseOutcome, changed: bool, names: Iterator[str]
) -> tuple[Picture, ...]:
    shown = SHOWN[outcome.kind]
    found = []
    for before, after in _paired(outcome.before.validation, outcome.after.validation)[
        :_VALIDATION_MAX
    ]:
        named = after.row and after.row != after.name
        label = f"{after.name} ({after.row})" if named else after.name
        last = f"{significant(after.errors.rms * shown.error_factor)} {shown.error_unit} RMS"
        if not changed:
            caption = f"{label}: {last}.{band_caption(after)}"
            found.append(picture(comparison_figure(after), names, caption))
            continue
        first = f"{significant(before.errors.rms * shown.error_factor)}"
        found.append(
            picture(
                drawn.before_after_figure(before, after),
                names,
                f"{label}: {shown.drive.lower()}, {shown.quantity.lower()} measured and by both "
                f"models, and the error before ({first}) and after ({last}); the "
                f"error axes have different scales.{band_caption(before)}{band_caption(after)}",
            )
        )
    return tuple(found)


def _channel_pictures(
    outcome: DiagnoseOutcome, changed: bool, names: Iterator[str]
) -> tuple[Picture, ...]:
    """Draw what each channel says of the leading families, and its residuals in one recording."""
    found, evidence = [], outcome.finding.channel_evidence
    if evidence:
        families = [(" + ".join(map(family_label, f.split(" + "))), said) for f, said in evidence]
        found.append(
            picture(
                evidence_figure(families),
                names,
                "What each channel adds to the criterion of the best model of each leading "
                "family. Positive supports the family; a difference of 10 is odds of 150 to 1.",
            )
        )
    for before, after in _paired(outcome.before.train, outcome.after.train)[:1]:
        for first, last in zip(before.curves, after.curves, strict=True):
            curves = [("before", drawn.BEFORE, first), ("after", drawn.AFTER, last)]
            if not changed:
                curves = [("model", drawn.AFTER, last)]
            found.append(
                picture(
                    channel_figure(curves),
                    names,
                    f"{after.name}: {channel_title(last.name)}, means at 200 Hz, with the "
                    f"prediction, and measured minus predicted. Gain and offset of the channel "
                    f"are fitted. Dashed lines are the noise of a mean.",
                )
            )
    return tuple(found)


def _after_pictures(
    outcome: DiagnoseOutcome, worst: list[Signature], names: Iterator[str]
) -> tuple[Picture, ...]:
    """Draw what distinguishes the final residual of the worst recording from noise."""
    chosen = [c for c in outcome.after.train if worst and c.name == worst[0].record]
    if not chosen:
        return ()
    return tuple(
        picture(figure, names, f"{chosen[0].name}, after: {caption[:1].lower()}{caption[1:]}")
        for figure, caption in residual_panels(chosen[0])
    )


def _provenance(outcome: DiagnoseOutcome) -> tuple[tuple[str, tuple[str, ...]], ...]:
    finding = outcome.finding
    rows = [
        *fitted_rows(outcome.after.train, outcome.after.validation),
        ("Driven by", (f"voltage {outcome.drive}" if outcome.kind == "actuator" else "stretch",)),
        ("Baseline", (describe_model(finding.baseline.model),)),
        ("Model", (describe_model(finding.final.model),)),
        ("Model file", (outcome.model_path or "not written",)),
        ("Simulations", (f"{finding.simulations:,}",)),
        ("Computing time", (seconds(outcome.seconds),)),
    ]
    if outcome.rig:
        rows.insert(0, ("Rig", (outcome.rig,)))
    return tuple(rows)


def _same(of: Sequence[_Of], record: str) -> _Of | None:
    return next((s for s in of if s.record == record), None)


def _duration(value: float) -> str:
    return f"{significant(value * 1e3)} ms" if value < 1.0 else seconds(value)


def _probability(p: float) -> str:
    return "below 0.001" if p < 1e-3 else significant(p, 2)


def _capitalised(text: str) -> str:
    return text[:1].upper() + text[1:]


def _with_full_stop(text: str) -> str:
    return text if text.endswith((".", "!", "?")) else f"{text}."
