"""Recovery of a recording whose run was killed: repaired in place and finished."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import h5py

from dearig.errors import InputError
from dearig.input_file import why_no_file
from dearig.recording.content.journal import carry_out, changed_in_place, whole_journal
from dearig.recording.content.layout import LIBVER, NUMBERED, name_dimensions
from dearig.recording.content.superblock import repair_superblock
from dearig.recording.files import system_text
from dearig.recording.lock import FileLock, lock_existing
from dearig.recording.reading.opening import UNREADABLE, opened
from dearig.recording.reading.reader import is_finished, open_recording
from dearig.recording.writing.finish import finish

__all__ = ["recover"]


def recover(path: str | Path, now: Callable[[], float] = time.time) -> bool:
    """Make the recording at ``path`` readable by any program, with physical values.

    A finished recording of an earlier version gets the dimensions that readers of netCDF need.
    Returns True if the file was changed. It stays marked as incomplete. Bytes that are replaced are
    copied first, so that a kill during the recovery loses nothing. Raises ``InputError`` for a file
    that is not a recording, has no samples, or is in use: a run has locked it, or, in a folder
    without locks, it changed within the last ten seconds (``now`` is Unix time in s).
    """
    path = Path(path)
    if reason := why_no_file(path):
        raise InputError(f"{path} {reason}")
    if path.is_symlink():
        # the journal is next to the file itself
        path = path.resolve()
    open_recording(path)
    try:
        if _is_whole(path) and not _has_old_scales(path):
            return False
        with lock_existing(path, now) as lock:
            # read again: another program may have finished it before it was locked
            samples = open_recording(path).samples
            if _is_whole(path):
                return _mend_scales(path, lock)
            # the run was killed while it closed
            if carry_out(path, lock):
                return True
            finish(
                path,
                lock=lock,
                complete=False,
                outcome=f"killed; {samples} samples recovered",
                ended=None,
                repair=repair_superblock,
                fsync=True,
            )
    except UNREADABLE as error:
        raise InputError(f"{path} cannot be repaired: {system_text(error)}") from error
    return True


def _has_old_scales(path: Path) -> bool:
    """Return True where tables are dimension scales themselves, which netCDF does not read."""
    with opened(path) as file:
        tables = [file["entry"].get(name) for name in NUMBERED]
        return any(isinstance(table, h5py.Dataset) and table.is_scale for table in tables)


def _mend_scales(path: Path, lock: FileLock) -> bool:
    """Name the dimensions of a finished run as this version does; return True if it was needed."""
    if not _has_old_scales(path):
        return False
    with (
        changed_in_place(path, lock, fsync=True) as changes,
        h5py.File(changes, "r+", libver=LIBVER) as file,
    ):
        name_dimensions(file["entry"])
    return True


def _is_whole(path: Path) -> bool:
    return is_finished(path) and whole_journal(path) is None
