"""Drives, films and errors that the tests of the kernel share."""

import numpy as np
import pytest

from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.simulation.actuator import Actuator, Drive
from tests.tools.model_oracle import solve

THESIS = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
LENGTH = THESIS_FILM.length
TOLERANCE = 0.1e-6  # m


def error(actuator, time, voltage, hold=False):
    """Largest error of the displacement against SciPy in m."""
    response = actuator.simulate(Drive(time, voltage, hold))
    assert response.ok, response.status_text
    expected = solve(actuator, time, voltage, hold)
    assert response.rest_stretch == pytest.approx(expected[0], abs=1e-12)
    return np.abs(response.stretch - expected).max() * actuator.film.length


def ticks(duration, step):
    return np.arange(round(duration / step) + 1) * step


def lobes(time, amplitude=8e3, frequency=1.0):
    return amplitude * np.abs(np.sin(np.pi * frequency * time))


def staircase(time):
    return 2e3 * np.floor(np.clip(time / 0.1, 0.0, 4.0))


def edge(time):
    return np.where(time >= 0.05, 8e3, 0.0)


def sudden(time):
    return np.full(time.size, 8e3)


def steep(time):
    return 8e3 * np.clip((time - 0.05) / 0.01, 0.0, 1.0)
