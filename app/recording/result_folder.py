"""The folder for the results of a command."""

from __future__ import annotations

from pathlib import Path

from dearig.errors import InputError

__all__ = ["result_folder"]


def result_folder(out: Path, overwrite: bool) -> Path:
    """Create the folder ``out``; ``InputError`` if it is not empty, unless ``overwrite``."""
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; give a folder for the results")
    if out.is_dir() and any(out.iterdir()) and not overwrite:
        raise InputError(f"{out} is not empty; give another folder with --out, or --force")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out} cannot be created: {error.strerror or error}") from error
    return out
