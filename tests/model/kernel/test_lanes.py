"""Films side by side: each as it moves alone, and derivatives without the noise of steps."""

from dataclasses import replace

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.coefficients import ELECTRIC, MODULUS, REST
from dearig.model.effects import EFFECTS
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.film.network import HEAD
from dearig.model.kernel.lanes import drive_in_lanes
from dearig.model.simulation.actuator import Actuator, Drive, at_rest, initial_state, reading_of
from tests.tools.engine import effect, typical
from tests.tools.film_drives import LENGTH

PLAIN = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
MOVING = sorted(e.name for e in EFFECTS.values() if "voltage" in e.drives and e.acts_on != "sensor")


def a_drive(rate: float = 200.0, seconds: float = 0.6) -> Drive:
    """A step, a ramp and a reversal, with air that warms."""
    time = np.arange(round(rate * seconds) + 1) / rate
    part = time / seconds
    voltage = np.where(part < 0.3, 6e3, 6e3 - 9e3 * (part - 0.3))
    return Drive(time, voltage, hold=True, warmth=5.0 * part, moisture=0.1 * part)


def moved(cs: np.ndarray, drive: Drive, fidelity: int = kernel.CAREFUL) -> np.ndarray:
    """Return the displacement (P, N) in m of films side by side."""
    cs = cs.copy()
    for c in cs:
        assert at_rest(c, drive)[0] == kernel.OK
    found, rate = np.zeros((len(cs), drive.time.size)), np.zeros((len(cs), drive.time.size))
    status, _ = drive_in_lanes(
        cs, drive.time, drive.voltage, drive.ends, drive.air, initial_state(cs[0], cs[0, REST]),
        found, rate, fidelity,
    )  # fmt: skip
    assert status == kernel.OK
    return found * LENGTH


def moved_alone(c: np.ndarray, drive: Drive, fidelity: int) -> np.ndarray:
    """Return the displacement (N,) in m of a film in steps of its own; a reading's are a pack's."""
    c = c.copy()
    at_rest(c, drive)
    stretch, rate = np.zeros((2, drive.time.size))
    status, _, _ = kernel.drive_by_voltage(
        c, drive.time, drive.voltage, drive.ends, drive.air, initial_state(c, c[REST]), stretch,
        rate, fidelity,
    )  # fmt: skip
    assert status == kernel.OK
    return (stretch - c[REST]) * LENGTH


@pytest.mark.parametrize("fidelity", [kernel.CAREFUL, kernel.COARSE])
@pytest.mark.parametrize("branches", [0, 1, 3])
def test_a_film_among_others_moves_as_it_does_alone(branches, fidelity):
    network = replace(TABLE_3, branches=TABLE_3.branches[:branches])
    c = replace(PLAIN, network=network).coefficients()
    drive = a_drive()
    other = c.copy()
    other[HEAD + MODULUS] *= 1.01
    alone = moved_alone(c, drive, fidelity)
    films = moved(np.array([c, other, other, other, c]), drive, fidelity)
    for film in films[[0, 4]]:
        # stiffnesses of the closed form are rounded again, which long steps show
        np.testing.assert_allclose(film, alone, rtol=0.0, atol=2e-7 if fidelity else 1e-10)
    # the others take the first one's steps, which are nearly their own
    np.testing.assert_array_equal(films[1], films[3])
    alone = moved_alone(other, drive, fidelity)
    np.testing.assert_allclose(films[1], alone, rtol=0.0, atol=5e-6 if fidelity else 1e-9)


@pytest.mark.parametrize("name", MOVING)
def test_every_effect_takes_part_in_a_pack_as_it_does_alone(name):
    c = replace(PLAIN, effects=(typical(name),)).coefficients()
    drive = a_drive(seconds=0.2)
    alone, status = reading_of(c, LENGTH, drive)
    assert status == kernel.OK
    # next to a film at the effect's neutral values
    neutral = PLAIN.coefficients()
    films = moved(np.array([c, neutral, c]), drive)
    for film in films[[0, 2]]:
        np.testing.assert_allclose(film, alone, rtol=0.0, atol=1e-9)
    without, _ = reading_of(neutral, LENGTH, drive)
    # a drag of the first film is in the closed form, which the other has to take off again
    np.testing.assert_allclose(films[1], without, rtol=0.0, atol=1e-5)


