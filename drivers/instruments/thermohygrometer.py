"""Sensor of temperature and humidity: readings, limits, and the interface of its drivers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, Protocol, runtime_checkable

from dearig.drivers.errors import RigError
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.interlocks import Trip
from dearig.drivers.settings import ThermohygrometerSettings

__all__ = [
    "NO_READING",
    "RoomLimits",
    "RoomReading",
    "RoomSource",
    "Thermohygrometer",
    "ThermohygrometerDriver",
    "ThermohygrometerError",
    "aged",
    "reading_finding",
]


class ThermohygrometerError(RigError):
    """Fault of the sensor: ``what`` happened, ``advice`` what to do."""

    def __init__(self, what: str, advice: str) -> None:
        super().__init__(f"{what}; {advice}")
        self.what = what
        self.advice = advice


@dataclass(frozen=True)
class RoomReading:
    """A reading in degrees Celsius and per cent; NaN where the sensor gave no value.

    ``age`` in s is that of the reading at the time of the request. ``trouble`` says why there is no
    value, or is "".
    """

    temperature: float
    humidity: float
    age: float = 0.0
    trouble: str = ""

    @property
    def known(self) -> bool:
        """Return True if there is any value."""
        return math.isfinite(self.temperature) or math.isfinite(self.humidity)

    @property
    def shown(self) -> str:
        """Return the values as text."""
        celsius = f"{self.temperature:.1f} °C" if math.isfinite(self.temperature) else "no °C"
        percent = f"{self.humidity:.1f} %" if math.isfinite(self.humidity) else "no humidity"
        return f"{celsius}, {percent}"


#: What is known where nothing is.
NO_READING = RoomReading(math.nan, math.nan, math.inf)


def aged(
    newest: RoomReading, age: float, settings: ThermohygrometerSettings, trouble: str
) -> RoomReading:
    """Return the ``newest`` reading with its ``age`` in s; without values above ``stale_s``.

    ``trouble`` says why there is no newer one, or is "".
    """
    if age > settings.stale_s:
        return replace(NO_READING, trouble=trouble)
    return replace(newest, age=age, trouble=trouble)


class Thermohygrometer(Protocol):
    """An open sensor."""

    def read(self) -> RoomReading:
        """Ask for a reading and return it; raises ``ThermohygrometerError`` in bounded time."""
        ...

    def close(self) -> None:
        """Release the port."""
        ...


@runtime_checkable
class ThermohygrometerDriver(Protocol):
    """Interface of a sensor's driver; ``thermohygrometer.driver`` is its name in the registry."""

    role: Literal["thermohygrometer"]

    def open(self, settings: ThermohygrometerSettings) -> Thermohygrometer:
        """Return the sensor at ``settings.port``. Raises ``ThermohygrometerError``."""
        ...

    def inspect(self, settings: ThermohygrometerSettings) -> tuple[Finding, ...]:
        """Return the state of the sensor; faults are findings."""
        ...


class RoomSource(Protocol):
    """Source of the room's values in a run: a sensor that is read during it, or a simulated one."""

    def reading(self, elapsed: float) -> RoomReading:
        """Return the newest reading ``elapsed`` s after the first sample; it never waits.

        A reading that is too old comes back as one without values.
        """
        ...

    def close(self) -> None:
        """Release the sensor."""
        ...


class RoomLimits:
    """Interlocks of one run on the room; each trips at most once.

    They judge readings as they come, once each; a sensor's noise is far below a limit's width, so
    that nothing is debounced. A value that is unknown breaks no limit: ``on_loss`` says what its
    loss does.
    """

    def __init__(self, settings: ThermohygrometerSettings, rate: float) -> None:
        self._settings = settings
        self._rate = rate
        self._tripped: set[str] = set()

    def broken(self, reading: RoomReading) -> list[tuple[str, str]]:
        """Return the interlocks that ``reading`` breaks, with a sentence each."""
        settings, found = self._settings, []
        for (name, unit, low, high), value in zip(
            settings.limits, (reading.temperature, reading.humidity), strict=True
        ):
            if value < low or value > high:
                allowed = _allowed(low, high, unit)
                sentence = f"the room's {name} was {value:.4g} {unit}, {allowed} is allowed"
                found.append((f"room {name}", sentence))
        if not reading.known and settings.on_loss != "go on":
            why = f" ({reading.trouble})" if reading.trouble else ""
            found.append(
                (
                    "thermohygrometer",
                    f"the thermo-hygrometer gave no value for {settings.stale_s:.3g} s{why}: check "
                    f"its cable and thermohygrometer.port",
                )
            )
        return found

    def watch(self, sample: int, reading: RoomReading) -> list[Trip]:
        """Return the interlocks that trip with ``reading``, taken before ``sample``."""
        trips = []
        for interlock, sentence in self.broken(reading):
            if interlock in self._tripped:
                continue
            self._tripped.add(interlock)
            action = self._settings.limit_action
            if interlock == "thermohygrometer":
                action = "at once" if self._settings.on_loss == "at once" else "ramp"
            text = f"at {sample / self._rate:.4g} s {sentence}"
            trips.append(Trip(interlock, sample, action, text))
        return trips


def reading_finding(settings: ThermohygrometerSettings, reading: RoomReading) -> Finding:
    """Return a reading against the limits of the rig file."""
    broken = RoomLimits(settings, 1.0).broken(reading)
    if not reading.known:
        return Finding(
            settings.model, "reading", reading.shown, "temperature and humidity",
            "wrong" if settings.on_loss != "go on" else "warning",
            "check the probe: the sensor answers without a value",
        )  # fmt: skip
    bounds = [
        f"{name} {_allowed(low, high, unit)}"
        for name, unit, low, high in settings.limits
        if math.isfinite(low) or math.isfinite(high)
    ]
    return Finding(
        settings.model, "reading", reading.shown, ", ".join(bounds), "wrong" if broken else "ok",
        "wait until the room is within the limits, or change them in [thermohygrometer]"
        if broken
        else "",
    )  # fmt: skip


def _allowed(low: float, high: float, unit: str) -> str:
    if math.isinf(high):
        return f"{low:.4g} {unit} or more"
    return f"{high:.4g} {unit} or less" if math.isinf(low) else f"{low:.4g} to {high:.4g} {unit}"
