"""The rest state: the thesis's, the measured one, and against the balance of stresses."""

import pytest

from dearig.model import coefficients as at
from dearig.model import kernel
from dearig.model.film.material import TABLE_3, THESIS_FILM, Load, Network, Spring
from dearig.model.film.network import HEAD
from dearig.model.simulation.actuator import Actuator
from tests.tools.film_drives import LENGTH, THESIS
from tests.tools.model_oracle import balance


def test_the_rest_states_are_those_of_the_thesis():
    # Table 3 contradicts section 4.1.1: 89.2 mm against the measured 82 mm
    assert THESIS.rest() == pytest.approx(1.1895, abs=1e-4)
    assert balance(THESIS, THESIS.rest(), 0.0) == pytest.approx(0.0, abs=1e-7)
    measured = Actuator(THESIS_FILM, Load(0.2, rest_length=0.082), TABLE_3)
    assert measured.rest() * LENGTH == pytest.approx(0.082, abs=1e-12)
    modulus = measured.coefficients()[HEAD + at.MODULUS]
    assert modulus == pytest.approx(83.0e3, rel=1e-3)


@pytest.mark.parametrize("voltage", [1e3, 5e3, 9e3])
def test_rest_under_voltage_balances_load_field_and_spring(voltage):
    status, stretch = kernel.rest_stretch(THESIS.coefficients(), voltage**2)
    assert status == kernel.OK
    assert balance(THESIS, stretch, voltage) == pytest.approx(0.0, abs=1e-7)


def test_a_field_that_no_spring_can_hold_is_pull_in():
    soft = Actuator(THESIS_FILM, Load(0.005), Network(Spring(2e3, kind="neo-hookean")))
    status, _ = kernel.rest_stretch(soft.coefficients(), 30e3**2)
    assert status == kernel.PULL_IN
