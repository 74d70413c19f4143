"""Folders for results."""

from __future__ import annotations

from pathlib import Path

from dearig.errors import InputError
from dearig.recording.files import system_text

__all__ = ["numbered_folder", "result_folder"]

#: More results of one kind than this in one folder are a mistake.
_NUMBERED_MAX = 10_000


def result_folder(out: Path, overwrite: bool) -> Path:
    """Create the folder ``out``; ``InputError`` if it is not empty, unless ``overwrite``."""
    if str(out) == "-":
        raise InputError("- is not the name of a folder; give one for the results")
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; give a folder for the results")
    if out.is_dir() and any(out.iterdir()) and not overwrite:
        raise InputError(f"{out} is not empty; give another folder", option=("out", "force"))
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out} cannot be created: {error.strerror or error}") from error
    return out


def numbered_folder(folder: Path, name: str) -> Path:
    """Make and return a new folder in ``folder``: ``name`` and the first number that is free.

    Raises ``InputError``.
    """
    where = folder
    try:
        for number in range(1, _NUMBERED_MAX):
            where = folder / f"{name}-{number}"
            try:
                where.mkdir()
            except FileExistsError:
                continue
            return where
    except OSError as error:
        raise InputError(f"{where} cannot be made: {system_text(error)}") from error
    raise InputError(
        f"{folder} holds {_NUMBERED_MAX} results of this kind; choose another folder for the "
        f"results"
    )
