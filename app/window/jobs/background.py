"""Run a function in a thread and deliver its result in the interface thread."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Signal, Slot

from dearig.errors import DearigError

__all__ = ["Background"]

log = logging.getLogger(__name__)


class Background(QObject):
    """Run one function at a time, then the newest of those submitted meanwhile.

    ``done`` carries the function's result, ``failed`` the message of its error. A result is dropped
    when a newer function waits. ``close`` waits for the thread.
    """

    done = Signal(object)
    failed = Signal(str)
    busy_changed = Signal(bool)
    _ended = Signal(object, object, str)  # thread, result, message of the error

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._thread: threading.Thread | None = None
        self._next: Callable[[], Any] | None = None
        self._ended.connect(self._finished)

    @property
    def busy(self) -> bool:
        """True while a function runs."""
        return self._thread is not None

    def start(self, function: Callable[[], Any]) -> None:
        """Run ``function`` now, or as soon as the running one has ended."""
        if self._thread is not None:
            self._next = function
            return
        # no QThread: its Python object could be freed by the garbage collector while it runs
        self._thread = threading.Thread(target=self._run, args=(function,), daemon=True)
        self._thread.start()
        self.busy_changed.emit(True)

    def close(self) -> None:
        """Wait for the running function, and signal nothing."""
        self._next = None
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()

    def _run(self, function: Callable[[], Any]) -> None:
        answer, message = None, ""
        try:
            answer = function()
        except DearigError as error:
            message = str(error)
        except Exception:
            log.exception("a function of the window failed in the background")
            message = "an error in the program; the log has its details"
        self._ended.emit(threading.current_thread(), answer, message)

    @Slot(object, object, str)
    def _finished(self, thread: threading.Thread, answer: Any, message: str) -> None:
        if thread is not self._thread:
            return  # closed meanwhile
        thread.join()
        self._thread = None
        if self._next is not None:
            function, self._next = self._next, None
            self.start(function)
            return
        self.busy_changed.emit(False)
        if message:
            self.failed.emit(message)
        else:
            self.done.emit(answer)
