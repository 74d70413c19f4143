"""Keeps the wheel from fields that do not have the focus, and what is dropped from all."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

from PySide6.QtCore import QCoreApplication, QEvent, QObject, QPointF
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QScrollBar,
    QTabBar,
    QWidget,
)

from dearig.window.kit.window_filter import WindowFilter, widget_of

__all__ = ["FieldGuard"]

_FIELDS = (QAbstractSpinBox, QComboBox, QAbstractSlider, QTabBar)


class FieldGuard(WindowFilter):
    """Keeps the wheel from every field of the program that does not have the focus.

    Fields are spin boxes, lists, sliders and tab bars. What surrounds the field scrolls instead.
    Qt turns the field under the pointer, and gives it the focus: limits and interlocks would be
    changed by a turn of the wheel.

    A text or a file that is dropped on a field of one line is written into it, whether it has the
    focus or not: a limit of 8.5 would be 98.5. The page around the field gets it instead.
    """

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        if event.type() == QEvent.Type.DragEnter and (over := widget_of(watched)) is not None:
            for field in over.findChildren(QLineEdit):
                field.setAcceptDrops(False)
            return False
        if event.type() != QEvent.Type.Wheel or QApplication.activePopupWidget() is not None:
            return False  # a list that is open takes the wheel itself
        wheel = cast(QWheelEvent, event)
        top = widget_of(watched)
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
