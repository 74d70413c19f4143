"""The last words of the command on a terminal: its own, and a closed terminal is not an error.

Libraries write to standard error by themselves, gRPC's core for instance, also while the
interpreter ends. An operator must find the command's sentence as the last line.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import sys
from typing import NoReturn, TextIO

__all__ = ["LastingStream", "leave", "open_streams", "output_failure", "silence_libraries"]

log = logging.getLogger(__name__)

#: Errors of a stream whose reader, or whose terminal, is gone.
_GONE = (errno.EPIPE, errno.EIO, errno.ENXIO)


class LastingStream:
    """Text stream that passes all to ``stream``, and drops it once that cannot be written.

    What a command does, and its exit code, must not depend on who reads what it says. The first
    error is kept in ``failure``. With ``ends_run`` a run that goes on is ended when the terminal
    has been closed, as by the signal of a closed terminal.
    """

    def __init__(self, stream: TextIO, *, ends_run: bool = False) -> None:
        self._stream = stream
        self._ends_run = ends_run
        self.failure: OSError | None = None

    def write(self, text: str) -> int:
        """Write ``text``; returns its number of characters."""
        try:
            if self.failure is None:
                self._stream.write(text)
        except OSError as error:
            self._end(error)
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        try:
            if self.failure is None:
                self._stream.flush()
        except OSError as error:
            self._end(error)

    def _end(self, error: OSError) -> None:
        self.failure = error
        # what is still in its buffer goes there too, when the interpreter flushes it at the end
        with contextlib.suppress(OSError, ValueError):
            _discard(self._stream.fileno())
        log.info("a stream cannot be written (%s); it is written to no more", error.strerror)
        if self._ends_run and error.errno in _GONE:
            from dearig.acquisition.interrupts import terminal_closed

            terminal_closed()

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)


def open_streams() -> None:
    """Open the null device in place of each standard stream that was closed at the start.

    The next file that is opened would have its number, and what libraries and the guardian write
    to the terminal would go into that file, such as a recording.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is not None:
            continue
        found = os.open(os.devnull, os.O_RDWR)  # the lowest number that is free
        if found > number:
            os.close(found)
            found = number
        mode = "w" if number else "r"
        stream = open(  # noqa: SIM115  (as long as the program)
            found, mode, encoding="utf-8", errors="backslashreplace", closefd=False
        )
        setattr(sys, name, stream)


def output_failure() -> OSError | None:
    """Return why standard output cannot be written any more, None while it can."""
    return getattr(sys.stdout, "failure", None)


def silence_libraries() -> None:
    """Let gRPC's core write nothing to standard error; must come before it is imported."""
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")


def leave(status: int) -> NoReturn:
    """End the program with the exit code ``status``; after a failure nothing more is written."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _discard(stream.fileno())
    own = sys.__stderr__
    if status and own is not None and own is sys.stderr:
        _discard(own.fileno())
    recorder = sys.modules.get("dearig.recording.writing.recorder")
    if recorder is not None and recorder.is_writing():
        # the operator has stopped waiting for a disk, and the interpreter would wait for it again
        logging.shutdown()
        os._exit(status)
    sys.exit(status)


def _discard(fd: int) -> None:
    """Send what is written to the file descriptor ``fd`` from now on to the null device."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, fd)
    os.close(null)
