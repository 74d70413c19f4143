"""Output files: checked before anything is changed, and replaced as a whole."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event

from dearig.errors import InputError
from dearig.recording.lock import (
    ATTEMPTS,
    FileLock,
    lock_existing,
    lock_or_none,
    refuse_in_use,
)

__all__ = [
    "check_output",
    "check_recording_name",
    "errno_of",
    "file_sha256",
    "journal_of",
    "keep_permissions",
    "old_of",
    "one_line",
    "put_back",
    "replaced_when_done",
    "set_aside",
    "system_text",
    "write_whole",
]

#: Largest length of a file's name in bytes; it leaves space for the ending .journal.
NAME_MAX = 255 - len(".journal")
#: Beginning of the names of outputs that are not finished; random digits and an ending follow.
PARTIAL = ".dearig-"
_PARTIAL_NAME = re.compile(re.escape(PARTIAL) + r"[0-9a-f]{16}\.partial")
#: s after which an unfinished output counts as abandoned in a folder without locks.
ABANDONED = 86400.0


def check_recording_name(path: Path) -> None:
    """Raise ``InputError`` for a recording that is to have another name than an HDF5 file's."""
    if path.suffix.lower() not in (".h5", ".hdf5", ".nxs"):
        raise InputError(
            f"{path} would be a recording, which is an HDF5 file; end its name in .h5 (a recording "
            f"is exported to CSV, MAT or Parquet)",
            option="out",
        )


def check_output(path: str | Path, overwrite: bool, *sources: str | Path) -> Path:
    """Return ``path`` if it may be written to; otherwise raise ``InputError``.

    ``sources`` are input files, which are never overwritten. A file that a run records to, or that
    another program changes, may not be written to, and neither may a symbolic link: its target
    could be anything. Nothing is changed.
    """
    path = Path(path)
    if str(path) == "-":  # for other programs standard output; a file of that name is a trap
        raise InputError(
            "- is not the name of a file: only JSON can be written to standard output; give the "
            "output a name"
        )
    try:
        if path.is_symlink():
            raise InputError(
                f"{path} is a symbolic link to {path.readlink()}; give the name of the file itself"
            )
        if path.is_dir():
            raise InputError(f"{path} is a folder; give the name of a file in it")
        if path.exists():
            if any(Path(s).exists() and path.samefile(s) for s in sources):
                raise InputError(f"{path} is the input file; choose another name for the output")
            if not path.is_file():
                # replacing a device (/dev/null) would take it from the whole machine
                raise InputError(f"{path} is not a regular file; give the name of one")
            if not overwrite:
                raise _exists(path)
            refuse_in_use(path)
        if len(os.fsencode(path.name)) > NAME_MAX:
            raise InputError(
                f"{path} cannot be written: its name has more than {NAME_MAX} bytes; choose a "
                f"shorter one"
            )
        if not path.parent.is_dir():
            raise InputError(f"{path} cannot be written: there is no folder {path.parent}")
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be written: {system_text(error)}") from error
    if not os.access(path.parent, os.W_OK):
        raise InputError(
            f"{path} cannot be written: the folder {path.parent} may not be written to; "
            f"choose another folder"
        )
    return path


def _exists(path: Path) -> InputError:
    return InputError(f"{path} exists already; choose another name", option="force")


def errno_of(error: Exception) -> int | None:
    """Return the system's error number, also where HDF5 has it only in its text."""
    if isinstance(error, OSError) and error.errno:
        return error.errno
    found = re.search(r"errno = (\d+)", str(error))
    return int(found[1]) if found else None


def system_text(error: Exception) -> str:
    """Return the system's text of ``error``, without its number and without the path."""
    number = errno_of(error)
    return one_line(error) if number is None else os.strerror(number)


def one_line(error: Exception, most: int = 300) -> str:
    """Return another library's error text as part of a sentence: printable and short."""
    text = " ".join("".join(c if c.isprintable() else " " for c in str(error)).split())
    return text if len(text) <= most else f"{text[: most - 3]}..."


@contextmanager
def replaced_when_done(path: Path, overwrite: bool) -> Iterator[Path]:
    """Yield an empty file in the folder of ``path`` to write to; it becomes ``path`` at the end.

    This happens in one step, and only if the body succeeds. The file has a random name that no one
    could have prepared, a link for instance. A file that is replaced keeps its permissions. Raises
    ``InputError`` for a ``path`` that is in use, and without ``overwrite`` for one that exists
    meanwhile. The body should only write: an ``OSError`` in it becomes an ``InputError``, and so
    does a ``RuntimeError``, by which HDF5 reports some full disks.
    """
    try:
        _remove_abandoned(path.parent)
        lock = _create_partial(path.parent)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {system_text(error)}") from error
    try:
        yield lock.path
        if not stat.S_ISREG(lock.path.lstat().st_mode):
            raise InputError(f"{path} cannot be written: {lock.path} is no longer a regular file")
        _publish(lock, path, overwrite)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{path} cannot be written: {system_text(error)}") from error
    finally:
        # what cannot be removed now is removed with the next output in this folder
        lock.remove()


