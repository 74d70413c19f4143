"""Locks on files: held by a run for its life, and taken by everything that changes a file.

A lock covers one byte far beyond the end of the file. So no read or write meets it, not even where
a network server enforces it, and HDF5's own locks of the whole file are independent of it. The
system releases a lock when its process ends, however it ends: there are no stale locks.

Linux has open file description locks (``F_OFD_SETLK``), which belong to one opening of the file;
the older ones of ``lockf`` are lost when the process closes any other opening. Windows has
``LockFileEx``. Other systems have ``flock`` on the whole file; a run holds a shared lock there, so
that HDF5 programs can still read its file.
"""

from __future__ import annotations

import errno
import os
import sys
import time
import weakref
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from dearig.errors import InputError

if sys.platform == "win32":
    import ctypes
    import msvcrt
    from ctypes import wintypes
else:
    import fcntl
    import struct

__all__ = [
    "NO_LOCKS",
    "FileLock",
    "ReplacedError",
    "create_locked",
    "lock_existing",
    "lock_or_none",
    "refuse_in_use",
]

#: Offset of the locked byte.
LOCKED_BYTE = 2**62
#: s since the last change within which a recording in a folder without locks counts as in use.
STILL_RUNNING = 10.0
#: Attempts at locking a file that another program replaces meanwhile.
ATTEMPTS = 10
#: Variable that switches HDF5's locks off, and the refusal of folders without locks.
VARIABLE = "HDF5_USE_FILE_LOCKING"

#: What to do in a folder whose file system has no locks.
NO_LOCKS = f"record to a local disk, or set {VARIABLE}=FALSE to do without locks"

#: Error numbers of a lock that another program holds.
_HELD = (errno.EAGAIN, errno.EACCES, errno.EWOULDBLOCK)
#: Error numbers of a file system without locks.
_UNSUPPORTED = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
_HDF5 = b"\x89HDF\r\n\x1a\n"
_OPEN = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)


class _NoLocksError(OSError):
    """The file system has no locks."""


class ReplacedError(InputError):
    """Another file, or another content, is where the file was that should be changed."""


