"""The simulated room, and the thermo-hygrometer in it."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.drivers.instruments.thermohygrometer import ThermohygrometerError
from dearig.drivers.settings import RoomSettings, ThermohygrometerSettings
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.room import AirOfRoom, SimulatedSource, still_air, time_in_room

SENSOR = ThermohygrometerSettings(interval_s=1.0, stale_s=3.0)
HOUR = 3600.0


def test_the_day_is_warmest_and_driest_in_the_afternoon() -> None:
    air = AirOfRoom(RoomSettings(daily_K=3.0, daily_percent=8.0))
    at = np.array([3.0, 9.0, 15.0, 39.0]) * HOUR
    np.testing.assert_allclose(air.temperature(at), [19.0, 22.0, 25.0, 25.0], atol=1e-9)
    np.testing.assert_allclose(air.humidity(at), [53.0, 45.0, 37.0, 37.0], atol=1e-9)


def test_the_heating_warms_and_dries_in_its_cycle() -> None:
    air = AirOfRoom(RoomSettings(heating_K=2.0, heating_percent=6.0, heating_period_min=30.0))
    at = np.linspace(0.0, 4 * 1800.0, 4001)
    warm, moist = air.temperature(at), air.humidity(at)
    assert np.ptp(warm) == pytest.approx(2.0, rel=1e-3)
    assert np.ptp(moist) == pytest.approx(6.0, rel=1e-3)
    assert np.corrcoef(warm, moist)[0, 1] == pytest.approx(-1.0)
    np.testing.assert_allclose(air.temperature(at + 1800.0), warm, atol=1e-9)


def test_the_weather_follows_its_seed_and_the_past_is_known() -> None:
    settings = RoomSettings(weather_K=2.0, weather_percent=5.0)
    at = np.linspace(-100.0 * 24 * HOUR, 100.0 * 24 * HOUR, 5000)
    same = AirOfRoom(settings).humidity(at)
    np.testing.assert_array_equal(same, AirOfRoom(settings).humidity(at))
    other = AirOfRoom(settings.model_copy(update={"seed": 1})).humidity(at)
    assert np.abs(same - other).max() > 1.0
    assert np.std(same) == pytest.approx(5.0, rel=0.3)
    assert np.std(AirOfRoom(settings).temperature(at)) == pytest.approx(2.0, rel=0.3)


def test_runs_advance_the_time_in_the_room() -> None:
    settings = RoomSettings(start_h=9.0, hours_per_run=0.5)
    assert time_in_room(settings, 0, lambda: 7.0) == 9.0 * HOUR
    assert time_in_room(settings, 4, lambda: 7.0) == 11.0 * HOUR
    assert time_in_room(settings.model_copy(update={"clock": "computer"}), 4, lambda: 7.0) == 7.0


def test_a_sensor_reads_the_room_every_interval() -> None:
    air = AirOfRoom(RoomSettings(heating_K=5.0, heating_period_min=1.0))
    source = SimulatedSource(SENSOR, air)
    first = source.reading(0.0)
    assert first.age == 0.0
    assert first.temperature == pytest.approx(float(air.temperature(np.array(0.0))), abs=0.15)
    between = source.reading(0.5)
    assert (between.temperature, between.age) == (first.temperature, 0.5)
    later = source.reading(30.4)
    assert later.age == pytest.approx(0.4)
    assert later.temperature == pytest.approx(float(air.temperature(np.array(30.0))), abs=0.15)
    # the same run again gives the same readings
    assert SimulatedSource(SENSOR, air).reading(0.0) == first


@pytest.mark.parametrize("kind", ["room-sensor-gone", "room-sensor-garbage"])
def test_a_sensor_that_fails_ages_and_then_has_no_value(kind: str) -> None:
    source = SimulatedSource(SENSOR, still_air(22.0, 45.0), faults=FaultPlan.parse([f"{kind}@2+6"]))
    known = [source.reading(float(s)).known for s in range(12)]
    # the last reading is that at 1 s; it is too old after 3 s, and the fault ends at 8 s
    assert known == [True] * 5 + [False] * 3 + [True] * 4


def test_a_sensor_without_a_simulation_is_refused() -> None:
    with pytest.raises(ThermohygrometerError, match="'acme' is not simulated"):
        SimulatedSource(SENSOR.model_copy(update={"driver": "acme"}), still_air(22.0, 45.0))
