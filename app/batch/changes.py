"""Change points: where a number of one film jumps from one run to the next, and stays there."""

from __future__ import annotations

import math

import numpy as np

__all__ = ["RUNS_MIN", "find_jumps", "jump_penalty"]

#: Runs between two changes, at least: fewer are outliers, not a level.
RUNS_MIN = 3
#: With a penalty of ``2 ln n + 5`` a series of 8 to 500 independent runs without a change has one
#: with a probability of at most 1 % (``bench_trends`` measures it).
_PENALTY = 5.0


def jump_penalty(runs: int, series: int) -> float:
    """Return the chi-square that a jump in one of so many ``series`` of ``runs`` must gain."""
    return 2.0 * math.log(max(runs, 2)) + _PENALTY + 2.0 * math.log(max(series, 1))


def find_jumps(values: np.ndarray, penalty: float) -> list[int]:
    """Return the places before which the level of ``values`` (n,) jumps, in deviations.

    The levels minimise the sum of squares plus a ``penalty`` for each jump, over all places, by
    dynamic programming: B. Jackson et al., "An algorithm for optimal partitioning of data on an
    interval", IEEE Signal Process. Lett. 12 (2005). A level has ``RUNS_MIN`` runs or more.
    """
    count = values.size
    if count < 2 * RUNS_MIN:
        return []
    # sums of squares lose digits where the level is far from 0
    centred = values - values.mean()
    sums, squares = (np.append(0.0, np.cumsum(centred**power)) for power in (1, 2))
    best = np.full(count + 1, np.inf)  # least cost of the first runs, by their number
    best[0] = -penalty
    last = np.zeros(count + 1, dtype=np.int64)  # place of the last jump before them
    for end in range(RUNS_MIN, count + 1):
        places = np.arange(end - RUNS_MIN + 1)
        within = squares[end] - squares[places] - (sums[end] - sums[places]) ** 2 / (end - places)
        costs = best[places] + np.maximum(within, 0.0) + penalty
        last[end] = np.argmin(costs)
        best[end] = costs[last[end]]
    found: list[int] = []
    place = int(last[count])
    while place > 0:
        found.append(place)
        place = int(last[place])
    return found[::-1]
