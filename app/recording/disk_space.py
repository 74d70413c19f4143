"""Disk space for a run: the estimate, the free space, and advice on errors of the disk."""

from __future__ import annotations

import errno
import math
import shutil
from pathlib import Path
from types import MappingProxyType

from dearig.errors import InputError
from dearig.recording.files import errno_of, in_words
from dearig.recording.finish import OVERVIEW, PHYSICAL_MAX

__all__ = ["LEFT_FREE", "advice", "check_room", "estimate_bytes", "free_bytes"]

#: Bytes that a run leaves free: a full disk harms other programs too.
LEFT_FREE = 2**26

#: Metadata, texts and the first chunks of everything.
FIXED = 200_000
#: Beside two bytes for each count: least and greatest counts over bins, checksums, indexes.
PER_COUNT = 2.0 * (1.0 + 2.0 / 64.0 + 2.0 / 4096.0 + 0.001)

#: What the operating system calls it, and what to do.
_ADVICE = MappingProxyType(
    {
        errno.ENOSPC: "the disk is full: make room, or record to another one",
        errno.EROFS: "the disk may only be read: record to another one",
        errno.EACCES: "nothing may be written there: choose another folder",
        errno.EPERM: "nothing may be written there: choose another folder",
        errno.EFBIG: "the disk, or a limit, takes no file as large: record to another disk",
        errno.EIO: "the disk fails, or was removed: record to another one",
        errno.ENOENT: "the disk, or the folder, was removed: record to another one",
        errno.ENODEV: "the disk was removed: record to another one",
        errno.ENXIO: "the disk was removed: record to another one",
        errno.ENAMETOOLONG: "the path is too long: choose a shorter one",
        # these codes are missing on some systems
        getattr(errno, "EDQUOT", -1): "your share of the disk is used up: make room, or record to "
        "another one",
        getattr(errno, "ESTALE", -2): "the network disk is gone: record to a local one",
    }
)


def estimate_bytes(channels: int, rate: float, samples: int) -> int:
    """Bytes that a run of ``samples`` samples of ``channels`` channels at ``rate`` Hz will take.

    From the first block to the finished file, which is at no time larger.
    """
    size = FIXED + PER_COUNT * channels * samples
    # computer's clock and events
    size += 100.0 * samples / rate
    if samples <= PHYSICAL_MAX:
        size += 8.0 * (channels + 1) * samples
    else:
        size += 16.0 * (channels + 1) * OVERVIEW
    return int(size)


def free_bytes(path: str | Path) -> int:
    """Bytes that may still be written to the disk of ``path``; quick enough to ask in a run.

    Raises ``InputError`` if the folder is not there (any more).
    """
    folder = Path(path).absolute().parent
    try:
        return shutil.disk_usage(folder).free
    except OSError as error:
        raise InputError(f"the disk of {path} does not answer: {in_words(error)}") from error


def check_room(path: str | Path, channels: int, rate: float, samples: int) -> None:
    """Raise ``InputError`` unless such a run fits on the disk of ``path``."""
    needed, free = estimate_bytes(channels, rate, samples), free_bytes(path)
    if needed + LEFT_FREE > free:
        raise InputError(
            f"the run needs {_size(needed)} and the disk of {path} has {_size(free)} free, of "
            f"which {_size(LEFT_FREE)} stay so: make room, record to another disk, or shorten it"
        )


def _size(amount: float) -> str:
    units = ("B", "kB", "MB", "GB", "TB")
    power = min(int(math.log10(max(amount, 1.0)) / 3.0), len(units) - 1)
    return f"{amount / 1000.0**power:.3g} {units[power]}"


def advice(error: Exception) -> str:
    """Return what to do about an ``error`` of the disk or of HDF5, in words."""
    number = errno_of(error)
    otherwise = "see that the disk has room and that no other program holds the file"
    return otherwise if number is None else _ADVICE.get(number, otherwise)
