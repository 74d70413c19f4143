"""Small widgets that the pages share."""

from __future__ import annotations

import math
from html import escape

from PySide6 import QtGui
from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import (
    QComboBox,
    QFrame,
    QHBoxLayout,
    QLabel,
    QLayout,
    QMenu,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QWidget,
)

from dearig.units import readable
from dearig.window.kit.theme import SPACE, digits

__all__ = [
    "ElidedLabel",
    "Message",
    "Readout",
    "button",
    "card",
    "label",
    "menu_button",
    "name_list",
    "number_text",
    "plain_tip",
    "set_role",
    "set_wrong",
]

_NAME_WIDTH = 420  # px of a list of names, at most
_EDGES = 2  # px of a line that are not for its text: glyphs reach beyond their advance


def label(text: str, role: str = "", tip: str = "") -> QLabel:
    """Make a label; ``role`` is one of the theme's: title, heading, muted, good, warn, bad."""
    made = QLabel(text)
    # by default Qt takes what looks like HTML for it, and loads the pictures that it names
    made.setTextFormat(Qt.TextFormat.PlainText)
    if role:
        made.setProperty("role", role)
    if tip:
        made.setToolTip(plain_tip(tip))
    return made


def plain_tip(text: str) -> str:
    """Return a tooltip that shows ``text`` as it is; Qt has no plain ones."""
    return escape(text) if QtGui.Qt.mightBeRichText(text) else text


def set_role(widget: QWidget, role: str) -> None:
    """Give a widget another role, also while it is shown."""
    _set_property(widget, "role", role)


def set_wrong(widget: QWidget, wrong: bool) -> None:
    """Mark a field as holding a wrong value, or not."""
    if bool(widget.property("wrong")) != wrong:
        _set_property(widget, "wrong", wrong)


def _set_property(widget: QWidget, name: str, value: object) -> None:
    if widget.property(name) == value:
        return
    widget.setProperty(name, value)
    widget.style().unpolish(widget)  # the style sheet looks at properties only here
    widget.style().polish(widget)


def button(text: str, tip: str, primary: bool = False) -> QPushButton:
    """Make a button with a tooltip; & stands before the letter of its key."""
    made = QPushButton(text)
    made.setToolTip(tip)
    if primary:
        made.setProperty("role", "primary")
    return made


def name_list() -> QComboBox:
    """Make a list of names that grows with the longest, up to a width."""
    made = QComboBox()
    made.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
    made.setMaximumWidth(_NAME_WIDTH)
    return made


def menu_button(text: str, tip: str, menu: QMenu) -> QToolButton:
    """Make a button that opens ``menu``."""
    made = QToolButton()
    made.setText(text)
    made.setToolTip(tip)
    made.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
    made.setMinimumHeight(28)
    made.setMenu(menu)
    return made


def card(layout: QLayout) -> QFrame:
    """Make a frame around ``layout``."""
    frame = QFrame()
    frame.setProperty("role", "card")
    layout.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
    frame.setLayout(layout)
    return frame


class Message(QLabel):
    """A message next to what it is about; hidden while it is empty."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
        self.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse
            | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
        self.hide()

    def show_text(self, text: str, role: str = "bad") -> None:
        """Show ``text`` in the colour of ``role``; an empty text hides the message."""
        set_role(self, role)
        self.setText(readable(text))
        self.setVisible(bool(text))


class ElidedLabel(QLabel):
    """One line of plain text that is cut at its end where there is no room; the tip has all.

    It takes the room that is left; with ``hugging`` it asks for that of its text, and takes less
    where there is less.
    """

    def __init__(
        self, role: str = "", *, hugging: bool = False, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self._hugging = hugging
        policy = QSizePolicy.Policy.Maximum if hugging else QSizePolicy.Policy.Ignored
        self.setSizePolicy(policy, QSizePolicy.Policy.Fixed)
        self.full_text = ""  #: text that is shown as far as there is room
        if role:
            self.setProperty("role", role)

    def show_text(self, text: str, tip: str = "") -> None:
        """Show ``text``; the tool tip has it whole, with ``tip`` below it."""
        whole = plain_tip(f"{text}\n{tip}" if tip else text)
        if text != self.full_text or whole != self.toolTip():
            self.full_text = text
            self.setToolTip(whole)
            self._cut()
            self.updateGeometry()

    def sizeHint(self) -> QSize:  # noqa: N802
        hint = super().sizeHint()
        if self._hugging:
            hint.setWidth(self.fontMetrics().size(0, self.full_text).width() + _EDGES)
        return hint

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        return QSize(0, super().minimumSizeHint().height())

    def resizeEvent(self, event: QtGui.QResizeEvent) -> None:  # noqa: N802
        super().resizeEvent(event)
        self._cut()

    def _cut(self) -> None:
        room = max(self.width() - _EDGES, 0)
        self.setText(
            self.fontMetrics().elidedText(self.full_text, Qt.TextElideMode.ElideRight, room)
        )


def number_text(value: float, decimals: int) -> str:
    """Return ``value`` with its decimals, or a dash where it is NaN; never "-0.00"."""
    if math.isnan(value):
        return "—"
    # + 0.0 turns a negative zero, which a small negative value is rounded to, into zero
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


class Readout(QWidget):
    """A number in large digits, with its name and its unit."""

    def __init__(self, name: str, unit: str, tip: str, points: int = 17) -> None:
        super().__init__()
        self._value = label("—")
        self._value.setFont(digits(points))
        self._value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self._name = label(name, "muted")
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self._name)
        row.addWidget(self._value, 1)
        of = label(unit, "muted")
        of.setMinimumWidth(28)
        row.addWidget(of)
        self.setToolTip(tip)
        self.setAccessibleName(name)

    def show_number(self, value: float, decimals: int) -> None:
        """Show ``value``, or a dash where it is NaN."""
        text = number_text(value, decimals)
        if self._value.text() != text:
            self._value.setText(text)

    def show_past(self, past: bool) -> None:
        """Show the number in grey: it is that of the last sample of a run that has ended."""
        set_role(self._value, "muted" if past else "")

    @property
    def text(self) -> str:
        """Text that is shown."""
        return self._value.text()
