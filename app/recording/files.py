"""Output files: refused before anything is touched, or replaced as a whole."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.errors import InputError

__all__ = ["check_output", "file_sha256", "replaced_when_done"]


def check_output(path: str | Path, overwrite: bool, source: Path | None = None) -> Path:
    """``path`` as one that may be written to; otherwise ``InputError`` with nothing touched.

    ``source`` is the file that is read meanwhile, and never overwritten.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path} is a folder; give the name of a file in it")
    if path.exists():
        if source is not None and source.exists() and path.samefile(source):
            raise InputError(f"{path} is the file that is read; choose another name for the output")
        if not overwrite:
            raise InputError(f"{path} exists already; choose another name, or replace it with --force")
    if not path.parent.is_dir():
        raise InputError(f"{path} cannot be written: there is no folder {path.parent}")
    return path


@contextmanager
def replaced_when_done(path: Path) -> Iterator[Path]:
    """A path beside ``path`` to write to, which takes its place only if the body ends well.

    The body should hold only what writes: an ``OSError`` in it becomes ``InputError``, and so does
    a ``RuntimeError``, as which HDF5 reports some full disks.
    """
    partial = path.with_name(f"{path.name}.partial")
    try:
        yield partial
        partial.replace(path)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{path} cannot be written: {error}") from error
    finally:
        partial.unlink(missing_ok=True)


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
