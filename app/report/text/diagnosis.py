"""Sentences of a diagnosis, for the terminal, the window and the HTML page."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from dearig.analysis.outcomes import pooled_noise, pooled_rms, pooled_steady_rms
from dearig.model.verdict import NOT_CONFIRMED, NOTHING_MISSING, TOLERANCE
from dearig.report.text.excitation import tested_texts, undetermined_texts
from dearig.report.text.laws import place_text
from dearig.report.text.numbers import significant, symbol, with_symbols
from dearig.report.text.sentences import few_data_text, listed, undetermined_names_text
from dearig.units import SHOWN, readable

if TYPE_CHECKING:
    from dearig.analysis.outcomes import Comparison, DiagnoseOutcome, Evaluation
    from dearig.model.diagnosis.channels import Denial
    from dearig.model.diagnosis.results import Stage, Step
    from dearig.model.residual import Signature

__all__ = [
    "HEADLINES",
    "family_label",
    "headline",
    "selection_rms",
    "signatures_of",
    "step_label",
    "summary",
    "untried_text",
    "warnings",
]

#: Headline of each verdict, and of a verdict that is less than what the search found.
HEADLINES = {
    "nothing_missing": "No missing effect found",
    "explained": "Residual explained",
    "partly_explained": "Residual partly explained",
    "not_confirmed": "Not confirmed: explains the training recordings, does not help on others",
    "unexplained": "Residual not explained by any known effect",
}
_LOWERED = {
    "excitation": "Not determined by these recordings: validation asks for what training lacks",
    "validation": "Training recordings explained, validation recordings not",
    "selection": "Residual partly explained: the cross-validation error rises",
    "training": "Residual partly explained: one training recording keeps more than noise",
    "rest": "Nothing found, but the readings at rest move by more than their noise",
    "stopped": "No missing effect found so far: not every effect was tried",
}


def selection_rms(stage: Stage, train: Sequence[Comparison]) -> float:
    """Return the cross-validation error of a ``stage``, in m or Pa, as errors are counted.

    A fit has a zero of its own for each recording; the errors of a recording are those of its
    readings as they are. What that adds to the ``train`` recordings is added here too.
    """
    if not train:
        return stage.selection_rms
    zero = pooled_rms(train) ** 2 - stage.train_rms**2
    return math.sqrt(max(stage.selection_rms**2 + zero, 0.0))


def signatures_of(
    outcome: DiagnoseOutcome,
) -> tuple[tuple[Signature, ...], tuple[Signature, ...]]:
    """Return the residuals before and after, with the errors that every table has.

    A residual of the search is that of its fit, which has a zero of its own for each recording: two
    numbers for one error.
    """
    found = outcome.finding
    return _as_tabled(found.before, outcome.before, outcome.kind), _as_tabled(
        found.after, outcome.after, outcome.kind
    )


def _as_tabled(
    signatures: Sequence[Signature], stand: Evaluation, kind: str
) -> tuple[Signature, ...]:
    compared, shown = {c.name: c for c in stand.train}, SHOWN[kind]
    tabled = []
    for s in signatures:
        c = compared.get(s.record)
        if c is None or not c.noise:
            tabled.append(s)
            continue
        rms, noise = (significant(v * shown.error_factor) for v in (c.errors.rms, c.noise))
        size = (
            f"{rms} {shown.suffix} RMS, {significant(c.errors.rms / c.noise)} times the noise "
            f"floor of {noise} {shown.suffix}"
        )
        # the noise of a film's signature has the error that its model is allowed
        if s.is_noise and c.errors.rms > TOLERANCE * max(c.noise, s.noise):
            size += ": noise, and slow changes of its own"
        elif s.is_noise:
            size += ": only noise is left"
        tabled.append(replace(s, rms=c.errors.rms, noise=c.noise, words=(size, *s.words[1:])))
    return tuple(tabled)


def headline(outcome: DiagnoseOutcome) -> str:
    """Return the headline: the verdict with the limits of what it rests on."""
    finding, judgement = outcome.finding, outcome.judgement
    if finding.interrupted and not finding.rounds:
        tried = "all effects were" if finding.steps else "any effect was"
        return f"Stopped before {tried} tried"
    said = next((_LOWERED[r] for r in _LOWERED if r in judgement.reasons), "")
    limits = []
    if judgement.verdict == "explained" and any(s.indistinguishable_from for s in finding.steps):
        limits.append("by which effect these data cannot tell")
    if judgement.verdict in ("explained", "nothing_missing") and not outcome.after.validation:
        limits.append("no validation recording was given")
    if judgement.verdict in ("explained", "nothing_missing") and not all(
        s.is_noise for s in finding.after
    ):
        limits.append("what is left is as small as the noise, but does not look like it")
    ended = [c.marked_name for c in outcome.after.train if c.ended and not c.ended.is_cut]
    if ended:
        limits.append(f"ended early: {listed(ended)}")
    if outcome.few_data:
        limits.append(f"little data: {outcome.few_data}")
    if outcome.status != "complete":
        limits.append(_STATUS[outcome.status])
    return "; ".join([said or HEADLINES[judgement.verdict], *limits])


_LIKELY = 0.5  # probability below which a family that is named is more likely not missing
_NOT_EXCLUDED = 0.1  # probability from which on a family that is not named is mentioned

_STATUS = {
    "stopped": "the search was stopped",
    "budget": "the search ended at its computing budget",
}


def family_label(family: str) -> str:
    """Return the name of an effect family in words."""
    return "no known family" if family == "unknown" else family.replace("_", " ")


def step_label(step: Step) -> str:
    """Return a step's effect with its family and the quantity that it acts on."""
    family = "" if family_label(step.family) == step.effect else f"{family_label(step.family)}, "
    return f"{step.effect} ({family}acting {place_text(step.acts_on)})"


