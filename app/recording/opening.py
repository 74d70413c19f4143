"""An HDF5 file opened for reading, in whatever state a run or a kill has left it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import h5py

from app.errors import InputError
from app.recording.files import in_words
from app.recording.journal import Patched, whole_journal
from app.recording.superblock import SIZE, flags_of

__all__ = ["UNREADABLE", "damage", "opened"]

#: What HDF5 raises for damage, and what items of another type than this layout's lead to.
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
    """What to tell of an ``UNREADABLE`` that came while ``path`` was read."""
    text = " ".join(str(error).split())
    if "filter returned failure" in text:
        text = "a checksum is wrong: the file was changed, or its disk fails"
    return InputError(f"{path} is damaged: {text}")


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """The HDF5 file at ``path`` open for reading; ``InputError`` where it cannot be."""
    with ExitStack() as stack:
        through: Patched | None = None
        try:
            if not path.is_file():
                raise InputError(f"{path} is {'a folder' if path.is_dir() else 'not there'}")
            if (journal := whole_journal(path)) is not None:
                before, after, pages = journal
                raw = stack.enter_context(path.open("rb", buffering=0))
                through = Patched(raw, before, {n: bytearray(p) for n, p in pages.items()})
                through.end = after
                flags = flags_of(through.read(SIZE) or b"")
            else:
                with path.open("rb") as stream:
                    flags = flags_of(stream.read(SIZE))
        except OSError as error:
            raise InputError(f"{path} cannot be read: {in_words(error)}") from error
        except ValueError as error:
            raise InputError(f"{path} is damaged: {error}") from error
        if flags is None:
            raise InputError(
                f"{path} is not an HDF5 file, as recordings are; bring data made elsewhere in with "
                f"dearig import"
            )
        try:
            # a plain open is refused after a kill and during a run; SWMR sees what was flushed. Not
            # SWMR always: it does not look whether the file has been cut short
            if through is None:
                file = h5py.File(path, "r", swmr=flags != 0)
            else:
                file = h5py.File(through, "r")
        except (OSError, RuntimeError) as error:
            if "truncated" in str(error):
                reason = "is truncated: it was not copied or downloaded to its end"
            elif flags:
                reason = (
                    "is being written by another program, or was killed before its first sample"
                )
            else:
                reason = f"cannot be read: {error}"
            raise InputError(f"{path} {reason}") from error
        with file:
            yield file
