"""Work in pieces, so that STOP is heard in between."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable

from PySide6.QtCore import QObject, QTimer, Slot

__all__ = ["Turns"]


class Turns(QObject):
    """Does one piece of work in each turn of the event loop while ``busy``, and all at once else.

    ``busy`` returns True while the rig is armed or a run goes on.
    """

    def __init__(self, busy: Callable[[], bool], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._busy = busy
        self._left: deque[Callable[[], object]] = deque()
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._next)

    def add(self, pieces: Iterable[Callable[[], object]]) -> None:
        """Do ``pieces`` after those that are left."""
        self._left.extend(pieces)
        if not self._busy():
            self.finish()
        elif self._left:
            self._timer.start()

    def clear(self) -> None:
        """Leave out the pieces that are left."""
        self._left.clear()
        self._timer.stop()

    def finish(self) -> None:
        """Do all pieces that are left now."""
        self._timer.stop()
        while self._left:
            self._left.popleft()()

    @Slot()
    def _next(self) -> None:
        if self._left:
            self._left.popleft()()
        if not self._left:
            self._timer.stop()
