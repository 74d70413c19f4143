"""What a diagnosis found, in sentences and tables, for the terminal and for the page alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.outcomes import pooled_rms
from dearig.report.numbers import NO_VALUE, interval, quoted, seconds, significant, symbol
from dearig.report.sentences import listed
from dearig.report.tables import Row, Table
from dearig.units import SHOWN, parameter_unit, readable

if TYPE_CHECKING:
    from dearig.analysis.outcomes import Comparison, DiagnoseOutcome
    from dearig.model.diagnosis.results import Diagnosis, Round, Step
    from dearig.model.fitting import Estimate
    from dearig.model.measures import Errors

__all__ = [
    "HEADLINES",
    "before_after_table",
    "dropped_effects",
    "effect_table",
    "estimate_table",
    "experiment_table",
    "family_label",
    "headline",
    "pooled_errors",
    "ranking_table",
    "step_label",
    "step_table",
    "summary",
    "thesis_before_after_table",
    "warnings",
]

#: The verdicts as headlines.
HEADLINES = {
    "nothing_missing": "Nothing is missing",
    "explained": "Found and explained",
    "partly_explained": "Explained in part",
    "unexplained": "Something is missing, and no known effect explains it",
}


def pooled_errors(comparisons: Sequence[Comparison]) -> Errors | None:
    """Errors over all samples of all recordings: None where there are none.

    The RMS is over all samples, the largest error is that of any; what is relative is relative to
    the range (or peak) of all recordings together, so that a small run does not count for more.
    """
    from dearig.model.measures import Errors

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


# ---------------------------------------------------------------- sentences


def headline(finding: Diagnosis) -> str:
    """The verdict as a headline."""
    if finding.interrupted and not finding.rounds:
        tried = "all effects were" if finding.steps else "anything was"
        return f"Interrupted before {tried} tried"
    return HEADLINES[finding.verdict]


def family_label(family: str) -> str:
    """A family as words."""
    return "of no known family" if family == "unknown" else family.replace("_", " ")


def step_label(step: Step) -> str:
    """A step's effect, its family and where it acts, in words."""
    family = "" if family_label(step.family) == step.effect else f"{family_label(step.family)}, "
    return f"{step.effect} ({family}acting on the {step.acts_on})"


def summary(outcome: DiagnoseOutcome) -> tuple[str, ...]:
    """The verdict, and what it rests on."""
    finding = outcome.finding
    said = [_verdict(outcome)]
    for role, before, after in (
        ("recordings that took no part in any fit or choice", outcome.before.validation,
         outcome.after.validation),
        ("the training recordings", outcome.before.train, outcome.after.train),
    ):  # fmt: skip
        if before and after:
            said.append(_error_change(role, before, after, outcome, bool(finding.steps)))
    if not outcome.after.validation:
        said.append(
            "No untouched recordings were given, so nothing here says how well the model predicts."
        )
    said += [_rivals_sentence(step) for step in finding.steps if step.indistinguishable_from]
    if finding.unnamed is not None:
        said.append(_unnamed(outcome))
    said += outcome.performed
    if finding.rivals and outcome.experiment_words:
        said.append(_sentence(outcome.experiment_words))
    if finding.interrupted:
        said.append(
            "The search was interrupted: this is what had been found until then, and a full run "
            "may find more."
        )
    return tuple(readable(s) for s in said)


def _verdict(outcome: DiagnoseOutcome) -> str:
    finding = outcome.finding
    if finding.interrupted and not finding.rounds:
        if finding.steps:
            return (
                "The search was interrupted before all effects were tried: this one did best until "
                "then, and another may do better."
            )
        return "The search was interrupted before anything was tried: nothing is known yet."
    if finding.verdict == "nothing_missing":
        return (
            f"Nothing is missing: the thesis's model explains these recordings down to the noise"
            f"{_film_tolerance(outcome) or ','} and no other effect improves on it by more than "
            f"chance would."
        )
    names = [step_label(s) for s in finding.steps]
    effects = f"the model lacks {listed(names)}"
    if finding.verdict == "explained":
        left = f"only noise{_film_tolerance(outcome)} is left"
        return f"{effects[0].upper()}{effects[1:]}; with that, {left}."
    if finding.verdict == "partly_explained":
        return (
            f"{effects[0].upper()}{effects[1:]}; that explains part of the residual, and something "
            f"is left that none of the known effects explains."
        )
    tried = f" ({listed(names)} helps, but explains little)" if names else ""
    return f"Something is missing that none of the known effects explains{tried}."


