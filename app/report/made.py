"""Program, time and command that made a report, also where it is made again from its data."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from dearig.command_line import without_secrets
from dearig.revision import revision, version

__all__ = ["Made", "command_line", "made", "made_by", "made_now", "one_time"]


@dataclass(frozen=True)
class Made:
    """``program`` with version and revision, ``time`` with its offset, and ``command`` line."""

    program: str
    time: str
    command: str


#: What made the result of the report that is written; None where it is this process.
_MADE: ContextVar[Made | None] = ContextVar("made", default=None)


#: The time of the page that is written, which stands in it twice.
_NOW: ContextVar[Made | None] = ContextVar("now", default=None)


@contextmanager
def one_time() -> Iterator[None]:
    """Let ``made_now`` return one time."""
    token = _NOW.set(made_now())
    try:
        yield
    finally:
        _NOW.reset(token)


def made_now() -> Made:
    """Return this program, the present time, and the command line of this process."""
    if (kept := _NOW.get()) is not None:
        return kept
    now = datetime.now().astimezone().isoformat(" ", timespec="seconds")
    return Made(f"dearig {revision().text(version())}", now, command_line())


def made() -> Made | None:
    """Return what made the result of the report that is made again, None for a first report."""
    return _MADE.get()


@contextmanager
def made_by(first: Made) -> Iterator[None]:
    """Make reports of a result that ``first`` made."""
    token = _MADE.set(first)
    try:
        yield
    finally:
        _MADE.reset(token)


def command_line() -> str:
    """Return the command line of this process, quoted as a shell reads it."""
    words = [Path(sys.argv[0]).stem if sys.argv[:1] != [""] else "python"]
    words += without_secrets(sys.argv[1:])
    if words[0] == "__main__":
        words[0] = "dearig"
    return subprocess.list2cmdline(words) if os.name == "nt" else shlex.join(words)
