"""The events of a run in the log, on a thread of its own.

A log file on a disk that stalls, or a terminal that is held (ctrl-S), must not delay the run.
"""

from __future__ import annotations

import logging
import threading
from queue import SimpleQueue

from dearig.drivers.rig import Event

__all__ = ["EventLog"]

log = logging.getLogger(__name__)

_LEVELS = {"info": logging.INFO, "warning": logging.WARNING, "fault": logging.ERROR}
_ENDS_WITHIN = 2.0  # s


class EventLog:
    """A context in which events are logged; at its end all of them have been, if that is quick."""

    def __init__(self) -> None:
        self._inbox: SimpleQueue[Event | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="events", daemon=True)

    def add(self, event: Event) -> None:
        """Log ``event`` soon."""
        self._inbox.put(event)

    def __enter__(self) -> EventLog:
        """Start the thread."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End the thread, or leave it behind where it is held."""
        self._inbox.put(None)
        self._thread.join(_ENDS_WITHIN)

    def _work(self) -> None:
        while (event := self._inbox.get()) is not None:
            log.log(_LEVELS.get(event.level, logging.INFO), "%s", event.message)
