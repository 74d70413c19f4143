"""Open an HDF5 file for reading, also one that is being written or whose run was killed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TypeVar

import h5py

from dearig.errors import InputError
from dearig.input_file import why_no_file
from dearig.recording.content.journal import Patched, whole_journal
from dearig.recording.content.layout import IDENTIFIER
from dearig.recording.content.safe import Refused, dataset
from dearig.recording.content.superblock import SIZE, flags_of, repair_superblock
from dearig.recording.content.text import text_of
from dearig.recording.files import journal_of, one_line, system_text

#: Consistency flag of a file in SWMR mode.
WRITTEN_IN_ORDER = 4
#: A size in bytes beyond the end of every file.
FAR = 2**60
BEING_WRITTEN = "is being written by another program, or was killed before its first sample"

__all__ = [
    "LOOKS",
    "UNREADABLE",
    "damage",
    "file_state",
    "identifier_of",
    "opened",
    "read_from",
]

T = TypeVar("T")

#: Attempts at reading a file that is being written before it counts as damaged.
LOOKS = 5

#: Exceptions of HDF5 for damage, and of items whose type is not that of this layout.
UNREADABLE = (
    AttributeError,
    LookupError,
    MemoryError,
    OSError,
    OverflowError,
    RuntimeError,
    TypeError,
    ValueError,
)


def damage(path: Path, error: Exception) -> InputError:
    """Return the error to raise for an ``UNREADABLE`` exception while reading ``path``."""
    text = one_line(error)
    if "filter returned failure" in text:
        text = "a checksum is wrong: the file was changed, or its disk fails"
    return InputError(f"{path} is damaged: {text}")


def read_from(path: Path, look: Callable[[h5py.File], T]) -> T:
    """Return what ``look`` returns for the file at ``path``; ``InputError`` if it is unreadable.

    A file that is being written, or that was changed meanwhile, is read again after an error: a
    write may have been half done.
    """
    for left in reversed(range(LOOKS)):
        before = file_state(path)
        try:
            with opened(path) as file:
                growing = file.driver == "fileobj"
                try:
                    return look(file)
                except Refused as error:
                    raise InputError(f"{path}: {error}") from error
                except UNREADABLE as error:
                    if not (growing and left):
                        raise damage(path, error) from error
        except InputError:
            if not left or file_state(path) == before:
                raise
    raise InputError(f"{path} cannot be read")


def identifier_of(entry: h5py.Group) -> str:
    """Return what tells this recording from every other: its identifier, or else its start."""
    for name in (IDENTIFIER, "start_time"):
        found = dataset(entry, name)
        if found is not None:
            return text_of(found[()])
    return ""


def file_state(path: Path) -> tuple[int, ...]:
    """Return what differs once a file, or its journal, has been changed or replaced."""
    found: list[int] = []
    for name in (path, journal_of(path)):
        try:
            about = name.stat()
        except OSError:
            found.append(-1)
        else:
            found += (about.st_ino, about.st_size, about.st_mtime_ns)
    return tuple(found)


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """Open the HDF5 file at ``path`` for reading. Raises ``InputError`` where it cannot be."""
    with ExitStack() as stack:
        flags: int | None = 0
        try:
            if reason := why_no_file(path):
                raise InputError(f"{path} {reason}")
            journal = whole_journal(path)
            raw = stack.enter_context(path.open("rb", buffering=0))
            before, after, pages = journal or (raw.seek(0, 2), raw.tell(), {})
            patched = Patched(raw, before, {n: bytearray(p) for n, p in pages.items()})
            patched.end = after
            if not after:
                raise InputError(
                    f"{path} is empty: its run or its program ended before it wrote anything, or "
                    f"has only begun; delete it, or record again",
                    option="force",
                )
            flags = flags_of(patched.read(SIZE) or b"")
        except OSError as error:
            raise InputError(f"{path} cannot be read: {system_text(error)}") from error
        except ValueError as error:
            raise InputError(f"{path} is damaged: {error}") from error
        if flags is None:
            raise InputError(
                f"{path} is not an HDF5 file, as recordings are; import data of other programs",
                command=("import",),
            )
        if flags and not flags & WRITTEN_IN_ORDER:
            raise InputError(f"{path} {BEING_WRITTEN}")
        try:
            file = _open(path, patched, as_closed=bool(flags), whole=not journal)
        except UNREADABLE as error:
            if "truncated" in str(error):
                reason = "is truncated: it was not copied or downloaded completely"
            elif flags:
                reason = BEING_WRITTEN
            else:
                reason = f"cannot be read: {one_line(error)}"
            raise InputError(f"{path} {reason}") from error
        with file:
            yield file


def _open(path: Path, patched: Patched, as_closed: bool, whole: bool) -> h5py.File:
    if as_closed:
        return h5py.File(_as_closed(patched), "r")
    if whole:
        try:
            return h5py.File(path, "r")
        except OSError as error:
            # reading needs no lock: where there are none, or another program has it, HDF5 reads
            # through Python
            if "lock file" not in str(error):
                raise
    return h5py.File(patched, "r")


def _as_closed(patched: Patched) -> Patched:
    """Return a file that was not closed, by a kill or during a run, as if it had been closed.

    HDF5's SWMR mode could read it too, but it reads damaged parts again and again, with pauses that
    grow without limit. Here damage raises an ``UNREADABLE`` error at once; the caller may retry.
    """
    # the file may grow while it is read
    patched.end = FAR
    repair_superblock(patched)
    return patched