def _with_rivals(step: Step) -> str:
    """Return a step's label, and the families that explain these data as well."""
    others = " or ".join(family_label(f) for f in step.indistinguishable_from)
    return f"{step_label(step)}, or {others} in its place" if others else step_label(step)


def summary(outcome: DiagnoseOutcome) -> tuple[str, ...]:
    """Return the verdict and its evidence as sentences."""
    finding = outcome.finding
    said = [*_doubts(outcome), _verdict(outcome)]
    for role, before, after in (
        ("the validation recordings, which no fit and no selection used,",
         outcome.before.validation, outcome.after.validation),
        ("the training recordings", outcome.before.train, outcome.after.train),
    ):  # fmt: skip
        if before and after:
            said.append(_error_change(role, before, after, outcome, bool(finding.steps)))
    if finding.steps and not outcome.recommends_final and outcome.verdict != NOT_CONFIRMED:
        names = [s.effect for s in finding.steps]
        said.append(
            f"Validation recordings are predicted better without {_them(names)}: the model to use, "
            f"and the one that is written, is that without {_them(names)}."
        )
    said += tested_texts(outcome)
    if outcome.few_data:
        said.append(few_data_text(outcome.few_data))
    stated = [symbol(e.name) for e in finding.final.estimates if e.constraint is not None]
    if stated and outcome.is_rejected:
        said.append(
            f"Every fit keeps to what was stated of {listed(stated)}: a wrong value leaves more "
            f"than noise too."
        )
    said += _sureness(outcome)
    said += _undetermined(outcome)
    said += _events(outcome)
    said += [
        _rivals_text(step, finding.denials) for step in finding.steps if step.indistinguishable_from
    ]
    if finding.unnamed is not None:
        said.append(_unnamed(outcome))
    said += outcome.performed
    if (finding.rivals or outcome.is_rejected or outcome.experiment) and outcome.experiment_text:
        said.append(_sentence(outcome.experiment_text))
    if outcome.status == "stopped":
        said.append(
            "The search was stopped. These are the results so far; a complete search may find more."
        )
    if outcome.status == "budget":
        said.append("The search ended at its computing budget; a thorough search may find more.")
    return tuple(readable(s) for s in said)


