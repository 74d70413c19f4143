"""Index of a folder of recordings: a summary of each file, cached until the file changes."""

from __future__ import annotations

import hashlib
import json
import logging
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import Any

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.input_file import parse_json, read_input
from dearig.model.compiled.trusted_folder import cache_root
from dearig.recording.content.fields import CONDITIONS, TEXTS, read_texts
from dearig.recording.content.layout import FORMAT, SIGNALS, counts_name
from dearig.recording.content.physical import SLICE, Counts, read_channels, sample_count
from dearig.recording.content.provenance import is_start_known, read_provenance
from dearig.recording.content.pyramid import reduced
from dearig.recording.content.safe import Refused, dataset, group, item
from dearig.recording.content.text import text_of
from dearig.recording.content.timestamps import local_time
from dearig.recording.files import journal_of, replaced_when_done, system_text
from dearig.recording.reading.environment import stored_means
from dearig.recording.reading.opening import UNREADABLE, identifier_of, read_from
from dearig.recording.reading.reader import read_events

__all__ = [
    "ENDINGS",
    "OUTLINE",
    "Entry",
    "Listing",
    "glance",
    "index_folder",
    "keep_index",
    "lines",
    "list_folder",
]

ENDINGS = (".h5", ".hdf5", ".nxs")
log = logging.getLogger(__name__)

#: Channels whose peaks are in the index.
PEAKS = (
    "voltage_command",
    "voltage_monitor",
    "current_monitor",
    "displacement",
    "temperature",
    "stretch",
    "nominal_stress",
)
#: Bins of the outline of a recording.
OUTLINE = 40
#: Events of a recording in the index, at most.
EVENTS_MAX = 12
_CACHE_MAX = 2**28  # bytes: ten times the entries of 10,000 recordings
#: Version of the cache, with the fields that it holds; another one is not read.
KEPT = f"dearig-index/6 {' '.join((*TEXTS, *CONDITIONS))}"


@dataclass(frozen=True)
class Entry:
    """Summary of one file.

    ``peaks`` has the largest absolute value of each channel, with its sign, in the units of the
    layout; ``outline`` is the measured signal in ``OUTLINE`` bins, as hexadecimal bytes of least
    and greatest value, of which 0 and 255 are the extremes. ``texts`` are those of
    ``content.fields.TEXTS``; ``room`` has the means of its ``CONDITIONS``, where the recording has
    them. ``events`` are time in s, level and message of the first ``EVENTS_MAX`` events.
    ``identifier`` tells the recording from every other. ``start_is_import``: the start time is the
    moment of an import, since the file does not tell that of the measurement.

    ``trouble`` is the reason why it is not a recording, or "". ``passing``: the reason is one of
    the system, not of the file, which may be readable the next time.
    """

    path: str
    bytes: int
    kind: str = ""
    title: str = ""
    start_time: str = ""
    start_is_import: bool = False
    samples: int = 0
    duration_s: float | None = None
    complete: bool = False
    outcome: str = ""
    texts: dict[str, str] = field(default_factory=dict)
    identifier: str = ""
    peaks: dict[str, float] = field(default_factory=dict)
    room: dict[str, float] = field(default_factory=dict)
    outline: str = ""
    events: list[list[Any]] = field(default_factory=list)
    trouble: str = ""
    passing: bool = False

    @property
    def film(self) -> str:
        """The operator's name for the film, "" without one."""
        return self.texts.get("film_id", "")

    def as_json(self) -> dict[str, Any]:
        """Return the entry for JSON, each text under its key, without the thumbnail."""
        facts = asdict(self)
        del facts["texts"], facts["outline"]
        return facts | {key: self.texts.get(key, "") for key in TEXTS}


#: Types of the facts in the cache.
_TYPES: Mapping[str, Any] = MappingProxyType(
    {
        **{f.name: str for f in fields(Entry)},
        "bytes": int,
        "samples": int,
        "duration_s": (int, float, NoneType),
        "complete": bool,
        "start_is_import": bool,
        "passing": bool,
        "texts": dict,
        "peaks": dict,
        "room": dict,
        "events": list,
    }
)


