"""Following a recording while another process writes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.recording.content.flushes import flush_notes
from dearig.recording.content.layout import UNITS
from dearig.recording.content.modelled import FIELD, NAME
from dearig.recording.content.physical import Counts, Rest
from dearig.recording.content.safe import dataset, group
from dearig.recording.content.text import text_of
from dearig.recording.reading.opening import identifier_of, read_from
from dearig.recording.reading.reader import read_events
from dearig.recording.reading.recording import RecordedEvent

__all__ = ["Extremes", "Follower", "News"]

#: Bins that summarise the samples that were passed over.
_BINS = 1000

#: Time in s, minimum and maximum (n,) of a value over n bins.
Extremes = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class News:
    """New samples since the last look: ``values`` by name, (n,) each, from sample ``start`` on.

    Values are in SI units, with ``time`` among them. ``passed`` has the extremes by name of samples
    before ``start`` that were passed over. ``written`` is Unix time in s of the last flush, None
    where the file does not say. ``ended``: the run was closed, and no samples follow; ``outcome``
    says how. ``expected`` is the number of samples of the whole run, 0 where it is not known.
    ``described`` has unit and label of each value. ``identifier`` tells this recording from another
    one that was given its name.
    """

    start: int
    values: dict[str, np.ndarray]
    events: tuple[RecordedEvent, ...]
    ended: bool
    passed: Mapping[str, Extremes] = field(default_factory=dict)
    written: float | None = None
    outcome: str = ""
    expected: int = 0
    simulated: bool = False
    described: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    identifier: str = ""


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

    def look(self, most: int | None = None, newest: bool = False) -> News:
        """Return what is new since the last look, at most ``most`` samples.

        With ``newest`` these are the last ones, and those before them are shown by their extremes.
        A flush makes new samples visible, four times a second. Raises ``InputError`` for a
        file that is not a recording of a run.
        """
        return read_from(self.path, lambda file: self._look(file, most, newest))

    def _look(self, file: h5py.File, most: int | None, newest: bool) -> News:
        entry = group(file, "entry")
        if entry is None or group(entry, "data") is None:
            raise InputError(f"{self.path}: the group /entry/data is missing")
        ended = "samples" in entry.attrs
        counts = Counts(entry, rest=self._rest)
        if not counts.channels:
            raise InputError(f"{self.path} is not the recording of a run: it has no counts")
        start, stop = self._samples, counts.samples
        rest = counts.rest
        passed: dict[str, Extremes] = {}
        if most is not None and stop - start > most:
            if newest:
                first, start = start, stop - most
                names = [name for name in counts.names if name != "time"]
                passed = {name: counts.overview(name, first, start, _BINS) for name in names}
            else:
                stop = start + most
        values = {name: counts.window(name, start, stop) for name in counts.names}
        modelled = _modelled(entry, start, stop)
        if modelled is not None:
            values[FIELD] = modelled
        events = read_events(self.path, entry)
        if rest.samples < counts.samples:
            self._rest = rest
        fresh = events[self._events :]
        self._samples, self._events = stop, len(events)
        notes, about = flush_notes(entry), group(entry, "provenance")
        return News(
            start, values, fresh, ended and stop == counts.samples,
            passed=passed,
            written=float(notes["unix_time"][-1]) if notes is not None and notes.size else None,
            outcome=text_of(entry.attrs.get("outcome", "")),
            expected=int(counts.data.attrs.get("samples_expected", 0)),
            simulated=about is not None and bool(about.attrs.get("simulated", False)),
            described={
                name: (UNITS[name], "") if name in UNITS else counts.described(name)
                for name in values
            },
            identifier=identifier_of(entry),
        )  # fmt: skip


def _modelled(entry: h5py.Group, start: int, stop: int) -> np.ndarray | None:
    """Return the live model's displacement (n,) in m, NaN where it is behind; None for none."""
    stored = dataset(entry, NAME) if NAME in entry else dataset(entry["data"], FIELD)
    if stored is None:
        return None
    there = np.full(stop - start, np.nan)
    read = stored[start:stop]
    there[: read.size] = read
    return there