def _film_tolerance(outcome: DiagnoseOutcome) -> str:
    """What may be left besides noise where everything is explained."""
    from dearig.model.diagnosis.bench import FILM_MODEL_ERROR

    film = outcome.kind == "film"
    return f", or {100.0 * FILM_MODEL_ERROR:g} % of the largest stress," if film else ""


def _error_change(
    role: str,
    before: Sequence[Comparison],
    after: Sequence[Comparison],
    outcome: DiagnoseOutcome,
    changed: bool,
) -> str:
    shown = SHOWN[outcome.kind]
    first, last = pooled_rms(before), pooled_rms(after)
    floor = (
        f"the noise floor of {significant(outcome.noise * shown.error_factor)} {shown.error_unit}"
    )
    if not changed:
        return (
            f"On {role} the error is {significant(last * shown.error_factor)} "
            f"{shown.error_unit} RMS, {significant(last / outcome.noise)} times {floor}."
        )
    return (
        f"On {role} the error {'falls' if last < first else 'goes'} from "
        f"{significant(first * shown.error_factor)} to {significant(last * shown.error_factor)} "
        f"{shown.error_unit} RMS, which is {significant(last / outcome.noise)} times {floor}."
    )


def _rivals_sentence(step: Step) -> str:
    return (
        f"These data cannot tell {step.effect} from "
        f"{listed(family_label(f) for f in step.indistinguishable_from)}: each explains them as "
        f"well."
    )


def _unnamed(outcome: DiagnoseOutcome) -> str:
    unnamed = outcome.finding.unnamed
    if unnamed is None:
        return ""
    formula = f"; as a formula: {unnamed.expression}" if unnamed.expression else ""
    return _sentence(f"What no known family covers acts on the {unnamed.acts_on}{formula}")


def _sentence(text: str) -> str:
    return text if text.endswith((".", "!", "?")) else f"{text}."


def warnings(outcome: DiagnoseOutcome) -> tuple[str, ...]:
    """What is to be said of recordings and search, none twice."""
    said = [*outcome.quality, *(w[:1].upper() + w[1:] for w in outcome.finding.notes)]
    for comparison in (*outcome.after.train, *outcome.after.validation):
        said += [f"{comparison.name}: {w}" for w in comparison.warnings]
    return tuple(dict.fromkeys(readable(_sentence(w)) for w in said))


# ---------------------------------------------------------------- tables


def _pairs(
    before: Sequence[Comparison], after: Sequence[Comparison]
) -> list[tuple[str, Errors, Errors, float | None]]:
    """(name, errors before, errors after, noise) of every recording, and of all together."""
    first = {c.name: c for c in before}
    rows = [(c.name, first[c.name].errors, c.errors, c.noise) for c in after if c.name in first]
    if len(rows) > 1:
        one, two = pooled_errors(before), pooled_errors(after)
        floors = [c.noise for c in after if c.noise]
        noise = math.sqrt(sum(n * n for n in floors) / len(floors)) if floors else None
        if one is not None and two is not None:
            rows.append(("all", one, two, noise))
    return rows


def before_after_table(
    title: str, before: Sequence[Comparison], after: Sequence[Comparison], kind: str
) -> Table:
    """RMS, NRMSE and RMS over noise of every recording, with the thesis's model and after."""
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
    """The largest error and the thesis's measures of every recording, before and after."""
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
    """The model step by step: error where it was fitted, where it was chosen, and untouched."""
    shown, finding = SHOWN[outcome.kind], outcome.finding
    stages = [finding.baseline, *(s.stage for s in finding.steps)]
    names = ["thesis's model", *(f"+ {s.effect}" for s in finding.steps)]
    rows = []
    for i, (name, stage) in enumerate(zip(names, stages, strict=True)):
        stand = outcome.stands[i] if i < len(stages) - 1 else outcome.after
        if i == 0:
            stand = outcome.before
        errors = pooled_errors(stand.validation)
        rows.append(
            Row(
                (
                    name,
                    significant(stage.train_rms * shown.error_factor),
                    significant(stage.selection_rms * shown.error_factor),
                    NO_VALUE if errors is None else significant(errors.rms * shown.error_factor),
                    NO_VALUE if errors is None else significant(errors.rms / outcome.noise),
                ),
                mark=i == len(stages) - 1 and i > 0,
            )
        )
    head = (
        ("Model", ""), ("Training", shown.error_unit), ("Selection", shown.error_unit),
        ("Untouched", shown.error_unit), ("Untouched", "/ noise"),
    )  # fmt: skip
    note = (
        "RMS errors. Training: on what was fitted. Selection: on stretches of time in the training "
        "recordings that were predicted by a fit to the others. Untouched: on other recordings, "
        "read once at the end."
    )
    return Table("Step by step", head, tuple(rows), note)


