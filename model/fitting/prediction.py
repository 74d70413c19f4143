"""How well a model predicts recordings that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dearig.model.fitting.intervals import correlation_time
from dearig.model.fitting.parameters import NORMAL_95, FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = ["prediction_error", "prediction_gain"]


def prediction_error(
    record: Record, model: Actuator | Strip, names: Sequence[str], covariance: np.ndarray
) -> float:
    """Return the RMS error in m or Pa of what ``model`` predicts of ``record``, 95 % bound.

    It is the part that the parameters' own error makes, to first order, from the ``covariance``
    (f, f) of the fitted parameters ``names``, in SI units. A direction that the fit did not
    determine counts as far as the derivatives hold.
    """
    layout = FitLayout(model)
    free = np.isin(layout.names, names)
    order = [list(names).index(name) for name in np.array(layout.names)[free]]
    values = layout.initial()
    x = layout.coordinates(values)
    natural = np.where([q.logarithmic for q in layout.quantities], values, 1.0)[free]
    reach = layout.reach(x)[free]
    # in steps of the reach, so that no direction is longer than 1
    scaled = covariance[np.ix_(order, order)] / np.outer(natural * reach, natural * reach)
    variances, directions = np.linalg.eigh(scaled)
    lengths = np.sqrt(np.clip(variances, 0.0, 1.0))
    problem = Problem([record], layout, workers=1)
    jacobian = problem.jacobian(x, free) * reach
    moved = jacobian @ (directions * lengths)
    return NORMAL_95 * record.noise * float(np.sqrt(np.mean(np.sum(moved**2, axis=1))))


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
