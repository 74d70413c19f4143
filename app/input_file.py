"""Input files that other people make: opened only if they are files, read only up to a size."""

from __future__ import annotations

import io
import json
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dearig.errors import InputError

__all__ = ["open_input", "parse_json", "read_input", "why_no_file"]

#: What an entry of a folder may be instead of a file.
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def why_no_file(path: Path) -> str:
    """Return why ``path`` cannot be read as a file ("is a pipe, not a file"); "" if it can.

    Reading a pipe waits for its writer, and a device may have no end.
    """
    try:
        return _not_regular(path.stat().st_mode)
    except FileNotFoundError:
        return "is not there"
    except OSError as error:
        return f"cannot be read: {error.strerror or error}"
    except ValueError:  # a zero byte
        return "cannot be read: its name has a character that no name may have"


def _not_regular(mode: int) -> str:
    if stat.S_ISREG(mode):
        return ""
    kind = _KINDS.get(stat.S_IFMT(mode), "something else")
    return "is a folder" if stat.S_ISDIR(mode) else f"is {kind}, not a file"


def open_input(path: Path, what: str = "") -> io.BufferedReader:
    """Open the file at ``path`` for reading, without waiting for anything.

    Raises ``InputError``; ``what`` it should be ("rig file") comes before its name there.
    """
    name = f"{what} {path}".strip()
    if reason := why_no_file(path):
        raise InputError(f"{name} {reason}")
    try:
        file = open(path, "rb", opener=_open_without_waiting)  # noqa: SIM115
    except OSError as error:
        raise InputError(f"{name} cannot be read: {error.strerror or error}") from error
    # it may have been exchanged after the first look
    if reason := _not_regular(os.fstat(file.fileno()).st_mode):
        file.close()
        raise InputError(f"{name} {reason}")
    return file


def _open_without_waiting(path: str, flags: int) -> int:
    # Windows has no such flag, and no pipes in its folders
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_input(path: Path, what: str, most: int) -> bytes:
    """Return the content of the file at ``path``, at most ``most`` bytes; raises ``InputError``."""
    with open_input(path, what) as file:
        try:
            raw = file.read(most + 1)
        except OSError as error:
            reason = error.strerror or error
            raise InputError(f"{what} {path} cannot be read: {reason}") from error
    if len(raw) > most:
        raise InputError(
            f"{what} {path} has more than {most / 1e6:.3g} MB, and no {what} needs that; see "
            f"that it is the right file"
        )
    return raw


def parse_json(text: str | bytes, number: Callable[[str], float] | None = None) -> Any:
    """Return the value of a JSON text; ``number`` reads what is not an integer.

    Raises ``ValueError``, also for a key that is there twice: which of its values a program takes
    differs from one to the next.
    """
    return json.loads(text, object_pairs_hook=_once, parse_constant=number, parse_float=number)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"the key {twice[:80]!r} is there more than once")
    return found
