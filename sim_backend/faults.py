"""Faults on purpose: what goes wrong in a simulated rig, and when."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

__all__ = ["Fault", "FaultKind", "FaultPlan"]


class FaultKind(StrEnum):
    """Everything that can be made to go wrong."""

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


#: s that a fault lasts where it is not said; the others stay.
_LASTS = {
    FaultKind.ARC: 0.01,
    FaultKind.SENSOR_NOISE_BURST: 0.2,
    FaultKind.SHORT_READ: 0.0,
    FaultKind.LATE_REPLY: 1.5,
}


@dataclass(frozen=True)
class Fault:
    """``kind`` sets in ``at`` s after the start of a run's sample clock and lasts ``duration`` s."""

    kind: FaultKind
    at: float
    duration: float = math.inf

    @property
    def end(self) -> float:
        """S after the start of the run."""
        return self.at + self.duration


@dataclass(frozen=True)
class FaultPlan:
    """The faults of a run, in the order of their beginnings."""

    faults: tuple[Fault, ...] = field(default=())

    @staticmethod
    def parse(items: Iterable[str]) -> FaultPlan:
        """From items such as ``arc@3.2`` or ``late-reply@1.5+0.8`` (at 1.5 s, for 0.8 s).

        Raises ``ValueError`` with a sentence for an item that is not understood.
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
            lasts = float(found[3]) if found[3] else _LASTS.get(kind, math.inf)
            faults.append(Fault(kind, float(found[2]), lasts))
        return FaultPlan(tuple(sorted(faults, key=lambda fault: fault.at)))

    def of(self, *kinds: FaultKind) -> tuple[Fault, ...]:
        """The faults that are of one of ``kinds``."""
        return tuple(fault for fault in self.faults if fault.kind in kinds)
