"""Room of a simulated rig: temperature and humidity with daily and heating cycles and slow weather.

Everything follows from the settings and the time, so that a run can be repeated and its film knows
what the room was like before. ``Air`` is the room as one run sees it, ``SimulatedSource`` the
thermo-hygrometer in it, read by the real driver through a simulated line.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dearig.drivers.errors import RigError
from dearig.drivers.instruments.registered import room_driver
from dearig.drivers.instruments.thermohygrometer import (
    NO_READING,
    RoomReading,
    ThermohygrometerError,
    aged,
)
from dearig.drivers.instruments.vaisala import VaisalaDriver
from dearig.drivers.settings import RoomSettings, ThermohygrometerSettings
from dearig.sim_backend.faults import FaultKind, FaultPlan
from dearig.sim_backend.serial_line import SimulatedLine
from dearig.sim_backend.vaisala import SimulatedProbe

__all__ = ["AirOfRoom", "SimulatedSource", "air_of_run", "still_air", "time_in_room"]

_HOUR = 3600.0  # s
_DAY = 24.0 * _HOUR
_WARMEST = 15.0 * _HOUR
_COOLING = 0.6  # share of a heating cycle in which the room cools; it warms in the rest
_WEATHERS = 6  # sines that make up the slow changes
_WEATHER_PERIODS = (0.5 * _DAY, 10.0 * _DAY)


def time_in_room(settings: RoomSettings, run: int, computer: Callable[[], float]) -> float:
    """Return the time in s in the room, 0 at a midnight, at which run number ``run`` starts.

    ``computer`` returns the computer's clock: s since a midnight.
    """
    if settings.clock == "computer":
        return computer()
    return (settings.start_h + settings.hours_per_run * run) * _HOUR


@dataclass(frozen=True)
class AirOfRoom:
    """Room of ``settings`` as a run sees it that starts at ``start`` s in the room.

    Times are s after the start of the run, any shape; earlier ones are the past of the room.
    """

    settings: RoomSettings
    start: float = 0.0

    def temperature(self, at: np.ndarray) -> np.ndarray:
        """Return the temperature in degrees Celsius."""
        return np.asarray(self.settings.temperature_degC + self.temperature_change(at))

    def temperature_change(self, at: np.ndarray) -> np.ndarray:
        """Return the temperature above its mean in K."""
        s = self.settings
        return self._changes(at, s.daily_K, s.heating_K, s.weather_K, 0)

    def humidity(self, at: np.ndarray) -> np.ndarray:
        """Return the relative humidity in per cent: lower where it is warmer."""
        mean = self.settings.relative_humidity_percent
        return np.clip(mean + self.humidity_change(at), 0.0, 100.0)

    def humidity_change(self, at: np.ndarray) -> np.ndarray:
        """Return the relative humidity above its mean in per cent: negative where it is warmer."""
        s = self.settings
        return -self._changes(at, s.daily_percent, s.heating_percent, s.weather_percent, 1)

    def _changes(
        self, at: np.ndarray, daily: float, heating: float, weather: float, which: int
    ) -> np.ndarray:
        now = self.start + np.asarray(at, dtype=np.float64)
        changes = daily * np.cos(2.0 * math.pi * (now - _WARMEST) / _DAY)
        phase = np.mod(now / (60.0 * self.settings.heating_period_min), 1.0)
        warming = (phase - _COOLING) / (1.0 - _COOLING)
        changes += heating * (np.where(phase < _COOLING, 1.0 - phase / _COOLING, warming) - 0.5)
        if weather > 0.0:
            generator = np.random.default_rng((self.settings.seed, which))
            ends = np.log(_WEATHER_PERIODS)
            for _ in range(_WEATHERS):
                period = math.exp(generator.uniform(*ends))
                turned = 2.0 * math.pi * (now / period + generator.random())
                changes += weather * math.sqrt(2.0 / _WEATHERS) * np.sin(turned)
        return np.asarray(changes)


def air_of_run(settings: RoomSettings, run: int) -> AirOfRoom:
    """Return the air of run number ``run`` of a simulated rig that starts now."""
    return AirOfRoom(settings, time_in_room(settings, run, _local_seconds))


def _local_seconds() -> float:
    """Return the s since a midnight of local time."""
    now = time.time()
    return now + time.localtime(now).tm_gmtoff


def still_air(temperature: float, humidity: float) -> AirOfRoom:
    """Return air that stays at so many degrees Celsius and per cent."""
    return AirOfRoom(RoomSettings(temperature_degC=temperature, relative_humidity_percent=humidity))


class SimulatedSource:
    """The thermo-hygrometer of a simulated rig; see ``RoomSource``.

    The driver that the rig file names reads a simulated probe; only the driver ``vaisala`` has one.
    Of the ``faults``, ``room-sensor-garbage`` and ``room-sensor-gone`` occur on its line.

    Raises ``ThermohygrometerError`` for another driver.
    """

    def __init__(
        self,
        settings: ThermohygrometerSettings,
        air: AirOfRoom,
        seed: tuple[int, ...] = (0,),
        faults: FaultPlan | None = None,
    ) -> None:
        if not isinstance(room_driver(settings.driver), VaisalaDriver):
            raise ThermohygrometerError(
                f"a thermo-hygrometer of the driver {settings.driver!r} is not simulated",
                "set thermohygrometer.driver to vaisala on a simulated rig",
            )
        shown = settings.model_copy(update={"port": f"{settings.port or 'a port'} (simulated)"})
        self._settings = shown
        self._elapsed = 0.0
        self._faults = faults or FaultPlan()
        self._probe = SimulatedProbe(
            shown,
            lambda: self._measured(air),
            seed=seed,
            garbled=lambda: self._has(FaultKind.ROOM_SENSOR_GARBAGE),
        )
        line = SimulatedLine(self._probe, shown.baud_rate)
        self.driver = VaisalaDriver(lambda _: line, line.now)
        self._sensor = self.driver.open(shown)
        self._due = 0.0  # s of the run at which it is read next
        self._newest, self._at = NO_READING, -math.inf
        self._trouble = ""

    def reading(self, elapsed: float) -> RoomReading:
        """Return the newest reading; the sensor is read where one is due at ``elapsed`` s."""
        if elapsed >= self._due:
            # a reader that looks rarely gets one reading, at the time of the last one due
            every = self._settings.interval_s
            self._elapsed = self._due + every * math.floor((elapsed - self._due) / every)
            self._due = self._elapsed + every
            try:
                if self._has(FaultKind.ROOM_SENSOR_GONE):
                    raise ThermohygrometerError("serial port fails: unplugged", "plug it in")
                self._newest, self._at = self._sensor.read(), self._elapsed
                self._trouble = ""
            except RigError as error:
                self._trouble = str(error).partition(";")[0]
        age = max(elapsed - self._at, 0.0)
        return aged(self._newest, age, self._settings, self._trouble)

    @property
    def port(self) -> str:
        """Name of the line, for messages."""
        return self._settings.port

    def close(self) -> None:
        """Release the line."""
        self._sensor.close()

    def _has(self, kind: FaultKind) -> bool:
        return any(f.at <= self._elapsed < f.end for f in self._faults.of(kind))

    def _measured(self, air: AirOfRoom) -> tuple[float, float]:
        at, noise = np.array(self._elapsed), self._probe.noise(2)
        room = air.settings
        return (
            float(air.temperature(at)) + room.sensor_noise_K * noise[0],
            float(air.humidity(at)) + room.sensor_noise_percent * noise[1],
        )
