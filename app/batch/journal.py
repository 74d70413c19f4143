"""Journal of a campaign: a text file to which lines of JSON are only appended.

Each line is on the disk before what follows from it is done. A line that a kill cut off has no end
of line: it is removed before the next one is written. One process at a time holds the journal's
lock; reading needs none.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import time
from collections.abc import Callable, Iterable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from dearig.clock import UnixTime
from dearig.errors import InputError
from dearig.input_file import parse_json, read_input
from dearig.recording.content.layout import iso_time
from dearig.recording.files import system_text
from dearig.recording.lock import lock_existing

__all__ = ["FORMAT", "JOURNAL", "REQUESTS", "Journal", "append_line", "read_lines"]

#: Name of the journal in the folder of a campaign.
JOURNAL = "campaign.jsonl"
#: Name of the file to which other programs append what they ask of a running campaign.
REQUESTS = "requests.jsonl"
FORMAT = "dearig-campaign-journal/1"
_APPEND = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
#: Bytes of a journal, at most: 10,000 runs of some 2 kB each, ten times over.
BYTES_MAX = 2**28


def read_lines(path: Path, tolerant: bool = False) -> list[dict[str, Any]]:
    """Return the entries of the journal at ``path``; none where there is no file.

    A last line without an end is left out. Raises ``InputError`` for a line that is not an entry;
    with ``tolerant`` its event is "".
    """
    if not path.exists():
        return []
    raw = read_input(path, "journal", BYTES_MAX)
    whole = raw[: raw.rfind(b"\n") + 1]
    found = []
    for i, line in enumerate(whole.splitlines()):
        entry: Any = None
        with contextlib.suppress(ValueError, RecursionError):
            entry = parse_json(line, _finite)
        if not isinstance(entry, dict) or not isinstance(entry.get("event"), str):
            if not tolerant:
                raise InputError(
                    f"{path}, line {i + 1} is not an entry of a journal: the file was changed, or "
                    f"its disk fails"
                )
            entry = {"event": ""}
        found.append(entry)
    return found


def _finite(text: str) -> float:
    """Return a number of a journal. Raises ``ValueError`` for one that is not finite."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def _last_of_arming(entries: Iterable[Mapping[str, Any]]) -> float:
    """Return the latest time in s since 1970 of ``entries`` since the last arming; 0 without."""
    last, until = 0.0, None
    for entry in entries:
        if entry["event"] == "armed" and entry.get("until") != until:
            last, until = 0.0, entry.get("until")
        with contextlib.suppress(ValueError, OverflowError, OSError):
            last = max(last, datetime.fromisoformat(str(entry.get("at"))).timestamp())
    return last


class Journal:
    """The journal of a campaign, locked and open to be appended to; a context manager.

    ``now`` gives Unix time in s, ``clock`` the s that have passed. ``time`` is that by which the
    armed time is judged: it does not go back where the computer's clock is set back, also between
    two sessions. Raises ``InputError`` for a journal that another process holds.
    """

    def __init__(
        self,
        folder: Path,
        now: Callable[[], float] = time.time,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.path = folder / JOURNAL
        self._now, self._clock = now, clock
        try:
            os.close(os.open(self.path, os.O_WRONLY | os.O_CREAT, 0o666))
            self._lock = lock_existing(self.path)
        except OSError as error:
            raise InputError(f"{self.path} cannot be written: {system_text(error)}") from error
        except InputError as error:
            raise InputError(
                f"the campaign in {folder} is running in another process (its journal is locked)",
                command=("watch", str(folder)),
            ) from error
        try:
            self.entries = read_lines(self.path)
            self.time = UnixTime(now, clock, _last_of_arming(self.entries))
            self._drop_torn_line()
            _sync_folder(folder)
        except BaseException:
            self._lock.release()
            raise

    def arm(self, seconds: float) -> float:
        """Return the Unix time in s at which an arming for so many ``seconds`` from now ends."""
        self.time = UnixTime(self._now, self._clock)
        return self.time() + seconds

    def append(self, event: str, **facts: Any) -> dict[str, Any]:
        """Append an entry, which is on the disk when this returns, and return it.

        Raises ``InputError`` where the disk does not take it: then nothing may follow from it.
        """
        entry = {"at": iso_time(self._now()), "event": event, **facts}
        try:
            _write(self._lock.fd, entry)
        except OSError as error:
            raise InputError(
                f"{self.path} cannot be written: {system_text(error)}; the output is at 0 V; free "
                f"some space, then continue the campaign",
                option="resume",
            ) from error
        self.entries.append(entry)
        return entry

    def _drop_torn_line(self) -> None:
        fd = self._lock.fd
        size = os.fstat(fd).st_size
        raw = self.path.read_bytes()
        whole = raw.rfind(b"\n") + 1
        if whole < size:
            os.ftruncate(fd, whole)
        os.lseek(fd, 0, os.SEEK_END)

    def close(self) -> None:
        """Release the journal."""
        self._lock.release()

    def __enter__(self) -> Journal:
        """Return the journal."""
        return self

    def __exit__(self, *_: object) -> None:
        """Release the journal."""
        self.close()


def append_line(path: Path, entry: dict[str, Any]) -> None:
    """Append ``entry`` to the file at ``path``, which several processes may do at once.

    Raises ``InputError``.
    """
    try:
        fd = os.open(path, _APPEND, 0o666)
        try:
            # a line that a kill cut off must not swallow this one
            size = os.fstat(fd).st_size
            if size:
                os.lseek(fd, size - 1, os.SEEK_SET)
                if os.read(fd, 1) != b"\n":
                    os.write(fd, b"\n")
            _write(fd, entry)
        finally:
            os.close(fd)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {system_text(error)}") from error


def _write(fd: int, entry: dict[str, Any]) -> None:
    raw = (json.dumps(entry, allow_nan=False) + "\n").encode()
    while raw:
        raw = raw[os.write(fd, raw) :]
    os.fsync(fd)


def _sync_folder(folder: Path) -> None:
    """Write the folder's list of names through to the disk, where a folder can be opened."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)
