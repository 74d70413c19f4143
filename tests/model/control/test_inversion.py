"""The inverse against the forward simulation, for every effect, pairs, and what cannot be had."""

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.control import TrackingTask, VoltageLimits, invert, readings_under
from dearig.model.control.linear import repeatable_part
from dearig.model.effects import EFFECTS
from dearig.model.errors import ModelError
from dearig.model.simulation.actuator import Drive
from dearig.model.simulation.stability import pull_in_voltage, static_stretch
from tests.deep import one_of_each
from tests.tools.effect_cases import BY_VOLTAGE, THESIS, numbers, with_effect
from tests.tools.targets import LEAD_IN, LIMITS, RATE, TAIL, path, task

CLOSE = 0.05e-6  # m
SETTLED = 0.2  # s: from here on, after the start at 0 V
BEFORE = 0.1  # s: before what is unreachable
# what is missed by more, and why
FARTHER = {
    # the film sticks: little changes until it slips, and where it slips is not differentiable
    "dry friction": 0.6e-6,
    "easing friction": 0.6e-6,
    "general friction": 1e-6,
    "elastoplastic hysteresis": 0.3e-6,
    "general hysteresis": 1e-6,
    # stiffer while it is stretched for the first time: a kink at every new largest stretch
    "first-loading damage": 0.3e-6,
    "Mullins softening": 0.6e-6,
    "general softening": 0.6e-6,
    # steepest about a rate of nothing
    "general drag": 0.3e-6,
    "thinning drag": 0.3e-6,
    # the voltage that the path needs is steeper than the amplifier's
    "amplifier slew": 1.1e-6,
    # the reading lags behind what the voltage does by more than the film's own period
    "amplifier resonance": 0.1e-6,
    "sensor delay": 0.1e-6,
    # the film moves before the voltage does
    "warm-up": 0.5e-6,
    "warm-up in stages": 0.5e-6,
    "slowing warm-up": 0.5e-6,
}
#: The film squeals: it slips and sticks by more than a micrometre whatever the voltage does.
UNSTEADY = ("elastoplastic friction",)
PAIRS = (
    ("load inertia", "electrode resistance"),
    ("linear drag", "sensor lag"),
    ("dielectric relaxation", "strain-dependent permittivity"),
    ("slow branch", "amplifier lag"),
    ("leakage", "sensor curvature"),
)
FREQUENCIES = {0.1: 50e-6, 1.0: 50e-6, 10.0: 5e-6}  # Hz to the amplitude in m


def inverted(model, target, limits=LIMITS, **options):
    return invert(model, task(target, limits), **options)


def missed(model, found):
    """Largest distance in m of the simulated reading from the target, where it is reachable."""
    reading = repeatable_part(model).simulate(Drive(found.time, found.voltage, hold=True))
    assert reading.ok
    start = LEAD_IN / RATE + SETTLED
    stop = min([u.start for u in found.unreachable if u.start > start], default=np.inf) - BEFORE
    assert stop > 2.0  # s: the sine is reachable
    compared = (found.time > start) & (found.time < stop)
    return np.abs(reading.displacement - found.target)[compared].max()


STEADY = [name for name in BY_VOLTAGE if name not in UNSTEADY]


@pytest.mark.parametrize(
    "name", one_of_each(STEADY, lambda name: (EFFECTS[name].family, EFFECTS[name].acts_on))
)
def test_the_simulated_film_follows_the_target_of_its_inverse(name):
    model = with_effect(THESIS, name, numbers(name))
    found = inverted(model, path())
    assert missed(model, found) < FARTHER.get(name, CLOSE)


@pytest.mark.parametrize("name", UNSTEADY)
def test_a_film_that_sticks_and_slips_is_said_to_miss_the_target(name):
    found = inverted(with_effect(THESIS, name, numbers(name)), path())
    assert "dynamics" in {u.cause for u in found.unreachable}


@pytest.mark.parametrize("frequency", FREQUENCIES)
@pytest.mark.parametrize("names", [(), *PAIRS], ids=lambda names: " and ".join(names) or "none")
def test_pairs_are_inverted_from_slow_to_fast(names, frequency):
    effects = tuple((name, tuple(numbers(name).items())) for name in names)
    model = replace(THESIS, effects=effects)
    found = inverted(model, path(frequency, FREQUENCIES[frequency]))
    assert missed(model, found) < CLOSE


def test_what_belongs_to_one_recording_is_not_followed():
    drifting = with_effect(THESIS, "linear drift", numbers("linear drift", 3.0))
    target = path()
    np.testing.assert_array_equal(
        inverted(drifting, target).voltage, inverted(THESIS, target).voltage
    )