def write_whole(path: Path, content: bytes) -> None:
    """Write ``content`` to ``path``, in place of what is there. Raises ``InputError``."""
    out = check_output(path, overwrite=True)
    with replaced_when_done(out, overwrite=True) as partial:
        partial.write_bytes(content)


def _create_partial(folder: Path) -> FileLock:
    """Create an empty file with a random name in ``folder`` and lock it, where there are locks."""
    while True:
        path = folder / f"{PARTIAL}{secrets.token_hex(8)}.partial"
        flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)
        fd = os.open(path, flags | getattr(os, "O_BINARY", 0), 0o666)
        try:
            lock = lock_or_none(fd, path)
        except OSError:
            path.unlink(missing_ok=True)
            raise
        # None if another program took the file for an abandoned one before it was locked
        if lock is not None:
            return lock


def _remove_abandoned(folder: Path) -> None:
    """Remove the unfinished outputs of ended programs in ``folder``: no one holds their locks."""
    with os.scandir(folder) as items:
        found = [Path(item.path) for item in items if _PARTIAL_NAME.fullmatch(item.name)]
    for path in found:
        # another program may remove it too, or it may belong to somebody else
        with suppress(OSError):
            fd = os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
            lock = lock_or_none(fd, path)
            if lock is None:
                continue
            if lock.held or time.time() - lock.status.st_mtime > ABANDONED:
                lock.remove()
            lock.release()


def _publish(partial: FileLock, path: Path, overwrite: bool) -> None:
    """Rename the file of ``partial`` to ``path``. Raises ``InputError`` and ``OSError``."""
    for _ in range(ATTEMPTS):
        try:
            with lock_existing(path) as there:
                if not overwrite:
                    raise _exists(path)
                keep_permissions(path, partial.path)
                if sys.platform == "win32":
                    # an open file can be neither renamed nor replaced there
                    there.release()
                    partial.release()
                partial.path.replace(path)
                # it belonged to the file that was replaced
                journal_of(path).unlink(missing_ok=True)
                return
        except FileNotFoundError:
            if not partial.path.exists():
                raise
        try:
            if sys.platform == "win32":
                partial.release()
            move(partial.path, path)
        except FileExistsError:
            continue  # another program has created it since
        return
    raise InputError(f"{path} is replaced again and again by other programs; try again later")


def keep_permissions(old: Path, new: Path) -> None:
    """Give the file ``new`` the owner and the permissions of ``old``, where allowed."""
    of, mine = old.lstat(), new.lstat()
    if sys.platform != "win32" and (of.st_uid, of.st_gid) != (mine.st_uid, mine.st_gid):
        # only an administrator may give a file away
        with suppress(PermissionError):
            os.chown(new, of.st_uid, of.st_gid)
    new.chmod(stat.S_IMODE(of.st_mode))


def move(source: Path, target: Path) -> None:
    """Rename a file, never in place of another. Raises ``FileExistsError``, ``OSError``."""
    if sys.platform == "win32":
        source.rename(target)  # refuses a name that is taken
        return
    try:
        os.link(source, target)
    except (FileExistsError, FileNotFoundError):
        raise
    except OSError:
        # a file system without hard links: the name is taken by an empty file first
        os.close(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL))
        source.replace(target)
    else:
        source.unlink()


def old_of(path: Path) -> Path:
    """Return the name of the file at ``path`` while another one is written in its place."""
    return path.with_name(f"{path.name}.old")


def journal_of(path: Path) -> Path:
    """Return the path of the journal of the file ``path``."""
    return path.with_name(f"{path.name}.journal")


def set_aside(path: Path) -> Path | None:
    """Rename the file at ``path`` to ``FILE.old`` until it is replaced; None if there is none.

    Raises ``InputError`` if it is in use, or if there is a ``FILE.old`` already; ``OSError``.
    """
    try:
        lock = lock_existing(path)
    except FileNotFoundError:
        return None
    with lock:
        old = old_of(path)
        if old.exists():
            raise InputError(
                f"{old} exists already, left by a run that ended before its first samples: rename "
                f"it or delete it"
            )
        if sys.platform == "win32":
            lock.release()  # an open file cannot be renamed there
        return path.rename(old)


def put_back(old: Path | None, path: Path) -> bool:
    """Move the file that was set aside as ``old``, if any, back to ``path``.

    Returns False if the name was taken meanwhile; the file is still at ``old`` then.
    """
    try:
        if old is not None and old.exists():
            move(old, path)
    except FileExistsError:
        return False
    return True


def file_sha256(path: Path, stop: Event | None = None) -> str:
    """Return the SHA-256 of a file, in hexadecimal; of a part of it once ``stop`` is set."""
    digest = hashlib.sha256()
    with path.open("rb", buffering=0) as stream:
        while (stop is None or not stop.is_set()) and (piece := stream.read(2**20)):
            digest.update(piece)
    return digest.hexdigest()
