"""Keys that stop: Esc and Space, on every page, while the rig is armed or runs; clicks on STOP.

Space writes where a text field has the focus, and stops elsewhere. Esc closes what is open and has
the focus (a menu, a list, a dialog, the guide, the cell that is edited, a search text), and stops
where nothing is. The whole stroke of a key does the same: neither the repetitions of a key that has
stopped nor its release reach a button or a field, and the repetitions of a key that has closed or
written something do not stop.

A click outside an open menu or list closes it, and nothing else hears of it. On STOP it stops too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

from PySide6.QtCore import QCoreApplication, QEvent, QObject, Qt, Slot
from PySide6.QtGui import QGuiApplication, QInputMethodEvent, QKeyEvent, QMouseEvent, QWindow
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QTextEdit,
    QWidget,
)
from shiboken6 import isValid

from dearig.window.high_voltage.bar import STOP_NAME
from dearig.window.kit.window_filter import WindowFilter, widget_of

__all__ = ["StopKeys"]

_NAMES = {Qt.Key.Key_Escape: "Esc", Qt.Key.Key_Space: "Space"}
_STROKES = (QEvent.Type.KeyPress, QEvent.Type.KeyRelease, QEvent.Type.ShortcutOverride)


class StopKeys(WindowFilter):
    """Calls ``stop`` with the name of a stop key while ``busy`` returns True.

    ``window`` is the main window: Esc closes others first.
    """

    def __init__(self, stop: Callable[[str], None], busy: Callable[[], bool], window: QWidget):
        self._stop = stop
        self._busy = busy
        self._window = window
        self._typed: QObject | None = None  # what an input method writes into
        self._held: set[int] = set()  # keys that have stopped and are still down
        self._passed: set[int] = set()  # keys that have closed or written something, and are down
        super().__init__(window)
        application = cast(QGuiApplication | None, QCoreApplication.instance())
        if application is not None:
            application.focusObjectChanged.connect(self._watch_typing)

    @Slot(QObject)
    def _watch_typing(self, focused: QObject | None) -> None:
        """Look at what has the focus: an input method writes into it, past the window."""
        if self._typed is not None and isValid(self._typed):
            self._typed.removeEventFilter(self)
        self._typed = focused
        if focused is not None:
            focused.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        kind = event.type()
        if kind == QEvent.Type.InputMethod:
            # an input method delivers a space as text
            typed = cast(QInputMethodEvent, event).commitString()
            if typed == " " and self._busy() and not _writes():
                self._stop(_NAMES[Qt.Key.Key_Space])
                return True
        elif kind == QEvent.Type.MouseButtonPress and isinstance(watched, QWindow):
            return self._click_behind_popup(cast(QMouseEvent, event))
        elif kind in _STROKES and cast(QKeyEvent, event).key() in _NAMES:
            if not isinstance(watched, QWindow):
                return False  # its window has seen it
            return self._stroke(watched, kind, cast(QKeyEvent, event))
        return False

    def _click_behind_popup(self, event: QMouseEvent) -> bool:
        """Press STOP where a click on it would only close a menu or a list."""
        popup, at = QApplication.activePopupWidget(), event.globalPosition().toPoint()
        if popup is None or not self._busy() or popup.geometry().contains(at):
            return False
        for stop in self._window.findChildren(QPushButton, STOP_NAME):
            if stop.isVisible() and stop.visibleRegion().contains(stop.mapFromGlobal(at)):
                while popup is not None:  # a menu and its submenus
                    popup.close()
                    popup = QApplication.activePopupWidget()
                stop.pressed.emit()
                return True
        return False

    def _stroke(self, window: QWindow, kind: QEvent.Type, event: QKeyEvent) -> bool:
        key, repeated = event.key(), event.isAutoRepeat()
        if kind == QEvent.Type.ShortcutOverride:
            if key in self._held or (self._busy() and not self._passes(window, key, repeated)):
                event.accept()  # it comes as a key press then, not as a shortcut
                return True
            return False
        if kind == QEvent.Type.KeyRelease:
            held = key in self._held
            if not repeated:
                self._held.discard(key)
                self._passed.discard(key)
            return held
        if not repeated:  # a release may have gone to another program
            self._held.discard(key)
            self._passed.discard(key)
        if key in self._held:
            return True
        if not self._busy():
            return False
        if self._passes(window, key, repeated):
            self._passed.add(key)
            return self._clear_search(key)
        self._held.add(key)
        self._stop(_NAMES[Qt.Key(key)])
        return True

    def _passes(self, window: QWindow, key: int, repeated: bool) -> bool:
        """Return whether the stroke closes or writes something."""
        if repeated and key in self._passed:
            return True
        if key == Qt.Key.Key_Space:
            return _writes()
        return self._is_open(window)

    def _is_open(self, window: QWindow) -> bool:
        """Return whether Esc, on its way to ``window``, has something to close."""
        if QApplication.activePopupWidget() is not None:
            return True
        at = widget_of(window)
        if at is not None and at is not self._window:
            return True
        return _edits_a_cell() or _searches(self._window)

    def _clear_search(self, key: int) -> bool:
        """Clear the search text of the field that has the focus; return whether Esc did that."""
        if key != Qt.Key.Key_Escape or not _searches(self._window):
            return False
        cast(QLineEdit, QApplication.focusWidget()).clear()
        return True


def _writes() -> bool:
    """Return whether a text field has the focus that can be written to."""
    field = QApplication.focusWidget()
    if isinstance(field, QLineEdit | QTextEdit | QPlainTextEdit):
        return field.isEnabled() and not field.isReadOnly()
    return isinstance(field, QComboBox) and field.isEnabled() and field.isEditable()


def _edits_a_cell() -> bool:
    field = QApplication.focusWidget()
    parent = None if field is None else field.parentWidget()
    table = None if parent is None else parent.parentWidget()
    if not isinstance(table, QAbstractItemView) or parent is not table.viewport():
        return False
    return table.state() == QAbstractItemView.State.EditingState


def _searches(window: QWidget) -> bool:
    """Return whether the focus is in a search text of ``window``: a field that can be cleared."""
    field = QApplication.focusWidget()
    if not isinstance(field, QLineEdit) or field.window() is not window:
        return False
    return field.isClearButtonEnabled() and bool(field.text())