_WORDS = {
    "chosen": "chosen",
    "indistinguishable": "not told apart",
    "better": "helps, but less",
    "worthless": "no better than chance",
    "failed": "could not be fitted",
}


def ranking_table(found: Round, longest: int | None = None) -> Table:
    """The candidates of one round, best first.

    With ``longest`` only so many, and without what a terminal has no room for.
    """
    brief = longest is not None
    base = f"on top of {listed(found.base)}" if found.base else "on top of the thesis's model"
    rows = []
    for c in found.candidates[:longest]:
        cells = [c.effect]
        if not brief:
            cells.append(family_label(c.family))
        cells.append(_share(c.gained))
        if not brief:
            cells += [_share(c.promised), significant(c.gain, 3)]
        cells += [significant(c.behind, 3), _WORDS.get(c.verdict, c.verdict)]
        idle = c.verdict in ("worthless", "failed")
        rows.append(Row(tuple(cells), c.note, idle, c.verdict == "chosen"))
    head = [("Effect", ""), ("Explains", "%"), ("Behind", "best"), ("Verdict", "")]
    if not brief:
        head[1:1] = [("Family", "")]
        head[3:3] = [("Promised", "%"), ("Gain", "")]
    rest = len(found.candidates) - len(rows)
    note = _sentence(found.reason[:1].upper() + found.reason[1:]) if found.reason else ""
    if rest:
        note = f"{note} {rest} more did worse."
    return Table(f"Candidates {base}", tuple(head), tuple(rows), note.strip())


def _share(of_one: float) -> str:
    """In per cent, where less than a tenth says nothing."""
    return f"{100.0 * max(of_one, 0.0):.1f}"


def dropped_effects(outcome: DiagnoseOutcome) -> str:
    """A sentence on what was chosen on the way and is not in the final model; empty without."""
    finding = outcome.finding
    kept = {s.effect for s in finding.steps}
    gone = dict.fromkeys(r.chosen for r in finding.rounds if r.chosen and r.chosen not in kept)
    if not gone or not kept:
        return ""
    was = "was the best alone and is" if len(gone) == 1 else "were the best on the way and are"
    return (
        f"{listed(gone)} {was} not in the final model: {listed(kept)} together explain more, with "
        f"nothing left for it to do."
    )


def effect_table(outcome: DiagnoseOutcome) -> Table:
    """The numbers of the effects that were found, with intervals and meaning."""
    from dearig.model.effects import EFFECTS

    rows = []
    for step in outcome.finding.steps:
        meanings = {p.name: p.meaning for p in EFFECTS[step.effect].parameters}
        for e in step.estimates:
            about = meanings.get(e.name.split(" in ")[0], "")  # of one recording, if so
            detail = "; ".join(w for w in (about, e.note) if w)
            rows.append(_estimate(e, f"{step.effect}: {e.name.replace('_', ' ')}", detail))
    return Table("Numbers of what was found", _ESTIMATES, tuple(rows))


def estimate_table(estimates: Sequence[Estimate]) -> Table:
    """All numbers of a model."""
    rows = tuple(_estimate(e, symbol(e.name).replace("_", " "), e.note) for e in estimates)
    note = ""
    if any(not e.determined for e in estimates):
        note = "Values in brackets are not determined by these data."
    return Table("Parameters", _ESTIMATES, rows, note)


_ESTIMATES = (("", ""), ("Value", ""), ("Unit", ""), ("95 % interval", ""))


def _estimate(e: Estimate, name: str, detail: str) -> Row:
    factor, unit = parameter_unit(e.unit)
    low, high = e.low * factor, e.high * factor
    value = quoted(e.value * factor, low, high)
    within = interval(low, high) if e.free else "follows"
    if e.free and e.low == e.high == e.value:
        within = NO_VALUE
    return Row(
        (name, value if e.determined else f"({value})", unit, within),
        detail,
        muted=not e.determined,
    )


def experiment_table(outcome: DiagnoseOutcome) -> Table | None:
    """The excitations that were considered, the best first; None where there were none."""
    experiment = outcome.experiment
    if experiment is None:
        return None
    rows = tuple(
        Row((name, significant(apart), seconds(duration)), mark=name == experiment.name)
        for name, apart, duration in experiment.tried
    )
    head = (("Excitation", ""), ("Separation", "/ noise"), ("Takes", ""))
    note = (
        "Separation is the RMS difference between the predictions of the two rivals that are "
        "nearest to each other, in noise floors."
    )
    return Table("Excitations considered", head, rows, note)