def _doubts(outcome: DiagnoseOutcome) -> Iterator[str]:
    """Yield a sentence for each reason for which the verdict is less than the search found."""
    reasons, shown = outcome.judgement.reasons, SHOWN[outcome.kind]
    baseline, final = outcome.finding.baseline, outcome.finding.final
    if "validation" in reasons:
        # the number of the table; the bound of the noise decides alone whether it is more
        left = [
            f"{c.name} keeps {significant(c.steady_rms / (c.noise or outcome.noise))} times its "
            f"noise{_without_own(c)}"
            for c in outcome.after.validation
            if c.over_noise(outcome.noise) > TOLERANCE
        ]
        left += [f"the model cannot follow {name}" for name in outcome.not_compared]
        yield (
            f"The model explains the training recordings, but not the validation recordings: "
            f"{listed(left)}."
        )
        yield from undetermined_texts(outcome)
    elif outcome.verdict == NOTHING_MISSING and _validation_is_above_noise(outcome):
        yield (
            "A validation recording keeps more than its noise; the uncertainty of the fitted "
            "parameters is large enough to explain it."
        )
        yield from undetermined_texts(outcome)
    if "selection" in reasons:
        before, after = (
            significant(selection_rms(stage, stand.train) * shown.error_factor)
            for stage, stand in ((baseline, outcome.before), (final, outcome.after))
        )
        yield (
            f"The cross-validation error rises from {before} to {after} {shown.error_unit}: the "
            f"effects found do not predict the time segments that they were not fitted to."
        )
    if "training" in reasons:
        left = [
            f"{s.record} keeps {significant(stated.rms / stated.noise)} times its noise"
            for s, stated in zip(outcome.finding.after, signatures_of(outcome)[1], strict=True)
            if s.rms / s.noise > TOLERANCE
        ]
        yield f"Not every training recording is explained: {listed(left)}."
    if "rest" in reasons:
        moving = listed([c.name for c in outcome.after.train if c.moves_at_rest])
        yield (
            f"The readings of {moving} move slowly before the voltage. What moves there counts as "
            f"noise, and was not found; effects that are smaller are hidden by it."
        )


def _validation_is_above_noise(outcome: DiagnoseOutcome) -> bool:
    return any(c.over_noise(outcome.noise) > TOLERANCE for c in outcome.after.validation)


def _without_own(comparison: Comparison) -> str:
    own = comparison.rms_without_events is not None
    return " without slow noise, drift and events of its own" if own else ""


def _verdict(outcome: DiagnoseOutcome) -> str:
    finding, judgement = outcome.finding, outcome.judgement
    names = [_with_rivals(s) for s in finding.steps]
    lacks = f"The thesis model lacks {listed(names)}"
    if finding.interrupted and not finding.rounds:
        if finding.steps:
            return (
                "The search was stopped before all effects were tried. This effect is the best so "
                "far; another one may be better."
            )
        return "The search was stopped before any effect was tried; there is no result yet."
    if "stopped" in judgement.reasons:
        return (
            f"The thesis model explains the training recordings down to the noise"
            f"{_film_tolerance(outcome)}. It is not known whether an effect is missing: the search "
            f"was stopped before every effect was tried."
        )
    if judgement.verdict == NOT_CONFIRMED:
        best = "with" if outcome.recommends_final else "without"
        return (
            f"On the training recordings the thesis model fits better with {listed(names)}. On "
            f"recordings that no fit used {_they(names)} not help by more than "
            f"chance, so that no effect is named. The model to use, and the one that is written, "
            f"is that {best} {_them(names)}."
        )
    if judgement.reasons and not names:
        return "No effect improves the thesis model on the training recordings by more than chance."
    if judgement.reasons:
        return f"{lacks}, as far as the training recordings show."
    if judgement.verdict == "nothing_missing":
        tried = (
            "and no effect that was tried improves it by more than chance"
            if finding.rounds
            else f"and what it leaves {_like(outcome)}, so that no effect was tried"
        )
        which = "the training" if _validation_is_above_noise(outcome) else "these"
        return (
            f"The thesis model explains {which} recordings down to the noise"
            f"{_film_tolerance(outcome) or ','} {tried}."
        )
    if judgement.verdict == "explained":
        if outcome.kind != "film" and not all(s.is_noise for s in finding.after):
            return f"{lacks}. With {_them(names)}, what is left is as small as the noise."
        if _keeps_slow_changes(outcome):
            return (
                f"{lacks}. With {_them(names)}, only noise and slow changes of each recording are "
                f"left."
            )
        return f"{lacks}. With {_them(names)}, only noise{_film_tolerance(outcome)} is left."
    if judgement.verdict == "partly_explained":
        return (
            f"{lacks}. With {_them(names)}, part of the residual is explained; no known effect "
            f"explains the rest."
        )
    helps = "helps" if len(names) == 1 else "help"
    most = listed(names)
    tried = f" {most[:1].upper()}{most[1:]} {helps}, but only a little." if names else ""
    return f"The residual is more than noise, and no known effect explains it.{tried}"


