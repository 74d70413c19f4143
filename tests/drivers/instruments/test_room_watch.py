"""A thermo-hygrometer during a run: its newest value, and never an old one as a present one."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from dearig.drivers.instruments.room_watch import RoomWatch
from dearig.drivers.instruments.thermohygrometer import (
    RoomLimits,
    RoomReading,
    Thermohygrometer,
    ThermohygrometerError,
)
from dearig.drivers.settings import ChannelSettings, ThermohygrometerSettings

SETTINGS = ThermohygrometerSettings(port="COM4", interval_s=2.0, stale_s=10.0)


class Sensor:
    """A driver and its sensor at once, whose next reading the test sets."""

    role = "thermohygrometer"

    def __init__(self) -> None:
        self.next: RoomReading | ThermohygrometerError = RoomReading(21.0, 40.0)
        self.opened = self.closed = 0

    def open(self, settings: ThermohygrometerSettings) -> Thermohygrometer:  # noqa: ARG002
        self.opened += 1
        return self

    def inspect(self, settings: ThermohygrometerSettings) -> tuple:  # noqa: ARG002
        return ()

    def read(self) -> RoomReading:
        if isinstance(self.next, ThermohygrometerError):
            raise self.next
        return self.next

    def close(self) -> None:
        self.closed += 1


class Now:
    def __init__(self) -> None:
        self.s = 100.0

    def __call__(self) -> float:
        return self.s


def test_a_value_has_its_age_and_is_unknown_when_it_is_too_old() -> None:
    sensor, now = Sensor(), Now()
    watch = RoomWatch(SETTINGS, sensor, now)
    assert watch.reading().temperature == 21.0
    sensor.next = ThermohygrometerError("the cable is off", "plug it in")
    now.s += 4.0
    watch.poll()
    held = watch.reading()
    assert (held.temperature, held.age, held.trouble) == (21.0, 4.0, "the cable is off")
    now.s += 6.5
    lost = watch.reading()
    assert not lost.known
    assert lost.trouble == "the cable is off"
    # the port is opened again on its own
    sensor.next = RoomReading(22.0, 41.0)
    watch.poll()
    assert watch.reading() == RoomReading(22.0, 41.0)
    assert (sensor.opened, sensor.closed) == (2, 1)
    watch.close()
    assert sensor.closed == 2


def test_a_sensor_that_never_answered_gives_no_value() -> None:
    sensor = Sensor()
    sensor.next = ThermohygrometerError("no reading from COM4", "check the cable")
    reading = RoomWatch(SETTINGS, sensor, Now()).reading()
    assert not reading.known
    assert reading.trouble == "no reading from COM4"


def test_limits_trip_once_each_and_name_what_is_allowed() -> None:
    settings = SETTINGS.model_copy(
        update={
            "temperature_max_degC": 25.0,
            "humidity_min_percent": 30.0,
            "humidity_max_percent": 60.0,
            "limit_action": "at once",
        }
    )
    limits = RoomLimits(settings, 100.0)
    assert limits.watch(0, RoomReading(24.9, 30.0)) == []
    assert limits.watch(0, RoomReading(math.nan, 45.0)) == []
    (trip,) = limits.watch(250, RoomReading(24.0, 61.5))
    assert (trip.interlock, trip.sample, trip.action) == ("room relative humidity", 250, "at once")
    assert trip.message == (
        "at 2.5 s the room's relative humidity was 61.5 %, 30 to 60 % is allowed"
    )
    assert [t.interlock for t in limits.watch(300, RoomReading(26.0, 61.5))] == ["room temperature"]


@pytest.mark.parametrize(
    ("on_loss", "action"), [("go on", None), ("ramp", "ramp"), ("at once", "at once")]
)
def test_a_lost_value_does_what_the_rig_file_says(on_loss: str, action: str | None) -> None:
    limits = RoomLimits(SETTINGS.model_copy(update={"on_loss": on_loss}), 100.0)
    trips = limits.watch(0, RoomReading(math.nan, math.nan, trouble="unplugged"))
    assert [trip.action for trip in trips] == ([] if action is None else [action])
    if trips:
        assert "gave no value for 10 s (unplugged)" in trips[0].message


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"humidity_min_percent": 60.0, "humidity_max_percent": 50.0}, "60 % is not below the"),
        ({"interval_s": 20.0}, "stale_s = 15 is not above interval_s = 20"),
    ],
)
def test_settings_that_contradict_each_other_are_refused(changes: dict, words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        ThermohygrometerSettings(**changes)


def test_humidity_at_the_card_is_in_per_cent() -> None:
    with pytest.raises(ValidationError, match='unit = "1" is not "%"'):
        ChannelSettings(name="relative_humidity", terminal="ai4", unit="1", unit_per_V=0.1)
