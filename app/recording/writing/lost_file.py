"""The file of a run that another program deletes, replaces, moves or overwrites.

The run has the file open, so on most systems its content outlives its name. Windows lets no one
delete or rename a file that is open.
"""

from __future__ import annotations

import os
import sys
from itertools import count
from pathlib import Path

from dearig.errors import DiskFault
from dearig.recording.lock import FileLock, create_locked

__all__ = ["LostFile", "UnsavedFile", "find_loss", "free_name", "rescued"]

#: Bytes copied at a time.
PIECE = 2**22


class LostFile(DiskFault):
    """The file of a run is not what and where it was; ``intact`` where its content is."""

    intact = True


class UnsavedFile(DiskFault):
    """The content of a lost file is gone too; ``clause`` says so without how it was lost."""

    clause = ""


def find_loss(lock: FileLock, path: Path, size: int, mark: tuple[int, bytes]) -> LostFile | None:
    """Return what has happened to the locked file of a run at ``path``, None if nothing has.

    It had ``size`` bytes or more, and has the bytes of ``mark`` at an offset that no later write
    changes. Raises ``OSError`` where the disk does not answer.
    """
    now = os.fstat(lock.fd)
    offset, expected = mark
    os.lseek(lock.fd, offset, os.SEEK_SET)
    if now.st_size < size or os.read(lock.fd, len(expected)) != expected:
        loss = LostFile(f"another program cut {path} short, or wrote to it, during the run")
        loss.intact = False
        return loss
    if lock.is_at(path):
        return None
    if now.st_nlink == 0 and path.exists():
        return LostFile(f"another file has taken the place of {path} during the run")
    if now.st_nlink == 0:
        return LostFile(f"{path} was deleted by another program during the run")
    place = _place(lock)
    where = f" to {place}" if place else ""
    return LostFile(f"{path} was moved{where} during the run, alone or with its folder")


def rescued(lock: FileLock, path: Path) -> tuple[Path, FileLock]:
    """Return path and lock of the content of ``lock``'s file, which is no longer at ``path``.

    That is the file itself where it was moved to, if the system tells, or else a copy next to
    ``path``; where its folder was deleted too, in the next one above that is there. Raises
    ``OSError`` where it cannot be copied.
    """
    place = _place(lock)
    if place is not None:
        return place, lock
    if not path.parent.is_dir():
        folders = path.absolute().parents
        path = next(f for f in folders if f.is_dir()) / path.name
    saved = free_name(path, "saved")
    copy = create_locked(saved)
    try:
        os.lseek(lock.fd, 0, os.SEEK_SET)
        with saved.open("r+b") as stream:
            while piece := os.read(lock.fd, PIECE):
                stream.write(piece)
    except BaseException:
        saved.unlink()
        copy.release()
        raise
    return saved, copy


def free_name(path: Path, word: str) -> Path:
    """Return a name next to ``path`` that no file has: ``run-saved.h5``, ``run-saved-2.h5``."""
    for number in count(1):
        ending = word if number == 1 else f"{word}-{number}"
        name = path.with_name(f"{path.stem}-{ending}{path.suffix}")
        if not os.path.lexists(name):
            return name
    raise AssertionError("there are more numbers")


def _place(lock: FileLock) -> Path | None:
    """Return the present path of the file of ``lock``, None if it has none or no one tells."""
    try:
        if sys.platform == "linux":
            place = Path(f"/proc/self/fd/{lock.fd}").readlink()
        elif sys.platform == "darwin":
            import fcntl

            raw = fcntl.fcntl(lock.fd, fcntl.F_GETPATH, bytes(1024))
            place = Path(os.fsdecode(raw.rstrip(b"\0")))
        else:
            return None
        return place if lock.is_at(place) else None
    except OSError:
        return None
