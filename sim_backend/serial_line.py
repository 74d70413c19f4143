"""Serial line in one process, with its own simulated time, and what answers at its end."""

from __future__ import annotations

from typing import Protocol

from dearig.drivers.instruments.serial_line import POLL

__all__ = ["Responder", "SimulatedLine"]


class Responder(Protocol):
    """Instrument at the end of a serial line; ``now`` is in s and never decreases."""

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes that arrived."""
        ...

    def due(self, now: float) -> bytes:
        """Return the bytes sent by ``now`` that were not returned before."""
        ...

    def next_due(self) -> float | None:
        """Return the time in s of the next bytes to send, or None."""
        ...


class SimulatedLine:
    """Driver's end of a line to ``responder``, in one process, with its own simulated time.

    Time passes only while the driver waits; ``now`` returns it.
    """

    def __init__(self, responder: Responder, baud_rate: int = 115200) -> None:
        self._responder = responder
        self._seconds_per_byte = 10.0 / baud_rate
        self._now = 0.0
        self._came = b""
        self.closed = False

    def now(self) -> float:
        """Present time in s."""
        return self._now

    @property
    def in_waiting(self) -> int:
        """Return the number of bytes that can be read at once."""
        self._came += self._responder.due(self._now)
        return len(self._came)

    def read(self, size: int = 1, /) -> bytes:
        """Return up to ``size`` bytes; waits for them as long as a port does."""
        if not self.in_waiting:
            until = self._now + POLL
            due = self._responder.next_due()
            self._now = until if due is None else min(until, max(due, self._now))
            self._came += self._responder.due(self._now)
        data, self._came = self._came[:size], self._came[size:]
        self._now += len(data) * self._seconds_per_byte
        return data

    def write(self, data: bytes, /) -> int:
        """Send."""
        self._responder.receive(data, self._now)
        return len(data)

    def close(self) -> None:
        """Release the line."""
        self.closed = True
