"""Marks that people set during a run, as they stand among the events of its recording."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from dearig.recording.content.layout import MESSAGE_BYTES
from dearig.recording.reading.recording import RecordedEvent

__all__ = ["NOTE_BYTES", "Mark", "mark_message", "marks_in", "read_mark"]

_PREFIX = "mark 999999: "
#: Longest note in bytes of UTF-8: what an event's message holds besides the number of the mark.
NOTE_BYTES = MESSAGE_BYTES - len(_PREFIX)
_MARK = re.compile(r"mark (\d{1,6})(?:: (.+))?", re.DOTALL)


@dataclass(frozen=True)
class Mark:
    """Mark ``number`` of a recording at ``sample``, ``time`` s, with its ``note`` or "" ."""

    number: int
    sample: int
    time: float
    note: str = ""

    @property
    def words(self) -> str:
        """Text for a plot: the note, or the number of a mark without one."""
        return self.note or f"mark {self.number}"


def mark_message(number: int, note: str = "") -> str:
    """Return the message of the event of a mark: ``mark 2`` or ``mark 2: film creaks``."""
    return f"mark {number}: {note}" if note else f"mark {number}"


def read_mark(message: str) -> tuple[int, str] | None:
    """Return the number and the note of the mark in an event's message; None for other events."""
    found = _MARK.fullmatch(message)
    return None if found is None else (int(found[1]), found[2] or "")


def marks_in(events: Iterable[RecordedEvent]) -> tuple[Mark, ...]:
    """Return the marks among ``events``, each once, in the order of their numbers.

    A note that was entered after its mark is an event of its own, at the same sample.
    """
    found: dict[int, Mark] = {}
    for event in events:
        read = read_mark(event.message)
        if read is None or event.level != "info":
            continue
        number, note = read
        before = found.get(number)
        if before is None:
            found[number] = Mark(number, event.sample, event.time, note)
        elif note:
            found[number] = Mark(number, before.sample, before.time, note)
    return tuple(found[number] for number in sorted(found))