def _keeps_slow_changes(outcome: DiagnoseOutcome) -> bool:
    """Return whether the training recordings keep more than noise if drift is counted."""
    train = outcome.after.train
    if outcome.kind == "film" or not train:
        return False
    return pooled_rms(train) > TOLERANCE * (pooled_noise(train) or outcome.noise)


def untried_text(outcome: DiagnoseOutcome) -> str:
    """Return why there is no round of candidates."""
    if outcome.finding.interrupted:
        return "The search was stopped before a round of candidates was complete."
    return f"No effect was tried: what the thesis model leaves {_like(outcome)}."


def _like(outcome: DiagnoseOutcome) -> str:
    looks = all(s.is_noise for s in outcome.finding.after)
    return "looks like noise" if looks else "is too small to tell its cause"


def _they(names: list[str]) -> str:
    return "it does" if len(names) == 1 else "they do"


def _them(names: list[str]) -> str:
    return "it" if len(names) == 1 else "them"


def _film_tolerance(outcome: DiagnoseOutcome) -> str:
    """Return the model error that a film model is allowed besides the noise."""
    from dearig.model.diagnosis.preparation import FILM_MODEL_ERROR

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
    rms = [pooled_rms(before), pooled_rms(after), pooled_steady_rms(after)]
    first, last, steady = (significant(error * shown.error_factor) for error in rms)
    # of the same recordings, as in the table
    noise = pooled_noise(after) or outcome.noise
    floor = f"the noise floor of {significant(noise * shown.error_factor)} {shown.error_unit}"
    times = f"{significant(rms[1] / noise)} times {floor}"
    if not changed:
        said = f"On {role} the error is {last} {shown.error_unit} RMS, {times}."
    elif first == last:
        said = f"On {role} the error stays {last} {shown.error_unit} RMS, which is {times}."
    else:
        verb = "falls" if rms[1] < rms[0] else "rises"
        said = (
            f"On {role} the error {verb} from {first} to {last} {shown.error_unit} RMS, which is "
            f"{times}."
        )
    if steady == last:
        return said
    return (
        f"{said} Without slow noise, drift and events of each recording it is "
        f"{steady} {shown.error_unit} RMS, {significant(rms[2] / noise)} times the noise."
    )


