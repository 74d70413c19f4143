"""Drift of each recording on its own, besides the parameters that recordings share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from dearig.model.effects import EFFECTS, PLACES
from dearig.model.fitting.drift import record_drift
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Drive
from tests.tools.engine import NOISE, PLAIN, effect, masked, record_of, thesis_drive, typical

DRIFTS = [name for name, e in EFFECTS.items() if e.drift_basis is not None]
WITH_DRIFT = replace(PLAIN, effects=(typical("fitful drift"),))
AMPLITUDES = tuple(p.name for p in EFFECTS["fitful drift"].parameters)
DRIFT_AMPLITUDES = np.zeros((2, len(AMPLITUDES)))
DRIFT_AMPLITUDES[:, :5] = [[2e-5, -8e-6, 3e-6, 1e-6, -2e-6], [-1e-5, 6e-6, -5e-6, 2e-6, 1e-6]]


def drifting(seed: int, sizes: np.ndarray) -> ActuatorRecord:
    """A record whose reading drifts; with ``seed`` in its name."""
    drift = effect("fitful drift", **dict(zip(AMPLITUDES, sizes, strict=True)))
    # 34 s: a shorter record does not determine thirteen amplitudes over 30 s
    record = record_of(replace(PLAIN, effects=drift), thesis_drive(periods=3), seed)
    return replace(record, name=f"run {seed}", lead_in=150)


def problem_of(records, model=WITH_DRIFT) -> tuple[Problem, np.ndarray, np.ndarray]:
    """A problem, coordinates (d,), and what is held: limits."""
    problem = Problem(records, FitLayout(model), workers=1)
    layout = problem.layout
    held = np.zeros(layout.size, dtype=bool)
    held[layout.column("J")] = True
    return problem, layout.coordinates(layout.initial()), held


def counted(records):
    """``records`` counted from their lead-in, as a recording's readings are."""
    return [replace(r, displacement=r.seen(r.displacement)) for r in records]


TWO = counted([drifting(1, DRIFT_AMPLITUDES[0]), drifting(2, DRIFT_AMPLITUDES[1])])


def off(problem: Problem, sizes: np.ndarray, others: np.ndarray) -> float:
    """RMS difference in m of the drift of amplitudes ``sizes`` and ``others`` (K, n).

    Over half a minute single amplitudes are poorly determined, their sum well.
    """
    return float(np.sqrt(np.mean(problem.drift.readings(sizes - others) ** 2)))


@pytest.mark.parametrize("name", DRIFTS)
def test_basis_is_the_derivative_of_the_reading_by_each_amplitude(name):
    time = np.linspace(0.0, 41.0, 57)
    e, sense = EFFECTS[name], PLACES[name].module.sense
    ways = e.drift_basis(time)
    assert ways.shape == (time.size, len(e.amplitudes)) == (time.size, len(e.parameters))
    for column, one in zip(ways.T, np.eye(len(e.amplitudes)), strict=True):
        shown = [sense(one, 0, np.zeros(1), 0, t, 0.1, 1e-3, 0.0) - 1e-3 for t in time]
        np.testing.assert_allclose(column, shown, rtol=1e-9, atol=1e-12)
    assert not e.is_reproducible
    assert e.acts_on == "sensor"


def test_shared_parameters_and_drift_equal_those_of_one_joint_fit():
    """The oracle is a joint fit by SciPy of springs and both drifts."""
    problem, start, held = problem_of(TWO)
    fit = descend(problem, start, held, gain=1e-6)
    found = problem.fit_drift(fit.x)
    shared = ~held & ~problem.own
    plain = Problem(TWO, FitLayout(PLAIN), workers=1)
    k, own = int(shared.sum()), DRIFT_AMPLITUDES.size
    scale = np.concatenate([np.maximum(np.abs(start[shared]), 1.0), np.full(own, 1e-6)])

    def left(z: np.ndarray) -> np.ndarray:
        x = start[: plain.layout.size].copy()
        x[shared[: plain.layout.size]] = z[:k] * scale[:k]
        return plain.residuals(x) + problem.drift.basis @ (z[k:] * scale[k:]) / NOISE

    great = least_squares(
        left,
        np.concatenate([start[shared], np.zeros(own)]) / scale,
        x_scale="jac",
        xtol=1e-12,
    )
    np.testing.assert_allclose(2.0 * great.cost / problem.samples, fit.cost, rtol=1e-6)
    np.testing.assert_allclose(great.x[:k] * scale[:k], fit.x[shared], rtol=2e-4)
    walked = problem.drift.readings(found.amplitudes)
    np.testing.assert_allclose(problem.drift.basis @ (great.x[k:] * 1e-6), walked, atol=2e-9)
    # as they were made, but for noise, and what the springs make up for
    assert off(problem, found.amplitudes, DRIFT_AMPLITUDES) < 5e-7
    assert fit.cost == pytest.approx(1.0, abs=0.06)


