"""The interface of every rig: simulated, a local card, or a card behind a server."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol, runtime_checkable

import numpy as np

from dearig.drivers.channels import Channel
from dearig.drivers.errors import RigStateError
from dearig.drivers.gate import GatedWaveform

__all__ = ["Block", "Event", "Instrument", "Rig", "RigIdentity", "RigState", "expect"]


class RigState(Enum):
    """State of a rig. ``SAFE`` is 0 V with nothing loaded; every path ends there."""

    SAFE = "safe"
    LOADED = "loaded"
    ARMED = "armed"
    RUNNING = "running"
    DONE = "done"
    CLOSED = "closed"


def expect(state: RigState, call: str, *allowed: RigState) -> None:
    """Raise ``RigStateError`` unless a rig in ``state`` can take ``call``."""
    if state not in allowed:
        wanted = " or ".join(one.value for one in allowed)
        raise RigStateError(f"{call}: the rig is {state.value}, it must be {wanted}")


@dataclass(frozen=True)
class Instrument:
    """One instrument; ``settings`` are pairs of text, name and value with unit."""

    role: str
    model: str
    serial: str
    settings: tuple[tuple[str, str], ...] = field(default=())


@dataclass(frozen=True)
class RigIdentity:
    """A rig: its address (``sim``, ``sim:7``, ``daqmx:Dev1``), instruments and channels."""

    address: str
    simulated: bool
    instruments: tuple[Instrument, ...]
    channels: tuple[Channel, ...]
    seed: int | None = None


@dataclass(frozen=True)
class Event:
    """Something that happened at ``sample`` of the run: ``level`` is info, warning or fault."""

    sample: int
    level: str
    message: str


@dataclass(frozen=True)
class Block:
    """Simultaneous samples: ``counts`` (channels, n) int16, the first being sample ``start``."""

    start: int
    counts: np.ndarray
    events: tuple[Event, ...] = field(default=())


@runtime_checkable
class Rig(Protocol):
    """A rig is loaded, armed, started, read until it returns None, and ends safe.

    Calls out of order raise ``RigStateError``; faults of instruments raise ``RigError``. Whatever
    happened, ``make_safe`` may be called, at any time and more than once.
    """

    @property
    def state(self) -> RigState:
        """State of the rig."""
        ...

    def identify(self) -> RigIdentity:
        """Return what the rig is made of; the output does not move."""
        ...

    def load(self, waveform: GatedWaveform) -> float:
        """Take a waveform that has passed the gate; returns the actual sample rate in Hz."""
        ...

    def arm(self) -> None:
        """Get ready to start without delay; the output stays at 0 V."""
        ...

    def start(self) -> None:
        """Start the sample clock."""
        ...

    def read(self) -> Block | None:
        """Return the next block, waiting for it; None when the waveform has been played."""
        ...

    @property
    def waiting(self) -> float:
        """Delay of the reader in s: samples that were acquired and not read."""
        ...

    def stop(self) -> None:
        """End the run early: ramp to 0 V in the set time; acquired samples stay readable."""
        ...

    def make_safe(self) -> None:
        """Take the output to 0 V at once and discard the waveform."""
        ...

    def close(self) -> None:
        """Make safe and release the instruments."""
        ...
