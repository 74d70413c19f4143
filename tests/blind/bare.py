"""``dearig diagnose`` without the intervals of parameters, which no score of the blind test reads.

They take most of the time of an easy case. Run as ``python -m tests.blind.bare`` with the arguments
of ``dearig diagnose``.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from unittest import mock

import numpy as np

from dearig.cli.main import main
from dearig.model.diagnosis import stages
from dearig.model.fitting import Estimate
from dearig.model.fitting.estimates import Intervals
from dearig.model.fitting.problem import Problem


def values_alone(
    problem: Problem,
    values: np.ndarray,
    held: np.ndarray,
    report: Callable[[float], None],
    **_: object,
) -> Intervals:
    """Return estimates at ``values`` (d,) with open intervals."""
    found = [
        Estimate(q.name, q.unit, float(v), 0.0, math.inf, False, "no interval was asked for")
        for q, v in zip(problem.layout.quantities, values, strict=True)
    ]
    return Intervals(tuple(found), (), np.empty((0, 0)))


if __name__ == "__main__":
    sys.argv[1:1] = ["diagnose"]
    with mock.patch.object(stages, "estimates_with_intervals", values_alone):
        main()
