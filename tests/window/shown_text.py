"""Everything that a window shows as text, and what is wrong with it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from PySide6 import QtGui
from PySide6.QtCore import QAbstractListModel, QCoreApplication, QEvent, QPoint, QRect, Qt
from PySide6.QtGui import QFontMetrics, QTextDocument
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSpinBox,
    QComboBox,
    QGraphicsTextItem,
    QGraphicsView,
    QGroupBox,
    QHeaderView,
    QLabel,
    QLineEdit,
    QMenu,
    QProgressBar,
    QScrollArea,
    QTabBar,
    QTableView,
    QToolButton,
    QWidget,
)

from dearig.window.kit.report_page import ReportPage
from dearig.window.kit.widgets import Message
from dearig.window.plots.canvas import Canvas

__all__ = [
    "commands",
    "cut_off",
    "overlapping",
    "rendered_markup",
    "shown_texts",
    "sideways",
    "squashed",
    "stretched",
    "unreadable",
]

#: Names of keys with their units, which are for files, and signs that stand in for others.
_RAW = re.compile(
    r"\b[A-Za-z]\w*_(?:kV|V|mA|kHz|Hz|s|ms|mm|um|g|kPa|kg|MB|pct)\b|\+-|(?<=\d) u[sm]\b"
)
#: What belongs to a terminal: options, and names of commands behind that of the program.
_COMMAND = re.compile(
    r"(?<![\w-])--[a-z][a-z-]+|\bdearig [a-z]+(?:-[a-z]+)*\b|\bctrl-C\b|\bexit code\b"
)
_NUMBER = 12  # px, height of a number of an axis
_ROWS = 400  # rows of a table that are looked at


#: A widget and a text of it.
Shown = tuple[QWidget, str]


def shown_texts(window: QWidget) -> Iterator[Shown]:
    """Yield the texts of all widgets in ``window``, their tips and their cells among them.

    Texts that the operator writes, in editors and fields, are not among them.
    """
    for widget in (window, *window.findChildren(QWidget)):
        yield widget, _visible(widget.toolTip())
        yield widget, widget.accessibleName()
        if isinstance(widget, QLabel):
            yield widget, _visible(widget.text(), widget.textFormat())
        elif isinstance(widget, QAbstractButton):
            yield widget, widget.text()
        elif isinstance(widget, QGroupBox):
            yield widget, widget.title()
        elif isinstance(widget, QTabBar):
            for index in range(widget.count()):
                yield widget, widget.tabText(index)
                yield widget, _visible(widget.tabToolTip(index))
        elif isinstance(widget, QGraphicsView):
            for item in widget.items():
                if isinstance(item, QGraphicsTextItem):
                    yield widget, item.toPlainText()
        elif isinstance(widget, QComboBox | QAbstractItemView):
            for text in _of_model(widget):
                yield widget, text
        if isinstance(widget, QMenu):
            for action in widget.actions():
                yield widget, action.text()
                yield widget, _visible(action.toolTip())


def _of_model(widget: QComboBox | QAbstractItemView) -> Iterator[str]:
    model = widget.model()
    if model is None or isinstance(widget, QHeaderView):
        return
    columns = 1 if isinstance(model, QAbstractListModel) else model.columnCount()
    for column in range(columns):
        across, tip = Qt.Orientation.Horizontal, Qt.ItemDataRole.ToolTipRole
        yield str(model.headerData(column, across) or "")
        yield _visible(str(model.headerData(column, across, tip) or ""))
        for row in range(min(model.rowCount(), _ROWS)):
            index = model.index(row, column)
            yield str(index.data() or "")
            yield _visible(str(index.data(tip) or ""))


def _visible(text: str, form: Qt.TextFormat = Qt.TextFormat.AutoText) -> str:
    """Return what is seen of ``text`` in the format ``form``."""
    if form == Qt.TextFormat.PlainText:
        return text
    if form == Qt.TextFormat.AutoText and not QtGui.Qt.mightBeRichText(text):
        return text
    document = QTextDocument()
    document.setHtml(text)
    return document.toPlainText()


def rendered_markup(texts: Iterable[Shown], within: str, tag: str) -> list[str]:
    """Return those of ``shown_texts`` that show ``within``, a part of a name, without its ``tag``.

    A name from a file is ``tag`` and ``within``; Qt that takes it for HTML shows it without.
    """
    return [
        f"{type(widget).__name__}: {text!r}"
        for widget, text in texts
        if within in text and tag not in text
    ]


def unreadable(texts: Iterable[Shown]) -> list[str]:
    """Return those of ``shown_texts`` that hold a key of a file, ``+-`` for ±, or ``us`` for µs."""
    return sorted(
        {f"{type(widget).__name__}: {text!r}" for widget, text in texts if _RAW.search(text)}
    )


def commands(window: QWidget) -> list[str]:
    """Return the shown texts that name a command, its option, or a key of a terminal."""
    return sorted(
        {
            f"{type(widget).__name__}: {text!r}"
            for widget, text in shown_texts(window)
            if _COMMAND.search(text)
        }
    )


def lay_out() -> None:
    """Lay out what has changed, as Qt does before it paints: a text may be new at any moment."""
    QCoreApplication.sendPostedEvents(None, QEvent.Type.LayoutRequest.value)


def overlapping(window: QWidget) -> list[str]:
    """Return the pairs of labels, buttons and fields that cover a part of each other."""
    lay_out()
    kinds = (QLabel, QAbstractButton, QLineEdit, QComboBox, QAbstractSpinBox, QProgressBar)
    placed: list[tuple[QWidget, QRect]] = []
    for widget in window.findChildren(QWidget):
        if not isinstance(widget, kinds) or not widget.isVisible() or widget.window() is not window:
            continue
        if isinstance(widget, QLabel) and not widget.text().strip():
            continue
        seen = widget.visibleRegion().boundingRect()
        if seen.isEmpty() or any(parent.isAncestorOf(widget) for parent, _ in placed):
            continue  # a field of another one
        placed.append((widget, seen.translated(widget.mapTo(window, QPoint(0, 0)))))
    found = []
    for i, (one, at) in enumerate(placed):
        for other, there in placed[:i]:
            common = at.intersected(there)
            if min(common.width(), common.height()) > 1 and not one.isAncestorOf(other):
                found.append(f"{_named(one)} over {_named(other)}")
    return found


def stretched(window: QWidget) -> list[str]:
    """Return the messages that take the room of others: more than a line above their own need."""
    lay_out()
    return [
        f"{_named(message)}: {message.height()} px for {message.heightForWidth(message.width())}"
        for message in window.findChildren(Message)
        if message.isVisible()
        and message.height()
        > message.heightForWidth(message.width()) + message.fontMetrics().lineSpacing()
    ]


def sideways(window: QWidget) -> list[str]:
    """Return the pages and forms that scroll sideways; a report's wide tables may."""
    lay_out()
    return [
        f"{type(area.widget()).__name__} by {area.horizontalScrollBar().maximum()} px"
        for area in window.findChildren(QScrollArea)
        if area.isVisible()
        and not isinstance(area, ReportPage)
        and area.horizontalScrollBar().maximum() > 0
    ]


