"""Change points: where a number of one film jumps from one run to the next, and stays there."""

from __future__ import annotations

import math

import numpy as np

from dearig.extras import import_extra

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

    The levels minimise the sum of squares plus a ``penalty`` for each jump (the algorithm PELT of
    ruptures).
    """
    if values.size < 2 * RUNS_MIN:
        return []
    ruptures = import_extra("ruptures", "trends", "a search for change points")
    search = ruptures.KernelCPD(kernel="linear", min_size=RUNS_MIN)
    # its sums of squares lose digits where the level is far from 0
    found = search.fit((values - values.mean())[:, None]).predict(pen=penalty)
    return [int(end) for end in found[:-1]]
