"""Walks that each of several recordings has of its own, beside the numbers that they share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from dearig.model.actuator import Drive
from dearig.model.effects import EFFECTS, PLACES
from dearig.model.fitting.drift import walks_of
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import Layout
from dearig.model.fitting.problem import Problem
from dearig.model.records import ActuatorRecord
from tests.tools.engine import NOISE, PLAIN, effect, masked, record_of, typical

WALKING = [name for name, e in EFFECTS.items() if e.drift_basis is not None]
WALK = replace(PLAIN, effects=(typical("wandering drift"),))
SIZES = ("linear", "quadratic", "cubic", "quartic", "quintic")
WALKS = np.array([[2e-5, -8e-6, 3e-6, 1e-6, -2e-6], [-1e-5, 6e-6, -5e-6, 2e-6, 1e-6]])


def walking(seed: int, sizes: np.ndarray) -> ActuatorRecord:
    """A record in which the reading walks so; with ``seed`` in its name."""
    drift = effect("wandering drift", **dict(zip(SIZES, sizes, strict=True)))
    record = record_of(replace(PLAIN, effects=drift), seed=seed)
    return replace(record, name=f"run {seed}", lead_in=150)


def problem_of(records, model=WALK) -> tuple[Problem, np.ndarray, np.ndarray]:
    """A problem, coordinates (d,), and what is held: limits."""
    problem = Problem(records, Layout(model), workers=1)
    layout = problem.layout
    held = np.zeros(layout.size, dtype=bool)
    held[layout.column("J")] = True
    return problem, layout.coordinates(layout.initial()), held


def counted(records):
    """``records`` counted from their lead-in, as a recording's readings are."""
    return [replace(r, displacement=r.seen(r.displacement)) for r in records]


TWO = counted([walking(1, WALKS[0]), walking(2, WALKS[1])])


def off(problem: Problem, sizes: np.ndarray, others: np.ndarray) -> float:
    """RMS of how far walks of ``sizes`` and of ``others`` (K, n) are from each other, m.

    Of half a span of half a minute the sizes themselves are hardly told, the walks well.
    """
    return float(np.sqrt(np.mean(problem.walks.moved(sizes - others) ** 2)))


@pytest.mark.parametrize("name", WALKING)
def test_ways_are_what_each_size_adds_to_a_reading(name):
    time = np.linspace(0.0, 41.0, 57)
    e, sense = EFFECTS[name], PLACES[name].module.sense
    ways = e.drift_basis(time)
    assert ways.shape == (time.size, len(e.amplitudes)) == (time.size, len(e.parameters))
    for column, one in zip(ways.T, np.eye(len(e.amplitudes)), strict=True):
        shown = [sense(one, 0, np.zeros(1), 0, t, 0.1, 1e-3, 0.0) - 1e-3 for t in time]
        np.testing.assert_allclose(column, shown, rtol=1e-9, atol=1e-12)
    assert not e.is_reproducible
    assert e.acts_on == "sensor"


def test_numbers_and_walks_are_those_of_one_great_fit():
    """An oracle: scipy's fit of the springs and of both walks together."""
    problem, start, held = problem_of(TWO)
    fit = descend(problem, start, held, gain=1e-6)
    found = problem.walking(fit.x)
    shared = ~held & ~problem.own
    plain = Problem(TWO, Layout(PLAIN), workers=1)
    k = int(shared.sum())
    scale = np.concatenate([np.maximum(np.abs(start[shared]), 1.0), np.full(10, 1e-6)])

    def left(z: np.ndarray) -> np.ndarray:
        x = start[: plain.layout.size].copy()
        x[shared[: plain.layout.size]] = z[:k] * scale[:k]
        return plain.residuals(x) + problem.walks.ways @ (z[k:] * scale[k:]) / NOISE

    great = least_squares(
        left, np.concatenate([start[shared], np.zeros(10)]) / scale, x_scale="jac", xtol=1e-12
    )
    np.testing.assert_allclose(2.0 * great.cost / problem.samples, fit.cost, rtol=1e-6)
    np.testing.assert_allclose(great.x[:k] * scale[:k], fit.x[shared], rtol=2e-4)
    walked = problem.walks.moved(found.sizes)
    np.testing.assert_allclose(problem.walks.ways @ (great.x[k:] * 1e-6), walked, atol=2e-9)
    # as they were made, but for noise, and what the springs make up for
    assert off(problem, found.sizes, WALKS) < 5e-7
    assert fit.cost == pytest.approx(1.0, abs=0.06)