def squashed(window: QWidget) -> list[str]:
    """Return the plots that are lower than three of their numbers."""
    return [
        f"{canvas.accessibleName()}: {plot.vb.height():.0f} px"
        for canvas in window.findChildren(Canvas)
        if canvas.isVisible()
        for plot in canvas.area_plots
        if plot.isVisible() and plot.vb.height() < 3 * _NUMBER
    ]


def _named(widget: QWidget) -> str:
    text = widget.text() if isinstance(widget, QLabel | QAbstractButton) else ""
    return f"{type(widget).__name__} {text or widget.toolTip()!r}"


def cut_off(window: QWidget) -> list[str]:
    """Return the texts that do not fit into the widgets that are shown."""
    lay_out()
    found = []
    for widget in window.findChildren(QWidget):
        if not widget.isVisible() or widget.width() == 0:
            continue
        if isinstance(widget, QLabel):
            bad = _label_is_cut(widget)
            text = widget.text()
        elif isinstance(widget, QAbstractButton) and widget.text():
            bad = _button_is_cut(widget)
            text = widget.text()
        elif isinstance(widget, QTabBar):
            bad, text = (
                any(
                    widget.tabRect(i).width() < widget.tabSizeHint(i).width()
                    for i in range(widget.count())
                    if widget.isTabVisible(i)
                ),
                "tabs",
            )
        elif isinstance(widget, QComboBox):
            room = widget.width() - _ARROW
            bad, text = _wide(widget, widget.currentText()) > room, widget.currentText()
        elif isinstance(widget, QScrollArea) and widget.widget() is not None:
            off = Qt.ScrollBarPolicy.ScrollBarAlwaysOff
            bad = widget.horizontalScrollBarPolicy() == off and (
                widget.widget().width() > widget.viewport().width()
            )
            text = widget.accessibleName() or "what cannot be scrolled to"
        elif isinstance(widget, QTableView) and widget.horizontalHeader().isVisible():
            text = _cut_head(widget)
            bad = bool(text)
        else:
            continue
        if bad:
            found.append(f"{type(widget).__name__}: {text!r} in {widget.size().toTuple()}")
    return found


_ARROW = 24  # px of the arrow and the frame of a combo box


def _wide(widget: QWidget, text: str) -> int:
    return QFontMetrics(widget.font()).horizontalAdvance(text)


def _label_is_cut(widget: QLabel) -> bool:
    text = _visible(widget.text(), widget.textFormat())
    if not text.strip() or widget.pixmap().width():
        return False
    room = widget.contentsRect()
    if widget.buddy() is not None:
        text = text.replace("&", "", 1)
    if not widget.wordWrap():
        need = QFontMetrics(widget.font()).size(0, text)
        return need.width() > room.width() + 1 or need.height() > room.height() + 1
    flags = Qt.TextFlag.TextWordWrap
    need_of = QFontMetrics(widget.font()).boundingRect(
        QRect(0, 0, room.width(), 10_000), flags.value, text
    )
    return need_of.height() > room.height() + 2 or need_of.width() > room.width() + 1


def _button_is_cut(widget: QAbstractButton) -> bool:
    text = widget.text().replace("&&", "\0").replace("&", "").replace("\0", "&")
    if (
        isinstance(widget, QToolButton)
        and widget.toolButtonStyle() == Qt.ToolButtonStyle.ToolButtonIconOnly
        and not widget.icon().isNull()
    ):
        return False
    need = QFontMetrics(widget.font()).size(0, text)
    return need.width() > widget.width() or need.height() > widget.height()


def _cut_head(widget: QTableView) -> str:
    header, model = widget.horizontalHeader(), widget.model()
    for column in range(model.columnCount()):
        if header.isSectionHidden(column):
            continue
        text = str(model.headerData(column, Qt.Orientation.Horizontal) or "")
        need = max((_wide(header, line) for line in text.split("\n")), default=0)
        if text and need > header.sectionSize(column):
            return text
    return ""
