"""Channels of tasks, of each kind that the card has."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.numbers import RISING, TIMEBASE
from dearig.sim_backend.daqmx.card.scales import Scale
from dearig.sim_backend.daqmx.card.sensors import Sensor

__all__ = [
    "AnalogInput",
    "AnalogOutput",
    "Channel",
    "CounterChannel",
    "Lines",
    "Pulse",
    "PulseChannel",
]


@dataclass
class AnalogInput:
    """Input channel: ``limits`` were requested, ``range`` V, plus and minus, is in use.

    With a ``scale`` or a sensor the limits are in its unit, otherwise in V. ``kept`` has the
    properties without effect.
    """

    name: str
    terminal: str
    limits: tuple[float, float]
    range: float
    wiring: int
    scale: Scale | Sensor | None = None
    kept: dict[object, Any] = field(default_factory=dict)

    @property
    def volts(self) -> tuple[float, float]:
        """Return the limits in V."""
        return self.limits if self.scale is None else self.scale.limits(self.limits)


@dataclass
class AnalogOutput:
    """Output channel, with the same fields."""

    name: str
    terminal: str
    limits: tuple[float, float]
    range: float
    scale: Scale | None = None
    kept: dict[object, Any] = field(default_factory=dict)

    @property
    def volts(self) -> tuple[float, float]:
        """Return the limits in V."""
        return self.limits if self.scale is None else self.scale.limits(self.limits)


@dataclass
class Lines:
    """Channel of digital lines, such as ``port0/line0``.

    ``columns`` are the same in the order of a waveform's data, which has the highest line of a
    whole port first.
    """

    name: str
    lines: tuple[str, ...]
    columns: tuple[str, ...] = ()
    kept: dict[object, Any] = field(default_factory=dict)


@dataclass
class CounterChannel:
    """Channel of a counter input with its settings; those that it does not use are ignored.

    ``terminals`` are by role: ``input`` and for some ``second``, ``direction``, ``a``, ``b``,
    ``z``. ``limits`` are in ``units``, in which the values are too. ``measure`` and the other
    numbers are DAQmx's.
    """

    name: str
    terminal: str
    measure: int
    limits: tuple[float, float] = (0.0, 0.0)
    units: int = 10364
    edge: int = RISING
    second_edge: int = RISING
    initial: float = 0.0
    direction: int = 10128
    method: int = 10105
    decoding: int = 10092
    index: bool = False
    index_value: float = 0.0
    index_phase: int = 10040
    distance: float = 1.0  # units of position for each period of the encoder
    pulses: int = 24
    terminals: dict[str, str] = field(default_factory=dict)
    kept: dict[object, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Pulse:
    """Pulse of ``high`` and ``low`` s."""

    high: float
    low: float

    @classmethod
    def of_frequency(cls, frequency: float, duty: float) -> Pulse:
        """Return the pulse of a train of ``frequency`` Hz."""
        if not (frequency > 0.0 and 0.0 < duty < 1.0):
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: CO.Pulse.Freq or CO.Pulse.DutyCyc; Requested Values: {frequency:g}, "
                f"{duty:g}",
            )
        return cls(duty / frequency, (1.0 - duty) / frequency)

    @classmethod
    def of_times(cls, high: float, low: float) -> Pulse:
        """Return the pulse of ``high`` and ``low`` s; both are at least two ticks long."""
        if not min(high, low) * TIMEBASE >= 2.0 - 1e-6:
            raise DaqmxError(
                Code.INVALID_VALUE,
                f"Property: CO.Pulse.HighTime or CO.Pulse.LowTime; Requested Values: {high:g}, "
                f"{low:g}; Minimum Value: {2.0 / TIMEBASE:g}",
            )
        return cls(high, low)

    @classmethod
    def of_ticks(cls, high: int, low: int) -> Pulse:
        """Return the pulse of ``high`` and ``low`` ticks of the counters' timebase."""
        return cls.of_times(high / TIMEBASE, low / TIMEBASE)


@dataclass
class PulseChannel:
    """Channel of a counter output; ``delay`` s before the first pulse, in the idle state.

    ``kind`` is DAQmx's number of how its pulses are given.
    """

    name: str
    terminal: str
    kind: int
    pulse: Pulse
    delay: float
    idle_high: bool
    output: str
    kept: dict[object, Any] = field(default_factory=dict)


Channel = AnalogInput | AnalogOutput | Lines | CounterChannel | PulseChannel
