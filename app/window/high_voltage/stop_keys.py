"""Keys that stop: Esc and Space, on every page and with any focus, while the rig is armed or runs.

The whole stroke of a key that has stopped is taken: neither its repetitions nor its release reach
a button or a field.

One field takes a space in a run: that of a note on the run, and there only one space after a word.
A space in an empty note, a second one in a row, or one that is held, stops as everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QInputMethodEvent, QKeyEvent
from PySide6.QtWidgets import QApplication, QLineEdit

__all__ = ["WRITES_SPACES", "StopKeys"]

#: Property of a field for notes on the run.
WRITES_SPACES = "writes_spaces"

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
            if typed == " " and self._busy() and not _between_words():
                self._stop()
                return True
        elif kind in _STROKES and cast(QKeyEvent, event).key() in _KEYS:
            return self._stroke(kind, cast(QKeyEvent, event))
        return super().eventFilter(watched, event)

    def _stroke(self, kind: QEvent.Type, event: QKeyEvent) -> bool:
        key, repeated = event.key(), event.isAutoRepeat()
        if kind == QEvent.Type.ShortcutOverride:
            if key in self._held or self._busy():
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
        if key == Qt.Key.Key_Space and not repeated and _between_words():
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


def _between_words() -> bool:
    """Return whether a space would follow a word in a field for notes on the run."""
    field = QApplication.focusWidget()
    if not isinstance(field, QLineEdit) or not field.property(WRITES_SPACES):
        return False
    before = field.text()[: field.cursorPosition()]
    return bool(before) and not before.endswith(" ")