def test_the_derivative_of_a_film_that_has_settled_is_that_of_its_balance():
    model = replace(
        PLAIN,
        network=Network(Spring(60e3, 100.0), (Branch(Spring(30e3, 100.0), 0.01),)),
        effects=effect("linear drag", drag=300.0),
    )
    time = np.arange(400) * 5e-3
    drive = Drive(time, np.full(time.size, 5e3), hold=True)
    c, h = model.coefficients(), 1e-5
    more = c.copy()
    more[HEAD + MODULUS] *= 1.0 + h
    one, two = moved(np.array([c, more]), drive)[:, -1] / LENGTH

    def settled(factor: float) -> float:
        other = c.copy()
        other[HEAD + MODULUS] *= factor
        return kernel.rest_stretch(other, 25e6)[1] - kernel.rest_stretch(other, 0.0)[1]

    exact = (settled(1.0 + h) - settled(1.0)) / h
    assert (two - one) / h == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("effects", [(), effect("linear drag", drag=300.0)])
def test_small_increments_give_the_derivative(effects):
    """Against films that are simulated one by one in steps sixteen times as fine."""
    c = replace(PLAIN, effects=effects).coefficients()
    drive = a_drive(400.0, 1.0)
    time = np.linspace(0.0, drive.time[-1], (drive.time.size - 1) * 16 + 1)
    held = np.append(np.repeat(drive.voltage[:-1], 16), drive.voltage[-1])
    fine = Drive(time, held, hold=True)

    def grown(part: float) -> np.ndarray:
        other = c.copy()
        other[HEAD + MODULUS] *= 1.0 + part
        return other

    def differences(part: float, on: Drive) -> np.ndarray:
        up, down = (reading_of(grown(p), LENGTH, on, times=drive.time)[0] for p in (part, -part))
        return (up - down) / (2.0 * part)

    exact = (4.0 * differences(1e-4, fine) - differences(2e-4, fine)) / 3.0
    one, two = moved(np.array([c, grown(1e-6)]), replace(drive, warmth=None, moisture=None))
    error = np.linalg.norm((two - one) / 1e-6 - exact) / np.linalg.norm(exact)
    # one by one, by the increment that a fit takes: the error of a one-sided difference
    part = 1e-3 if effects else 1e-4
    alone = (reading_of(grown(part), LENGTH, drive)[0] - reading_of(c, LENGTH, drive)[0]) / part
    assert error < 0.1 * np.linalg.norm(alone - exact) / np.linalg.norm(exact)


@pytest.mark.parametrize(
    "network",
    [
        Network(Spring(8e6, 100.0), (Branch(Spring(8e6, 100.0), 1e-5),)),
        Network(Spring(60e3, 100.0, "arruda-boyce"), ()),
    ],
    ids=["stiff", "another spring"],
)
def test_films_that_cannot_share_steps_are_refused(network):
    c = replace(PLAIN, network=network).coefficients()
    drive = a_drive()
    at_rest(c, drive)
    found, rate = np.zeros((2, drive.time.size)), np.zeros((2, drive.time.size))
    status, _ = drive_in_lanes(
        np.array([c, c]), drive.time, drive.voltage, drive.ends, drive.air,
        initial_state(c, c[REST]), found, rate, kernel.CAREFUL,
    )  # fmt: skip
    assert status == kernel.NOT_CONVERGED


def test_a_film_that_runs_away_beside_one_that_does_not_is_refused():
    c = PLAIN.coefficients()
    weak = c.copy()
    weak[ELECTRIC] *= 500.0
    drive = a_drive()
    assert reading_of(weak, LENGTH, drive)[1] == kernel.PULL_IN
    with pytest.raises(AssertionError):
        moved(np.array([c, weak]), drive)
