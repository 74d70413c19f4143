"""The last words of the command on a terminal: they are its own, and a closed terminal is no error.

Libraries write to standard error by themselves, gRPC's core for instance, also while the
interpreter ends. An operator must find the command's sentence as the last line.
"""

from __future__ import annotations

import errno
import logging
import os
import sys
from typing import NoReturn, TextIO

__all__ = ["LastingStream", "leave", "silence_libraries"]

log = logging.getLogger(__name__)

#: Errors of a stream whose reader, or whose terminal, is gone.
_GONE = (errno.EPIPE, errno.EIO, errno.ENXIO)


class LastingStream:
    """Text stream that passes all to ``stream``, and drops it when its terminal has been closed.

    A run that goes on then is ended, as by the signal of a closed terminal.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._gone = False

    def write(self, text: str) -> int:
        """Write ``text``; returns its number of characters."""
        try:
            if not self._gone:
                self._stream.write(text)
        except OSError as error:
            self._end(error)
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        try:
            if not self._gone:
                self._stream.flush()
        except OSError as error:
            self._end(error)

    def _end(self, error: OSError) -> None:
        if error.errno not in _GONE:
            raise error
        self._gone = True
        log.info("standard error was closed (%s); it is written to no more", error.strerror)
        from dearig.acquisition.interrupts import terminal_closed

        terminal_closed()

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)


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
