"""Errors of the program that nothing has handled: counted, logged, and shown in the window.

They reach this module from the interface thread and Qt's slots, from threads, from objects that are
being deleted, and as records of the log, which is how threads and processes with a handler of their
own report them.
"""

from __future__ import annotations

import logging
import platform
import sys
import threading
import traceback
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any

from PySide6.QtCore import (
    QMessageLogContext,
    QObject,
    Qt,
    QtMsgType,
    Signal,
    Slot,
    qInstallMessageHandler,
)

from dearig import __version__
from dearig.printable import printable

__all__ = ["ErrorInProcess", "ProgramError", "ProgramErrors"]

log = logging.getLogger(__name__)
qt_log = logging.getLogger("dearig.qt")

#: Different errors that are kept, and characters of the details of one.
_ERRORS_MAX, _DETAILS_MAX = 50, 20_000
#: Frames of a traceback that tell one error from another; a recursion has thousands.
_FRAMES = 20
_QT_LEVELS = {
    QtMsgType.QtDebugMsg: logging.DEBUG,
    QtMsgType.QtInfoMsg: logging.INFO,
    QtMsgType.QtWarningMsg: logging.WARNING,
    QtMsgType.QtCriticalMsg: logging.ERROR,
    QtMsgType.QtFatalMsg: logging.CRITICAL,
}


class ErrorInProcess(Exception):  # noqa: N818  (not raised: it carries another's traceback)
    """An error of another process; its text is the traceback there."""


@dataclass(frozen=True)
class ProgramError:
    """One error, told from others by its type and the place where it was raised.

    ``count``: how often it came; ``first`` and ``last``: when, in local time; ``details``: its
    traceback.
    """

    sentence: str
    details: str
    count: int
    first: datetime
    last: datetime


class ProgramErrors(QObject):
    """Collects errors from ``install`` to ``close``; ``changed``: there is a new one or a repeat.

    Every different error is logged once with its traceback, and its repeats as a count.
    """

    changed = Signal()
    _came = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._lock = threading.Lock()
        self._errors: dict[object, ProgramError] = {}
        self._answered = True  # False while a signal is on its way: a storm of errors sends one
        self._before: tuple[Any, Any, Any] | None = None
        self._qt_before: Any = None
        self._handler = _Records(self)
        self._came.connect(self._tell, Qt.ConnectionType.QueuedConnection)

    @property
    def errors(self) -> tuple[ProgramError, ...]:
        """The different errors so far, in the order of their first occurrence."""
        with self._lock:
            return tuple(self._errors.values())

    @property
    def details(self) -> str:
        """Versions and the tracebacks of all errors, for a report."""
        parts = [f"dearig {__version__}, Python {platform.python_version()}, {platform.platform()}"]
        for error in self.errors:
            span = f"{error.count} x, {error.first:%Y-%m-%d %H:%M:%S} to {error.last:%H:%M:%S}"
            parts.append(f"{error.sentence}\n{span}\n{error.details}")
        return "\n\n".join(parts)

    def install(self) -> None:
        """Take the errors that Python and Qt would print."""
        if self._before is not None:
            return
        self._before = sys.excepthook, threading.excepthook, sys.unraisablehook
        sys.excepthook = self._uncaught
        threading.excepthook = self._in_thread
        sys.unraisablehook = self._unraisable
        logging.getLogger().addHandler(self._handler)
        self._qt_before = qInstallMessageHandler(_qt_message)

    @Slot()
    def close(self) -> None:
        """Give the errors back to those who took them before, and log how often each came."""
        if self._before is None:
            return
        sys.excepthook, threading.excepthook, sys.unraisablehook = self._before
        self._before = None
        qInstallMessageHandler(self._qt_before)
        logging.getLogger().removeHandler(self._handler)
        for error in self.errors:
            if error.count > 1:
                log.info("%d times in all: %s", error.count, error.sentence)

    def take(self, error: BaseException, what: str = "", *, logged: bool = False) -> None:
        """Count ``error``; ``logged``: its record is in the log already. Any thread may call it."""
        now = datetime.now().astimezone()
        key = _key(error)
        with self._lock:
            known = self._errors.get(key)
            if known is None and len(self._errors) >= _ERRORS_MAX:
                key = None  # all further ones are counted together
                known = self._errors.get(key)
            if known is None:
                fresh = ProgramError(_sentence(error, what), _details(error), 1, now, now)
                self._errors[key] = fresh
            else:
                fresh = replace(known, count=known.count + 1, last=now)
                self._errors[key] = fresh
            tell, self._answered = self._answered, False
        if not logged and fresh.count == 1:
            log.error("error in the program: %s", fresh.sentence, exc_info=error)
        elif not logged and _power_of_ten(fresh.count):
            log.error("%d times: %s", fresh.count, fresh.sentence)
        if tell:
            self._came.emit()

    @Slot()
    def _tell(self) -> None:
        with self._lock:
            self._answered = True
        self.changed.emit()

    def _uncaught(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        if isinstance(error, KeyboardInterrupt) and self._before is not None:
            self._before[0](kind, error, trace)
        else:
            self.take(error)

    def _in_thread(self, found: threading.ExceptHookArgs) -> None:
        if found.exc_value is not None:
            name = "" if found.thread is None else f" {found.thread.name}"
            self.take(found.exc_value, f"in the thread{name}")

    def _unraisable(self, found: Any) -> None:
        if found.exc_value is not None:
            self.take(found.exc_value, f"while an object was deleted ({found.object!r:.200})")


class _Records(logging.Handler):
    """Takes the errors that others have caught and logged with their traceback."""

    def __init__(self, errors: ProgramErrors) -> None:
        super().__init__(logging.ERROR)
        self._errors = errors

    def emit(self, record: logging.LogRecord) -> None:
        if record.name != __name__ and record.exc_info and record.exc_info[1] is not None:
            self._errors.take(record.exc_info[1], record.getMessage(), logged=True)


def _qt_message(kind: QtMsgType, context: QMessageLogContext, message: str) -> None:
    """Write a message of Qt to the log."""
    place = f" ({context.category})" if context.category not in (None, "default") else ""
    qt_log.log(_QT_LEVELS.get(kind, logging.WARNING), "Qt%s: %s", place, message)


def _key(error: BaseException) -> object:
    """Return what is the same for each repeat of ``error``: its type and place, not its words."""
    if isinstance(error, ErrorInProcess):
        places = [line for line in str(error).splitlines() if line.startswith("  File ")]
        return type(error).__name__, *(places or [str(error)])[-_FRAMES:]
    frames = traceback.StackSummary.extract(
        traceback.walk_tb(error.__traceback__), lookup_lines=False
    )[-_FRAMES:]
    return type(error).__name__, *((frame.filename, frame.lineno) for frame in frames)


def _sentence(error: BaseException, what: str) -> str:
    if isinstance(error, ErrorInProcess):
        return printable(what or "an error in another process", most=600)
    words = " ".join(str(error).split())
    said = f"{type(error).__name__}: {words}" if words else type(error).__name__
    frames = traceback.extract_tb(error.__traceback__, limit=-1)
    place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return printable(f"{said}{place}{f'; {what}' if what else ''}", most=600)


def _details(error: BaseException) -> str:
    lines = (
        [str(error)]
        if isinstance(error, ErrorInProcess)
        else traceback.format_exception(type(error), error, error.__traceback__, limit=-60)
    )
    return printable("".join(lines).rstrip(), "\n", most=_DETAILS_MAX)


def _power_of_ten(count: int) -> bool:
    return str(count).strip("0") == "1"
