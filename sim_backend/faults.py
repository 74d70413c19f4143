"""Planned faults of a simulated rig: their kinds and times."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

__all__ = ["Fault", "FaultKind", "FaultPlan"]


class FaultKind(StrEnum):
    """Kinds of faults that a simulated rig can have."""

    # in the high voltage and on the film
    ARC = "arc"
    FILM_RUPTURE = "film-rupture"
    ELECTRODE_OPEN = "electrode-open"
    AMPLIFIER_TRIP = "amplifier-trip"
    MONITOR_WIRE_OFF = "monitor-wire-off"
    # at the laser
    SENSOR_STUCK = "sensor-stuck"
    SENSOR_OUT_OF_RANGE = "sensor-out-of-range"
    SENSOR_NOISE_BURST = "sensor-noise-burst"
    # in the card and on the way to it
    AI_OVERFLOW = "ai-overflow"
    AO_UNDERFLOW = "ao-underflow"
    SHORT_READ = "short-read"
    LATE_REPLY = "late-reply"
    SERVER_FROZEN = "server-frozen"
    SERVER_GONE = "server-gone"
    # at the laser's serial port
    SERIAL_GARBAGE = "serial-garbage"
    # at the thermo-hygrometer
    ROOM_SENSOR_GONE = "room-sensor-gone"
    ROOM_SENSOR_GARBAGE = "room-sensor-garbage"


#: Default duration of a fault in s. Kinds that are not listed last until the run ends.
_DURATION = {
    FaultKind.ARC: 0.01,
    FaultKind.SENSOR_NOISE_BURST: 0.2,
    FaultKind.SHORT_READ: 0.0,
    FaultKind.LATE_REPLY: 1.5,
}


#: Faults that are permanent and take no duration.
_PERMANENT = {FaultKind.FILM_RUPTURE, FaultKind.AMPLIFIER_TRIP}

_NEVER = 2**62  # samples


@dataclass(frozen=True)
class Fault:
    """``kind`` sets in ``at`` s after the start of a run's sample clock, for ``duration`` s.

    Raises ``ValueError`` for invalid times, and for a duration of a permanent fault.
    """

    kind: FaultKind
    at: float
    duration: float = math.inf

    def __post_init__(self) -> None:
        if not (math.isfinite(self.at) and self.at >= 0.0 and self.duration >= 0.0):
            raise ValueError(
                f"fault {self.kind} at {self.at!r} s for {self.duration!r} s: write times from 0 up"
            )
        if self.kind in _PERMANENT and math.isfinite(self.duration):
            raise ValueError(f"fault {self.kind} is permanent: leave its duration out")

    @property
    def end(self) -> float:
        """Return the end of the fault, in s after the start of the run."""
        return self.at + self.duration

    def samples(self, rate: float) -> tuple[int, int]:
        """Return the first sample of the fault and the first one after it, at ``rate`` Hz."""
        return _sample(self.at, rate), _sample(self.end, rate)


def _sample(time: float, rate: float) -> int:
    """Return the first sample at or after ``time`` s, up to rounding."""
    return math.ceil(time * rate - 1e-6) if math.isfinite(time) else _NEVER


@dataclass(frozen=True)
class FaultPlan:
    """Faults of a run, in the order of their start times."""

    faults: tuple[Fault, ...] = field(default=())

    @staticmethod
    def parse(items: Iterable[str]) -> FaultPlan:
        """Parse items such as ``arc@3.2`` or ``late-reply@1.5+0.8`` (at 1.5 s, for 0.8 s).

        Raises ``ValueError`` for an invalid item.
        """
        faults = []
        for item in items:
            found = re.fullmatch(r"([a-z-]+)@(\d+(?:\.\d+)?)(?:\+(\d+(?:\.\d+)?))?", item.strip())
            if not found or found[1] not in set(FaultKind):
                raise ValueError(
                    f"fault {item!r} is not understood: write KIND@SECONDS or "
                    f"KIND@SECONDS+DURATION, KIND one of {', '.join(FaultKind)}"
                )
            kind = FaultKind(found[1])
            lasts = float(found[3]) if found[3] else _DURATION.get(kind, math.inf)
            faults.append(Fault(kind, float(found[2]), lasts))
        return FaultPlan(tuple(sorted(faults, key=lambda fault: fault.at)))

    def of(self, *kinds: FaultKind) -> tuple[Fault, ...]:
        """Return the faults whose kind is one of ``kinds``."""
        return tuple(fault for fault in self.faults if fault.kind in kinds)

    def active(self, first: int, samples: int, rate: float, *kinds: FaultKind) -> np.ndarray:
        """Return where one of ``kinds`` is active: (samples,) from ``first`` on at ``rate`` Hz."""
        there = np.zeros(samples, dtype=bool)
        for fault in self.of(*kinds):
            begin, end = (min(max(0, s - first), samples) for s in fault.samples(rate))
            there[begin:end] = True
        return there
