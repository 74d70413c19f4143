"""Keeps the wheel from fields that do not have the focus."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

from PySide6.QtCore import QCoreApplication, QEvent, QObject, QPointF, Slot
from PySide6.QtGui import QGuiApplication, QWheelEvent, QWindow
from PySide6.QtWidgets import (
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QScrollBar,
    QTabBar,
    QWidget,
)

__all__ = ["WheelGuard"]

_FIELDS = (QAbstractSpinBox, QComboBox, QAbstractSlider, QTabBar)


class WheelGuard(QObject):
    """Keeps the wheel from every field of the program that does not have the focus.

    Fields are spin boxes, lists, sliders and tab bars. What surrounds the field scrolls instead.
    Qt turns the field under the pointer, and gives it the focus: limits and interlocks would be
    changed by a turn of the wheel.

    The guard looks at what the window system sends to the windows, of which there are few events,
    and not at every event of every object, which took a fifth of the time of a window's tests.
    """

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        application = cast(QGuiApplication | None, QCoreApplication.instance())
        if application is not None:
            application.focusWindowChanged.connect(self._watch)
        self._watch()

    @Slot()
    def _watch(self) -> None:
        """Look at all windows that there are; a dialog gets the focus once it is shown."""
        for window in QGuiApplication.topLevelWindows():
            window.installEventFilter(self)  # a second time changes nothing

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        if event.type() != QEvent.Type.Wheel or QApplication.activePopupWidget() is not None:
            return False  # a list that is open takes the wheel itself
        wheel = cast(QWheelEvent, event)
        top = QWidget.find(cast(QWindow, watched).winId())
        if top is None:
            return False
        below = [*_up_from(top.childAt(wheel.position().toPoint()))]
        if not any(map(_is_kept_out, below)):
            return False
        # Qt passes on what comes from the window system alone
        for place in below:
            if not _is_kept_out(place) and _turn(place, top, wheel):
                break
        return True


def _up_from(widget: QWidget | None) -> Iterator[QWidget]:
    """Yield ``widget`` and what it is in, up to its window."""
    while widget is not None:
        yield widget
        widget = None if widget.isWindow() else widget.parentWidget()


def _is_kept_out(widget: QWidget) -> bool:
    """Return whether the wheel is kept from ``widget``: a field that does not have the focus."""
    is_field = isinstance(widget, _FIELDS) and not isinstance(widget, QScrollBar)
    return is_field and not widget.hasFocus()


def _turn(place: QWidget, top: QWidget, wheel: QWheelEvent) -> bool:
    """Turn the wheel over ``place`` in the window ``top``; return whether it has answered."""
    turned = QWheelEvent(
        QPointF(place.mapFrom(top, wheel.position())), wheel.globalPosition(),
        wheel.pixelDelta(), wheel.angleDelta(), wheel.buttons(), wheel.modifiers(),
        wheel.phase(), wheel.inverted(), wheel.source(),
    )  # fmt: skip
    QCoreApplication.sendEvent(place, turned)
    return turned.isAccepted()