def test_numbers_that_each_record_has_for_itself_do_nothing():
    problem, x, _ = problem_of(TWO)
    assert list(np.array(problem.layout.names)[problem.own]) == [
        f"wandering drift: {size}" for size in SIZES
    ]
    other = x.copy()
    other[problem.own] = 1e-4
    there = problem.residuals(x)
    np.testing.assert_allclose(problem.residuals(other), there, atol=1e-6)
    free = np.ones(x.size, dtype=bool)
    jac = problem.jacobian(x, free)
    assert np.max(np.abs(jac[:, problem.own] * 1e-6)) < 1e-6
    # nor do they in what is said of the walks
    np.testing.assert_allclose(problem.walking(other).sizes, problem.walking(x).sizes, atol=1e-12)
    # the others' columns are what is left of them beside the walks
    bare = problem.without_walks().jacobian(x, ~problem.own)
    np.testing.assert_allclose(
        problem.off_walks(bare), jac[:, ~problem.own], rtol=1e-6, atol=1e-9 * np.max(np.abs(bare))
    )


def test_what_is_not_known_of_a_jacobian_is_not_known_beside_walks():
    problem, x, _ = problem_of(TWO)
    jac = problem.without_walks().jacobian(x, ~problem.own)
    jac[:, 0] = np.nan
    off = problem.off_walks(jac)
    assert np.isnan(off[:, 0]).all()
    assert np.isfinite(off[:, 1:]).all()


def test_one_record_has_its_walk_as_any_other_number():
    assert walks_of(TWO[:1], WALK.effects) is None
    assert walks_of(TWO, PLAIN.effects) is None
    problem, x, _ = problem_of(TWO[:1])
    assert problem.walks is None
    assert problem.walking(x) is None
    assert not problem.own.any()
    jac = np.ones((TWO[0].time.size, 3))
    assert np.array_equal(problem.off_walks(jac), jac)


def test_readings_that_must_not_be_used_say_nothing_of_the_walk():
    bad = np.zeros(TWO[0].time.size, dtype=bool)
    bad[600:900] = True
    problem, x, held = problem_of([masked(TWO[0], bad), TWO[1]])
    fit = descend(problem, x, held)
    assert fit.cost == pytest.approx(1.0, abs=0.06)
    assert off(problem, problem.walking(fit.x).sizes, WALKS) < 5e-7


def test_one_walk_for_all_leaves_what_they_do_not_share():
    alike = counted([walking(1, WALKS[0]), walking(2, WALKS[0])])
    problem, x, held = problem_of(alike)
    found = problem.walking(descend(problem, x, held).x)
    assert off(problem, found.sizes, np.tile(found.in_common, (2, 1))) < 5e-7
    assert np.mean(found.residuals_in_common**2) == pytest.approx(1.0, abs=0.06)
    problem, x, held = problem_of(TWO)
    found = problem.walking(descend(problem, x, held).x)
    assert np.mean(found.residuals_in_common**2) > 10.0


def test_a_record_too_short_for_its_walk_is_followed_without_more_ado():
    short = ActuatorRecord(
        "short", Drive(TWO[1].time[:4], TWO[1].drive.voltage[:4]), TWO[1].displacement[:4], NOISE
    )
    problem, x, held = problem_of([TWO[0], short])
    fit = descend(problem, x, held)
    assert np.all(np.isfinite(problem.walking(fit.x).sizes))
    assert np.max(np.abs(fit.residuals[-3:])) < 1e-6  # all walks begin at 0
    assert fit.cost == pytest.approx(1.0, abs=0.06)
