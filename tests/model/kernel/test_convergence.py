"""Order of convergence of the methods that take any film: classical Runge-Kutta and RODAS."""

import numpy as np
import pytest

from dearig.model.kernel.motion import spring_table
from dearig.model.kernel.rk4 import rk4_steps
from dearig.model.kernel.rodas import rodas_step
from dearig.model.simulation.actuator import initial_state
from tests.deep import mostly_deep
from tests.tools.film_drives import THESIS


@pytest.mark.parametrize("method", mostly_deep(["rk4", "rodas"], ["rodas"]))
def test_a_method_of_order_four_converges_with_the_fourth_power_of_the_step(method):
    c = THESIS.coefficients()
    springs = spring_table(c)
    rest = THESIS.rest()

    def end(steps):
        y = initial_state(c, rest)
        h = 0.02 / steps
        work, out, trace = np.zeros((15, y.size)), np.zeros(5), np.zeros(5)
        for k in range(steps):
            v0, v1 = 4e5 * k * h, 4e5 * (k + 1) * h
            if method == "rodas":
                rodas_step(c, springs, y, v0, v1 - v0, h, work, out)
                y[:5] = out
            else:
                rk4_steps(0, c, springs, y, v0, v1, k * h, 0.0, h, 1, 1, work, trace)
        return y[0]

    counts = (32, 64, 128)
    exact = end(1024)  # its error is a 4096th of that of 128 steps
    errors = [abs(end(n) - exact) for n in counts]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([4.0, 4.0], abs=0.4)
