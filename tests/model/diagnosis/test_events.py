"""Events and drift of one recording, next to a model that stays as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.diagnosis.events import drifts_at_rest, own_of
from dearig.model.film.material import TABLE_3
from dearig.model.fitting import identify
from dearig.model.readings.noise import noise_at_rest
from dearig.model.readings.records import ActuatorRecord, counted
from dearig.model.simulation.actuator import Drive
from dearig.model.simulation.excitation import Sequence
from tests.deep import mostly_deep
from tests.tools.engine import NOISE, PLAIN, effect, pink_noise, record_of, thesis_drive

KINDS = {
    "sudden change of force": {"stress": 60.0, "moment": 6.3},
    "sudden change of reading": {"jump": 2e-5, "moment": 9.1},
    "sudden loss of field": {"loss": 0.01, "moment": 4.9},
}


@pytest.mark.parametrize("name", KINDS)
def test_an_event_is_found_with_its_moment_and_size(name: str) -> None:
    own = own_of(record_of(replace(PLAIN, effects=effect(name, **KINDS[name]))), PLAIN)
    assert own is not None
    (event,) = own.events
    size, moment = KINDS[name].values()
    assert event.kind == name
    assert event.time == pytest.approx(moment, abs=0.03)
    assert event.size == pytest.approx(size, rel=0.05)
    assert not own.drifts
    assert own.rms == pytest.approx(NOISE, rel=0.05)


def test_two_events_of_different_kinds_are_both_found() -> None:
    effects = tuple(one for name in list(KINDS)[1:] for one in effect(name, **KINDS[name]))
    own = own_of(record_of(replace(PLAIN, effects=effects)), PLAIN)
    assert own is not None
    assert [e.kind for e in own.events] == ["sudden loss of field", "sudden change of reading"]
    assert own.rms == pytest.approx(NOISE, rel=0.05)


def test_noise_has_neither_events_nor_drift() -> None:
    assert own_of(record_of(PLAIN), PLAIN) is None


def test_a_drift_of_the_reading_is_no_event() -> None:
    record = record_of(PLAIN)
    walk = 1e-5 * np.sin(0.3 * record.drive.time)
    own = own_of(replace(record, displacement=record.displacement + walk), PLAIN)
    assert own is not None
    assert own.events == ()
    assert own.drifts
    assert own.rms < 1.1 * NOISE


def test_what_is_slow_is_no_drift_where_no_reading_is_known_to_drift() -> None:
    record = record_of(PLAIN)
    time = record.time
    drifting = replace(record, displacement=record.displacement + 2e-5 * np.sqrt(time / time[-1]))
    assert own_of(drifting, PLAIN) is not None
    assert own_of(drifting, PLAIN, may_drift=False) is None


def record_in_pink_noise(seed: int, lead_in: int = 400, density: float = 1.5e-13) -> ActuatorRecord:
    """At rest for 4 s, of which the first readings are told to be at rest, then 20 s more."""
    drive = thesis_drive()
    time = np.arange(400 + drive.time.size) / 100.0
    voltage = np.concatenate((np.zeros(400), drive.voltage))
    plain = record_of(PLAIN, Drive(time, voltage, hold=True))
    pink = pink_noise(np.random.default_rng(seed), time.size, density)
    reading = plain.displacement + pink - pink[:lead_in].mean()
    noise = noise_at_rest(time[:lead_in], reading[:lead_in])
    return replace(plain, displacement=reading, noise=noise, lead_in=lead_in)


def error_of(record: ActuatorRecord) -> float:
    error = record.displacement - record.seen(PLAIN.simulate(record.drive).displacement)
    return float(np.sqrt(np.mean(error**2)))


def test_the_slow_part_of_coloured_noise_is_no_error_of_the_model() -> None:
    # 1/f noise goes farther in the whole recording than at rest
    record = record_in_pink_noise(8, density=4e-13)
    own = own_of(record, PLAIN, may_drift=False)
    assert own is not None
    assert (own.events, own.drifts) == ((), False)
    assert own.rms < 0.9 * error_of(record)
    assert own.rms < 1.15 * record.noise


def test_the_colour_of_noise_is_that_of_all_recordings_at_rest() -> None:
    record = record_in_pink_noise(8, lead_in=120)
    assert own_of(record, PLAIN, may_drift=False) is None  # too few readings to tell
    others = [record_in_pink_noise(seed) for seed in (1, 2, 3)]
    own = own_of(record, PLAIN, may_drift=False, others=others)
    assert own is not None
    assert (own.events, own.drifts) == ((), False)
    assert own.rms < 0.9 * error_of(record)


def test_a_law_that_the_model_lacks_is_not_taken_off_as_events() -> None:
    truth = replace(PLAIN, effects=effect("sensor curvature", quadratic=15.0))
    record = record_of(truth)
    left = record.displacement - PLAIN.simulate(record.drive).displacement
    assert np.sqrt(np.mean(left**2)) > 10.0 * NOISE
    assert own_of(record, PLAIN) is None


@pytest.mark.parametrize("part", [0.9985, 1.003])
def test_a_film_that_differs_from_the_start_on_has_no_event(part: float) -> None:
    film = replace(PLAIN.film, permittivity=part * PLAIN.film.permittivity)
    record = record_of(replace(PLAIN, film=film))
    left = record.displacement - PLAIN.simulate(record.drive).displacement
    assert np.sqrt(np.mean(left**2)) > 1.5 * NOISE
    own = own_of(record, PLAIN)
    assert own is None or own.events == ()


def test_a_drift_of_the_reading_is_there_before_the_voltage() -> None:
    record = replace(record_in_pink_noise(8, density=0.0), lead_in=400)
    time = record.time
    begins = time[record.lead_in]
    # a stand that wanders, and a film that goes on as slowly once it is pulled
    wanders = 2e-5 * np.sin(0.3 * time + 1.0)
    creeps = np.where(time > begins, 2e-5 * np.sin(0.3 * (time - begins)), 0.0)
    here = counted(record.displacement + wanders, record.lead_in)
    late = record.displacement + creeps
    assert drifts_at_rest([replace(record, displacement=here)], PLAIN)
    assert not drifts_at_rest([replace(record, displacement=late)], PLAIN)
    # without readings at rest nothing speaks against a drift
    assert drifts_at_rest([replace(record, displacement=late, lead_in=0)], PLAIN)


@pytest.mark.parametrize("seed", mostly_deep([2, 8], [8]))
def test_what_other_springs_explain_is_no_event(seed: int) -> None:
    """A fit to 4 s under voltage predicts half a minute with a slow error."""
    thesis = replace(PLAIN, network=TABLE_3)
    lobes = Sequence.thesis(amplitudes=(6e3, 7e3), frequencies=(0.4, 1.0), periods=1)
    little = record_of(thesis, Drive(*lobes.sample(100.0), hold=True), seed=seed)
    fitted = identify([little], thesis, intervals=False, workers=1).model
    record = record_of(thesis, thesis_drive(periods=2), seed=seed + 50)
    assert own_of(record, fitted, may_drift=False) is None
