"""What happened once, in one recording: a slip, a jump, a sudden loss of field; and its own drift.

A model that predicts other recordings cannot know of them. They are sought in each recording by
itself, the validation recordings too, while the model stays as it is, and taken off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dearig.model import kernel
from dearig.model.diagnosis.evidence import Judge
from dearig.model.diagnosis.fits import Fit, Fitter, fit_of, with_effect
from dearig.model.diagnosis.preparation import without_spikes
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.diagnosis.shapes import typical_values
from dearig.model.effects import EFFECTS
from dearig.model.fitting.broyden import descend_broyden
from dearig.model.fitting.slow_noise import WhitenedProblem
from dearig.model.readings.records import ActuatorRecord, Record
from dearig.model.simulation.actuator import Actuator

__all__ = ["OneTimeEvent", "Own", "drifts_at_rest", "own_of"]

_ITERATIONS = 20  # of the fit of one size and one moment


@dataclass(frozen=True)
class OneTimeEvent:
    """One event: the effect ``kind`` of that ``size`` in ``unit``, at ``time`` s."""

    kind: str
    time: float
    size: float
    unit: str


@dataclass(frozen=True)
class Own:
    """What is a recording's own: its ``events``, and whether its reading ``drifts``.

    ``rms`` is the model's error in m without them, and without the slow part of a noise that is
    coloured: over a whole recording it is larger than at rest. ``signal`` (N,) in m is what they
    add to the reading.
    """

    events: tuple[OneTimeEvent, ...]
    drifts: bool
    rms: float
    signal: np.ndarray = field(default_factory=lambda: np.zeros(0), compare=False)


def own_of(
    record: ActuatorRecord,
    model: Actuator,
    settings: DiagnosisSettings | None = None,
    may_drift: bool = True,
    others: Sequence[Record] = (),
) -> Own | None:
    """Return the events and the drift of ``record`` besides ``model``; None in white noise alone.

    With ``may_drift`` False a slow error is not taken for drift: a missing law can be as slow. The
    readings at rest of ``others``, recordings with the same sensor, tell the colour of its noise
    better than a single lead-in.

    They are accepted only if the remaining error is noise, or a fiftieth of what they explain: an
    event imitates part of any law that the model lacks. What explains as much from the start on, or
    with other moduli and relaxation times, is a difference of the whole recording and no event: a
    fit to little data predicts a longer recording with a slow error. An effect acts at one moment
    of a recording, so of two events of one kind the larger is found.
    """
    response = model.simulate(record.drive, record.lag)
    if response.ok:
        calm = without_spikes(record, record.displacement - record.seen(response.displacement))
        record = calm if isinstance(calm, ActuatorRecord) else record
    settings = settings or DiagnosisSettings()
    fitter = Fitter([record], replace(model, effects=()), settings, 1, others=others)
    fitter.read_colour()
    plain = _as_it_is(fitter.problem(model))
    judge = Judge(fitter.settings, plain)
    nothing = None
    if plain.problem.noise_drift is not None:
        nothing = Own((), False, fitter.full[0].noise * math.sqrt(plain.cost))
    if judge.is_noise(plain):
        return nothing
    ways = [_with_events(fitter, judge, plain)]
    if may_drift:
        later = fitter.space().most_probable(ways[0].plain_residuals())
        redrifted = _as_it_is(fitter.problem(ways[0].model, later))
        ways.append(replace(redrifted, fixed=ways[0].fixed))
    drift = fitter.space().most_probable(plain.plain_residuals()) if may_drift else 0.0
    if drift:
        ways.append(_with_events(fitter, judge, _as_it_is(fitter.problem(model, drift))))
    judge.see(ways)
    best = judge.ranked([plain, *ways])[0]
    added = best.effects[len(model.effects) :]
    left = max(best.cost - 1.0, 0.0) / max(plain.cost - best.cost, 1e-12)
    believed = judge.is_noise(best) or left < fitter.settings.form_share
    if not believed or not (added or best.drift):
        return nothing
    numbers = dict(best.model.effects)
    events = []
    for name in added:
        size, moment = EFFECTS[name].parameters
        found = dict(numbers[name])
        events.append(OneTimeEvent(name, found[moment.name], found[size.name], size.unit))
    whole = _as_it_is(fitter.careful_problem(best.model, best.drift))
    bare = _as_it_is(fitter.careful_problem(model, 0.0)).plain_residuals()
    error, own = whole.plain_residuals(), whole.problem.noise_drift
    error = error - own.mean(error) if own and best.drift else error
    good = np.isfinite(whole.problem.sigma)
    noise = fitter.full[0].noise
    rms = noise * float(np.sqrt(np.mean(error[good] ** 2)))
    signal = noise * np.where(good, error - bare, 0.0)
    return Own(tuple(sorted(events, key=lambda e: e.time)), best.drift > 0.0, rms, signal)


def drifts_at_rest(
    records: Sequence[ActuatorRecord], model: Actuator, settings: DiagnosisSettings | None = None
) -> bool:
    """Whether what ``model`` leaves of ``records`` that is slow may be a drift of the readings.

    It is none where it begins with the voltage: then the model lacks a law.
    """
    bare = replace(model, effects=())
    fitter = Fitter(records, bare, settings or DiagnosisSettings(), 1)
    fitter.read_colour()
    return fitter.drifts_at_rest(_as_it_is(fitter.problem(model)).plain_residuals())


def _as_it_is(problem: WhitenedProblem) -> Fit:
    """Return the model of ``problem`` as a fit in which nothing was free."""
    x = problem.layout.coordinates(problem.layout.initial())
    costs, residuals = problem.evaluate(x[None])
    held = np.ones(x.size, dtype=bool)
    none = np.zeros((residuals.shape[1], 0))
    return Fit(problem, x, held, float(costs[0]), residuals[0], none)


def _with_events(fitter: Fitter, judge: Judge, best: Fit) -> Fit:
    """Return ``best`` with the events that the evidence asks for, one after the other."""
    kinds = [e.name for e in EFFECTS.values() if "moment" in {p.name for p in e.parameters}]
    held = best.fixed.size
    # each moment that is tried is a candidate of its own
    odds = fitter.settings.odds + 2.0 * math.log(fitter.settings.moments)
    for _ in range(fitter.settings.effects_max):
        if judge.is_noise(best):
            break
        fits = [_with_event(fitter, best, n, held) for n in kinds if n not in best.effects]
        judge.see(fits)
        top = min(fits, key=judge.criterion, default=best)
        if judge.gain(best, top) < odds:
            break
        whole = [_from_the_start(fitter, top, held), _of_other_springs(best, held)]
        judge.see(whole)
        if any(judge.gain(other, top) < odds for other in whole):
            break  # the whole recording differs from the model: this is not an event
        best = top
    return best


def _from_the_start(fitter: Fitter, fit: Fit, held: int) -> Fit:
    """Return ``fit`` with its last event as a difference of the whole recording, of any size."""
    layout = fit.problem.layout
    values = layout.values(fit.x)
    values[-1] = fitter.records[0].time[0]
    fixed = np.arange(layout.size) < held
    fixed[-1] = True  # the moment
    return _fitted(fit.problem, values, fixed)


def _of_other_springs(fit: Fit, held: int) -> Fit:
    """Return ``fit`` with moduli and relaxation times free, and the events that it has."""
    layout = fit.problem.layout
    events = np.arange(held, layout.size)
    free = np.concatenate([layout.column("mu"), layout.column("T"), events])
    return _fitted(fit.problem, layout.values(fit.x), ~np.isin(np.arange(layout.size), free))


def _with_event(fitter: Fitter, best: Fit, name: str, held: int) -> Fit:
    """Return ``best`` with an event of the kind ``name`` where it explains most.

    The first ``held`` parameters stay. A size that is small against the film's motion acts in
    proportion to it, so that one simulation at each moment tells the size there.
    """
    problem = fitter.problem(
        with_effect(best.model, name, typical_values(EFFECTS[name])), best.drift
    )
    rough = fitter.problem(problem.layout.base, best.drift, kernel.ROUGH)
    layout, time = problem.layout, fitter.records[0].time
    count = fitter.settings.moments
    step = float(np.ptp(time)) / count
    typical = layout.values(layout.coordinates(layout.initial()))
    typical[: best.x.size] = best.problem.layout.values(best.x)
    at, values = time[0] - step / 2.0, typical
    # all of the recording, then the place between two of the moments
    for among in (np.arange(1, count + 1), np.linspace(-1.0, 1.0, count)):
        rows = np.tile(typical, (count, 1))
        rows[:, -1] = np.clip(at + step * among, time[0], time[-1])
        _, residuals = rough.evaluate(np.array([layout.coordinates(row) for row in rows]))
        shape = np.where(np.isfinite(residuals), residuals - best.residuals, 0.0)
        size = -shape @ best.residuals / np.maximum(np.sum(shape**2, axis=1), 1e-12)
        most = int(np.argmax(-size * (shape @ best.residuals)))
        values, at = rows[most], float(rows[most, -1])
        values[-2] = typical[-2] * size[most]
    return _fitted(problem, values, np.arange(layout.size) < held)


def _fitted(problem: WhitenedProblem, values: np.ndarray, fixed: np.ndarray) -> Fit:
    """Return the fit from natural ``values`` (d,), of which the ``fixed`` ones stay."""
    layout = problem.layout
    start = np.clip(layout.coordinates(values), layout.lower, layout.upper)
    found = descend_broyden(problem, start, fixed, None, _ITERATIONS, 1.0, True)
    return fit_of(problem, fixed, found)
