"""Starts by regression against what made the records."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from dearig.model.diagnosis.least_squares import bounded, lagrange
from dearig.model.diagnosis.regression import Regression, Start
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.diagnosis.shapes import extent_of, shape_points
from dearig.model.effects import EFFECTS
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from tests.tools.engine import (
    NOISE,
    PLAIN,
    STRIP,
    effect,
    film_record_of,
    record_of,
    thesis_drive,
)

SETTINGS = DiagnosisSettings()
TIMES = (0.1, 40.0)


def regression(record: Record, model: Actuator | Strip) -> Regression:
    return Regression([record], model, TIMES, SETTINGS)


def starts(record: Record, model: Actuator | Strip, *names: str) -> dict[str, list[Start]]:
    extent = extent_of([record], lambda low, high: 0.5 * (low + high))
    return regression(record, model).starts([EFFECTS[n] for n in names], extent)


def silent(model: Actuator) -> Record:
    """A record of ``model`` without noise, at the rate of a real one."""
    return record_of(model, thesis_drive(200.0), noise=1e-3 * NOISE)


def test_the_model_that_made_the_record_leaves_little() -> None:
    # by the interpolation between two times of the grid: 1.5e-3 of a motion of 1e3 noises
    record = replace(silent(PLAIN), noise=NOISE)
    assert regression(record, PLAIN).misfit < 1.5


@pytest.mark.parametrize(("off", "left"), [(1.01, 5e-4), (1.03, 3e-3)])
def test_another_modulus_is_followed_through_the_rest_stretch(off: float, left: float) -> None:
    # one linear step: what is left is of second order
    record = replace(silent(PLAIN), noise=NOISE)
    network = PLAIN.network
    stiffer = replace(network.equilibrium, modulus=off * network.equilibrium.modulus)
    model = replace(PLAIN, network=replace(network, equilibrium=stiffer))
    start = starts(record, model, "linear drag")["linear drag"][0]
    assert start.moduli[0] == pytest.approx(45e3, rel=left)


@pytest.mark.parametrize(
    ("name", "hidden"),
    [
        ("linear drag", {"drag": 900.0}),
        ("sensor curvature", {"quadratic": 15.0}),
        ("electrode resistance", {"resistance": 6e7}),
        ("strain-dependent permittivity", {"strain_coefficient": 1.0}),
        ("load inertia", {"moving_mass": 0.2}),
    ],
)
def test_an_amplitude_is_found_from_the_model_without_it(
    name: str, hidden: dict[str, float]
) -> None:
    record = replace(silent(replace(PLAIN, effects=effect(name, **hidden))), noise=NOISE)
    start = starts(record, PLAIN, name)[name][0]
    assert start.values == pytest.approx(tuple(hidden.values()), rel=0.15)


def test_a_shape_between_the_points_of_the_grid_is_found() -> None:
    hidden = effect("amplifier saturation", loss=0.1, exponent=7.1)
    record = replace(silent(replace(PLAIN, effects=hidden)), noise=NOISE)
    found = starts(record, PLAIN, "amplifier saturation")["amplifier saturation"]
    loss, exponent = found[0].values
    assert loss == pytest.approx(0.1, rel=0.5)
    assert exponent == pytest.approx(7.1, rel=0.15)


def test_a_film_driven_by_stretch_is_regressed_alike() -> None:
    hidden = effect("Mullins softening", softening=0.1, width=0.4)
    record = film_record_of(replace(STRIP, effects=hidden), noise=1.0)
    start = starts(record, STRIP, "Mullins softening", "linear drag")["Mullins softening"][0]
    assert start.values == pytest.approx((0.1, 0.4), rel=0.3)


def test_bounded_least_squares_agree_with_scipys() -> None:
    rng = np.random.default_rng(0)
    springs = np.abs(rng.standard_normal((60, 5)))
    wanted, d = rng.standard_normal(60), rng.standard_normal((60, 2))
    q, triangle = np.linalg.qr(springs)
    low, high = np.array([0.0, -1e3]), np.array([1e3, 1e3])
    a, left = bounded(
        triangle, q.T @ wanted, wanted - q @ (q.T @ wanted), q.T @ d, d - q @ (q.T @ d), low, high
    )
    every = lsq_linear(
        np.hstack([springs, -d]), wanted,
        (np.array([0.0] * 5 + list(low)), np.array([np.inf] * 5 + list(high))),
    )  # fmt: skip
    assert a == pytest.approx(every.x[5:], abs=1e-6)
    assert left == pytest.approx(np.sqrt(2.0 * every.cost))


def test_coefficients_beyond_a_bound_are_held_there() -> None:
    rng = np.random.default_rng(1)
    springs = np.abs(rng.standard_normal((40, 3)))
    d = rng.standard_normal((40, 1))
    wanted = springs @ np.ones(3) - 5.0 * d[:, 0]
    q, triangle = np.linalg.qr(springs)
    a, left = bounded(
        triangle, q.T @ wanted, wanted - q @ (q.T @ wanted), q.T @ d, d - q @ (q.T @ d),
        np.zeros(1), np.full(1, 2.0),
    )  # fmt: skip
    assert a == pytest.approx([2.0])
    assert left > 1.0


def test_shapes_start_at_those_of_the_effect_and_spread_over_its_bounds() -> None:
    extent = extent_of([record_of(PLAIN)], lambda *_: 50.02)
    points = shape_points(EFFECTS["dielectric relaxation"], extent, SETTINGS)
    assert (0.1, 1.0) in points
    assert len(points) > len(EFFECTS["dielectric relaxation"].shape_parameters[0].starts)
    mains = shape_points(EFFECTS["mains interference"], extent, SETTINGS)
    assert (50.02,) in mains


def test_interpolation_between_nodes_is_exact_for_a_cubic() -> None:
    nodes = np.arange(4.0)
    for t in (0.0, 0.4, 1.0, 1.7, 2.5, 3.0):
        for powers in np.eye(4):
            at_nodes = np.polynomial.polynomial.polyval(nodes, powers)
            expected = np.polynomial.polynomial.polyval(t, powers)
            assert lagrange(t) @ at_nodes == pytest.approx(expected, abs=1e-12)
