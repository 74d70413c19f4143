"""Jacobians by films side by side: against wider differences of films one by one."""

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.fitting.drift import record_drift
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.slow_noise import DriftSpace, WhitenedProblem
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, Drive, reading_of
from tests.tools.engine import effect, record_of, thesis_drive, typical

PLAIN = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
FELT = ("mu_0", "mu_1", "mu_2", "T_1", "T_2")  # parameters that the thesis's record determines


def one_by_one(problem: Problem, x: np.ndarray, part: float = 1.0) -> np.ndarray:
    """Return central differences (N, d) of films simulated one by one."""
    steps = part * problem.layout.differences(x)
    sides = [
        np.minimum(x + np.diag(steps), problem.layout.upper),
        np.maximum(x - np.diag(steps), problem.layout.lower),
    ]
    up, down = (problem.predict(problem.layout.values(side))[0] for side in sides)
    width = (sides[0] - sides[1]).sum(axis=1)
    return np.asarray(((up - down) / problem.sigma).T / width)


def made(model: Actuator, count: int = 1) -> list[ActuatorRecord]:
    return [record_of(model, thesis_drive(rate=100.0), seed=seed) for seed in range(count)]


def difference(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return how far columns are from those of ``other``, relative."""
    return np.asarray(np.linalg.norm(one - other, axis=0) / np.linalg.norm(other, axis=0))


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (typical("slow branch"), typical("sensor lag")),
        (typical("electrode resistance"),),
        (typical("dry friction"),),
    ],
    ids=["plain", "sensor", "supply", "friction"],
)
def test_a_jacobian_of_films_side_by_side_is_that_of_films_one_by_one(effects):
    model = replace(PLAIN, effects=effects)
    layout = FitLayout(model)
    problem = Problem(made(model), layout)
    x = layout.coordinates(layout.initial())
    felt = np.array([n in FELT for n in layout.names])
    known = one_by_one(problem, x)[:, felt]
    for residuals in (None, problem.residuals(x)):
        found = problem.jacobian(x, felt, residuals)
        np.testing.assert_array_less(difference(found, known), 2e-2 if effects else 2e-4)


@pytest.mark.parametrize("effects", [(), effect("linear drag", drag=300.0)])
def test_its_error_is_a_tenth_of_that_of_films_one_by_one(effects):
    """One-sided, against central differences of films in steps sixteen times as fine."""
    model = replace(PLAIN, effects=effects)
    layout = FitLayout(model)
    (record,) = made(model)
    problem = Problem([record], layout)
    x = layout.coordinates(layout.initial())
    felt = np.array([n in FELT for n in layout.names])
    time, voltage = record.time, record.drive.voltage
    ticks = np.linspace(time[0], time[-1], (time.size - 1) * 16 + 1)
    fine = Drive(ticks, np.interp(ticks, time, voltage))

    def readings(rows: np.ndarray) -> np.ndarray:
        cs = layout.coefficients(layout.values(rows))
        return np.array([reading_of(c, THESIS_FILM.length, fine, times=time)[0] for c in cs])

    steps = np.diag(1e-4 * np.maximum(np.abs(x), 1.0))[felt]
    width = steps.sum(axis=1)
    exact = (readings(x + steps) - readings(x - steps)).T / (2.0 * width) / record.noise
    # as a fit sees them: less the offset that a recording has
    exact += problem._offsets.nearest(-exact.T).T
    residuals = problem.residuals(x)
    beside = difference(problem.jacobian(x, felt, residuals), exact)
    coarse = np.zeros(int(felt.sum()), dtype=bool)
    alone = difference(problem._one_by_one(x, felt, residuals, coarse), exact)
    np.testing.assert_array_less(beside, np.maximum(0.11 * alone, 3e-6))


def test_several_records_masked_readings_drift_and_whitening_are_as_in_predictions():
    model = replace(PLAIN, effects=(typical("fitful drift"),))
    records = made(model, 2)
    valid = np.ones(records[0].time.size, dtype=bool)
    valid[100:120] = False
    records[0] = replace(records[0], valid=valid)
    layout = FitLayout(model)
    assert record_drift(records, model.effects) is not None
    x = layout.coordinates(layout.initial())
    white = Problem(records, layout)
    bases = [np.cos(np.outer(r.time, [0.3, 0.6])) for r in records]
    slow = WhitenedProblem(records, layout, DriftSpace(bases).drift(1.0))
    for problem in (white, slow):
        felt = np.array([n in FELT for n in layout.names])
        found = problem.jacobian(x, felt)
        np.testing.assert_array_less(difference(found, one_by_one(problem, x)[:, felt]), 2e-4)
        assert not problem.jacobian(x, problem.own).any()


def test_stiff_films_are_simulated_one_by_one():
    model = replace(PLAIN, network=Network(Spring(4e5, 1e3), (Branch(Spring(8e6, 1e3), 1e-5),)))
    layout = FitLayout(model)
    problem = Problem(made(model), layout)
    x = layout.coordinates(layout.initial())
    assert problem.differences(layout.values(np.tile(x, (2, 1)))) is None
    free = np.array([n == "mu_0" for n in layout.names])
    known = one_by_one(problem, x)[:, free]
    np.testing.assert_allclose(problem.jacobian(x, free), known)
    # the stiff method's own steps are the noise of a one-sided difference
    one_sided = problem.jacobian(x, free, problem.residuals(x))
    np.testing.assert_array_less(difference(one_sided, known), 0.2)


def test_neighbours_count_as_simulations_and_cost_what_their_packs_do():
    layout = FitLayout(PLAIN)
    seen: list[tuple[int, float]] = []

    def count(simulations: int, cost: float) -> None:
        seen.append((simulations, cost))

    problem = Problem(made(PLAIN), layout, on_simulations=count)
    values = np.tile(layout.initial(), (12, 1))
    problem.predict(values[:1])
    assert problem.differences(values) is not None
    (one, alone), (twelve, beside) = seen
    assert (one, twelve, problem.simulations) == (1, 12, 13)
    # one film alone, then three packs
    assert beside == pytest.approx(4.0 * (alone - 1.5e4) + 1.5e4)
