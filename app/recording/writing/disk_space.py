"""Disk space for a run: the estimate, the free space, and advice on errors of the disk."""

from __future__ import annotations

import errno
import math
import shutil
from pathlib import Path
from types import MappingProxyType

from dearig.errors import InputError
from dearig.recording.content.layout import counts_type
from dearig.recording.files import errno_of, system_text
from dearig.recording.lock import NO_LOCKS
from dearig.recording.writing.finish import OVERVIEW, PHYSICAL_MAX

__all__ = ["LEFT_FREE", "advice", "check_room", "estimate_bytes", "free_bytes"]

#: Bytes that a run leaves free: a full disk harms other programs too.
LEFT_FREE = 2**26

#: Metadata, texts and the first chunks of everything.
FIXED = 200_000
#: Times the bytes of a count: the count itself, minima and maxima over bins, checksums, indexes.
PER_COUNT = 1.0 + 2.0 / 64.0 + 2.0 / 4096.0 + 0.001

#: Bytes of a deflated physical value of a noise over the whole range of the converter, and of the
#: time of a sample at a rate that is not a decimal number, with 10 % more.
VALUE, TIME = 7.3, 7.0

#: Error number of the operating system: what happened, and what to do.
_ADVICE = MappingProxyType(
    {
        errno.ENOSPC: "the disk is full: free some space, or record to another disk",
        errno.EROFS: "the disk is read-only: record to another disk",
        errno.EACCES: "the folder may not be written to: choose another folder",
        errno.EPERM: "the folder may not be written to: choose another folder",
        errno.EFBIG: "the disk, or a limit, allows no file of this size: record to another disk",
        errno.EIO: "the disk fails, or was removed: record to another disk",
        errno.ENOENT: "the disk, or the folder, was removed: record to another disk",
        errno.ENODEV: "the disk was removed: record to another disk",
        errno.ENXIO: "the disk was removed: record to another disk",
        errno.ENAMETOOLONG: "the path is too long: choose a shorter one",
        errno.ENOLCK: f"the folder has no file locks: {NO_LOCKS}",
        # these codes are missing on some systems
        getattr(errno, "EDQUOT", -1): "your disk quota is used up: free some space, or record to "
        "another disk",
        getattr(errno, "ESTALE", -2): "the network disk is gone: record to a local one",
    }
)


def estimate_bytes(channels: int, rate: float, samples: int, average: int = 1) -> int:
    """Return the bytes that a run of ``samples`` samples of ``channels`` channels needs.

    They come at ``rate`` Hz, each the mean of ``average`` conversions. At no time from the first
    block to the finished file it is larger, whatever the readings are.
    """
    size = FIXED + PER_COUNT * counts_type(average).itemsize * channels * samples
    # computer's clock and events
    size += 100.0 * samples / rate
    if samples <= PHYSICAL_MAX:
        # readings that are all noise: physical values, and a journal of the bytes of the counts
        # that are replaced, old and new
        size += (VALUE + 2.0 * counts_type(average).itemsize) * channels * samples
        size += TIME * samples + FIXED
    else:
        size += 16.0 * (channels + 1) * OVERVIEW
    return int(size)


def free_bytes(path: str | Path) -> int:
    """Return the free bytes of the disk of ``path``; fast enough to call during a run.

    Raises ``InputError`` if the folder does not exist (any more).
    """
    folder = Path(path).absolute().parent
    try:
        return shutil.disk_usage(folder).free
    except OSError as error:
        raise InputError(f"the disk of {path} does not answer: {system_text(error)}") from error


def check_room(
    path: str | Path, channels: int, rate: float, samples: int, average: int = 1
) -> None:
    """Raise ``InputError`` unless such a run fits on the disk of ``path``."""
    needed, free = estimate_bytes(channels, rate, samples, average), free_bytes(path)
    if needed + LEFT_FREE > free:
        raise InputError(
            f"the run needs {_size(needed)} and the disk of {path} has {_size(free)} free, of "
            f"which {_size(LEFT_FREE)} must stay free: free some space, record to another disk, or "
            f"shorten the run"
        )


def _size(amount: float) -> str:
    units = ("B", "kB", "MB", "GB", "TB")
    power = min(int(math.log10(max(amount, 1.0)) / 3.0), len(units) - 1)
    return f"{amount / 1000.0**power:.3g} {units[power]}"


def advice(error: Exception) -> str:
    """Return advice on an ``error`` of the disk or of HDF5."""
    number = errno_of(error)
    otherwise = "check that the disk has space and that no other program has the file open"
    return otherwise if number is None else _ADVICE.get(number, otherwise)
