"""General laws: each comes close to laws of its family that have another form."""

import numpy as np
import pytest
from scipy.special import erf

from dearig.model.effects import EFFECTS
from tests.deep import one_of_each
from tests.tools.effect_cases import numbers
from tests.tools.general_laws import approximate, columns, motion, response

GENERAL = [name for name, effect in EFFECTS.items() if effect.is_general]

# general law, simple law with the shapes given, and the RMS that may be left, of the law's own
NEAR = [
    ("general amplifier curve", "amplifier saturation", {"exponent": 5.0}, 0.01),
    ("general creep", "slow branch", {"relaxation_time": 4.0}, 0.02),
    ("general creep", "broad creep", {"exponent": 0.4}, 0.02),
    ("general drag", "mixed drag", {}, 0.01),
    ("general drag", "power-law drag", {"exponent": 1.5}, 0.01),
    ("general drag", "thinning drag", {"exponent": 0.5}, 0.03),
    ("general field-dependent permittivity", "field-dependent permittivity", {}, 0.01),
    ("general friction", "dry friction", {}, 0.05),
    ("general hysteresis", "distributed hysteresis", {"spread": 1.0}, 0.03),
    ("general hysteresis", "elastoplastic hysteresis", {}, 0.08),
    ("general polarisation", "broad dielectric relaxation", {}, 0.01),
    ("general polarisation", "dielectric relaxation", {"relaxation_time": 0.5}, 0.01),
    ("general sensor curve", "sensor bend", {}, 0.01),
    ("general sensor curve", "sensor saturation", {}, 0.01),
    ("general sensor lag", "sensor averaging", {"window": 0.02}, 0.01),
    ("general sensor lag", "sensor delay", {"delay": 0.02}, 0.01),
    ("general sensor lag", "sensor double lag", {"time_constant": 0.01}, 0.01),
    ("general sensor lag", "sensor lag", {"time_constant": 0.02}, 0.01),
    ("general softening", "first-loading damage", {}, 0.02),
    ("general softening", "Mullins softening", {}, 0.02),
    ("general strain-dependent permittivity", "saturating permittivity", {}, 0.01),
]


def johnson(path, values):
    """Johnson's permittivity (J. Appl. Phys. 33, 1962), one tenth lost at 10 MV/m."""
    field = path.voltage * path.stretch / 1e-3
    return (1.0 + 3.0 * values * field**2) ** (-1.0 / 3.0) - 1.0


def kohlrausch(path, values):
    """The stress of a stretched exponential relaxation after every step of the strain."""
    time, exponent = values
    strain = np.diff(np.log(path.stretch / path.stretch[0]), prepend=0.0)
    relaxing = np.exp(-((path.time / time) ** exponent))
    return np.convolve(strain, relaxing)[: path.time.size] / path.stretch


def lognormal_loop(path, values):
    """Stops with lognormally distributed thresholds."""
    middle, width = values
    y = np.linspace(-3.0, 3.0, 121)
    ends, weights = middle * np.exp(width * y), np.exp(-0.5 * y**2)
    z, out = np.zeros(y.size), []
    for travel in np.diff(path.stretch, prepend=path.stretch[0]):
        z = np.clip(z + travel, -ends, ends)
        out.append(weights @ (z / ends))
    return np.array(out)


@pytest.mark.parametrize(
    ("general", "simple", "shape", "error"),
    one_of_each(
        [pytest.param(*case, id="-".join(case[:2])) for case in NEAR], lambda p: p.values[0]
    ),
)
def test_a_general_law_comes_close_to_a_simple_one(general, simple, shape, error):
    assert EFFECTS[general].family == EFFECTS[simple].family
    assert approximate(general, response(simple, numbers(simple, **shape))).error < error


def healing(path, values):
    """Ogden and Roxburgh's loss below a largest energy that heals (Proc. R. Soc. A 455, 1999)."""
    energy = 0.5 * (path.stretch**2 + path.stretch**-2)
    energy -= energy[0]
    width, time = values
    left, most, out = np.exp(-np.diff(path.time, prepend=0.0) / time), 0.0, []
    for now, kept in zip(energy, left, strict=True):
        most = max(now, now + (most - now) * kept)
        out.append(-erf((most - now) / width))
    return np.array(out)


@pytest.mark.parametrize(
    ("general", "law", "values", "error"),
    [
        ("general field-dependent permittivity", johnson, 1.2e-15, 0.01),
        ("general creep", kohlrausch, (20.0, 0.5), 0.03),
        ("general hysteresis", lognormal_loop, (3e-3, 0.8), 0.02),
        ("general friction", lognormal_loop, (2e-4, 0.5), 0.03),
        ("general softening", healing, (0.01, 40.0), 0.01),
    ],
)
def test_a_general_law_comes_close_to_a_published_one(general, law, values, error):
    grid = {"healing_time": 40.0, "width": 1.0} if law is healing else {}
    assert approximate(general, law(motion(), values), **grid).error < error


@pytest.mark.parametrize("name", GENERAL)
def test_a_general_law_is_linear_in_its_weights(name):
    effect, grid = EFFECTS[name], numbers(name)
    shape = {p.name: grid[p.name] for p in effect.shape_parameters}
    weights = np.random.default_rng(1).uniform(0.0, 1.0, len(effect.amplitudes))
    values = {
        p.name: w * p.typical for p, w in zip(effect.amplitudes, weights, strict=True)
    } | shape
    expected = columns(name, tuple(shape.items())) @ weights
    found = response(name, values)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", GENERAL)
def test_the_curve_of_a_general_law_is_drawn_over_all_of_its_grid(name):
    effect = EFFECTS[name]
    values = numbers(name)
    curve = effect.curve(values)
    assert curve.axis.shape == curve.values.shape
    assert np.all(np.diff(curve.axis) > 0.0)
    assert curve.axis_label
    assert curve.values_label
    for p in effect.amplitudes:
        changed = effect.curve(values | {p.name: values[p.name] + p.typical})
        np.testing.assert_array_equal(changed.axis, curve.axis)
        assert np.abs(changed.values - curve.values).max() > 0.0, p.name
    # at rest or under no voltage nothing is lost or gained
    neutral = effect.curve(values | {p.name: 0.0 for p in effect.amplitudes}).values
    assert np.ptp(neutral) == 0.0
