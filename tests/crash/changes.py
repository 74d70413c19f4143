"""Every change that a process made to the files of a folder, and the same made again one by one."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Change", "able", "again", "changes_of"]

SHIM = Path(__file__).with_name("shim.c")
NUMBERS = struct.Struct("<3Q")


@dataclass(frozen=True)
class Change:
    """``what`` (a letter, see ``shim.c``) happened to the file ``name`` of the folder."""

    what: str
    name: str
    offset: int
    data: bytes


def able() -> bool:
    """Whether changes can be noted here: on Linux, with a C compiler."""
    return sys.platform == "linux" and shutil.which("cc") is not None


def changes_of(command: Sequence[str], folder: Path, cwd: Path) -> list[Change]:
    """Run ``command`` to its end; what it changed in the empty ``folder``, in order."""
    folder = folder.resolve()
    library, log = folder.with_suffix(".so"), folder.with_suffix(".log")
    build = ["cc", "-shared", "-fPIC", "-O1", "-o", str(library), str(SHIM), "-ldl", "-lpthread"]
    subprocess.run(build, check=True)
    environment = os.environ | {
        "LD_PRELOAD": str(library),
        "CRASH_FOLDER": str(folder),
        "CRASH_LOG": str(log),
    }
    subprocess.run(command, cwd=cwd, env=environment, check=True, stdout=subprocess.DEVNULL)
    return list(_read(log.read_bytes(), folder))


def _read(raw: bytes, folder: Path) -> Iterator[Change]:
    at = 0
    while at < len(raw):
        what = chr(raw[at])
        offset, name_size, data_size = NUMBERS.unpack_from(raw, at + 1)
        at += 1 + NUMBERS.size
        name = Path(os.fsdecode(raw[at : at + name_size])).relative_to(folder)
        at += name_size
        yield Change(what, str(name), offset, raw[at : at + data_size])
        at += data_size


def again(change: Change, folder: Path) -> None:
    """Make one change in ``folder``."""
    path = folder / change.name
    match change.what:
        case "C":
            path.write_bytes(b"")
        case "W" | "T":
            with path.open("r+b") as file:
                if change.what == "T":
                    file.truncate(change.offset)
                else:
                    file.seek(change.offset)
                    file.write(change.data)
        case "R":
            path.rename(folder / Path(os.fsdecode(change.data)).name)
        case "L":
            (folder / Path(os.fsdecode(change.data)).name).hardlink_to(path)
        case "U":
            path.unlink()
