"""What the example programs of nidaqmx-python must read and write on the simulated card."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from dearig.sim_backend.daqmx.device import Device


@dataclass
class Played:
    """An example that has run: the card, its reads and writes, its output, and its error."""

    device: Device
    calls: list[list[Any]]
    printed: str
    failure: dict[str, Any]


CHECKS: dict[str, Callable[[Played], str]] = {}
