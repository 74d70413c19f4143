"""Small parts of which the pages are made."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QLayout,
    QPushButton,
    QSizePolicy,
    QWidget,
)

from dearig.window.theme import SPACE, digits

__all__ = ["Message", "Readout", "button", "card", "label", "set_role"]


def label(text: str, role: str = "", tip: str = "") -> QLabel:
    """Words; ``role`` is one of the theme's: title, heading, muted, good, warn, bad."""
    made = QLabel(text)
    if role:
        made.setProperty("role", role)
    if tip:
        made.setToolTip(tip)
    return made


def set_role(widget: QWidget, role: str) -> None:
    """Let a widget that is shown already take another role."""
    if widget.property("role") == role:
        return
    widget.setProperty("role", role)
    widget.style().unpolish(widget)
    widget.style().polish(widget)


def button(text: str, tip: str, primary: bool = False) -> QPushButton:
    """A button that says in its tip what it does; & stands before the letter of its key."""
    made = QPushButton(text)
    made.setToolTip(tip)
    if primary:
        made.setProperty("role", "primary")
    return made


def card(layout: QLayout) -> QFrame:
    """A frame around ``layout``."""
    frame = QFrame()
    frame.setProperty("role", "card")
    layout.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
    frame.setLayout(layout)
    return frame


class Message(QLabel):
    """A message where it belongs: hidden while there is nothing to say."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWordWrap(True)
        self.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse
            | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
        self.hide()

    def show_text(self, text: str, role: str = "bad") -> None:
        """Show ``text``; nothing, to hide."""
        set_role(self, role)
        self.setText(text)
        self.setVisible(bool(text))


class Readout(QWidget):
    """A number in large digits, with its name and its unit."""

    def __init__(self, name: str, unit: str, tip: str, points: int = 17) -> None:
        super().__init__()
        self._value = QLabel("—")
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
        """Show ``value``, or a dash where it is not a number."""
        # a dash keeps the place of a number without being one
        # + 0.0: what is rounded to nothing is not negative
        text = f"{round(value, decimals) + 0.0:.{decimals}f}" if value == value else "—"
        if self._value.text() != text:
            self._value.setText(text)

    @property
    def text(self) -> str:
        """What it shows."""
        return self._value.text()