def index_folder(
    folder: str | Path, progress: Callable[[float], None] | None = None, cache: Path | None = None
) -> list[Entry]:
    """Return the recordings in ``folder`` and its subfolders, sorted by relative path.

    A file whose size and time of change are those in ``cache`` is not opened again, unless the
    system could not read it then. The cache is by default in the user's cache folder. ``progress``
    is called with the part of the files that is done. A folder that cannot be read is an entry,
    whose path ends in ``/``. Raises ``InputError`` if ``folder`` itself cannot be read.
    """
    listing = list_folder(folder, cache)
    entries = dict(listing.entries)
    fresh = listing.fresh
    for i, name in enumerate(fresh):
        entries[name] = glance(listing.folder / name, name, listing.files[name][0])
        if progress is not None:
            progress((i + 1) / len(fresh))
    keep_index(listing, entries, cache)
    return sorted([*entries.values(), *listing.unread], key=lambda entry: entry.path)


@dataclass(frozen=True)
class Listing:
    """Files of a folder that may be recordings, and what is known of them without opening any.

    ``files`` has size in bytes and time of the last change in ns by relative path; ``entries`` the
    entries of those that have not changed since they were read; ``unread`` an entry for each
    subfolder that cannot be read, whose path ends in ``/``, and for each link to no file;
    ``folders`` the subfolders.
    """

    folder: Path
    files: dict[str, tuple[int, int]]
    entries: dict[str, Entry]
    unread: tuple[Entry, ...]
    folders: tuple[str, ...]
    cached: int = 0

    @property
    def fresh(self) -> list[str]:
        """Files without an entry: new, or changed since they were read."""
        return [name for name in self.files if name not in self.entries]


