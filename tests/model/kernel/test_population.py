"""Films that differ, four at a time: each as it moves alone."""

from dataclasses import replace

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.coefficients import ELECTRIC, MODULUS
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.film.network import HEAD
from dearig.model.fitting.parameters import FitLayout
from dearig.model.simulation.actuator import Actuator, Drive, readings_of
from tests.tools.engine import thesis_drive, typical
from tests.tools.film_drives import LENGTH

PLAIN = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)


def films_about(model: Actuator, count: int, spread: float = 0.3) -> np.ndarray:
    """Return coefficients (P, C) of films whose numbers differ by about such a ``spread``."""
    layout = FitLayout(model)
    factors = np.exp(spread * np.random.default_rng(3).standard_normal((count, layout.size)))
    return layout.coefficients(layout.initial() * factors)


def alone(
    cs: np.ndarray, drive: Drive, fidelity: int, lag: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return readings (P, N) and statuses (P,) of films simulated one after the other."""
    found = [readings_of(c[None], LENGTH, drive, lag, fidelity) for c in cs]
    return np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found])


@pytest.mark.parametrize("branches", [0, 2, 3])
@pytest.mark.parametrize(
    ("rate", "fidelity", "near"),
    [
        (500.0, kernel.CAREFUL, 1e-9),
        (50.0, kernel.CAREFUL, 1e-9),
        (50.0, kernel.QUICK, 2e-8),
        (50.0, kernel.COARSE, 1e-6),
    ],
)
def test_films_in_packs_read_as_they_do_alone(branches, rate, fidelity, near):
    model = replace(PLAIN, network=replace(TABLE_3, branches=TABLE_3.branches[:branches]))
    drive = replace(thesis_drive(rate=rate), hold=rate > 100.0)
    cs = films_about(model, 7)
    readings, statuses, steps = readings_of(cs, LENGTH, drive, 1e-3, fidelity)
    known, same = alone(cs, drive, fidelity, 1e-3)
    np.testing.assert_array_equal(statuses, same)
    assert (statuses == kernel.OK).all()
    np.testing.assert_allclose(readings, known, rtol=0.0, atol=near)
    # seven films in two packs: not seven times the steps of one
    _, _, of_one = readings_of(cs[:1], LENGTH, drive, 1e-3, fidelity)
    assert steps < 3.5 * of_one


def test_a_film_that_fails_among_others_fails_as_it_does_alone():
    cs = films_about(PLAIN, 4, 0.05)
    cs[1, ELECTRIC] *= 500.0  # pulls in
    cs[2, HEAD + MODULUS] *= 1e-6  # no rest state
    drive = thesis_drive(rate=100.0)
    readings, statuses, _ = readings_of(cs, LENGTH, drive)
    known, same = alone(cs, drive, kernel.CAREFUL)
    assert statuses[1] == kernel.PULL_IN
    assert statuses[2] == kernel.NO_REST
    np.testing.assert_array_equal(statuses, same)
    np.testing.assert_allclose(readings, known, rtol=0.0, atol=1e-9)


def test_a_stiff_film_among_others_is_simulated_alone():
    stiff = Network(TABLE_3.equilibrium, (Branch(Spring(5e7, 10.0), 1e-4),))
    soft = Network(TABLE_3.equilibrium, TABLE_3.branches[:1])
    cs = np.array([replace(PLAIN, network=n).coefficients() for n in (soft, stiff, soft, soft)])
    drive = thesis_drive(rate=100.0)
    readings, statuses, _ = readings_of(cs, LENGTH, drive)
    known, same = alone(cs, drive, kernel.CAREFUL)
    np.testing.assert_array_equal(statuses, same)
    np.testing.assert_array_equal(readings, known)


def test_members_of_one_film_read_it_each_by_its_own_sensor():
    model = replace(PLAIN, effects=(typical("sensor lag"),))
    layout = FitLayout(model)
    values = np.tile(layout.initial(), (6, 1))
    values[1::2, -1] *= 2.0
    values[2:4, 0] *= 1.1
    values[4:, 0] *= 1.2
    cs, drive = layout.coefficients(values), thesis_drive(rate=100.0)
    films = [[0, 1], [2, 3], [4, 5]]
    readings, statuses, steps = readings_of(cs, LENGTH, drive, films=films)
    known, _ = alone(cs, drive, kernel.CAREFUL)
    np.testing.assert_allclose(readings, known, rtol=0.0, atol=1e-9)
    assert statuses.shape == (6,)
    assert np.ptp(readings[:2], axis=0).max() > 1e-7
    _, _, of_each = readings_of(cs, LENGTH, drive)
    assert steps < of_each


def test_numbers_that_are_none_fail_as_they_do_alone():
    cs = films_about(PLAIN, 4, 0.05)
    drive = thesis_drive(rate=100.0)
    voltage = drive.voltage.copy()
    voltage[40] = np.nan
    _, statuses, _ = readings_of(cs, LENGTH, Drive(drive.time, voltage))
    assert (statuses == kernel.BAD_INPUT).all()
