"""Responses in closed form, against the exponential of the whole linear system."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import odeint, solve_ivp
from scipy.linalg import expm

from dearig.model.effects.shared.filters import (
    along_cubic,
    bent,
    bristles_slip,
    lagged,
    low_pass,
    slewed,
    slid,
    switched,
    swung,
    wound,
    wound_on,
)
from tests.tools.effect_oracle import bouc_wen

RATIOS = 10.0 ** np.arange(-6.0, 3.5, 0.5)  # of the step to the filter's own time
TAU = 0.02


def driven(system, before, h, powers):
    """State of z' = A z + B x after ``h``, x(t) = sum of ``powers``[k] t^k, by one exponential.

    ``system`` is (A, B); x and its derivatives join the state as a chain of integrators.
    """
    a, b = system
    n, m = len(b), len(powers)
    full = np.zeros((n + m, n + m))
    full[:n, :n] = a
    full[:n, n] = b
    full[n : n + m - 1, n + 1 :] = np.eye(m - 1)
    derivatives = [math.factorial(k) * p for k, p in enumerate(powers)]
    # in units of the step, so that the exponential is of numbers of one size
    scale = h ** np.arange(m)
    scaled = full * h
    for k in range(m - 1):
        scaled[n + k, n + k + 1] = 1.0
    return (expm(scaled) @ np.concatenate([before, derivatives * scale]))[:n]


def cubic(rng, h, tau):
    """Coefficients of a cubic that moves by about 1 in the longer of ``h`` and ``tau``."""
    return rng.uniform(-1.0, 1.0, 4) / max(h, tau) ** np.arange(4)


def ends(powers, h):
    value = np.polynomial.Polynomial(powers)
    rate = value.deriv()
    return value(0.0), rate(0.0), value(h), rate(h)


@pytest.mark.parametrize("ratio", RATIOS)
def test_lagged(ratio):
    rng = np.random.default_rng(1)
    h = ratio * TAU
    for _ in range(5):
        before, start, end = rng.uniform(-1.0, 1.0, 3)
        expected = driven(([[-1.0 / TAU]], [1.0 / TAU]), [before], h, [start, (end - start) / h])
        # short steps take Pade's approximation: 1.4e-7 of the change of input at its end
        assert lagged(before, start, end, h, TAU) == pytest.approx(expected[0], abs=2e-7)


@pytest.mark.parametrize("ratio", RATIOS)
def test_low_pass(ratio):
    rng = np.random.default_rng(2)
    h = ratio * TAU
    for _ in range(5):
        before, powers = rng.uniform(-1.0, 1.0), cubic(rng, h, TAU)
        expected = driven(([[-1.0 / TAU]], [1.0 / TAU]), [before], h, powers)
        x0, u0, x1, u1 = ends(powers, h)
        found = low_pass(before, x0, u0, x1, u1, h, TAU)
        assert found == pytest.approx(expected[0], abs=1e-9)


@pytest.mark.parametrize("part", [0.0, 0.3, 1.0])
def test_along_cubic(part):
    rng = np.random.default_rng(3)
    for h in (1e-4, 5e-3, 2.0):
        x = np.polynomial.Polynomial(cubic(rng, h, h))
        integral, there = along_cubic(x(0.0), x.deriv()(0.0), x(h), x.deriv()(h), h, part * h)
        assert there == pytest.approx(x(part * h), abs=1e-9)
        assert integral == pytest.approx(x.integ()(part * h), abs=1e-9 * h)


@pytest.mark.parametrize("damping", [1e-3, 0.05, 0.7, 1.0])
@pytest.mark.parametrize("ratio", RATIOS)
def test_swung(ratio, damping):
    rng = np.random.default_rng(4)
    h, omega = ratio * TAU, 1.0 / TAU
    system = ([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]], [0.0, omega**2])
    for _ in range(5):
        before, (e0, rise) = rng.uniform(-1.0, 1.0, 2) / [1.0, TAU], rng.uniform(-1.0, 1.0, 2)
        e1 = e0 + rise * min(ratio, 1.0)
        expected = driven(system, before, h, [e0, (e1 - e0) / h])
        found = swung(*before, e0, e1, h, omega, damping)
        # critical damping is stood in for by one just below
        error = 4e-6 if damping == 1.0 else 1e-9
        assert found[0] == pytest.approx(expected[0], abs=error)
        assert found[1] * TAU == pytest.approx(expected[1] * TAU, abs=error)


@pytest.mark.parametrize("travel", [1e-9, 1e-3, 0.4, 3.0, 500.0])
@pytest.mark.parametrize("z", [-1.0, -0.3, 0.0, 0.9])
def test_slid(z, travel):
    for way in (1.0, -1.0):
        far = min(travel, 30.0)  # beyond, there is nothing left to integrate
        done = solve_ivp(
            lambda _, y, way=way: [way - y[0]], (0.0, far), [z], rtol=1e-11, atol=1e-13
        )
        assert slid(z * 2e-4, way * travel * 2e-4, 2e-4) == pytest.approx(
            done.y[0, -1] * 2e-4, rel=1e-8, abs=1e-15
        )


@pytest.mark.parametrize("elastic", [0.0, 0.4, 0.7, 0.9])
@pytest.mark.parametrize("z", [-1.3, -0.5, 0.0, 0.95, 1.4])
def test_bent_is_what_bristles_do_that_slip_so(z, elastic):
    def slope(_, y):
        return [1.0 - bristles_slip(y[0], elastic) * y[0]]

    for travel in (1e-6, 0.01, 0.03, 0.15, 0.8, 2.0, 8.0, 500.0):
        far = min(travel, 30.0)  # beyond, there is nothing left to integrate
        done = solve_ivp(slope, (0.0, far), [z], rtol=1e-10, atol=1e-12, max_step=0.1)
        for way in (1.0, -1.0):
            found = bent(way * z * 2e-4, way * travel * 2e-4, 2e-4, elastic) / 2e-4
            # as measured, rounded up: a thousandth where they slip from the first
            assert found == pytest.approx(way * done.y[0, -1], abs=1e-3 if elastic == 0.0 else 3e-4)


def test_bristles_slip_from_nothing_to_all():
    z = np.linspace(-1.5, 1.5, 61)
    slip = np.array([bristles_slip(part, 0.5) for part in z])
    assert np.all(slip[z <= 0.5] == 0.0)
    assert np.all(slip[z >= 1.0] == 1.0)
    assert bristles_slip(0.75, 0.5) == pytest.approx(0.5)


@pytest.mark.parametrize("asymmetry", [0.5, 0.8, 1.0])
@pytest.mark.parametrize("exponent", [0.7, 1.0, 2.4, 6.0])
@pytest.mark.parametrize("b", [-1.0, -0.3, 0.0, 0.9])
def test_wound_is_bouc_and_wens_loop(b, exponent, asymmetry):
    def slope(_, y, way):
        return [bouc_wen(way, y[0], exponent, asymmetry)]

    for travel in (1e-6, 0.15, 1.3, 8.0):
        for way in (1.0, -1.0):
            span = (0.0, travel)
            done = odeint(slope, [b], span, args=(way,), tfirst=True, rtol=1e-10, atol=1e-12)[1, 0]
            found = wound(b, way * travel, exponent, asymmetry)
            # a power below 1 has a corner where the stress is 0
            error = 3e-5 if exponent >= 1.0 else 1e-3
            assert found == pytest.approx(done, abs=error)
            known = abs(b) ** exponent
            on = wound_on(b, known, way * travel, exponent, asymmetry)
            assert on == pytest.approx(done, abs=error)
            # with 1 and 1 it is Dahl's
            if exponent == asymmetry == 1.0:
                assert found == pytest.approx(slid(b, way * travel, 1.0), abs=error)


@pytest.mark.parametrize("seed", range(20))
def test_slewed_is_what_tiny_steps_come_to(seed):
    rng = np.random.default_rng(seed)
    before, start, end = rng.uniform(-1.0, 1.0, 3)
    most = rng.uniform(0.2, 3.0)
    steps = 20000
    out = before
    for x in np.linspace(start, end, steps + 1)[1:]:
        out += min(max(x - out, -most / steps), most / steps)
    assert slewed(before, start, end, 1.0, most) == pytest.approx(out, abs=3.0 * most / steps)


def test_switched():
    assert [switched(s) for s in (-1.0, -0.01, 0.0, 0.005, 0.01, 9.0)] == pytest.approx(
        [0.0, 0.0, 0.5, 0.75, 1.0, 1.0]
    )


VALUE = st.floats(-1e4, 1e4)
STEP = st.floats(1e-9, 1e4)
TIME = st.floats(1e-12, 1e4)


@given(before=VALUE, start=VALUE, end=VALUE, h=STEP, tau=TIME, part=st.floats(0.01, 0.99))
def test_two_steps_are_one(before, start, end, h, tau, part):
    middle = start + (end - start) * part
    for step, scale in ((lagged, 2e-7), (slewed, 1e-9)):
        whole = step(before, start, end, h, tau)
        half = step(before, start, middle, h * part, tau)
        joined = step(half, middle, end, h * (1.0 - part), tau)
        size = max(abs(before), abs(start), abs(end), 1.0)
        assert joined == pytest.approx(whole, abs=2.0 * scale * size)


@given(before=VALUE, start=VALUE, end=VALUE, h=STEP, tau=TIME)
def test_outputs_stay_between_what_they_come_from_and_go_to(before, start, end, h, tau):
    low, high = min(before, start, end), max(before, start, end)
    room = 1e-6 * max(abs(low), abs(high))
    for step in (lagged, slewed):
        assert low - room <= step(before, start, end, h, tau) <= high + room


@pytest.mark.parametrize("exponent", [0.7, 1.0, 2.4, 6.0])
@pytest.mark.parametrize("b", [-1.0, -0.3, 1e-3, 0.2, 0.9, 1.0])
def test_short_travels_by_a_series_are_as_good(b, exponent):
    for part in (0.01, 0.03, 0.049):
        for way in (1.0, -1.0):
            travel = way * part * abs(b) / max(exponent, 1.0)
            done = solve_ivp(
                lambda _, y, way=way: [bouc_wen(way, y[0], exponent, 0.8)], (0.0, abs(travel)), [b],
                rtol=1e-12, atol=1e-15,
            )  # fmt: skip
            on = wound_on(b, abs(b) ** exponent, travel, exponent, 0.8)
            assert on == pytest.approx(done.y[0, -1], abs=3e-5 * abs(travel))


@given(
    before=VALUE, rate=VALUE, x0=VALUE, u0=VALUE, x1=VALUE, u1=VALUE,
    h=st.floats(1e-9, 1e4), tau=st.floats(1e-12, 2.0), damping=st.floats(1e-3, 1.0),
)  # fmt: skip
def test_everything_is_finite(before, rate, x0, u0, x1, u1, h, tau, damping):
    assert math.isfinite(low_pass(before, x0, u0, x1, u1, h, tau))
    assert np.isfinite(along_cubic(x0, u0, x1, u1, h, h)).all()
    omega = 2.0 * math.pi * min(max(1.0 / tau, 0.3), 40.0)
    assert np.isfinite(swung(before, rate, x0, x1, h, omega, damping)).all()
    assert abs(slid(x0, x1 - x0, tau)) <= max(abs(x0), tau) * (1.0 + 1e-12)
    for asymmetry in (0.5, 1.0):
        b, n = min(max(x0, -1.0), 1.0), 1.0 + damping
        assert abs(wound(b, (x1 - x0) / h, n, asymmetry)) <= 1.0
        assert abs(wound_on(b, abs(b) ** n, (x1 - x0) / h, n, asymmetry)) <= 1.0 + 1e-12
