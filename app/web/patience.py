"""Connections that send no whole request: each has a time limit, and each address a number."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Any, ClassVar

from uvicorn.protocols.http.h11_impl import H11Protocol

__all__ = ["HEADER_S", "WAITING_MAX", "PatientProtocol"]

#: Time in s for the lines of a request. They are one packet; Apache's mod_reqtimeout gives 20 s to
#: the first byte of slow lines, and a page that only computers nearby open needs half of it.
HEADER_S = 10.0
#: Connections of one address that may be without a whole request: a browser opens six.
WAITING_MAX = 16


class PatientProtocol(H11Protocol):
    """HTTP connection that is closed when its next request is not whole within ``HEADER_S``.

    The time runs from the connection, and from the end of each answer, whatever arrives meanwhile.
    It comes before the token: who has none must not keep out those who have one.
    """

    waiting: ClassVar[Counter[str]] = Counter()

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._timer: asyncio.TimerHandle | None = None
        self._peer = ""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._peer = self.client[0] if self.client else ""
        if self.waiting[self._peer] >= WAITING_MAX:
            transport.abort()
        else:
            self._look()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._look()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._look()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop()
        super().connection_lost(exc)

    def _look(self) -> None:
        """Start the time where no request is being answered, end it where one is."""
        if self.cycle is not None and not self.cycle.response_complete:
            self._stop()
        elif self._timer is None and not self.transport.is_closing():
            self.waiting[self._peer] += 1
            self._timer = self.loop.call_later(HEADER_S, self.transport.abort)

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self.waiting[self._peer] -= 1
            if not self.waiting[self._peer]:
                del self.waiting[self._peer]
