"""Output files: checked before anything is changed, and replaced as a whole."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dearig.errors import InputError

__all__ = [
    "check_output",
    "errno_of",
    "file_sha256",
    "in_words",
    "old_of",
    "one_line",
    "put_back",
    "replaced_when_done",
    "set_aside",
]

#: Largest length of a file's name in bytes; it leaves space for the endings .partial and .journal.
NAME_MAX = 255 - len(".partial")


def check_output(path: str | Path, overwrite: bool, *sources: str | Path) -> Path:
    """Return ``path`` if it may be written to; otherwise raise ``InputError``.

    ``sources`` are input files, which are never overwritten. Nothing is changed.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise InputError(f"{path} is a folder; give the name of a file in it")
        if path.exists():
            if any(Path(s).exists() and path.samefile(s) for s in sources):
                raise InputError(f"{path} is the input file; choose another name for the output")
            if not path.is_file():
                # replacing a device (/dev/null) would take it from the whole machine
                raise InputError(f"{path} is not a regular file; give the name of one")
            if not overwrite:
                raise InputError(
                    f"{path} exists already; choose another name, or replace it with --force"
                )
        if len(os.fsencode(path.name)) > NAME_MAX:
            raise InputError(
                f"{path} cannot be written: its name has more than {NAME_MAX} bytes; choose a "
                f"shorter one"
            )
        if not path.parent.is_dir():
            raise InputError(f"{path} cannot be written: there is no folder {path.parent}")
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be written: {in_words(error)}") from error
    if not os.access(path.parent, os.W_OK):
        raise InputError(
            f"{path} cannot be written: the folder {path.parent} may not be written to; "
            f"choose another folder"
        )
    return path


def errno_of(error: Exception) -> int | None:
    """Return the system's error number, also where HDF5 has it only in its text."""
    if isinstance(error, OSError) and error.errno:
        return error.errno
    found = re.search(r"errno = (\d+)", str(error))
    return int(found[1]) if found else None


def in_words(error: Exception) -> str:
    """Return the system's text of ``error``, without its number and without the path."""
    number = errno_of(error)
    return one_line(error) if number is None else os.strerror(number)


def one_line(error: Exception, most: int = 300) -> str:
    """Return another library's error text as part of a sentence: printable and short."""
    text = " ".join("".join(c if c.isprintable() else " " for c in str(error)).split())
    return text if len(text) <= most else f"{text[: most - 3]}..."


@contextmanager
def replaced_when_done(path: Path) -> Iterator[Path]:
    """Yield a path beside ``path`` to write to; the file replaces ``path`` if the body succeeds.

    The body should only write: an ``OSError`` in it becomes an ``InputError``, and so does a
    ``RuntimeError``, by which HDF5 reports some full disks.
    """
    partial = path.with_name(f"{path.name}.partial")
    try:
        yield partial
        partial.replace(path)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{path} cannot be written: {in_words(error)}") from error
    finally:
        partial.unlink(missing_ok=True)


def old_of(path: Path) -> Path:
    """Return the name of the file at ``path`` while another one is written in its place."""
    return path.with_name(f"{path.name}.old")


def set_aside(path: Path) -> Path | None:
    """Rename the file at ``path`` to ``FILE.old`` until it is replaced; None if there is none.

    Raises ``InputError`` if there is a ``FILE.old`` already, ``OSError``.
    """
    if not path.exists():
        return None
    old = old_of(path)
    if old.exists():
        raise InputError(
            f"{old} exists already, left by a run that ended before its first samples: rename it "
            f"or delete it"
        )
    return path.rename(old)


def put_back(old: Path | None, path: Path) -> None:
    """Move the file that was set aside as ``old``, if any, back to ``path``."""
    if old is not None and old.exists():
        old.replace(path)


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