def test_a_film_is_never_pushed():
    time = np.arange(500) / RATE
    target = np.zeros(time.size + LEAD_IN + TAIL)
    target[LEAD_IN:-TAIL] = 400e-6 * np.sin(np.pi * time / time[-1]) ** 2  # back in 1 s
    found = inverted(THESIS, target)
    (part,) = found.unreachable
    assert part.cause == "zero"
    assert part.start > 1.0
    assert "no voltage pushes it" in part.sentence
    # the nearest feasible target is what the film does there
    there = (found.time >= part.start) & (found.time <= part.stop)
    np.testing.assert_allclose(found.reference[there], found.reading[there])
    assert part.worst == pytest.approx(np.abs(target - found.reading)[there].max())
    assert np.all(found.voltage >= 0.0)


@pytest.mark.parametrize(
    ("limits", "cause", "says"),
    [
        (VoltageLimits(3.5e3, 1.5e6, 15e6), "voltage", "3.5 kV is allowed"),
        (VoltageLimits(8.5e3, 1.5e6, 4e6), "field", "highest true field"),
    ],
    ids=["voltage", "field"],
)
def test_a_target_beyond_a_limit_says_when_and_by_how_much(limits, cause, says):
    found = inverted(THESIS, path(), limits)
    part = max(found.unreachable, key=lambda u: u.worst)
    assert part.cause == cause
    assert says in part.sentence
    assert part.needed > part.allowed
    assert found.voltage.max() <= limits.voltage
    feasible = inverted(THESIS, path(), VoltageLimits(1.001 * part.needed, 1.5e6))
    assert cause not in {u.cause for u in feasible.unreachable}


def test_what_is_too_fast_is_said():
    target = path()
    time = np.arange(target.size) / RATE
    shaking = (time > 1.5) & (time < 2.0)
    target[shaking] += 5e-6 * np.sin(2.0 * np.pi * 60.0 * time[shaking])
    found = inverted(THESIS, target)
    assert found.unreachable[0].cause == "bandwidth"
    assert 1.4 < found.unreachable[0].start < found.unreachable[0].stop < 2.1


def test_a_target_beyond_pull_in_is_cut_off_below_it():
    free = replace(THESIS, film=replace(THESIS.film, kinematics="equibiaxial"))
    pull_in = pull_in_voltage(free)
    last = (static_stretch(free, pull_in * (1 - 1e-9)) - free.rest()) * free.film.length
    target = path(offset=1.1 * last, amplitude=0.0)
    found = inverted(free, target, VoltageLimits(2.0 * pull_in))
    assert "pull-in" in {u.cause for u in found.unreachable}
    assert found.reading.max() < last


@pytest.mark.parametrize(
    "target", [np.zeros(2), np.full(300, np.nan), np.zeros((300, 2))], ids=["short", "nan", "table"]
)
def test_a_target_that_is_no_path_is_refused(target):
    with pytest.raises(ModelError, match="finite displacements"):
        TrackingTask(target, RATE, LIMITS)


def test_a_target_of_nothing_takes_no_voltage():
    found = inverted(THESIS, np.zeros(400))
    assert found.feasible
    assert found.voltage.max() < 1.0  # V


def test_a_sensor_that_reads_nothing_of_some_frequencies_makes_no_voltage_ring():
    averaging = with_effect(THESIS, "sensor averaging", {"window": 0.04})  # nothing at 25 Hz
    wanted = task(path(5.0, 10e-6))
    frequency = np.fft.rfftfreq(wanted.samples, 1.0 / RATE)
    near = (frequency > 20.0) & (frequency < 30.0)
    with_it, without = (
        np.abs(np.fft.rfft(np.square(invert(model, wanted).voltage)))[near]
        for model in (averaging, THESIS)
    )
    assert with_it.max() < 3.0 * without.max()


def test_a_drift_of_the_recordings_is_read_with_and_without():
    drifting = with_effect(THESIS, "slowing drift", numbers("slowing drift", 10.0))
    wanted = task(path())
    voltage = invert(THESIS, wanted).voltage
    [plain] = readings_under(THESIS, wanted, voltage)
    without, with_it = readings_under(drifting, wanted, voltage)
    np.testing.assert_allclose(without, plain, atol=1e-9)
    assert np.abs(with_it - plain)[-1] > 1e-6
    assert with_it[:LEAD_IN].mean() == pytest.approx(0.0, abs=1e-12)
