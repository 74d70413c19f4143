"""Following a recording while another process writes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.recording.opening import read_from
from dearig.recording.physical import Counts, Rest
from dearig.recording.reader import read_events
from dearig.recording.recording import RecordedEvent
from dearig.recording.safe import group

__all__ = ["Follower", "News"]


@dataclass(frozen=True, eq=False)
class News:
    """New samples since the last look: ``values`` by name, (n,) each, from sample ``start`` on.

    Values are in SI units, with ``time`` among them. ``ended``: the run was closed, and no samples
    follow.
    """

    start: int
    values: dict[str, np.ndarray]
    events: tuple[RecordedEvent, ...]
    ended: bool


class Follower:
    """Follows the recording at ``path`` of a run in another process.

    Between looks no file is open. Displacement is counted from the mean of the lead-in, or of the
    part of it that has been recorded so far.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._samples = 0
        self._events = 0
        self._rest: Rest | None = None

    def look(self, most: int | None = None) -> News:
        """Return what is new since the last look, at most ``most`` samples.

        A flush makes new samples visible, four times a second. Raises ``InputError`` for a
        file that is not a recording of a run.
        """
        return read_from(self.path, lambda file: self._look(file, most))

    def _look(self, file: h5py.File, most: int | None) -> News:
        entry = group(file, "entry")
        if entry is None or group(entry, "data") is None:
            raise InputError(f"{self.path}: the group /entry/data is missing")
        ended = "samples" in entry.attrs
        counts = Counts(entry, rest=self._rest)
        if not counts.channels:
            raise InputError(f"{self.path} is not the recording of a run: it has no counts")
        start, stop = self._samples, counts.samples
        if most is not None:
            stop = min(stop, start + most)
        rest = counts.rest
        values = {name: counts.window(name, start, stop) for name in counts.names}
        events = read_events(self.path, entry)
        if rest.samples < counts.samples:
            self._rest = rest
        fresh = events[self._events :]
        self._samples, self._events = stop, len(events)
        return News(start, values, fresh, ended and stop == counts.samples)
