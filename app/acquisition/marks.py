"""Marks and notes that people set while a run goes on."""

from __future__ import annotations

import threading

from dearig.drivers.rig import Event
from dearig.recording.reading.marks import NOTE_BYTES, mark_message

__all__ = ["RunMarks"]


class RunMarks:
    """Marks of one run: any thread sets them, and the run's own loop records them as events.

    Hand it to ``record`` as ``marks``. A mark stands at the newest sample that the run had received
    when it was set, so it is late by at most one block of the rig. A note may follow at any moment
    of the run; it is recorded at the sample of its mark. A text that is still being typed when the
    run ends is recorded too, if ``draft`` was told of it.

    Without a run in progress nothing can be marked: ``mark`` returns None, the others False.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._present: int | None = None  # sample; None while no run is in progress
        self._samples: list[int] = []  # of the marks, mark 1 first
        self._drafts: dict[int, str] = {}
        self._waiting: list[Event] = []

    @property
    def open(self) -> bool:
        """True while a run is in progress."""
        return self._present is not None

    def mark(self, note: str = "") -> int | None:
        """Set a mark at the present sample, and return its number: 1, 2, ...

        Raises ``ValueError`` for a note that is too long.
        """
        note = _one_line(note)
        with self._lock:
            if self._present is None:
                return None
            self._samples.append(self._present)
            number = len(self._samples)
            self._waiting.append(Event(self._present, "info", mark_message(number, note)))
            return number

    def note(self, number: int, text: str) -> bool:
        """Give mark ``number`` a note; return whether it will be recorded.

        Raises ``ValueError`` for a note that is too long, or for a mark that was never set.
        """
        text = _one_line(text)
        with self._lock:
            self._check(number)
            self._drafts.pop(number, None)
            if self._present is None:
                return False
            if text:
                self._waiting.append(self._noted(number, text))
            return True

    def draft(self, number: int, text: str) -> bool:
        """Keep a note that is not complete yet; it is recorded if the run ends before it is.

        Raises ``ValueError`` as ``note`` does.
        """
        text = _one_line(text)
        with self._lock:
            self._check(number)
            if self._present is None:
                return False
            self._drafts[number] = text
            return True

    def remark(self, text: str, level: str = "info") -> bool:
        """Record ``text`` as an event at the present sample, without a mark.

        Raises ``ValueError`` for a text that is too long.
        """
        text = _one_line(text)
        with self._lock:
            if self._present is None:
                return False
            self._waiting.append(Event(self._present, level, text))
            return True

    # called by the loop of the run

    def reach(self, received: int) -> list[Event]:
        """Say that the run has received so many samples, and return the events to be recorded."""
        with self._lock:
            self._present = max(received - 1, 0)
            taken, self._waiting = self._waiting, []
        return taken

    def close(self) -> list[Event]:
        """Accept nothing more, and return the last events to be recorded."""
        with self._lock:
            self._present = None
            taken = self._waiting
            taken += [self._noted(n, text) for n, text in self._drafts.items() if text]
            self._waiting, self._drafts = [], {}
        return taken

    def _noted(self, number: int, text: str) -> Event:
        return Event(self._samples[number - 1], "info", mark_message(number, text))

    def _check(self, number: int) -> None:
        if not 1 <= number <= len(self._samples):
            raise ValueError(f"mark {number} was not set: the run has {len(self._samples)} marks")


def _one_line(text: str) -> str:
    """Return ``text`` with single spaces. Raises ``ValueError`` where it is too long."""
    line = " ".join(text.split())
    size = len(line.encode())
    if size > NOTE_BYTES:
        raise ValueError(
            f"a note has at most {NOTE_BYTES} bytes, this one has {size}: shorten it, or set "
            f"another mark for the rest"
        )
    return line
