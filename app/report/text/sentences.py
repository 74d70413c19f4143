"""Summaries of identification and validation, for readers who do not know the thesis."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from dearig.analysis.outcomes import noise_from, pooled_noise, pooled_over_noise, pooled_rms
from dearig.model.readings.noise import LEAD_IN
from dearig.model.verdict import is_rejected, p_text, smallest_p
from dearig.report.text.numbers import seconds, significant, symbol, with_symbols
from dearig.report.text.thesis import SIMULATED_CAVEAT
from dearig.units import SHOWN, counted

if TYPE_CHECKING:
    from dearig.analysis.outcomes import (
        Comparison,
        IdentifyOutcome,
        SpringCandidate,
        ValidateOutcome,
    )
    from dearig.analysis.simulate import SimulatedRecord
    from dearig.model.fitting import Identification
    from dearig.model.simulation.actuator import Actuator
    from dearig.model.simulation.strip import Strip

__all__ = [
    "describe_model",
    "few_data_text",
    "fit_is_rejected",
    "identify_summary",
    "listed",
    "pull_in_text",
    "spring_label",
    "undetermined_names_text",
    "undetermined_text",
    "validate_summary",
    "warnings_of",
]

_METHODS = {
    "hybrid": "a global search followed by least squares",
    "de": "the thesis's Algorithm 1 (differential evolution) as printed",
}
_NAMES_MAX = 6  # more recordings than this are counted and not named
_LIKELY = 0.05  # a strain energy that is less probable is not named
# RMS over noise floor up to which the residual is almost only noise, and beyond which it is more
_AT_NOISE, _ABOVE_NOISE = 1.1, 1.5
_RARE = 0.05  # one in twenty, the usual level: what is less probable is no agreement


def spring_label(kind: str) -> str:
    """Return the name of a strain energy as reports have it."""
    # imports the compiler, which a watcher of runs does without
    from dearig.model.springs import SPRING_LAWS

    return SPRING_LAWS[kind].shown


def pull_in_text(prediction: SimulatedRecord) -> str:
    """Return the voltage of the static pull-in of a prediction, or why there is none."""
    limits = listed(map(symbol, prediction.open_limits))
    unknown = (
        f"no intervals of {limits} were computed"
        if prediction.is_without_intervals
        else f"the data do not determine {limits}"
    )
    if prediction.pull_in is None:
        return f"not known: {unknown}" if limits else "none: the springs stiffen first"
    voltage = f"{significant(prediction.pull_in * 1e-3)} kV"
    return f"{voltage} with the model's limits, but {unknown}" if limits else voltage


def listed(names: Iterable[str]) -> str:
    """Join names as "a, b and c"."""
    names = list(names)
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _recordings(comparisons: Sequence[Comparison]) -> str:
    names = [c.name for c in comparisons]
    head = counted(len(names), "recording")
    return f"{head} ({listed(names)})" if len(names) <= _NAMES_MAX else head


def describe_model(model: Actuator | Strip) -> str:
    """Return springs, branches and effects of a model in a few words."""
    network = model.network
    kinds = sorted({s.kind for s in network.springs})
    springs = listed(map(spring_label, kinds))
    text = f"{springs} springs with {counted(len(network.branches), 'relaxation branch')}"
    text = text.replace("branchs", "branches")
    effects = [name for name, _ in model.effects]
    return f"{text}, and {listed(effects)}" if effects else text


def identify_summary(outcome: IdentifyOutcome) -> tuple[str, ...]:
    """Return sentences on the fit and its errors on training and validation data."""
    train = outcome.train
    samples = sum(c.errors.samples for c in train)
    free = sum(e.free for e in outcome.fit.estimates)
    said = [
        f"A model of the {'film' if outcome.kind == 'film' else 'actuator'} "
        f"({describe_model(outcome.fit.model)}; {counted(free, 'free parameter')}) was fitted to "
        f"{_recordings(train)}, {counted(samples, 'sample')} in all, by "
        f"{_METHODS.get(outcome.method, outcome.method)}. It took {seconds(outcome.seconds)}."
    ]
    said.append(f"On {_these(train)} its {_error(train)}")
    if outcome.validation:
        n = len(outcome.validation)
        others = "another recording" if n == 1 else f"{n} other recordings"
        said.append(f"On {others}, not used in the fit, its {_error(outcome.validation)}")
    if outcome.published_fit is not None:
        said.append(
            f"The thesis reports e_rms = {outcome.published_fit.e_rms_pct:g} % and e_m = "
            f"{outcome.published_fit.e_m_pct:g} % for its own fit; by the same formulas this one "
            f"has {_worst(train, 'e_rms_thesis_pct')} and {_worst(train, 'e_m_thesis_pct')}."
        )
        if any(c.is_simulated for c in train):
            said.append(SIMULATED_CAVEAT)
    said += _spring_texts(outcome.springs)
    chosen = [t for t in outcome.trials if t.chosen]
    if chosen:
        tried = listed(str(t.branches) for t in outcome.trials)
        said.append(
            f"Of {tried} branches, {chosen[0].branches} were chosen by the Bayesian information "
            f"criterion of the training data."
        )
    if outcome.few_data:
        said.append(few_data_text(outcome.few_data))
    said.append(undetermined_text(outcome.fit))
    return tuple(said)


def _spring_texts(candidates: Sequence[SpringCandidate]) -> list[str]:
    """Return a sentence on the strain energy that was chosen; none where there was no choice."""
    if not candidates:
        return []
    # the same energy with other numbers of branches counts as one
    odds: dict[str, float] = {}
    for candidate in candidates:
        odds[candidate.spring] = odds.get(candidate.spring, 0.0) + candidate.probability
    chosen = next(c.spring for c in candidates if c.chosen)
    rest = listed(
        f"{spring_label(kind)} ({p:.2f})"
        for kind, p in sorted(odds.items(), key=lambda item: -item[1])
        if kind != chosen and p >= _LIKELY
    )
    return [
        f"Of {len(odds)} strain energies the training data give {spring_label(chosen)} the "
        f"probability {odds[chosen]:.2f}" + (f"; not excluded: {rest}." if rest else ".")
    ]


def few_data_text(few: str) -> str:
    """Return a sentence on ``few`` data."""
    return (
        f"Very little was fitted: {few}. Slow effects, and differences between loadings, do not "
        f"show in it; add longer recordings."
    )


def validate_summary(outcome: ValidateOutcome) -> tuple[str, ...]:
    """Return sentences on the errors of a model on recordings."""
    all_of = outcome.comparisons
    fresh = tuple(c for c in all_of if c.role != "train")
    said = [
        f"The model ({outcome.model_name}) was compared with {_recordings(all_of)}. "
        f"On {_these(all_of)} its {_error(all_of)}"
    ]
    if len(fresh) < len(all_of):
        seen = [c.name for c in all_of if c.role == "train"]
        said.append(
            f"{listed(seen)} {'was' if len(seen) == 1 else 'were'} used to fit this model: "
            f"{'its error is' if len(seen) == 1 else 'their errors are'} no validation."
        )
    if len(all_of) > 1:
        shown = SHOWN[outcome.kind]
        worst = max(all_of, key=lambda c: c.errors.rms)
        said.append(
            f"The largest error is that on {worst.name}: "
            f"{significant(worst.errors.rms * shown.error_factor)} {shown.error_unit} RMS."
        )
    return tuple(said)


def undetermined_text(fit: Identification) -> str:
    """Return a sentence on the parameters that the data do not determine."""
    if fit.covariance.size == 0:
        return (
            "No intervals were computed, so it is not known how well the data determine these "
            "parameters."
        )
    if not fit.undetermined:
        return "The data determine every parameter."
    return undetermined_names_text(fit.undetermined)


def undetermined_names_text(names: Iterable[str]) -> str:
    """Return a sentence on parameters ``names`` that the data do not determine."""
    of_effects: dict[str, list[str]] = {}
    for name in names:
        effect, _, own = name.rpartition(": ")
        of_effects.setdefault(effect, []).append(symbol(own).replace("_", " "))
    plain = of_effects.pop("", [])
    others = (f"{listed(own)} of {effect}" for effect, own in of_effects.items())
    named = "; ".join(filter(None, (listed(plain), *others)))
    return (
        f"The data do not determine {named}: other values fit equally well. Do not quote these "
        f"values."
    )


def warnings_of(outcome: IdentifyOutcome | ValidateOutcome) -> tuple[str, ...]:
    """Return all warnings without duplicates; those of a recording begin with its name."""
    fit = getattr(outcome, "fit", None)
    said = [with_symbols(_begun(w)) for w in fit.warnings] if fit is not None else []
    if fit is not None:
        comparisons = (*getattr(outcome, "train", ()), *getattr(outcome, "validation", ()))
    else:
        comparisons = getattr(outcome, "comparisons", ())
    assumed = getattr(outcome, "assumed", "")
    said += [assumed] if assumed else []
    said += getattr(outcome, "quality", ())
    said += [f"{c.name}: {w}" for c in comparisons for w in c.warnings]
    return tuple(dict.fromkeys(_sentence(w) for w in said))


def _begun(text: str) -> str:
    """Return ``text`` with a capital; the name of a parameter becomes its symbol instead."""
    first, _, rest = text.partition(" ")
    return f"{symbol(first)} {rest}" if symbol(first) != first else text[:1].upper() + text[1:]


def fit_is_rejected(outcome: IdentifyOutcome) -> bool:
    """Whether the residual on the training recordings rejects the fitted model."""
    return is_rejected(smallest_p(c.misfit_p for c in outcome.train))


def _sentence(text: str) -> str:
    return text if text.endswith((".", "!", "?")) else f"{text}."


def _these(comparisons: Sequence[Comparison]) -> str:
    return "this recording" if len(comparisons) == 1 else "these recordings"


def _span(values: Sequence[float]) -> str:
    low, high = significant(min(values)), significant(max(values))
    return low if low == high else f"{low} to {high}"


def _worst(comparisons: Sequence[Comparison], measure: str) -> str:
    return f"{_span([getattr(c.errors, measure) for c in comparisons])} %"


def _error(comparisons: Sequence[Comparison]) -> str:
    """Return "error in displacement is 1.2 um RMS ..." and its comparison with the noise."""
    kind = comparisons[0].kind
    shown = SHOWN[kind]
    rms = pooled_rms(comparisons)
    if kind == "film":
        share = f"{_span([c.errors.peak_pct for c in comparisons])} % of the peak"
    else:
        share = f"{_span([c.errors.nrmse_pct for c in comparisons])} % of the measured range"
    largest = max(c.errors.max for c in comparisons)
    text = (
        f"error in {shown.quantity.lower()} is {significant(rms * shown.error_factor)} "
        f"{shown.error_unit} RMS ({share}) and at most "
        f"{significant(largest * shown.error_factor)} {shown.error_unit}."
    )
    noise = pooled_noise(comparisons)
    if not noise:
        return f"{text} The noise floor is not known, so the error cannot be compared with it."
    floor = f"{significant(noise * shown.error_factor)} {shown.error_unit}"
    if kind == "actuator" and noise_from(comparisons) != LEAD_IN:
        floor += " (from second differences, not from a lead-in at rest)"
    ratio = pooled_over_noise(comparisons) or 0.0
    times = f"{text} The noise floor is {floor}: the error is {significant(ratio)} times that"
    p = smallest_p(c.misfit_p for c in comparisons)
    if p is not None and is_rejected(p):
        return (
            f"{times}. The model is rejected: noise as that at rest leaves such a residual with "
            f"{p_text(p)}."
        )
    if ratio <= _AT_NOISE:
        return f"{text} The noise floor is {floor}: the residual is almost only noise."
    if p is not None and p < _RARE:
        return (
            f"{times}, which noise as that at rest seldom leaves ({p_text(p)}): too often to "
            f"reject the model, too seldom to trust it."
        )
    if p is not None:
        return f"{times}, which noise as that at rest does not exclude ({p_text(p)})."
    if ratio > _ABOVE_NOISE:
        return f"{times}, so that it is more than noise, which the model does not describe."
    return f"{times}; there are too few readings at rest to tell whether that is more than noise."
