"""Tables of a diagnosis, for the terminal, the window and the HTML page."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.outcomes import pooled_noise, pooled_rms
from dearig.report.text.diagnosis import family_label, selection_rms
from dearig.report.text.numbers import NO_VALUE, seconds, significant
from dearig.report.text.sentences import listed
from dearig.report.text.tables import Row, Table
from dearig.units import SHOWN

if TYPE_CHECKING:
    from dearig.analysis.outcomes import Comparison, DiagnoseOutcome
    from dearig.model.diagnosis.results import Round
    from dearig.model.readings.measures import Errors

__all__ = [
    "before_after_table",
    "dropped_effects",
    "experiment_table",
    "pooled_errors",
    "ranking_table",
    "rankings",
    "step_table",
    "thesis_before_after_table",
]


def pooled_errors(comparisons: Sequence[Comparison]) -> Errors | None:
    """Return the errors over all samples of all recordings; None without recordings.

    Relative errors refer to the range (or peak) of all recordings together, so that a recording
    with a small range does not dominate.
    """
    from dearig.model.readings.measures import Errors

    if not comparisons:
        return None
    rms = pooled_rms(comparisons)
    largest = max(c.errors.max for c in comparisons)
    tops = [(np.nanmin(c.measured), np.nanmax(c.measured)) for c in comparisons]
    span = max(t[1] for t in tops) - min(t[0] for t in tops)
    peak = max(abs(end) for ends in tops for end in ends)
    model_span = max(c.model.max() for c in comparisons) - min(c.model.min() for c in comparisons)

    def per_cent(value: float, of: float) -> float:
        return 100.0 * value / of if of > 0.0 else math.inf

    return Errors(
        rms=rms,
        nrmse_pct=per_cent(rms, float(span)),
        max=largest,
        peak_pct=per_cent(rms, float(peak)),
        e_rms_thesis_pct=rms * 1e3 * 100.0,
        e_m_thesis_pct=per_cent(largest, float(model_span)),
        samples=sum(c.errors.samples for c in comparisons),
    )


def _pairs(
    before: Sequence[Comparison], after: Sequence[Comparison]
) -> list[tuple[str, Errors, Errors, float | None]]:
    """Return (name, errors before, errors after, noise) of every recording and of all pooled."""
    first = {c.name: c for c in before}
    rows = [
        (c.marked_name, first[c.name].errors, c.errors, c.noise) for c in after if c.name in first
    ]
    if len(rows) > 1:
        one, two = pooled_errors(before), pooled_errors(after)
        noise = pooled_noise([c for c in after if c.name in first])
        if one is not None and two is not None:
            rows.append(("all", one, two, noise))
    return rows


def before_after_table(
    title: str, before: Sequence[Comparison], after: Sequence[Comparison], kind: str
) -> Table:
    """Return RMS, NRMSE and RMS over noise of every recording, before and after."""
    shown, film = SHOWN[kind], kind == "film"
    rows = []
    for name, one, two, noise in _pairs(before, after):
        both = (one, two)
        cells = [
            name,
            *(significant(e.rms * shown.error_factor) for e in both),
            *(significant(e.peak_pct if film else e.nrmse_pct) for e in both),
            *(significant(e.rms / noise) if noise else NO_VALUE for e in both),
        ]
        rows.append(Row(tuple(cells), mark=name == "all"))
    relative = "RMS %" if film else "NRMSE %"
    head = (
        ("", ""),
        (f"RMS {shown.error_unit}", "before"), ("", "after"),
        (relative, "before"), ("", "after"),
        ("RMS / noise", "before"), ("", "after"),
    )  # fmt: skip
    return Table(title, head, tuple(rows))


def thesis_before_after_table(
    title: str, before: Sequence[Comparison], after: Sequence[Comparison], kind: str
) -> Table:
    """Return the thesis's measures and the largest error of every recording, before and after."""
    shown, film = SHOWN[kind], kind == "film"
    rows = []
    for name, one, two, _ in _pairs(before, after):
        cells = [name]
        if not film:
            cells += [significant(e.e_rms_thesis_pct) for e in (one, two)]
        cells += [significant(e.e_m_thesis_pct) for e in (one, two)]
        cells += [significant(e.max * shown.error_factor) for e in (one, two)]
        rows.append(Row(tuple(cells), mark=name == "all"))
    head = [("", "")]
    if not film:
        head += [("e_rms %", "before"), ("", "after")]
    head += [("e_m %", "before"), ("", "after")]
    head += [(f"Max {shown.error_unit}", "before"), ("", "after")]
    return Table(title, tuple(head), tuple(rows))


