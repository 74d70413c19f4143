"""The actuator: values that no film can have, and what a response says."""

import numpy as np
import pytest

from dearig.model.errors import ModelError
from dearig.model.film.material import (
    TABLE_3,
    THESIS_FILM,
    THESIS_LOAD,
    Branch,
    Film,
    Load,
    Network,
    Spring,
)
from dearig.model.simulation.actuator import Actuator, Drive
from tests.tools.film_drives import THESIS, ticks


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Film(0.0, 0.072, 0.001), "film: length = 0.0 must be a finite number above 0"),
        (lambda: Film(0.1, 0.1, 0.1, kinematics="radial"), "'radial' is not one of constrained"),
        (lambda: Load(-1.0), "load: mass = -1.0 kg"),
        (lambda: Load(0.0, rest_length=0.08), "measured rest length: mass = 0.0"),
        (lambda: Spring(-1.0), "modulus = -1.0 Pa must be finite, 0 or more"),
        (lambda: Spring(1.0, 0.0), "limit = 0.0 must be above 0.0"),
        (lambda: Spring(1.0, 1.0, "arruda-boyce"), "limit = 1.0 must be above 1.0"),
        (lambda: Spring(1.0, kind="hooke"), "'hooke' is not one of neo-hookean"),
        (lambda: Branch(Spring(1.0), -1.0), "relaxation_time = -1.0 s must be 0 or more"),
        (lambda: Network.gent([1.0], [1.0], [1.0]), "not 1, 1 and 1"),
        (lambda: Drive(np.zeros(3), np.zeros(2)), "two arrays of one length"),
        (lambda: Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, (("magic", ()),)), "'magic' is not"),
        (
            lambda: Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, (("load inertia", ()),)),
            "takes the parameters moving_mass",
        ),
        (lambda: Actuator(THESIS_FILM, THESIS_LOAD, Network(Spring(0.0))).rest(), "no rest state"),
        (
            lambda: Actuator(THESIS_FILM, Load(0.2, 0.07), TABLE_3).coefficients(),
            "rest stretch of 0.9333 needs a pull between 0 and the locking limit",
        ),
    ],
)
def test_values_that_no_film_can_have_are_refused_with_a_sentence(build, message):
    with pytest.raises(ModelError, match=message):
        build()


def test_the_true_field_grows_with_the_stretch():
    time = ticks(0.1, 1e-2)
    response = THESIS.simulate(Drive(time, np.full(time.size, 5e3)))
    # held in width: the film is thinner by the stretch
    np.testing.assert_allclose(response.field, 5e6 * response.stretch)