def _sureness(outcome: DiagnoseOutcome) -> list[str]:
    """Return how probable each family of the effects found is, where that is known."""
    known, families = outcome.marginals, dict.fromkeys(s.family for s in outcome.finding.steps)
    text = "The probability that {} is among what is missing is {:.2f}."
    said = [text.format(family_label(f), known.get(f, 0.0)) for f in families if known]
    counted = known != dict(outcome.finding.marginals)
    if counted and any(known.get(f, 0.0) < _LIKELY for f in families):
        said.append("Validation recordings, which do not confirm what was found, count in this.")
    if families and (other := known.get("unknown", 0.0)) >= _NOT_EXCLUDED:
        said.append(f"The probability that an effect of no known family is missing is {other:.2f}.")
    others = [
        f"{family_label(f)} ({p:.2f})"
        for f, p in known.items()
        if families and p >= _NOT_EXCLUDED and f not in (*families, "none", "unknown")
    ]
    if others:
        said.append(f"Not excluded: {listed(others)}.")
    return said


def _undetermined(outcome: DiagnoseOutcome) -> Iterator[str]:
    """Yield a sentence on the parameters that the data do not determine; none if there are none."""
    if weak := [e.name for e in outcome.finding.final.estimates if e.free and not e.determined]:
        yield undetermined_names_text(weak)


def _events(outcome: DiagnoseOutcome) -> Iterator[str]:
    """Yield a sentence on each recording in which something happened once."""
    shown = SHOWN[outcome.kind]
    for c in (*outcome.after.train, *outcome.after.validation):
        if not c.events:
            continue
        what = listed(
            f"a {e.kind} of {significant(e.size)}{f' {e.unit}' if e.unit else ''} at {e.time:.2f} s"
            for e in c.events
        )
        left = ""
        if c.rms_without_events is not None:
            left = (
                f" Without what is its own, the error is "
                f"{significant(c.rms_without_events * shown.error_factor)} {shown.error_unit} RMS."
            )
        yield f"In {c.name} there is {what}: other recordings are predicted without it.{left}"
    yield from _events_of_each_run(outcome)


def _events_of_each_run(outcome: DiagnoseOutcome) -> Iterator[str]:
    """Yield a sentence on each event that all of several recordings have at the same moment."""
    # a diagnosis has loaded the model; what only reads reports does without
    from dearig.analysis.readings.events import of_each_run

    comparisons = (*outcome.after.train, *outcome.after.validation)
    others = of_each_run({c.name: c.events for c in comparisons})
    for event in (*outcome.recurring, *others):
        has = ", and predictions have it" if event in outcome.recurring else ""
        yield (
            f"The {event.kind} at {event.time:.2f} s is in {listed(c.name for c in comparisons)} "
            f"alike, so it comes with each run and did not happen once{has}: look for what the rig "
            f"does at that moment."
        )


def _rivals_text(step: Step, denials: Sequence[Denial]) -> str:
    said = (
        f"These data cannot separate {step.effect} from "
        f"{listed(family_label(f) for f in step.indistinguishable_from)}: each explains them "
        f"equally well."
    )
    denied = {d.family for d in denials if d.is_of_monitor} & set(step.indistinguishable_from)
    if denied:
        said += (
            " A fault of the amplifier would be behind the point that its monitor reads: a "
            "measurement of the voltage at the film would tell."
        )
    return said


def _unnamed(outcome: DiagnoseOutcome) -> str:
    unnamed = outcome.finding.unnamed
    if unnamed is None:
        return ""
    formula = f"; as a formula: {unnamed.expression}" if unnamed.expression else ""
    return _sentence(
        f"The part that no known family covers acts {place_text(unnamed.acts_on)}{formula}"
    )


def _sentence(text: str) -> str:
    return text if text.endswith((".", "!", "?")) else f"{text}."


def warnings(outcome: DiagnoseOutcome) -> tuple[str, ...]:
    """Return the warnings about recordings and search, without duplicates."""
    said = [outcome.assumed] if outcome.assumed else []
    notes = (w[:1].upper() + w[1:] for w in outcome.finding.notes)
    said += [*outcome.quality, *map(with_symbols, notes)]
    for comparison in (*outcome.after.train, *outcome.after.validation):
        said += [f"{comparison.name}: {w}" for w in comparison.warnings]
    return tuple(dict.fromkeys(readable(_sentence(w)) for w in said))