def step_table(outcome: DiagnoseOutcome) -> Table:
    """Return the errors of the model after each step: training, selection and validation."""
    shown, finding = SHOWN[outcome.kind], outcome.finding
    stages = [finding.baseline, *(s.stage for s in finding.steps)]
    names = ["thesis model", *(f"+ {s.effect}" for s in finding.steps)]
    rows = []
    for i, (name, stage) in enumerate(zip(names, stages, strict=True)):
        stand = outcome.stands[i] if i < len(stages) - 1 else outcome.after
        if i == 0:
            stand = outcome.before
        fitted, errors = pooled_errors(stand.train), pooled_errors(stand.validation)
        noise = pooled_noise(stand.validation) or outcome.noise
        rows.append(
            Row(
                (
                    name,
                    NO_VALUE if fitted is None else significant(fitted.rms * shown.error_factor),
                    significant(selection_rms(stage, stand.train) * shown.error_factor),
                    NO_VALUE if errors is None else significant(errors.rms * shown.error_factor),
                    NO_VALUE if errors is None else significant(errors.rms / noise),
                ),
                mark=i == len(stages) - 1 and i > 0,
            )
        )
    head = (
        ("Model", ""), ("Training", shown.error_unit), ("Selection", shown.error_unit),
        ("Validation", shown.error_unit), ("Validation", "/ noise"),
    )  # fmt: skip
    note = (
        "RMS errors. Training: recordings that were fitted. Selection: time segments of the "
        "training recordings, each predicted by a fit to the others. Validation: other "
        "recordings, compared once at the end."
    )
    return Table("Step by step", head, tuple(rows), note)


_VERDICTS = {
    "chosen": "chosen",
    "indistinguishable": "nearly as good",
    "better": "less probable",
    "worthless": "no better than chance",
    "failed": "fit failed",
    "denied": "denied by a channel",
}


def ranking_table(found: Round, kept: Collection[str], longest: int | None = None) -> Table:
    """Return the candidates of one round, best first; ``kept`` are the effects of the final model.

    A candidate that was chosen and later replaced is not marked as chosen. With ``longest`` the
    table has at most so many rows, and fewer columns for a terminal.
    """
    brief = longest is not None
    base = f"on top of {listed(found.base)}" if found.base else "on top of the thesis model"
    rows = []
    for c in found.candidates[:longest]:
        cells = [c.effect]
        if not brief:
            cells.append(family_label(c.family))
        denied = c.verdict == "denied"
        cells.append(_share(c.gained))
        if not brief:
            cells += [_share(c.promised), NO_VALUE if denied else significant(c.gain, 3)]
        chosen = c.verdict == "chosen" and c.effect in kept
        verdict = "replaced later" if c.verdict == "chosen" and not chosen else c.verdict
        cells += [NO_VALUE if denied else significant(c.behind, 3), _VERDICTS.get(verdict, verdict)]
        idle = c.verdict in ("worthless", "failed", "denied")
        rows.append(Row(tuple(cells), c.note, idle, chosen))
    head = [("Effect", ""), ("Explains", "%"), ("Behind", "best"), ("Verdict", "")]
    if not brief:
        head[1:1] = [("Family", "")]
        head[3:3] = [("Predicted", "%"), ("Gain", "")]
    rest = len(found.candidates) - len(rows)
    note = f"{found.reason[:1].upper()}{found.reason[1:]}." if found.reason else ""
    if rest:
        note = f"{note} {rest} more candidates are worse."
    return Table(f"Candidates {base}", tuple(head), tuple(rows), note.strip())


def _share(of_one: float) -> str:
    """Return a share in percent, with one decimal."""
    return f"{100.0 * max(of_one, 0.0):.1f}"


def rankings(outcome: DiagnoseOutcome, longest: int | None = None) -> tuple[Table, ...]:
    """Return the table of each round, see ``ranking_table``."""
    kept = {s.effect for s in outcome.finding.steps}
    return tuple(ranking_table(found, kept, longest) for found in outcome.finding.rounds)


def dropped_effects(outcome: DiagnoseOutcome) -> str:
    """Return a sentence on effects that were chosen and later removed; empty without any."""
    finding = outcome.finding
    kept = {s.effect for s in finding.steps}
    gone = dict.fromkeys(r.chosen for r in finding.rounds if r.chosen and r.chosen not in kept)
    if not gone or not kept:
        return ""
    was = "was the best single effect but is" if len(gone) == 1 else "were chosen first but are"
    it = "it adds" if len(gone) == 1 else "they add"
    return (
        f"{listed(gone)} {was} not in the final model: {listed(kept)} together explain more, and "
        f"{it} nothing to them."
    )


def experiment_table(outcome: DiagnoseOutcome) -> Table | None:
    """Return the excitations that were considered, the best first; None without any."""
    experiment = outcome.experiment
    if experiment is None:
        return None
    rows = tuple(
        Row((name, significant(apart), seconds(duration)), mark=name == experiment.name)
        for name, apart, duration in experiment.tried
    )
    head = (("Excitation", ""), ("Separation", "/ noise"), ("Duration", ""))
    note = (
        "Separation: RMS difference between the predictions of the two most similar rivals, "
        "divided by the noise floor. What electrical channels tell counts as more of it."
    )
    return Table("Excitations considered", head, rows, note)
