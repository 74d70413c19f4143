"""The mouse wheel scrolls; it changes a field only where the field has the focus."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication, QEvent, QObject, Qt
from PySide6.QtWidgets import QAbstractSlider, QAbstractSpinBox, QComboBox, QScrollBar, QTabBar

__all__ = ["WheelGuard"]

_FIELDS = (QAbstractSpinBox, QComboBox, QAbstractSlider, QTabBar)


class WheelGuard(QObject):
    """Keeps the wheel from every field of the program that does not have the focus.

    Fields are spin boxes, lists, sliders and tab bars, in the windows and dialogs that are shown
    while the guard exists. What surrounds the field scrolls instead. Qt's own rule, by which the
    wheel gives the focus to the field under the pointer, is switched off: limits and interlocks
    would be changed by a turn of the wheel.
    """

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        application = QCoreApplication.instance()
        if application is not None:
            application.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        kind = event.type()
        if kind == QEvent.Type.Wheel:
            if isinstance(watched, _FIELDS) and not _scrolls(watched) and not watched.hasFocus():
                event.ignore()  # it goes on to the parents of the field
                return True
        elif kind == QEvent.Type.Polish and isinstance(watched, _FIELDS):
            policy = watched.focusPolicy()
            if policy == Qt.FocusPolicy.WheelFocus:
                watched.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        return False


def _scrolls(watched: QObject) -> bool:
    return isinstance(watched, QScrollBar)
