"""Viscoplastic flow, thinning drag and the sensor's delay, by their hooks alone."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dearig.model.coefficients import EFFECTS_AT, REST
from dearig.model.effects.library.mechanical import thinning_drag, viscoplastic_flow
from dearig.model.effects.library.sensor import sensor_delay, sensor_lag
from tests.tools.effect_cases import numbers


def coefficients(name, **given):
    c = np.concatenate([np.zeros(EFFECTS_AT), list(numbers(name, **given).values())])
    c[REST] = 1.2
    return c


def followed(c, time, stretch):
    """Stress of the viscoplastic element along a stretch that is straight between samples."""
    m, out = np.zeros(1), [0.0]
    for (t0, t1), (a, b) in zip(pairwise(time), pairwise(stretch), strict=True):
        rate = (b - a) / (t1 - t0)
        out.append(viscoplastic_flow.stress(c, EFFECTS_AT, m, 0, b, rate, a, t1 - t0, t0))
        viscoplastic_flow.commit(c, EFFECTS_AT, m, 0, b, rate, a, t1 - t0, t0)
    return np.array(out)


@pytest.mark.parametrize(
    ("threshold", "exponent"), [(0.6, 1.0), (0.0, 1.0), (0.0, 4.0), (0.5, 2.0)]
)
def test_viscoplastic_flow_is_followed_over_steps_of_any_length(threshold, exponent):
    c = coefficients("viscoplastic flow", threshold=threshold, exponent=exponent)
    size, reach, *_ = c[EFFECTS_AT:]
    corners, levels = [0.0, 1.0, 2.0, 3.0, 4.0, 6.0], [1.2, 1.23, 1.19, 1.2, 1.2, 1.21]
    time = np.arange(601) * 0.01

    def slope(t, z):
        k = min(int(np.searchsorted(corners, t, side="right")) - 1, len(corners) - 2)
        rate = (levels[k + 1] - levels[k]) / (corners[k + 1] - corners[k])
        over = max(abs(z[0]) / reach - threshold, 0.0) / (1.0 - threshold)
        return [rate - math.copysign(0.01 * over**exponent, z[0])]

    z = solve_ivp(slope, (0.0, 6.0), [0.0], t_eval=time, max_step=2e-3, rtol=1e-9, atol=1e-13).y[0]
    for samples in (1, 50, 100):
        ticks = time[::samples]
        found = followed(c, ticks, np.interp(ticks, corners, levels))
        np.testing.assert_allclose(found, size * z[::samples] / reach, atol=1e-2 * size)


def test_viscoplastic_flow_bears_its_stress_at_the_reference_rate_and_leaves_a_set():
    c = coefficients("viscoplastic flow", threshold=0.5, exponent=1.0)
    size, reach, *_ = c[EFFECTS_AT:]
    steady = followed(c, np.array([0.0, 20.0]), np.array([1.2, 1.4]))
    assert steady[1] == pytest.approx(size, rel=1e-2)
    time = np.array([0.0, 0.1, 20.0, 20.1, 60.0])
    held = followed(c, time, np.array([1.2, 1.2 + 5.0 * reach, *[1.2 + 5.0 * reach] * 3]))
    assert held[1] > 3.0 * size
    assert held[2] == pytest.approx(0.5 * size, rel=1e-6)
    back = followed(c, time, np.array([1.2, *[1.2 + 5.0 * reach] * 2, 1.2, 1.2]))
    # at the stretch of the start the element now pushes, with its threshold, for good
    assert back[-1] == pytest.approx(-0.5 * size, rel=1e-6)
    # below the threshold it is a spring
    small = followed(c, time, np.array([1.2, *[1.2 + 0.4 * reach] * 2, 1.2, 1.2]))
    np.testing.assert_allclose(small, size * np.array([0.0, 0.4, 0.4, 0.0, 0.0]), atol=1e-9 * size)


@pytest.mark.parametrize("exponent", [0.0, 0.3, 1.0, 1.7, 2.0])
def test_a_thinning_drag_is_a_power_of_the_rate_and_linear_at_rest(exponent):
    c = coefficients("thinning drag", exponent=exponent, linear_below=5e-4)

    def drag(rate):
        return thinning_drag.stress(c, EFFECTS_AT, np.zeros(0), 0, 1.2, rate, 1.2, 0.0, 0.0)

    assert math.log2(drag(0.4) / drag(0.2)) == pytest.approx(exponent, abs=0.01)
    assert drag(-0.1) == -drag(0.1)
    assert drag(2e-7) == pytest.approx(2.0 * drag(1e-7), rel=1e-3)
    assert drag(0.0) == 0.0


def shown(sensor, name, age, time, rows):
    c, m = coefficients(name), np.zeros(sensor.EFFECT.memory)
    c[EFFECTS_AT] = age
    steps = np.diff(time, prepend=time[0])
    return np.array(
        [
            sensor.sense(c, EFFECTS_AT, m, 0, t, dt, x, u)
            for t, dt, x, u in zip(time, steps, *rows, strict=True)
        ]
    )


@pytest.mark.parametrize("age", [0.4e-3, 3.7e-3, 0.0512])
def test_a_delay_is_no_lag(age):
    time = np.arange(1001) * 2e-3
    swing = 2.0 * math.pi * 2.0
    rows = np.stack((1.0 - np.cos(swing * time), swing * np.sin(swing * time))) * 1e-3
    late = shown(sensor_delay, "sensor delay", age, time, rows)
    then = np.maximum(time - age, 0.0)
    np.testing.assert_allclose(late, 1e-3 * (1.0 - np.cos(swing * then)), atol=1e-9)
    # a lag of the same mean age follows as late, and is smaller and rounded
    lag = shown(sensor_lag, "sensor lag", age, time, rows)
    assert np.abs(lag - late).max() > 0.3 * (swing * age) ** 2 * 1e-3
