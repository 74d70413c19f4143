"""State of the high voltage as a colour, a shape and a word, readable at two metres."""

from __future__ import annotations

from enum import Enum

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from dearig.window.session import Session

__all__ = ["HighVoltage", "HighVoltageBadge"]


class HighVoltage(Enum):
    """Voltage that may be on the electrodes, as far as this program knows."""

    SAFE = "SAFE  0 V"
    ARMED = "ARMED"
    ON = "HIGH VOLTAGE"
    RAMPING = "RAMPING DOWN"
    UNCONFIRMED = "NOT CONFIRMED"


_EXPLAINED = {
    HighVoltage.SAFE: "The output of this program is at 0 V. Check that the amplifier also shows "
    "0 V before you touch the film.",
    HighVoltage.ARMED: "Start begins the run. Keep away from the electrodes.",
    HighVoltage.ON: "A sequence is playing. The electrodes may carry 8 kV and more.",
    HighVoltage.RAMPING: "The voltage is being ramped down to 0 V.",
    HighVoltage.UNCONFIRMED: "It is not known whether the output is at 0 V. Switch the amplifier's "
    "high voltage off by hand.",
}
# background and text; the same in the light and the dark theme
_COLOURS = {
    HighVoltage.SAFE: ("#00785a", "#ffffff"),
    HighVoltage.ARMED: ("#f0b429", "#16181d"),
    HighVoltage.ON: ("#c43d00", "#ffffff"),
    HighVoltage.RAMPING: ("#f0b429", "#16181d"),
    HighVoltage.UNCONFIRMED: ("#16181d", "#f0e442"),
}


class HighVoltageBadge(QWidget):
    """Shows a ``HighVoltage``, and the voltage in kV where it is known."""

    def __init__(self, session: Session, large: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._large = large
        self._state = HighVoltage.SAFE
        self._detail = ""
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.show_state(HighVoltage.SAFE)

    @property
    def state(self) -> HighVoltage:
        """State that is shown."""
        return self._state

    def show_state(self, state: HighVoltage, detail: str = "") -> None:
        """Show ``state``, and ``detail`` such as 7.9 kV beside it."""
        self._state, self._detail = state, detail
        self.setToolTip(_EXPLAINED[state])
        self.setAccessibleName(f"High voltage: {state.value} {detail}")
        self.update()

    def sizeHint(self) -> QSize:  # noqa: N802
        return QSize(260, 64) if self._large else QSize(210, 26)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        back, front = (QColor(c) for c in _COLOURS[self._state])
        area = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        painter.setPen(QPen(front, 2) if self._state is HighVoltage.UNCONFIRMED else QPen(back))
        painter.setBrush(back)
        painter.drawRoundedRect(area, 6, 6)
        side = area.height() * 0.62
        spot = QRectF(area.left() + side * 0.4, area.center().y() - side / 2, side, side)
        _shape(painter, self._state, spot, front)
        painter.setPen(front)
        font = painter.font()
        font.setBold(True)
        font.setPixelSize(int(area.height() * (0.34 if self._large else 0.54)))
        painter.setFont(font)
        words = area.adjusted(side * 1.8, 0, -6, 0)
        vertical = Qt.AlignmentFlag.AlignVCenter
        if self._large and self._detail:
            upper, lower = words.adjusted(0, 4, 0, -words.height() / 2), QRectF(words)
            lower.setTop(words.center().y())
            painter.drawText(upper, vertical, self._state.value)
            font.setPixelSize(int(area.height() * 0.29))
            painter.setFont(font)
            painter.drawText(lower.adjusted(0, 0, 0, -4), vertical, self._detail)
        else:
            text = f"{self._state.value}  {self._detail}".rstrip()
            painter.drawText(words, vertical, text)
        painter.end()


def _shape(painter: QPainter, state: HighVoltage, spot: QRectF, colour: QColor) -> None:
    """Draw a ring (safe), triangle (armed), bolt (on), arrow down (ramping) or crossed box."""
    painter.setPen(QPen(colour, max(2.0, spot.width() / 9)))
    painter.setBrush(Qt.BrushStyle.NoBrush)

    def points(*places: tuple[float, float]) -> QPolygonF:
        return QPolygonF(
            [QPointF(spot.left() + x * spot.width(), spot.top() + y * spot.height())
             for x, y in places]
        )  # fmt: skip

    if state is HighVoltage.SAFE:
        painter.drawEllipse(spot)
        return
    if state is HighVoltage.UNCONFIRMED:
        painter.drawRect(spot)
        painter.drawLine(spot.topLeft(), spot.bottomRight())
        painter.drawLine(spot.topRight(), spot.bottomLeft())
        return
    if state is HighVoltage.ARMED:
        painter.drawPolygon(points((0.5, 0.05), (1.0, 0.95), (0.0, 0.95)))
        return
    painter.setBrush(colour)
    painter.setPen(Qt.PenStyle.NoPen)
    if state is HighVoltage.ON:
        painter.drawPolygon(
            points((0.62, 0.0), (0.12, 0.58), (0.46, 0.58), (0.36, 1.0), (0.88, 0.38), (0.54, 0.38))
        )
    else:
        painter.drawPolygon(
            points((0.35, 0.0), (0.65, 0.0), (0.65, 0.5), (0.95, 0.5), (0.5, 1.0), (0.05, 0.5),
                   (0.35, 0.5))
        )  # fmt: skip
