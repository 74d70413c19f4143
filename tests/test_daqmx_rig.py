"""The driver for the card, line by line as it runs at a rig, against the simulated card's server."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from app.rigfile import RigFile
from drivers.daqmx.address import Address
from drivers.daqmx.rig import DaqmxRig
from drivers.errors import RigError
from drivers.rig import RigState
from sim_backend.daqmx.opening import open_device
from sim_backend.daqmx.server import DaqmxServer
from sim_backend.faults import FaultPlan
from tests.rig_contract import RigContract, begin, drain, lobes, play


class Watcher:
    """A guardian that takes down what it is told, and can die; nothing runs beside the test."""

    def __init__(self) -> None:
        self.words: list[str] = []
        self.dead = False
        self.fails = ""

    def arm(self) -> None:
        self.words.append("arm")

    def beat(self) -> bool:
        return not self.dead

    def disarm(self) -> None:
        self.words.append("disarm")

    def take_over(self) -> None:
        self.words.append("take over")
        if self.fails:
            raise RigError(self.fails)

    def close(self) -> None:
        self.words.append("close")


class Bench:
    """A simulated card behind a server of its own, and rigs on it."""

    def __init__(self, settings: RigFile | None = None, *, seed: int = 0, faults=(), **options):
        self.settings = settings or RigFile()
        self.device = open_device(
            "sim", self.settings, self.settings.as_film(), self.settings.as_load(), seed=seed,
            paced=False, faults=FaultPlan.parse(faults),
        )  # fmt: skip
        self.server = DaqmxServer(self.device, client_timeout=None)
        self.address = Address("Dev1", f"127.0.0.1:{self.server.start()}")
        self.guardian = Watcher()
        self.rig = DaqmxRig(self.address, self.settings, self.guardian, **options)

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *_: object) -> None:
        self.rig.close()
        self.server.close()


class TestDaqmxRig(RigContract):
    def opened(self, *, block_samples=None, seed=0):
        return self._opened(block_samples, seed)

    from contextlib import contextmanager

    @contextmanager
    def _opened(self, block_samples, seed) -> Iterator[DaqmxRig]:
        with Bench(seed=seed, block_samples=block_samples) as bench:
            yield bench.rig
