"""How far a fitted model may be off on recordings that it was not fitted to, by its parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dearig.model.fitting.parameters import NORMAL_95, Layout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = ["prediction_error"]


def prediction_error(
    record: Record, model: Actuator | Strip, names: Sequence[str], covariance: np.ndarray
) -> float:
    """Return the RMS error in m or Pa of what ``model`` predicts of ``record``, 95 % bound.

    It is the part that the parameters' own error makes, to first order, from the ``covariance``
    (f, f) of the fitted parameters ``names``, in SI units. A direction that the fit did not
    determine counts as far as the derivatives hold.
    """
    layout = Layout(model)
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