def list_folder(folder: str | Path, cache: Path | None = None, *, deep: bool = True) -> Listing:
    """List ``folder``, with ``deep`` also its subfolders, with the entries in the cache.

    Raises ``InputError`` if the folder cannot be read.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder} is {'not a folder' if folder.exists() else 'not there'}")
    kept = _load(_cache_of(folder) if cache is None else cache)
    found, unread, folders = _files(folder, deep)
    files = {name: (size, changed) for name, size, changed in found}
    entries = {name: entry for name, (stamp, entry) in kept.items() if files.get(name) == stamp}
    return Listing(folder, files, entries, tuple(unread), tuple(folders), len(kept))


def keep_index(listing: Listing, entries: Mapping[str, Entry], cache: Path | None = None) -> None:
    """Write the ``entries`` of the files of ``listing`` to the cache, unless it has the same."""
    # what cannot be read now may be readable the next time
    known = {n: e for n, e in entries.items() if not e.passing and n in listing.files}
    if known != listing.entries or listing.cached != len(known):
        target = _cache_of(listing.folder) if cache is None else cache
        _save(target, known, listing.files)


def _files(folder: Path, deep: bool) -> tuple[list[tuple[str, int, int]], list[Entry], list[str]]:
    """Return the files that may be recordings, and an entry for each folder or link without one.

    Each file has its relative path, its size, and the time of its last change in ns. The third
    value are the relative paths of the subfolders.
    """
    # text is faster than Path: there may be ten thousand files
    found: list[tuple[str, int, int]] = []
    unread: list[Entry] = []
    folders: list[str] = []
    waiting = [""]
    while waiting:
        here = waiting.pop()
        try:
            with os.scandir(folder / here) as items:
                for item in items:
                    name = f"{here}{item.name}"
                    if item.is_dir(follow_symlinks=False):
                        if deep:
                            waiting.append(f"{name}/")
                            folders.append(name)
                    elif not name.lower().endswith(ENDINGS):
                        continue
                    elif item.is_file():
                        about = item.stat()
                        found.append((name, about.st_size, about.st_mtime_ns))
                    elif item.is_symlink() and not item.is_dir():
                        lost = f"{folder / name} is a link to a file that is not there"
                        unread.append(Entry(name, 0, trouble=lost, passing=True))
        except OSError as error:
            reason = f"{folder / here} cannot be read: {system_text(error)}"
            if not here:
                raise InputError(reason) from error
            unread.append(Entry(here, 0, trouble=reason, passing=True))
    return sorted(found), unread, folders


def glance(path: Path, name: str, size: int) -> Entry:
    """Return the summary of the file at ``path``; of a long run few samples are read."""
    try:
        return read_from(path, lambda file: _entry(path, file, name, size))
    except InputError as error:
        # HDF5 raises them for the errors of the disk; a journal may be gone at the next look, which
        # the recording itself does not show
        passing = isinstance(
            error.__cause__, OSError | MemoryError | RuntimeError
        ) or os.path.lexists(journal_of(path))
        return Entry(name, size, trouble=str(error), passing=passing)


def _entry(path: Path, file: h5py.File, name: str, size: int) -> Entry:
    if text_of(file.attrs.get("format", "")) != FORMAT:
        raise Refused(f"it is not of format {FORMAT}")
    entry = group(file, "entry")
    data = None if entry is None else group(entry, "data")
    if entry is None or data is None:
        raise Refused("the group /entry/data is missing")
    facts = entry.attrs
    rate = data.attrs.get("rate_Hz")
    duration: float | None = None
    time = dataset(data, "time")
    if "samples" in facts:
        samples = int(facts["samples"])
    else:
        samples = sample_count(data, read_channels(data)) if time is None else time.shape[0]
    if rate is not None:
        duration = max(samples - 1, 0) / float(rate)
    elif time is not None and time.shape[0]:
        duration = float(time[-1]) - float(time[0])
    complete = bool(facts.get("complete", False))
    kind = text_of(facts.get("kind", ""))
    for channel in data:
        item(data, channel, stored=False)  # links out of the file are refused
    try:
        peaks, outline = _peaks(entry, data, samples, kind)
    except UNREADABLE as error:
        # a damaged part of a long run; the rest of the file can be read
        log.info("%s: its peaks cannot be read: %s", path, error)
        peaks, outline = {}, ""
    events = read_events(path, entry)[:EVENTS_MAX]
    return Entry(
        path=name,
        bytes=size,
        kind=kind,
        title=_text(entry, "title"),
        start_time=_text(entry, "start_time"),
        start_is_import=_start_is_import(entry),
        samples=samples,
        duration_s=duration,
        complete=complete,
        outcome=text_of(facts.get("outcome", "" if complete else "killed, or still running")),
        texts=read_texts(entry),
        identifier=identifier_of(entry),
        peaks=peaks,
        room=stored_means(entry),
        outline=outline,
        events=[[e.time, e.level, e.message] for e in events],
    )


def _peaks(
    entry: h5py.Group, data: h5py.Group, samples: int, kind: str
) -> tuple[dict[str, float], str]:
    """Return the largest absolute value of each channel, and the outline of the signal."""
    if not samples:
        return {}, ""
    signal = SIGNALS.get(kind, "")
    peaks: dict[str, float] = {}
    outline = ""
    counts = None
    if any(name.endswith(counts_name("")) for name in data):
        counts = Counts(entry)  # as many samples as are stored, whatever the file claims
        if not counts.samples:
            return {}, ""
    for name in PEAKS:
        points = OUTLINE if name == signal else 1
        if counts is not None and name in counts.names:
            _, low, high = counts.overview(name, 0, counts.samples, points)
        elif (row := dataset(data, name)) is not None and row.ndim == 1 and row.size:
            low, high = _reduced(row, points)
        else:
            continue
        known = np.isfinite(low) & np.isfinite(high)
        if not known.any():
            continue
        least, most = float(low[known].min()), float(high[known].max())
        peaks[name] = least if -least > most else most
        if name == signal:
            places = np.arange(low.size)  # readings of an imported file may be missing
            low, high = (np.interp(places, places[known], end[known]) for end in (low, high))
            outline = _outline(low, high, least, most)
    return peaks, outline


def _reduced(row: h5py.Dataset, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return minimum and maximum (n,) of ``row`` in at most about ``points`` bins."""
    step = max(SLICE, -(-row.size // points))
    if row.size <= step:
        values = row[()].astype(np.float64)
        return reduced(values, values, points)
    ends = [
        (np.fmin.reduce(values), np.fmax.reduce(values))
        for values in (row[start : start + step] for start in range(0, row.size, step))
    ]
    low, high = np.array(ends, dtype=np.float64).T
    return reduced(low, high, points)


def _outline(low: np.ndarray, high: np.ndarray, least: float, most: float) -> str:
    span = most - least
    if not np.isfinite(span) or span <= 0.0:
        return ""
    pairs = np.rint((np.stack((low, high), axis=1) - least) / span * 255.0)
    return pairs.astype(np.uint8).tobytes().hex()


def _start_is_import(entry: h5py.Group) -> bool:
    noted = group(entry, "provenance")
    return noted is not None and not is_start_known(read_provenance(noted))


def _text(parent: h5py.Group, name: str) -> str:
    found = dataset(parent, name)
    return "" if found is None else text_of(found[()])


def _cache_of(folder: Path) -> Path | None:
    """Return the file of the cache for ``folder``; None where there is no folder for caches."""
    root = cache_root().path
    key = hashlib.sha256(os.fsencode(folder.resolve())).hexdigest()[:24]
    return None if root is None else root / f"index-{key}.json"


def _load(cache: Path | None) -> dict[str, tuple[tuple[int, int], Entry]]:
    """Return the cache; empty where it is missing, of another version, or damaged."""
    if cache is None:
        return {}
    try:
        kept = parse_json(read_input(cache, "index", _CACHE_MAX))
        if kept["format"] != KEPT:
            return {}
        return {
            str(name): ((int(size), int(changed)), _entry_from(facts))
            for name, size, changed, facts in kept["files"]
        }
    except (InputError, ValueError, TypeError, KeyError, RecursionError):
        return {}


def _entry_from(facts: dict[str, Any]) -> Entry:
    """Return the entry with ``facts``. Raises ``TypeError`` for those that no entry has."""
    entry = Entry(**facts)
    for name, kind in _TYPES.items():
        if not isinstance(getattr(entry, name), kind):
            raise TypeError(f"{name} is {getattr(entry, name)!r}")
    if not all(isinstance(text, str) for text in entry.texts.values()):
        raise TypeError(f"texts are {entry.texts!r}")
    return entry


def _save(
    cache: Path | None, entries: dict[str, Entry], stamps: dict[str, tuple[int, int]]
) -> None:
    if cache is None:
        return
    files = [[name, *stamps[name], asdict(entry)] for name, entry in entries.items()]
    try:
        cache.parent.mkdir(parents=True, exist_ok=True)
        with replaced_when_done(cache, overwrite=True) as partial:
            partial.write_text(json.dumps({"format": KEPT, "files": files}), encoding="utf-8")
    except (OSError, InputError):
        # without the cache the next index is only slower
        return


def lines(entries: Sequence[Entry]) -> list[str]:
    """Return a line for each entry: start in local time, length, path and content."""
    if not entries:
        return ["no recordings"]
    shown = []
    for entry in entries:
        if entry.trouble:
            shown.append(f"{'not read':<25}  {'':>10}  {entry.path}: {entry.trouble}")
            continue
        length = "" if entry.duration_s is None else f"{entry.duration_s:.6g} s"
        texts = [entry.texts.get(key, "") for key, field in TEXTS.items() if field.column]
        facts = [entry.title, *_peaks_text(entry), *texts]
        if not entry.complete:
            facts.append(f"INCOMPLETE: {entry.outcome}")
        if entry.start_is_import:
            facts.append("the time is that of the import")
        line = ", ".join(fact for fact in facts if fact)
        shown.append(f"{local_time(entry.start_time):<25}  {length:>10}  {entry.path}: {line}")
    return shown


def _peaks_text(entry: Entry) -> list[str]:
    shown = (("voltage_command", 1e-3, "kV"), ("displacement", 1e3, "mm"))
    return [
        f"{entry.peaks[name] * factor:.3g} {unit}"
        for name, factor, unit in shown
        if name in entry.peaks
    ]
