"""Steps of general laws: monotone, smooth, and a partition of a straight line."""

import numpy as np
import pytest
from scipy.integrate import quad

from dearig.model.effects.shared.splines import even, hat, rise, spline, step

KNOTS = [(0.0, 1.0, 3.0), (1.0, 1.0, 2.0), (-2.0, 0.5, 0.7)]


@pytest.mark.parametrize("knots", KNOTS)
def test_a_step_is_the_integral_of_its_hat(knots):
    for x in np.linspace(-2.5, 3.5, 25):
        area = quad(lambda at: hat(at, *knots), -3.0, x, points=[k for k in knots if k < x] or None)
        assert step(x, *knots) == pytest.approx(area[0], abs=1e-7)
    assert (step(-9.0, *knots), step(9.0, *knots)) == (0.0, 1.0)


def test_even_steps_with_even_weights_are_a_straight_line():
    knots = np.arange(-1.0, 8.0)
    for x in np.linspace(0.0, 5.9, 30):
        line = sum(step(x, *knots[i : i + 3]) for i in range(7))
        assert line == pytest.approx(x + 0.5, abs=1e-12)


@pytest.mark.parametrize("at_rest", [True, False])
def test_a_spline_sums_its_weighted_steps_and_goes_on_with_its_slope(at_rest):
    knots = (*even(4, 3, at_rest=at_rest)[:-1], np.inf)
    weights = np.array([9.0, 1.0, -2.0, 0.0, 3.0])
    middle, last = knots[3], knots[-2]
    summed = weights[1] * step(middle, *knots[:3]) + weights[2] * step(middle, *knots[1:4])
    assert spline(weights, 1, middle, knots) == pytest.approx(summed)
    for x in (0.4 * last, 0.99 * last, 1.7 * last):
        slope = (spline(weights, 1, x + 1e-6, knots) - spline(weights, 1, x - 1e-6, knots)) / 2e-6
        assert rise(weights, 1, x, knots) == pytest.approx(slope, rel=1e-5)
    assert spline(weights, 1, 3.0 * last, knots) == pytest.approx(
        spline(weights, 1, last, knots) + 2.0 * last * rise(weights, 1, last, knots)
    )
