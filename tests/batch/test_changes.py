"""Jumps of a series: the same optimum as a search over all places."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.batch.changes import RUNS_MIN, find_jumps, jump_penalty


def cost(values: np.ndarray, places: tuple[int, ...], penalty: float) -> float:
    parts = itertools.pairwise((0, *places, values.size))
    return sum(float(((values[a:b] - values[a:b].mean()) ** 2).sum()) for a, b in parts) + (
        penalty * len(places)
    )


def optimum(values: np.ndarray, penalty: float) -> float:
    inner = range(RUNS_MIN, values.size - RUNS_MIN + 1)
    sets = (
        places
        for count in range(values.size // RUNS_MIN)
        for places in itertools.combinations(inner, count)
        if all(b - a >= RUNS_MIN for a, b in itertools.pairwise((0, *places, values.size)))
    )
    return min(cost(values, places, penalty) for places in sets)


@settings(max_examples=80, deadline=None)
@given(
    values=st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=13).map(np.array),
    penalty=st.sampled_from([0.1, 1.0, 5.0, 20.0]),
)
def test_jumps_are_the_optimum_of_all_places(values: np.ndarray, penalty: float) -> None:
    found = tuple(find_jumps(values, penalty))
    if values.size < 2 * RUNS_MIN:
        assert found == ()
        return
    assert all(b - a >= RUNS_MIN for a, b in itertools.pairwise((0, *found, values.size)))
    assert cost(values, found, penalty) == pytest.approx(optimum(values, penalty), abs=1e-9)


@pytest.mark.parametrize("level", [0.0, 1e6])
def test_levels_far_from_zero_lose_no_jump(level: float) -> None:
    noise = np.random.default_rng(5).normal(0.0, 1.0, 400)
    series = level + noise + 8.0 * (np.arange(400) >= 120) - 6.0 * (np.arange(400) >= 333)
    assert find_jumps(series, jump_penalty(400, 1)) == [120, 333]
