"""Run a function in a thread and deliver its result in the interface thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, QThread, Signal, Slot

from dearig.errors import DearigError

__all__ = ["Background"]


class _Thread(QThread):
    def __init__(self, function: Callable[[], Any], parent: QObject) -> None:
        super().__init__(parent)
        self._function = function
        self.answer: Any = None
        self.error = "an error in the program; the terminal shows its details"

    def run(self) -> None:
        try:
            self.answer = self._function()
        except DearigError as error:
            self.error = str(error)
        else:
            self.error = ""


class Background(QObject):
    """Run one function at a time, then the newest of those submitted meanwhile.

    ``done`` carries the function's result, ``failed`` the message of its ``DearigError``. A result
    is dropped when a newer function waits. ``close`` waits for the thread.
    """

    done = Signal(object)
    failed = Signal(str)
    busy_changed = Signal(bool)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._thread: _Thread | None = None
        self._next: Callable[[], Any] | None = None

    @property
    def busy(self) -> bool:
        """True while a function runs."""
        return self._thread is not None

    def start(self, function: Callable[[], Any]) -> None:
        """Run ``function`` now, or as soon as the running one has ended."""
        if self._thread is not None:
            self._next = function
            return
        self._thread = _Thread(function, self)
        self._thread.finished.connect(self._finished)
        self._thread.start()
        self.busy_changed.emit(True)

    def close(self) -> None:
        """Wait for the running function, and signal nothing."""
        self._next = None
        if self._thread is not None:
            self._thread.finished.disconnect(self._finished)
            self._thread.wait()
            self._thread = None

    @Slot()
    def _finished(self) -> None:
        thread, self._thread = self._thread, None
        if thread is None:
            return
        thread.deleteLater()
        if self._next is not None:
            function, self._next = self._next, None
            self.start(function)
            return
        self.busy_changed.emit(False)
        if thread.error:
            self.failed.emit(thread.error)
        else:
            self.done.emit(thread.answer)
