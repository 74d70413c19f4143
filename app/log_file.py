"""The log file: one for all dearig programs of a user, in the platform's folder for logs.

Each program appends whole lines. When the file has grown beyond ``SIZE_MAX`` it is renamed to
``dearig.log.1`` and so on. On Windows a file that another program has open cannot be renamed; it
then grows until the last other program has ended. A folder that cannot be written stops nothing:
the log is a help for the search of errors, never a condition for a run.
"""

from __future__ import annotations

import contextlib
import io
import logging
import os
import stat
from collections.abc import Iterator
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Any

from platformdirs import user_log_path

from dearig.printable import printable

__all__ = [
    "FOLDER_VARIABLE",
    "SIZE_MAX",
    "LogFile",
    "PrintableFormatter",
    "attached",
    "log_path",
]

#: Environment variable with another folder for the log file.
FOLDER_VARIABLE = "DEARIG_LOG_DIR"
#: Size in bytes at which a new file is started: some 10,000 lines.
SIZE_MAX = 1_000_000
#: Number of older files that are kept.
KEPT = 3
#: Characters of a record, at most: a hundredth of a file. Longer ones are cut in the middle.
LINE_MAX = SIZE_MAX // 100

_FORMAT = "%(asctime)s %(levelname)s [%(process)d] %(name)s: %(message)s"


def log_path() -> Path:
    """Return the path of the log file; neither the file nor its folder need exist."""
    folder = os.environ.get(FOLDER_VARIABLE)
    return (Path(folder) if folder else user_log_path("dearig")) / "dearig.log"


class LogFile(RotatingFileHandler):
    """Handler that appends to the log file and shares it with other programs.

    ``problem`` says why the last line could not be written; None if it could.
    """

    problem: str | None = None

    def __init__(self, path: Path) -> None:
        super().__init__(
            path, maxBytes=SIZE_MAX, backupCount=KEPT, encoding="utf-8", delay=True,
            errors="backslashreplace",
        )  # fmt: skip
        # platformdirs leaves the ~ where it does not know the user's home
        self._homeless = path.parts[:1] == ("~",)
        self.setLevel(logging.INFO)
        self.setFormatter(PrintableFormatter(_FORMAT))
        # other packages have news at this level that no one needs
        self.addFilter(lambda r: r.name.startswith("dearig") or r.levelno >= logging.WARNING)

    def emit(self, record: logging.LogRecord) -> None:
        self.problem = None
        try:
            if self._homeless:
                raise OSError("the user has no home folder")  # noqa: TRY301
            self._leave_renamed()
            Path(self.baseFilename).parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            self.problem = _reason(error)
            return
        super().emit(record)

    def _open(self) -> io.TextIOWrapper:
        """Open the file of this user; links, pipes and files of other users are refused."""
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT
        # a pipe without a reader would block; Windows has neither flag
        flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        number = os.open(self.baseFilename, flags, 0o600)
        found = os.fstat(number)
        if not stat.S_ISREG(found.st_mode):
            reason = "it is not a regular file"
        elif os.name != "nt" and found.st_uid != os.geteuid():
            reason = "it belongs to another user"
        else:
            stream = os.fdopen(number, "ab")
            return io.TextIOWrapper(stream, encoding=self.encoding, errors=self.errors)
        os.close(number)
        raise OSError(reason)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: ARG002, N802
        # inside an except clause of logging; its own report would be a traceback on the terminal
        import sys

        error = sys.exc_info()[1]
        self.problem = _reason(error) if isinstance(error, OSError) else repr(error)

    def close(self) -> None:
        """Close the file. What a full disk does not take of the last lines is lost."""
        try:
            super().close()
        except OSError as error:
            self.problem = _reason(error)

    def doRollover(self) -> None:  # noqa: N802
        """Start a new file, unless another program on Windows keeps the present one open."""
        if self.stream is not None:
            self.stream.close()
            self.stream = None  # logging's own way to say: opened later
        aside = f"{self.baseFilename}.rotating"
        # raises where the file is open elsewhere (Windows) or another program has just renamed it
        with contextlib.suppress(OSError):
            Path(self.baseFilename).replace(aside)
            for n in range(self.backupCount - 1, 0, -1):
                older = Path(f"{self.baseFilename}.{n}")
                if older.exists():
                    older.replace(f"{self.baseFilename}.{n + 1}")
            Path(aside).replace(f"{self.baseFilename}.1")

    def _leave_renamed(self) -> None:
        """Close the stream if another program has renamed its file."""
        if self.stream is None:
            return
        path = Path(self.baseFilename)
        if not path.exists() or not os.path.samestat(path.stat(), os.fstat(self.stream.fileno())):
            self.stream.close()
            self.stream = None


class PrintableFormatter(logging.Formatter):
    """Formatter whose records are one line each, and whose tracebacks are printable."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802
        """Return the line of ``record``."""
        return printable(super().formatMessage(record), most=LINE_MAX)

    def formatException(self, ei: Any) -> str:  # noqa: N802
        """Return the traceback."""
        return printable(super().formatException(ei), "\n", most=LINE_MAX)


def _reason(error: OSError) -> str:
    return error.strerror or str(error)


@contextlib.contextmanager
def attached() -> Iterator[LogFile]:
    """Write log records of level INFO and above to the log file while the body runs."""
    root, handler = logging.getLogger(), LogFile(log_path())
    root.addHandler(handler)
    level = root.level
    root.setLevel(min(level, logging.INFO))
    try:
        yield handler
    finally:
        root.setLevel(level)
        root.removeHandler(handler)
        handler.close()