class FileLock:
    """An open file that stays the same file whatever happens to its name; a context manager.

    ``held`` is False in a folder without locks.
    """

    def __init__(self, fd: int, path: Path, held: bool) -> None:
        self.path = path
        self.held = held
        self.fd = fd
        #: Size, owner, permissions and identity of the file when it was opened.
        self.status = os.fstat(fd)
        # closing the descriptor releases the lock
        self._close = weakref.finalize(self, os.close, fd)

    def is_at(self, path: Path) -> bool:
        """Return True if ``path`` is the name of this file, and not of another one by now.

        Files are compared by device and inode, on Windows by volume and file index. Neither is used
        again while the file is open. Raises ``OSError`` where the folder does not answer.
        """
        try:
            return os.path.samestat(path.lstat(), self.status)
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Release the lock; calling it again is fine."""
        self._close()

    def remove(self) -> None:
        """Delete the file, unless another one has its name by now, and release the lock.

        A file that cannot be deleted stays: an error that led here is not hidden by another one.
        """
        with suppress(OSError):
            own = self.is_at(self.path)
            if sys.platform == "win32":
                self.release()  # an open file cannot be deleted there
            if own:
                self.path.unlink(missing_ok=True)
        self.release()

    def __enter__(self) -> FileLock:
        """Return the lock."""
        return self

    def __exit__(self, *_: object) -> None:
        """Release the lock."""
        self.release()


def create_locked(path: Path) -> FileLock:
    """Create the file ``path``, which must not exist, and lock it for a run.

    Raises ``FileExistsError`` for a name that is taken, also by a link, another ``OSError``, and
    ``InputError`` in a folder without locks; then no file is left behind.
    """
    fd = os.open(path, _OPEN | os.O_CREAT | os.O_EXCL, 0o666)
    lock = FileLock(fd, path, held=False)
    taken, wanted = False, not _switched_off()
    try:
        lock.held = _lock(fd, exclusive=False)
        taken = not lock.held or not lock.is_at(path)
        if wanted:
            _check_whole_file_lock(fd)
    except _NoLocksError as error:
        if wanted:
            lock.remove()
            raise InputError(
                f"{path} cannot be written: its folder has no file locks, which keep other "
                f"programs from changing the recording during the run; {NO_LOCKS}"
            ) from error
    except BaseException:
        lock.remove()
        raise
    if taken:
        lock.remove()
        raise InputError(f"{path} was taken by another program; choose another name")
    return lock


def lock_existing(path: Path, now: Callable[[], float] = time.time) -> FileLock:
    """Lock the file at ``path``, to change or to replace it.

    In a folder without locks, a recording that changed within the last ten seconds counts as in use
    (``now`` is Unix time in s). Raises ``InputError`` for a file in use, and ``OSError``.
    """
    for _ in range(ATTEMPTS):
        fd, writable = _open_any(path)
        lock = FileLock(fd, path, held=False)
        try:
            # a file that may not be written to can be replaced; its lock can only be looked at
            lock.held = _lock(fd, exclusive=True) if writable else not _is_locked(fd)
        except _NoLocksError:
            _refuse_recent(lock, now)
        else:
            if not lock.held:
                lock.release()
                raise InputError(_in_use(path))
        if lock.is_at(path):
            return lock
        lock.release()
    raise InputError(f"{path} is replaced again and again by other programs; try again later")


def lock_or_none(fd: int, path: Path) -> FileLock | None:
    """Lock the open file ``fd`` at ``path``; None if another program has locked or replaced it.

    A folder without locks gives one that is not held. ``fd`` is closed with the lock.
    """
    lock = FileLock(fd, path, held=False)
    try:
        lock.held = _lock(fd, exclusive=True)
    except _NoLocksError:
        return lock
    if lock.held and lock.is_at(path):
        return lock
    lock.release()
    return None


def refuse_in_use(path: Path) -> None:
    """Raise ``InputError`` if a run, or another program, has locked the existing file ``path``.

    Nothing is locked. A file whose lock cannot be looked at counts as not in use.
    """
    try:
        fd, _ = _open_any(path)
        try:
            locked = _is_locked(fd)
        finally:
            os.close(fd)
    except OSError:
        return
    if locked:
        raise InputError(_in_use(path))


def _in_use(path: Path) -> str:
    return (
        f"{path} is in use: a run records to it, or another program changes it; wait until that "
        f"has ended, or choose another name"
    )


def _open_any(path: Path) -> tuple[int, bool]:
    """Open ``path`` for writing, or else for reading; the descriptor, and whether it is writable.

    Raises ``OSError``, for a link too.
    """
    try:
        return os.open(path, _OPEN), True
    except PermissionError:
        return os.open(path, _OPEN & ~os.O_RDWR | os.O_RDONLY), False


def _switched_off() -> bool:
    """Return True if the operator has switched the locks off, as HDF5 reads it."""
    return os.environ.get(VARIABLE, "").upper() in ("FALSE", "0", "BEST_EFFORT")


def _refuse_recent(lock: FileLock, now: Callable[[], float]) -> None:
    """Raise ``InputError`` for an HDF5 file that changed within the last ten seconds."""
    with lock.path.open("rb") as stream:
        if stream.read(len(_HDF5)) != _HDF5:
            return
    age = now() - lock.status.st_mtime
    if age < STILL_RUNNING:
        lock.release()
        raise InputError(
            f"{lock.path} changed {max(age, 0.0):.1f} s ago and may still be recorded to; its "
            f"folder has no file locks that would tell: wait until the run has ended, and then "
            f"{STILL_RUNNING:g} s"
        )


if sys.platform == "win32":
    _FAIL_AT_ONCE, _EXCLUSIVE, _LOCK_VIOLATION = 1, 2, 33

    class _Overlapped(ctypes.Structure):
        _fields_ = (
            ("internal", ctypes.c_void_p),
            ("internal_high", ctypes.c_void_p),
            ("offset", wintypes.DWORD),
            ("offset_high", wintypes.DWORD),
            ("event", wintypes.HANDLE),
        )

    def _lock(fd: int, exclusive: bool) -> bool:  # noqa: ARG001  (readers meet no byte there)
        """Lock ``fd``; False if another opening holds the lock."""
        kernel = ctypes.WinDLL("kernel32", use_last_error=True)
        at = _Overlapped(offset=LOCKED_BYTE & 0xFFFFFFFF, offset_high=LOCKED_BYTE >> 32)
        flags = _FAIL_AT_ONCE | _EXCLUSIVE
        handle = wintypes.HANDLE(msvcrt.get_osfhandle(fd))
        if kernel.LockFileEx(handle, flags, 0, 1, 0, ctypes.byref(at)):
            return True
        number = ctypes.get_last_error()
        if number == _LOCK_VIOLATION:
            return False
        raise _NoLocksError(number, ctypes.FormatError(number))

    def _is_locked(fd: int) -> bool:
        """Return True if another opening holds the lock. The caller closes ``fd`` afterwards."""
        return not _lock(fd, exclusive=True)

    def _check_whole_file_lock(fd: int) -> None:
        """Do nothing: HDF5 on Windows has no locks."""

else:
    _OFD = hasattr(fcntl, "F_OFD_SETLK")
    #: struct flock of Linux: type, whence, start, length, process (0 for these locks).
    _FLOCK = "hhqqi"

    def _region(kind: int) -> bytes:
        return struct.pack(_FLOCK, kind, os.SEEK_SET, LOCKED_BYTE, 1, 0)

    def _lock(fd: int, exclusive: bool) -> bool:
        """Lock ``fd``; False if another opening holds the lock."""
        try:
            if _OFD:
                kind = fcntl.F_WRLCK if exclusive else fcntl.F_RDLCK
                fcntl.fcntl(fd, fcntl.F_OFD_SETLK, _region(kind))
            else:
                fcntl.flock(fd, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in _HELD:
                return False
            raise _without_locks(error) from error
        return True

    def _is_locked(fd: int) -> bool:
        """Return True if another opening holds the lock. The caller closes ``fd`` afterwards."""
        if not _OFD:
            return not _lock(fd, exclusive=True)
        try:
            there = fcntl.fcntl(fd, fcntl.F_OFD_GETLK, _region(fcntl.F_WRLCK))
        except OSError as error:
            raise _without_locks(error) from error
        return bool(struct.unpack(_FLOCK, there)[0] != fcntl.F_UNLCK)

    def _check_whole_file_lock(fd: int) -> None:
        """Raise ``_NoLocksError`` unless the file can be locked as other HDF5 programs lock it.

        They cannot open a file that they cannot lock, as in a network folder without a lock server.
        """
        if not _OFD:
            return  # it has been locked in this way
        try:
            fcntl.flock(fd, fcntl.LOCK_SH | fcntl.LOCK_NB)
            fcntl.flock(fd, fcntl.LOCK_UN)
        except BlockingIOError:
            return  # another program reads it: locks work
        except OSError as error:
            raise _without_locks(error) from error

    def _without_locks(error: OSError) -> OSError:
        if error.errno in _UNSUPPORTED:
            return _NoLocksError(error.errno, os.strerror(error.errno or 0))
        return error
