"""How well a model predicts recordings that it was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dearig.model.fitting.intervals import correlation_time
from dearig.model.fitting.parameters import NORMAL_95, FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = ["parameter_deviation", "prediction_error", "prediction_gain"]

#: Bytes of the simulations of one pass, and of the derivatives that are kept, at most.
_PASS_BYTES, _KEPT_BYTES = 2**28, 2**29
_PER_SAMPLE = 32  # bytes of one film: motion, rate, reading, and a copy


def parameter_deviation(
    record: Record, model: Actuator | Strip, names: Sequence[str], covariance: np.ndarray
) -> np.ndarray:
    """Return the standard deviation (N,) in m or Pa of what ``model`` predicts of ``record``.

    It is the part that the parameters' own error makes, to first order, J C J^T, from the
    ``covariance`` C (f, f) of the fitted parameters ``names``, in SI units. Parameters that this
    model does not have are left out. A direction that the fit did not determine counts as far as
    the derivatives hold. Of very long records every few readings are computed, and lines between.
    """
    layout = FitLayout(model)
    free = np.isin(layout.names, names)
    size = record.measured.size
    if not free.any():
        return np.zeros(size)
    order = [list(names).index(name) for name in np.array(layout.names)[free]]
    values = layout.initial()
    x = layout.coordinates(values)
    natural = np.where([q.logarithmic for q in layout.quantities], values, 1.0)[free]
    reach = layout.reach(x)[free]
    # in steps of the reach, so that no direction is longer than 1
    scaled = covariance[np.ix_(order, order)] / np.outer(natural * reach, natural * reach)
    variances, directions = np.linalg.eigh(scaled)
    lengths = np.sqrt(np.clip(variances, 0.0, 1.0))
    # nothing is fitted to what is predicted: no offset, and no reading without weight
    problem = Problem([replace(record, valid=None)], layout, workers=1, exact_zero=True)
    every = -(-size * reach.size * 8 // _KEPT_BYTES)
    kept = np.empty((-(-size // every), reach.size))
    columns = np.flatnonzero(free)
    # two films for each column
    together = max(1, (_PASS_BYTES // (_PER_SAMPLE * size) - 1) // 2)
    for start in range(0, columns.size, together):
        part = np.zeros_like(free)
        part[columns[start : start + together]] = True
        kept[:, start : start + together] = problem.jacobian(x, part)[::every]
    moved = (kept * reach) @ (directions * lengths)
    deviation = record.noise * np.sqrt(np.sum(moved**2, axis=1))
    if every > 1:
        deviation = np.interp(np.arange(size), np.arange(0, size, every), deviation)
    return np.asarray(deviation)


def prediction_error(
    record: Record, model: Actuator | Strip, names: Sequence[str], covariance: np.ndarray
) -> float:
    """Return the RMS error in m or Pa of what ``model`` predicts of ``record``, 95 % bound.

    It is the part that the parameters' own error makes, as of ``parameter_deviation``.
    """
    deviation = parameter_deviation(record, model, names, covariance)
    return NORMAL_95 * math.sqrt(float(np.mean(deviation**2)))


def prediction_gain(before: np.ndarray, after: np.ndarray, noise: float) -> float:
    """Return how much more probable a recording is with a second model than with a first.

    ``before`` and ``after`` (N,) are the residuals of the two models, NaN where a reading must not
    be used, and ``noise`` is the floor of one reading. No parameter was fitted to the recording, so
    that the gain is n ln(b/a): twice the logarithm of the likelihood ratio, with the scale of the
    noise marginalised, b and a the mean squares, and n the readings over the shorter of the two
    correlation times.
    """
    good = np.isfinite(before) & np.isfinite(after)
    one, two = before[good], after[good]
    independent = one.size / max(min(correlation_time(one), correlation_time(two)), 1.0)
    b, a = (max(float(np.mean(r**2)), noise**2) for r in (one, two))
    return float(independent * np.log(b / a))
