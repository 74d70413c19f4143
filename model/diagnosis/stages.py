"""What a fit comes to: errors, cross-validation of whole segments of time, intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from dearig.model.diagnosis.evidence import Judge
from dearig.model.diagnosis.fits import Fit
from dearig.model.diagnosis.results import Stage
from dearig.model.effects import EFFECTS
from dearig.model.fitting import Estimate
from dearig.model.fitting.estimates import Intervals, estimates_with_intervals
from dearig.model.fitting.left_out import left_out
from dearig.model.fitting.slow_noise import WhitenedProblem
from dearig.model.readings.records import ActuatorRecord, Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = ["DRIFT_LAW", "drift_values", "stage_of", "with_drift"]

#: The effect by which the drift of a record is written into models: polynomials of the time.
DRIFT_LAW = "fitful drift"

_NORMAL_95 = 1.96
_FLAT = 1e-4  # relative singular value: polynomials that nearly cancel are left out


def stage_of(
    fit: Fit,
    judge: Judge,
    full: Sequence[Record],
    *,
    profiled: WhitenedProblem | None = None,
    for_others: Actuator | Strip | None = None,
    ended: Callable[[], bool] = lambda: False,
    gain: float = math.inf,
) -> Stage:
    """Return the errors of ``fit``; with ``profiled`` the intervals of its parameters too.

    That is a problem with the same optimum, on which their likelihood is profiled until ``ended``.
    ``for_others`` is the model that predicts other recordings, where it is another one. Errors are
    of readings of the ``full`` records. Raises ``BetterPoint`` where a profile comes to a
    chi-square that is lower by more than ``gain``.
    """
    problem = fit.problem
    jacobian = problem.jacobian(fit.x, ~fit.fixed, None if profiled else fit.residuals)
    good = np.isfinite(problem.sigma)
    scale = problem.sigma[good]
    # thinning took noise away: put back, so that errors compare with those of every sample
    lost = _noise_lost(problem.records, full)
    reach = problem.layout.reach(fit.x)[~fit.fixed]
    predicted = left_out(fit.residuals, jacobian, reach)[good] * scale
    estimates: tuple[Estimate, ...] = ()
    found = Intervals((), (), np.empty((0, 0)))
    if profiled is not None:
        values = problem.layout.values(fit.x)
        found = estimates_with_intervals(
            profiled,
            values,
            fit.fixed,
            lambda _: None,
            lower_ends=False,
            ended=ended,
            gain=gain,
        )
        estimates = (*found.estimates, *_drift_estimates(fit))
    return Stage(
        model=fit.model,
        cost=fit.cost,
        train_rms=math.sqrt(float(np.mean((fit.residuals[good] * scale) ** 2)) + lost),
        selection_rms=math.sqrt(float(np.mean(predicted**2)) + lost),
        selection_max=float(np.max(np.abs(predicted))),
        criterion=judge.criterion(fit),
        estimates=estimates,
        sums=found.sums,
        covariance_names=found.names,
        covariance=found.covariance,
        for_others=for_others or fit.model,
        models=with_drift(fit),
    )


def _noise_lost(thin: Sequence[Record], full: Sequence[Record]) -> float:
    """Return the mean square of the noise that thinning averaged away, pooled over readings."""
    sizes = np.array([r.measured.size for r in thin], dtype=float)
    lost = np.array([f.noise**2 - t.noise**2 for f, t in zip(full, thin, strict=True)])
    return max(float(np.sum(sizes * lost) / np.sum(sizes)), 0.0)


# ---------------------------------------------------------------- drift


def drift_values(fit: Fit) -> list[np.ndarray]:
    """Return the amplitudes (n,) in m of ``DRIFT_LAW`` nearest to each record's drift."""
    basis_of = EFFECTS[DRIFT_LAW].drift_basis
    if basis_of is None or not fit.drift:
        return []
    mean = fit.mean_drift()
    found = []
    for record, (a, b) in zip(fit.problem.records, pairwise(fit.problem.edges), strict=True):
        if isinstance(record, ActuatorRecord):
            basis = record.seen(basis_of(record.time).T).T
            scale = np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
            amplitudes, *_ = np.linalg.lstsq(basis / scale, mean[a:b] * record.noise, rcond=_FLAT)
            found.append(amplitudes / scale)
    return found


def with_drift(fit: Fit) -> tuple[Actuator | Strip, ...]:
    """Return the fitted model of each record, each with its own drift; () without drift."""
    return tuple(_drifting(fit.model, values) for values in drift_values(fit))


def _drifting(model: Actuator | Strip, values: np.ndarray) -> Actuator | Strip:
    parameters = EFFECTS[DRIFT_LAW].parameters
    inside = (
        (p.name, float(min(max(v, p.bounds[0]), p.bounds[1])))
        for p, v in zip(parameters, values, strict=True)
    )
    return replace(model, effects=(*model.effects, (DRIFT_LAW, tuple(inside))))


def _drift_estimates(fit: Fit) -> Iterator[Estimate]:
    """Yield the RMS of each record's drift; its interval is that of the drift's variance."""
    if not fit.drift:
        return
    mean = fit.mean_drift()
    for record, (a, b) in zip(fit.problem.records, pairwise(fit.problem.edges), strict=True):
        part = mean[a:b]
        rms = float(np.sqrt(np.mean(part**2))) * record.noise
        # of the drift's many modes, those above the noise are known to the noise over sqrt(N)
        error = _NORMAL_95 * record.noise / math.sqrt(part.size)
        name = f"{DRIFT_LAW}: rms in {record.name}"
        yield Estimate(name, "m", rms, max(rms - error, 0.0), rms + error, True)
