"""Keys that stop: Esc and Space, on every page and with any focus, while the rig is armed or runs.

The whole stroke of a key that has stopped is taken: neither its repetitions nor its release reach
a button or a field.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QInputMethodEvent, QKeyEvent
from PySide6.QtWidgets import QApplication

__all__ = ["StopKeys"]

_KEYS = (Qt.Key.Key_Escape, Qt.Key.Key_Space)
_STROKES = (QEvent.Type.KeyPress, QEvent.Type.KeyRelease, QEvent.Type.ShortcutOverride)


class StopKeys(QObject):
    """Calls ``stop`` for a stop key while ``busy`` returns True.

    ``watch`` is called with True when the rig is armed or a run begins, and with False when neither
    is so any more: all events of the program pass the filter meanwhile.
    """

    def __init__(
        self, stop: Callable[[], None], busy: Callable[[], bool], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._stop = stop
        self._busy = busy
        self._watching = self._installed = False
        self._held: set[int] = set()  # keys that have stopped and are still down

    def watch(self, watching: bool) -> None:
        """Begin or end to look at the keys; a key that is still down is taken until its release."""
        self._watching = watching
        self._install()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        kind = event.type()
        if kind == QEvent.Type.InputMethod:
            # an input method delivers the space of a text field as text
            typed = cast(QInputMethodEvent, event).commitString()
            if typed == " " and self._busy():
                self._stop()
                return True
        elif kind in _STROKES and cast(QKeyEvent, event).key() in _KEYS:
            return self._stroke(kind, cast(QKeyEvent, event))
        return super().eventFilter(watched, event)

    def _stroke(self, kind: QEvent.Type, event: QKeyEvent) -> bool:
        key, repeated = event.key(), event.isAutoRepeat()
        if kind == QEvent.Type.ShortcutOverride:
            if self._busy() or key in self._held:
                event.accept()  # it comes as a key press then, not as a shortcut
                return True
            return False
        if kind == QEvent.Type.KeyRelease:
            held = key in self._held
            if not repeated:
                self._held.discard(key)
                self._install()
            return held
        if not repeated:
            self._held.discard(key)  # a release may have gone to another program
        if key in self._held:
            return True
        if not self._busy():
            self._install()
            return False
        self._held.add(key)
        self._stop()
        return True

    def _install(self) -> None:
        wanted = self._watching or bool(self._held)
        application = QApplication.instance()
        if application is None or wanted == self._installed:
            return
        self._installed = wanted
        if wanted:
            application.installEventFilter(self)
        else:
            application.removeEventFilter(self)
