"""Interface of all rigs: simulated, on a local card, or on a card behind a server."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol, runtime_checkable

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.errors import RigStateError
from dearig.drivers.gate import GatedWaveform

__all__ = [
    "Block",
    "Event",
    "Instrument",
    "Rig",
    "RigIdentity",
    "RigState",
    "expect",
]


class RigState(Enum):
    """State of a rig. ``SAFE`` is 0 V with nothing loaded; every path ends there."""

    SAFE = "safe"
    LOADED = "loaded"
    ARMED = "armed"
    RUNNING = "running"
    DONE = "done"
    CLOSED = "closed"


def expect(state: RigState, call: str, *allowed: RigState) -> None:
    """Raise ``RigStateError`` unless a rig in ``state`` allows ``call``."""
    if state not in allowed:
        wanted = " or ".join(one.value for one in allowed)
        raise RigStateError(f"{call}: the rig is {state.value}, it must be {wanted}")


@dataclass(frozen=True)
class Instrument:
    """Instrument; ``settings`` are pairs of text: name, and value with unit."""

    role: str
    model: str
    serial: str
    settings: tuple[tuple[str, str], ...] = field(default=())


@dataclass(frozen=True)
class RigIdentity:
    """Identity of a rig: address (``sim``, ``sim:7``, ``daqmx:Dev1``), instruments, channels."""

    address: str
    simulated: bool
    instruments: tuple[Instrument, ...]
    channels: tuple[Channel, ...]
    seed: int | None = None


@dataclass(frozen=True)
class Event:
    """Event at ``sample`` of the run; ``level`` is info, warning or fault."""

    sample: int
    level: str
    message: str


@dataclass(frozen=True)
class Block:
    """Block of samples: ``counts`` (channels, n) int16, the first one being sample ``start``."""

    start: int
    counts: np.ndarray
    events: tuple[Event, ...] = field(default=())


@runtime_checkable
class Rig(Protocol):
    """Rig: it is loaded, armed, started, read until ``read`` returns None, and ends safe.

    Calls out of order raise ``RigStateError``; faults of instruments raise ``RigError``.
    ``make_safe`` may be called in any state, at any time and more than once.

    A rig may have a property ``zero_reading``: the ``ZeroReading`` of its last ``make_safe``, None
    where the monitor could not be read. Without it, the end of a run counts as confirmed only by
    the last samples.

    A rig that ends runs early of its own accord has a property ``ramping``: True once it plays the
    ramp of a ``stop``.

    A rig with the attribute ``plays_growing_waveforms = True`` also plays a waveform that grows: it
    outputs only what is admitted, takes what was admitted since the last ``read`` with the next
    one, and raises ``RigError`` where nothing is left to output. Without it no run is corrected.
    """

    @property
    def state(self) -> RigState:
        """Return the state of the rig."""
        ...

    def identify(self) -> RigIdentity:
        """Return the rig's instruments; the output does not change."""
        ...

    def load(self, waveform: GatedWaveform) -> float:
        """Load a waveform that has passed the gate; returns the actual sample rate in Hz."""
        ...

    def arm(self) -> None:
        """Prepare for a start without delay; the output stays at 0 V."""
        ...

    def start(self) -> None:
        """Start the sample clock."""
        ...

    def read(self) -> Block | None:
        """Wait for the next block and return it, or None after the last one."""
        ...

    @property
    def waiting(self) -> float:
        """Return the reader's delay in s: samples that were acquired and not read."""
        ...

    def stop(self) -> None:
        """End the run early with a ramp to 0 V; acquired samples stay readable."""
        ...

    def make_safe(self) -> None:
        """Take the output to 0 V immediately and discard the waveform."""
        ...

    def close(self) -> None:
        """Make safe and release the instruments."""
        ...
