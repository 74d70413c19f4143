"""Index of a folder of recordings: a summary of each file, cached until the file changes."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import Any

import h5py

from dearig.errors import InputError
from dearig.model.trusted_folder import cache_root
from dearig.recording.files import in_words, replaced_when_done
from dearig.recording.layout import FORMAT
from dearig.recording.opening import read_from
from dearig.recording.physical import read_channels, sample_count
from dearig.recording.safe import Refused, dataset, group
from dearig.recording.text import text_of
from dearig.recording.timestamps import local_time

__all__ = ["ENDINGS", "Entry", "glance", "index_folder", "lines"]

ENDINGS = (".h5", ".hdf5", ".nxs")
#: Version of the cache; another one is not read.
KEPT = "dearig-index/2"


@dataclass(frozen=True)
class Entry:
    """Summary of one file.

    ``trouble`` is the reason why it is not a recording, or "". ``passing``: the reason is one of
    the system, not of the file, which may be readable the next time.
    """

    path: str
    bytes: int
    kind: str = ""
    title: str = ""
    start_time: str = ""
    samples: int = 0
    duration_s: float | None = None
    complete: bool = False
    outcome: str = ""
    rig: str = ""
    film_id: str = ""
    operator: str = ""
    trouble: str = ""
    passing: bool = False


#: Types of the facts in the cache.
_TYPES: Mapping[str, Any] = MappingProxyType(
    {
        **{f.name: str for f in fields(Entry)},
        "bytes": int,
        "samples": int,
        "duration_s": (int, float, NoneType),
        "complete": bool,
        "passing": bool,
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
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder} is {'not a folder' if folder.exists() else 'not there'}")
    cache = _cache_of(folder) if cache is None else cache
    kept = _load(cache)
    found, unread = _files(folder)
    entries: dict[str, Entry] = {}
    stamps: dict[str, tuple[int, int]] = {}
    fresh = 0
    for i, (name, size, changed) in enumerate(found):
        stamp, entry = kept.get(name, ((-1, -1), None))
        if entry is None or stamp != (size, changed):
            entry = glance(folder / name, name, size)
            fresh += 1
            if progress is not None:
                progress((i + 1) / len(found))
        entries[name], stamps[name] = entry, (size, changed)
    # what cannot be read now may be readable the next time
    known = {name: entry for name, entry in entries.items() if not entry.passing}
    if fresh or len(kept) != len(known):
        _save(cache, known, stamps)
    return sorted([*entries.values(), *unread], key=lambda entry: entry.path)


def _files(folder: Path) -> tuple[list[tuple[str, int, int]], list[Entry]]:
    """Return the files that may be recordings, and an entry for each folder that cannot be read.

    Each file has its relative path, its size, and the time of its last change in ns.
    """
    # text is faster than Path: there may be ten thousand files
    found: list[tuple[str, int, int]] = []
    unread: list[Entry] = []
    waiting = [""]
    while waiting:
        here = waiting.pop()
        try:
            with os.scandir(folder / here) as items:
                for item in items:
                    name = f"{here}{item.name}"
                    if item.is_dir(follow_symlinks=False):
                        waiting.append(f"{name}/")
                    elif name.lower().endswith(ENDINGS) and item.is_file():
                        about = item.stat()
                        found.append((name, about.st_size, about.st_mtime_ns))
        except OSError as error:
            reason = f"{folder / here} cannot be read: {in_words(error)}"
            if not here:
                raise InputError(reason) from error
            unread.append(Entry(here, 0, trouble=reason, passing=True))
    return sorted(found), unread


def glance(path: Path, name: str, size: int) -> Entry:
    """Return the summary of the file at ``path``; its samples are not read."""
    try:
        return read_from(path, lambda file: _entry(file, name, size))
    except InputError as error:
        # HDF5 raises them for the errors of the disk
        passing = isinstance(error.__cause__, OSError | MemoryError | RuntimeError)
        return Entry(name, size, trouble=str(error), passing=passing)


def _entry(file: h5py.File, name: str, size: int) -> Entry:
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
    noted = group(entry, "provenance")
    said = {} if noted is None else noted.attrs
    sample = group(entry, "sample")
    complete = bool(facts.get("complete", False))
    return Entry(
        path=name,
        bytes=size,
        kind=text_of(facts.get("kind", "")),
        title=_text(entry, "title"),
        start_time=_text(entry, "start_time"),
        samples=samples,
        duration_s=duration,
        complete=complete,
        outcome=text_of(facts.get("outcome", "" if complete else "killed, or still running")),
        rig=text_of(said.get("rig", "")),
        film_id="" if sample is None else _text(sample, "name"),
        operator=text_of(said.get("operator", "")),
    )


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
        kept = json.loads(cache.read_text("utf-8"))
        if kept["format"] != KEPT:
            return {}
        return {
            str(name): ((int(size), int(changed)), _entry_from(facts))
            for name, size, changed, facts in kept["files"]
        }
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return {}


def _entry_from(facts: dict[str, Any]) -> Entry:
    """Return the entry with ``facts``. Raises ``TypeError`` for those that no entry has."""
    entry = Entry(**facts)
    for name, kind in _TYPES.items():
        if not isinstance(getattr(entry, name), kind):
            raise TypeError(f"{name} is {getattr(entry, name)!r}")
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
        facts = [entry.title, entry.rig, entry.film_id, entry.operator]
        if not entry.complete:
            facts.append(f"INCOMPLETE: {entry.outcome}")
        told = ", ".join(fact for fact in facts if fact)
        shown.append(f"{local_time(entry.start_time):<25}  {length:>10}  {entry.path}: {told}")
    return shown
