"""What no effect covers: a made formula is found and judged where it was not fitted."""

from __future__ import annotations

import functools
import re
from typing import NamedTuple

import numpy as np
import pytest

from dearig.model.residual import MissingStress, describe_unnamed, signatures
from tests.tools.engine import NOISE, PLAIN, made_fit, record_of, thesis_drive


@functools.cache
def answer(rate=100.0):
    return PLAIN.simulate(thesis_drive(rate, 2))


class Course(NamedTuple):
    """Strain, its rate, voltage in kV and time."""

    e: np.ndarray
    u: np.ndarray
    v: np.ndarray
    t: np.ndarray


def made(formula, noise=2.0, seed=0):
    """Missing stress by ``formula(Course)``, with ``noise`` Pa, on the thesis's lobes."""
    found, drive = answer(), thesis_drive(100.0, 2)
    rng = np.random.default_rng(seed)
    strain = found.stretch - found.rest_stretch
    stress = formula(Course(strain, found.rate, drive.voltage * 1e-3, drive.time))
    stress = stress + noise * rng.standard_normal(drive.time.size)
    return MissingStress(
        "made", drive.time, stress, found.stretch, found.rate, drive.voltage, 10.0, 1e3
    )


def looks(residual=None):
    record = record_of(PLAIN, thesis_drive(100.0, 2))
    if residual is None:
        residual = NOISE * np.random.default_rng(1).standard_normal(record.time.size)
    return signatures([record], made_fit([record], PLAIN, residual))


def terms(expression):
    """Factors by name, of an expression like ``p/Pa = +2 V^2 -300 e'``."""
    assert expression.startswith("p/Pa = ")
    found = re.findall(r"([+-][0-9.e+-]+) (.+?)(?= [+-][0-9]|$)", expression[7:])
    return {name: float(factor) for factor, name in found}


FORMULAS = {
    "drag": (lambda c: -800.0 * c.u, {"e'": -800.0}),
    "quadratic drag": (lambda c: -2e4 * c.u * np.abs(c.u), {"e'|e'|": -2e4}),
    "fourth power of the voltage": (lambda c: 0.03 * c.v**4, {"V^4": 0.03}),
    "a bent spring": (lambda c: 3e5 * c.e**2, {"e^2": 3e5}),
    "two at once": (lambda c: -800.0 * c.u + 4.0 * c.t, {"e'": -800.0, "t": 4.0}),
    "a stop": (
        lambda c: -2e4 * np.maximum(c.e - 0.7 * c.e.max(), 0.0), {"max(e - ": -2e4},
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", FORMULAS)
def test_a_made_formula_is_found(case):
    formula, wanted = FORMULAS[case]
    unnamed = describe_unnamed([made(formula)], looks())
    found = terms(unnamed.expression)
    assert len(found) == len(wanted)
    for name, factor in wanted.items():
        (value,) = (f for n, f in found.items() if n.startswith(name))
        # three digits are told
        assert value == pytest.approx(factor, rel=0.03)
    share = float(re.search(r"explains (\d+) %", unnamed.signature)[1])
    assert share > 90.0


def test_noise_gives_no_formula():
    for seed in range(20):
        unnamed = describe_unnamed([made(lambda _: 0.0, seed=seed)], looks())
        assert unnamed.expression == ""
        assert "no short formula" in unnamed.signature


def test_a_formula_is_judged_on_the_time_left_out():
    # one sign in the parts of time that are fitted, the other in those that are not
    def two_faced(c):
        part = (np.arange(c.t.size) * 8 // c.t.size) % 2
        return np.where(part == 0, 1.0, -1.0) * 20.0 * c.v**2

    assert describe_unnamed([made(two_faced)], looks()).expression == ""
    # and the share is that of these parts: half of the variance is noise that nothing explains
    wave = made(lambda c: -800.0 * c.u, noise=0.0)
    noisy = made(lambda c: -800.0 * c.u, noise=float(np.std(wave.stress)))
    words = describe_unnamed([noisy], looks()).signature
    assert float(re.search(r"explains (\d+) %", words)[1]) == pytest.approx(50.0, abs=8.0)


def test_something_delayed_is_found():
    def late(c):
        return 8.0 * np.concatenate([np.zeros(20), c.v[:-20] ** 2])

    found = terms(describe_unnamed([made(late)], looks()).expression)
    assert found == {"V^2(t - 0.2 s)": pytest.approx(8.0, rel=0.02)}


def test_the_record_that_lacks_most_is_looked_at():
    quiet = made(lambda _: 0.0)
    loud = made(lambda c: -800.0 * c.u)
    for order in ([quiet, loud], [loud, quiet]):
        assert "e'" in terms(describe_unnamed(order, looks()).expression)
    assert describe_unnamed([], looks()) is None


@pytest.mark.parametrize(
    ("quantity", "place"),
    [("voltage", "dielectric"), ("displacement", "film stress"), ("rate", "load"),
     ("time", "environment")],
)  # fmt: skip
def test_where_it_acts_is_where_the_residual_points(quantity, place):
    found, drive = answer(), thesis_drive(100.0, 2)
    along = {
        "voltage": drive.voltage**2,
        "displacement": found.displacement,
        "rate": found.rate,
        "time": drive.time,
    }[quantity]
    residual = 5e-6 * np.cos(5.0 * along / np.max(np.abs(along)))
    assert describe_unnamed([made(lambda _: 0.0)], looks(residual)).acts_on == place
