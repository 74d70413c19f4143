"""Clients of the server, and the response to one that is lost while there is a voltage."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

from dearig.sim_backend.clock import Clock
from dearig.sim_backend.daqmx.card.tasks import Kind
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

__all__ = ["Clients"]

log = logging.getLogger(__name__)

_OUTPUTS = (Kind.AO, Kind.DO, Kind.WATCHDOG)
_FORGET_S = 60.0  # a client that calls again later is counted as a new one
_DEADLINE_S = 0.05  # a call that ends with less time left than this has timed out


class _Context(Protocol):
    """Interface of a call's context."""

    def add_callback(self, callback: object) -> bool: ...

    def time_remaining(self) -> float | None: ...


@dataclass
class _Client:
    calls: int = 0  # in progress
    heard: float = 0.0  # time of the last call, s on the link's clock
    drives: bool = False  # True once it has had output tasks


class Clients:
    """Clients of ``device`` on the link's ``clock``; each one is a connection.

    A client that drives the output is lost if it is silent for ``timeout`` s while there is a
    voltage at the film, or if its connection ends. Its tasks are then aborted, the output is set to
    0 V and the enable line low. A client that waits for an answer is not silent.
    """

    def __init__(self, device: SimulatedCard, clock: Clock, timeout: float) -> None:
        self._device = device
        self._clock = clock
        self._timeout = timeout
        self._lock = threading.Lock()
        self._clients: dict[str, _Client] = {}

    @contextmanager
    def call(self, name: str, context: _Context) -> Iterator[None]:
        """Track a call of the client ``name`` while the body answers it.

        If its ``context`` ends earlier, and not by the client's time-out, the connection has ended.
        """
        answered = threading.Event()

        def ended() -> None:
            left = context.time_remaining()
            if not answered.is_set() and (left is None or left > _DEADLINE_S):
                self.gone(name)

        with self._lock:
            client = self._clients.setdefault(name, _Client())
            client.calls += 1
            client.heard = self._clock.now()
        context.add_callback(ended)
        try:
            yield
        finally:
            answered.set()
            drives = any(task.kind in _OUTPUTS for task in self._device.tasks_of(name))
            with self._lock:
                client.calls -= 1
                client.heard = self._clock.now()
                client.drives = client.drives or drives

    def listen(self, name: str, task: str, context: _Context) -> None:
        """Track an event of ``task`` to which the client ``name`` listens while ``context`` lasts.

        If ``context`` ends before the client has cleared the task, the client is lost.
        """
        there = self._device.task(task)

        def ended() -> None:
            if there.listens(context) and there in self._device.tasks_of(name):
                self.gone(name)

        context.add_callback(ended)

    def gone(self, name: str) -> None:
        """Handle the end of the connection of ``name``, and clear its tasks."""
        with self._lock:
            client = self._clients.pop(name, None)
        tasks = self._device.tasks_of(name)
        drives = any(task.kind in _OUTPUTS for task in tasks)
        if drives or (client is not None and client.drives and self._device.drives(name)):
            self._make_safe(name, "its connection has ended")
        for task in tasks:
            self._device.clear(task)

    def all_gone(self) -> None:
        """Handle the end of all connections."""
        with self._lock:
            names = list(self._clients)
        for name in names:
            self.gone(name)

    @property
    def known(self) -> tuple[str, ...]:
        """Return the clients that are tracked."""
        with self._lock:
            return tuple(self._clients)

    def check(self) -> None:
        """Find a client that is silent while there is a voltage at the film.

        Others that have no tasks and are silent for long are forgotten.
        """
        now = self._clock.now()
        self._forget(now)
        if not self._device.live():
            return
        with self._lock:
            silent = [
                name
                for name, client in self._clients.items()
                if client.drives and client.calls == 0 and now - client.heard > self._timeout
            ]
        for name in silent:
            if self._device.drives(name):
                self._make_safe(
                    name,
                    f"it was silent for more than {self._timeout:g} s, the time limit of clients, "
                    f"with a voltage at the film",
                )

    def _forget(self, now: float) -> None:
        """Forget the clients without tasks that made no call for a while."""
        with self._lock:
            silent = [
                name
                for name, client in self._clients.items()
                if client.calls == 0 and now - client.heard > _FORGET_S
            ]
            for name in silent:
                if not (self._device.drives(name) or self._device.tasks_of(name)):
                    del self._clients[name]

    def _make_safe(self, name: str, why: str) -> None:
        self._device.make_safe(name, f"The client was lost: {why}.")
        log.warning("client %s: %s; its tasks were aborted, the output is at 0 V", name, why)
