"""The exponential method: against classical Runge-Kutta, SciPy's exponential and closed forms."""

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.effects import assembly
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.kernel.exponential_rk import exponential_steps, film_table
from dearig.model.kernel.motion import network_stiffness, spring_table
from dearig.model.kernel.propagator import PROPAGATOR, fill_propagator
from dearig.model.kernel.rk4 import rk4_steps
from dearig.model.simulation.actuator import (
    NO_AIR,
    Actuator,
    Drive,
    at_rest,
    initial_state,
    reading_of,
)
from tests.tools.film_drives import LENGTH, ticks

SOME_EFFECTS = (
    ("linear drag", (("drag", 300.0),)),
    ("electrode resistance", (("resistance", 1e7),)),
    ("dielectric relaxation", (("strength", 0.05), ("relaxation_time", 0.02), ("settled", 0.0))),
    ("strain-dependent permittivity", (("strain_coefficient", 0.5),)),
    ("ageing", (("softening", 0.02), ("path", 0.01))),
    ("slow branch", (("modulus", 4e3), ("relaxation_time", 3.0))),
)


# Deep: no program calls the steps by themselves, and to compile them so takes half a minute.
@pytest.mark.deep
@pytest.mark.parametrize("effects", [(), SOME_EFFECTS], ids=["without", "with effects"])
def test_small_exponential_steps_are_those_of_classical_runge_kutta(effects):
    c = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects).coefficients()
    _, rest = at_rest(c)
    springs = spring_table(c)
    acting = assembly.active(c)
    assert (acting > 0) == bool(effects)
    classical, exponential = initial_state(c, rest), initial_state(c, rest)
    traces = np.zeros((2, 5))
    work = np.zeros((15, classical.size))
    table, branches = film_table(c, springs), np.zeros((2, 3))
    network_stiffness(c, exponential, branches)
    propagator = np.zeros(PROPAGATOR)
    fill_propagator(2e5, 30.0, branches, 1e-4, np.empty((7, 3, 3)), propagator)
    for v0, v1, t0 in ((0.0, 8e3, 0.0), (8e3, 6e3, 0.04)):
        rk4_steps(acting, c, springs, classical, v0, v1, t0, 0.0, 1e-4, 400, 40, work, traces[0])
        exponential_steps(
            acting, c, table, branches, propagator, exponential, v0, v1, t0, 0.0, 1e-4, 400, 40,
            traces[1],
        )  # fmt: skip
    # both are of order 4, and differ by what each of them leaves out
    np.testing.assert_allclose(exponential, classical, rtol=1e-7, atol=1e-6)
    np.testing.assert_allclose(traces[1, :3], traces[0, :3], rtol=1e-3)


@pytest.mark.deep
@pytest.mark.parametrize("drag", [0.0, 40.0, 2000.0])
def test_the_method_is_of_order_four_where_the_drag_is_in_closed_form(drag):
    effects = (("linear drag", (("drag", drag * THESIS_FILM.inertia),)),) if drag else ()
    c = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects).coefficients()
    _, rest = at_rest(c)
    table, branches = film_table(c, spring_table(c)), np.zeros((2, 3))
    start = initial_state(c, rest)
    stiffness, _ = network_stiffness(c, start, branches)
    acting = assembly.active(c)

    def end(steps):
        y, h = start.copy(), 0.02 / steps
        propagator = np.zeros(PROPAGATOR)
        fill_propagator(0.97 * stiffness, drag, branches, h, np.empty((7, 3, 3)), propagator)
        exponential_steps(
            acting, c, table, branches, propagator, y, 0.0, 8e3, 0.0, 0.0, h, steps, 1, np.zeros(5)
        )
        return y[0]

    errors = [abs(end(n) - end(1024)) for n in (8, 16, 32)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # a strong drag comes to order 4 only in shorter steps
    assert orders.min() > (3.4 if drag > 1e3 else 3.75)


@pytest.mark.parametrize("drag", [1.0, 300.0, 3e4, 1e5])
def test_a_drag_of_any_strength_takes_no_more_steps_than_none(drag):
    time = ticks(2.0, 5e-3)
    drive = Drive(time, 7e3 * np.sin(np.pi * 0.5 * time) ** 2)

    def steps_of(effects):
        c = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects).coefficients()
        _, rest = at_rest(c)
        stretch, rate = np.zeros(time.size), np.zeros(time.size)
        status, _, steps = kernel.drive_by_voltage(
            c, time, drive.voltage, drive.ends, NO_AIR, initial_state(c, rest), stretch, rate
        )
        assert status == kernel.OK
        return steps

    assert steps_of((("linear drag", (("drag", drag),)),)) <= steps_of(())


def test_a_linear_film_of_one_branch_is_exact_in_coarse_steps():
    # small steps of the voltage on a strong branch next to a weak spring: linear, and nothing left
    network = Network(Spring(40e3), (Branch(Spring(200e3), 0.1),))
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, network)
    time = ticks(4.0, 5e-3)
    drive = Drive(time, np.interp(time, [0.5, 0.6, 2.0, 2.1], [0.0, 400.0, 400.0, 100.0]))
    c, far = actuator.coefficients(), slice(None, None, 8)
    fine, _ = reading_of(c, LENGTH, drive)
    held = Drive(time[far], drive.voltage[far])
    coarse, status = reading_of(c, LENGTH, held, fidelity=kernel.COARSE)
    exact, _ = reading_of(c, LENGTH, held, times=time[far])
    assert status == kernel.OK
    assert np.ptp(fine) > 1e-6
    assert np.abs(coarse - exact).max() < 1e-4 * np.ptp(fine)
