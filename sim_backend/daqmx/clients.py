"""Who is at the other end of the link: a client that left a voltage up does not go unnoticed."""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass
from typing import Any

from sim_backend.clock import Clock
from sim_backend.daqmx.device import Device
from sim_backend.daqmx.tasks import Kind

__all__ = ["Clients"]

log = logging.getLogger(__name__)

_OUTPUTS = (Kind.AO, Kind.DO, Kind.WATCHDOG)


@dataclass
class _Client:
    calls: int = 0  # that it waits for
    heard: float = 0.0  # s on the link's clock
    drives: bool = False  # it has had output tasks


class Clients:
    """The clients of ``device`` on the link's ``clock``; each is a connection.

    One that drives the output and is silent for ``timeout`` s while there is a voltage at the film,
    or whose connection ends, has its tasks aborted, the output taken to 0 V and the enable line
    low. A client that waits for an answer is not silent.
    """

    def __init__(self, device: Device, clock: Clock, timeout: float) -> None:
        self._device = device
        self._clock = clock
        self._timeout = timeout
        self._lock = threading.Lock()
        self._clients: dict[str, _Client] = {}

    def begin(self, name: str) -> None:
        """A call of the client ``name`` has come in."""
        with self._lock:
            client = self._clients.setdefault(name, _Client())
            client.calls += 1
            client.heard = self._clock.now()

    def end(self, name: str) -> None:
        """It has been answered."""
        drives = any(task.kind in _OUTPUTS for task in self._device.tasks_of(name))
        with self._lock:
            client = self._clients.setdefault(name, _Client())
            client.calls -= 1
            client.heard = self._clock.now()
            client.drives = client.drives or drives

    def listen(self, name: str, task: str, context: Any) -> None:
        """The client ``name`` listens to an event of ``task`` for as long as ``context`` lasts.

        When that ends and the task is still there, the client has not cleared it: it is gone.
        """
        there = self._device.task(task)

        def ended() -> None:
            if there.listened and there in self._device.tasks_of(name):
                self.gone(name)

        there.listened = True
        context.add_callback(ended)

    def gone(self, name: str) -> None:
        """The connection of ``name`` has ended: its tasks are cleared as well."""
        with self._lock:
            client = self._clients.pop(name, None)
        if client is not None and client.drives:
            self._make_safe(name, "its connection has ended")
        for task in self._device.tasks_of(name):
            self._device.clear(task)

    def check(self) -> None:
        """Look for a client that is silent with a voltage at the film."""
        if not self._device.live():
            with self._lock:
                for name, client in self._clients.items():
                    client.drives = client.drives and bool(self._device.tasks_of(name))
            return
        now = self._clock.now()
        with self._lock:
            silent = [
                name
                for name, client in self._clients.items()
                if client.drives and client.calls == 0 and now - client.heard > self._timeout
            ]
            others = any(c.drives for name, c in self._clients.items() if name not in silent)
        for name in silent:
            # somebody else may drive it now; the silent one's own tasks end either way
            if not others or self._device.drives(name):
                self._make_safe(name, f"it is silent for more than {self._timeout:g} s")

    def _make_safe(self, name: str, why: str) -> None:
        log.warning("client %s: %s; its tasks are aborted and the output is at 0 V", name, why)
        self._device.make_safe(name)
