"""A function in a thread of its own, whose answer comes back to the interface thread."""

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
        self.error = "a fault of the program: what it was stands in the terminal"

    def run(self) -> None:
        try:
            self.answer = self._function()
        except DearigError as error:
            self.error = str(error)
        else:
            self.error = ""


class Background(QObject):
    """Runs one function at a time; of those that came while it was busy, the newest.

    ``done`` brings what the function returned, ``failed`` the sentence of its ``DearigError``. An
    answer that something newer has overtaken is not told. ``close`` waits for the thread.
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
        """Run ``function``, now or as soon as the present one has ended."""
        if self._thread is not None:
            self._next = function
            return
        self._thread = _Thread(function, self)
        self._thread.finished.connect(self._finished)
        self._thread.start()
        self.busy_changed.emit(True)

    def close(self) -> None:
        """Wait for what runs, and tell nothing of it."""
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
