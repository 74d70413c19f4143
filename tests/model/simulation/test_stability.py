"""Pull-in and static stretch against closed forms and against the kernel."""

import math

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.errors import ModelError
from dearig.model.film.material import (
    TABLE_3,
    THESIS_LOAD,
    VACUUM_PERMITTIVITY,
    Branch,
    Film,
    Load,
    Network,
    Spring,
)
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.stability import pull_in_voltage, static_stretch
from tests.tools.model_oracle import balance

MU = 50e3


def film(kinematics="constrained-width"):
    return Film(0.075, 0.072, 0.001, kinematics=kinematics)


def unloaded(kinematics, spring):
    return Actuator(film(kinematics), Load(0.0), Network(spring))


def field(actuator, voltage):
    """True-field scale sqrt(eps/mu) V/Z of the classical results."""
    permittivity = VACUUM_PERMITTIVITY * actuator.film.permittivity
    return voltage / actuator.film.thickness * math.sqrt(permittivity / MU)


def test_neo_hookean_held_in_width_only_approaches_its_limit():
    actuator = unloaded("constrained-width", Spring(MU, kind="neo-hookean"))
    assert field(actuator, pull_in_voltage(actuator)) == pytest.approx(1.0, rel=1e-7)


def test_neo_hookean_pulled_both_ways_is_the_classical_result():
    actuator = unloaded("equibiaxial", Spring(MU, kind="neo-hookean"))
    # V^2 ~ lam^-2 - lam^-8: its maximum is at lam^6 = 4
    highest = math.sqrt(4.0 ** (-1 / 3) - 4.0 ** (-4 / 3))
    voltage = pull_in_voltage(actuator)
    assert field(actuator, voltage) == pytest.approx(highest, rel=1e-12)
    assert static_stretch(actuator, voltage) == pytest.approx(2.0 ** (1 / 3), rel=1e-6)


@pytest.mark.parametrize(
    ("kinematics", "spring"),
    [
        ("constrained-width", Spring(MU, 3.0)),
        ("uniaxial", Spring(MU, kind="neo-hookean")),
        ("equibiaxial", Spring(MU, 0.5)),
    ],
)
def test_a_film_that_stiffens_in_time_never_pulls_in(kinematics, spring):
    assert pull_in_voltage(unloaded(kinematics, spring)) is None


def test_a_gent_film_pulled_both_ways_has_its_first_maximum_before_it_stiffens():
    actuator = unloaded("equibiaxial", Spring(MU, 100.0))
    voltage = pull_in_voltage(actuator)
    highest = math.sqrt(4.0 ** (-1 / 3) - 4.0 ** (-4 / 3))
    assert field(actuator, voltage) == pytest.approx(highest, rel=0.01)
    assert static_stretch(actuator, voltage) < 1.35


@pytest.mark.parametrize("voltage", [0.0, 2e3, 8e3, -8e3])
def test_static_stretch_balances_the_forces(voltage):
    actuator = Actuator(film(), THESIS_LOAD, TABLE_3)
    stretch = static_stretch(actuator, voltage)
    assert balance(actuator, stretch, voltage) == pytest.approx(0.0, abs=1e-6)
    if voltage == 0.0:
        assert stretch == pytest.approx(actuator.rest(), abs=1e-12)


def test_more_load_means_less_voltage():
    network = Network(Spring(MU, kind="neo-hookean"))
    films = [Actuator(film("equibiaxial"), Load(m), network) for m in (0.0, 0.05, 0.1)]
    voltages = [pull_in_voltage(f) for f in films]
    assert voltages == sorted(voltages, reverse=True)


@pytest.mark.parametrize(("factor", "status"), [(0.98, kernel.OK), (1.03, kernel.PULL_IN)])
def test_the_kernel_pulls_in_where_the_statics_say_so(factor, status):
    # slow, so that the branch stays relaxed and nothing overshoots
    branch = Branch(Spring(MU, kind="neo-hookean"), 0.02)
    network = Network(Spring(MU, kind="neo-hookean"), (branch,))
    actuator = Actuator(film("equibiaxial"), Load(0.02), network)
    time = np.linspace(0.0, 20.0, 2001)
    voltage = factor * pull_in_voltage(actuator) * np.minimum(time / 18.0, 1.0)
    assert actuator.simulate(Drive(time, voltage)).status == status


def test_beyond_pull_in_it_refuses():
    actuator = unloaded("equibiaxial", Spring(MU, kind="neo-hookean"))
    with pytest.raises(ModelError, match=r"no stable stretch at 40 kV: the film pulls in at \d"):
        static_stretch(actuator, 40e3)
    with pytest.raises(ModelError, match="must be a finite number"):
        static_stretch(actuator, math.nan)
    with pytest.raises(ModelError, match="no rest state"):
        pull_in_voltage(Actuator(film(), THESIS_LOAD, Network(Spring(0.0))))