def test_numbers_that_each_record_has_for_itself_do_nothing():
    problem, x, _ = problem_of(TWO)
    assert list(np.array(problem.layout.names)[problem.own]) == [
        f"fitful drift: {size}" for size in AMPLITUDES
    ]
    other = x.copy()
    other[problem.own] = 1e-4
    there = problem.residuals(x)
    np.testing.assert_allclose(problem.residuals(other), there, atol=1e-6)
    free = np.ones(x.size, dtype=bool)
    jac = problem.jacobian(x, free)
    assert np.max(np.abs(jac[:, problem.own] * 1e-6)) < 1e-6
    # nor do they change the fitted drift
    np.testing.assert_allclose(
        problem.fit_drift(other).amplitudes, problem.fit_drift(x).amplitudes, atol=1e-12
    )
    # columns of shared parameters are projected off the drift
    bare = problem.without_drift().jacobian(x, ~problem.own)
    np.testing.assert_allclose(
        problem.project_off_drift(bare),
        jac[:, ~problem.own],
        rtol=1e-6,
        atol=1e-9 * np.max(np.abs(bare)),
    )


def test_unknown_jacobian_columns_stay_unknown_beside_drift():
    problem, x, _ = problem_of(TWO)
    jac = problem.without_drift().jacobian(x, ~problem.own)
    jac[:, 0] = np.nan
    off = problem.project_off_drift(jac)
    assert np.isnan(off[:, 0]).all()
    assert np.isfinite(off[:, 1:]).all()


def test_drift_of_one_record_is_fitted_like_any_parameter():
    assert record_drift(TWO[:1], WITH_DRIFT.effects) is None
    assert record_drift(TWO, PLAIN.effects) is None
    problem, x, _ = problem_of(TWO[:1])
    assert problem.drift is None
    assert problem.fit_drift(x) is None
    assert not problem.own.any()
    jac = np.ones((TWO[0].time.size, 3))
    assert np.array_equal(problem.project_off_drift(jac), jac)


def test_masked_readings_do_not_influence_the_drift():
    bad = np.zeros(TWO[0].time.size, dtype=bool)
    bad[600:900] = True
    problem, x, held = problem_of([masked(TWO[0], bad), TWO[1]])
    fit = descend(problem, x, held)
    assert fit.cost == pytest.approx(1.0, abs=0.06)
    assert off(problem, problem.fit_drift(fit.x).amplitudes, DRIFT_AMPLITUDES) < 5e-7


def test_one_common_drift_leaves_what_records_do_not_share():
    alike = counted([drifting(1, DRIFT_AMPLITUDES[0]), drifting(2, DRIFT_AMPLITUDES[0])])
    problem, x, held = problem_of(alike)
    found = problem.fit_drift(descend(problem, x, held).x)
    assert off(problem, found.amplitudes, np.tile(found.in_common, (2, 1))) < 5e-7
    assert np.mean(found.residuals_in_common**2) == pytest.approx(1.0, abs=0.06)
    problem, x, held = problem_of(TWO)
    found = problem.fit_drift(descend(problem, x, held).x)
    assert np.mean(found.residuals_in_common**2) > 10.0


def test_a_record_too_short_for_its_drift_is_fitted_without_error():
    short = ActuatorRecord(
        "short", Drive(TWO[1].time[:4], TWO[1].drive.voltage[:4]), TWO[1].displacement[:4], NOISE
    )
    problem, x, held = problem_of([TWO[0], short])
    fit = descend(problem, x, held)
    assert np.all(np.isfinite(problem.fit_drift(fit.x).amplitudes))
    # drift and offset take everything but a constant
    assert np.ptp(fit.residuals[-3:]) < 1e-6
    assert fit.cost == pytest.approx(1.0, abs=0.06)
