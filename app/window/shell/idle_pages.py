"""Pages made before they are needed, so that no page that is opened first keeps STOP waiting."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer, Slot

from dearig.window.session.state import Session

__all__ = ["IdlePages"]

#: ms after the start: the first plan, and what the operator does first, are not kept waiting.
_AFTER = 3000
#: ms between two pages, each of which takes some tenths of a second: input is answered there.
_BETWEEN = 250


class IdlePages(QObject):
    """Calls ``make``, which makes the next page and returns False once there is none, while idle.

    While the rig is armed or a run goes on nothing is made: STOP is answered at once. What is not
    made yet is made before the rig is armed, when there is no voltage.
    """

    def __init__(
        self, session: Session, make: Callable[[], bool], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._make = make
        self._is_closed = False
        self.done = False  #: all pages are made
        self._timer = QTimer(self, singleShot=True, interval=_AFTER)
        self._timer.timeout.connect(self._next)
        session.arming.connect(self._make_rest)

    def start(self) -> None:
        """Begin, after a while."""
        if not self._is_closed:
            self._timer.start()

    def close(self) -> None:
        """Make no further page."""
        self._is_closed = True
        self._timer.stop()

    @Slot()
    def _next(self) -> None:
        if self._is_closed:
            return
        if not self._session.busy:
            self.done = not self._make()
        if not self.done:
            self._timer.start(_BETWEEN)

    @Slot()
    def _make_rest(self) -> None:
        while not (self.done or self._is_closed):
            self.done = not self._make()
