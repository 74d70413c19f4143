"""State of the high voltage: what is known of it, as words, a shape and a colour.

A state at rest is a measurement with its time of day, never a guess: see ``HighVoltageStatus``.
"""

from __future__ import annotations

from enum import Enum

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from dearig.output_state import Known
from dearig.window.kit.widgets import number_text, plain_tip

__all__ = ["HighVoltage", "HighVoltageBadge", "kilovolts", "state_at_rest"]


class HighVoltage(Enum):
    """Voltage that may be on the electrodes, as far as this program has measured it."""

    NOT_CONTACTED = "NOT CONTACTED"
    CONFIRMED = "0 V CONFIRMED"
    COMMANDED = "0 V NOT CONFIRMED"
    UNKNOWN = "UNKNOWN"
    ARMED = "ARMED"
    BETWEEN = "BETWEEN RUNS"
    ON = "HIGH VOLTAGE"
    RAMPING = "RAMPING DOWN"


EXPLAINED = {
    HighVoltage.NOT_CONTACTED: "This program has not contacted the rig: it knows nothing of its "
    "voltage. Look at the amplifier before you touch the film.",
    HighVoltage.CONFIRMED: "The voltage monitor read 0 V at this time. Look at the amplifier too "
    "before you touch the film.",
    HighVoltage.COMMANDED: "The output was set to 0 V, and the voltage monitor was not read after "
    "that. Switch the amplifier's high voltage off by hand before you touch the film.",
    HighVoltage.UNKNOWN: "There may be high voltage. Switch the amplifier's high voltage off by "
    "hand.",
    HighVoltage.ARMED: "Start (F6) begins the run; Esc or Space disarms, outside text fields. "
    "Keep away from the electrodes.",
    HighVoltage.BETWEEN: "The output is at 0 V. The campaign starts its next run automatically, "
    "unless it is paused. Esc, Space or STOP ends the campaign. Keep away from the electrodes.",
    HighVoltage.ON: "A sequence is playing. The electrodes may carry 8 kV and more. Esc or Space "
    "stops.",
    HighVoltage.RAMPING: "The voltage is being ramped down to 0 V. Esc, Space or STOP: 0 V at "
    "once.",
}
# background and text; the same in the light and the dark theme
_COLOURS = {
    HighVoltage.NOT_CONTACTED: ("#6b7280", "#ffffff"),
    HighVoltage.CONFIRMED: ("#00785a", "#ffffff"),
    HighVoltage.COMMANDED: ("#16181d", "#f0e442"),
    HighVoltage.UNKNOWN: ("#16181d", "#f0e442"),
    HighVoltage.ARMED: ("#f0b429", "#16181d"),
    HighVoltage.BETWEEN: ("#f0b429", "#16181d"),
    HighVoltage.ON: ("#c43d00", "#ffffff"),
    HighVoltage.RAMPING: ("#f0b429", "#16181d"),
}
_AT_REST = {
    Known.CONFIRMED: HighVoltage.CONFIRMED,
    Known.COMMANDED: HighVoltage.COMMANDED,
    Known.UNKNOWN: HighVoltage.UNKNOWN,
}
_CROSSED = (HighVoltage.COMMANDED, HighVoltage.UNKNOWN)
_SMALLEST = 8  # px of a text that is made smaller to fit


def state_at_rest(known: Known) -> HighVoltage:
    """Return the state of an output that is ``known`` like that, without a run."""
    return _AT_REST[known]


def kilovolts(volts: float, decimals: int = 2) -> str:
    """Return ``volts`` in kV with their unit; a small negative value is 0, never -0."""
    return f"{number_text(volts * 1e-3, decimals)} kV"


class HighVoltageBadge(QWidget):
    """Shows a ``HighVoltage`` with its shape, and in the ``large`` one a line of detail.

    ``painted`` carries the state whenever it has been drawn.
    """

    painted = Signal(object)

    def __init__(self, large: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._large = large
        self._state = HighVoltage.NOT_CONTACTED
        self._detail = ""
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.show_state(self._state)

    @property
    def state(self) -> HighVoltage:
        """State that is shown."""
        return self._state

    @property
    def detail(self) -> str:
        """Line that is shown below the state."""
        return self._detail

    def show_state(self, state: HighVoltage, detail: str = "") -> None:
        """Show ``state``, and ``detail`` such as 7.9 kV with it."""
        self._state, self._detail = state, detail
        self.setToolTip(plain_tip(f"{detail}\n{EXPLAINED[state]}" if detail else EXPLAINED[state]))
        self.setAccessibleName(f"High voltage: {state.value} {detail}")
        self.update()

    def sizeHint(self) -> QSize:  # noqa: N802
        return QSize(260, 64) if self._large else QSize(240, 44)

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        return QSize(200, 64) if self._large else QSize(170, 44)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        back, front = (QColor(c) for c in _COLOURS[self._state])
        area = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        painter.setPen(QPen(front, 2) if self._state in _CROSSED else QPen(back))
        painter.setBrush(back)
        painter.drawRoundedRect(area, 6, 6)
        side = area.height() * 0.6
        spot = QRectF(area.left() + side * 0.35, area.center().y() - side / 2, side, side)
        _shape(painter, self._state, spot, front)
        painter.setPen(front)
        words = area.adjusted(side * 1.7, 0, -6, 0)
        if self._large and self._detail:
            upper, lower = words.adjusted(0, 4, 0, -words.height() / 2), QRectF(words)
            lower.setTop(words.center().y())
            self._write(painter, upper, self._state.value, 0.34 * area.height())
            self._write(painter, lower.adjusted(0, 0, 0, -4), self._detail, 0.27 * area.height())
        else:
            self._write(painter, words, self._state.value, 0.42 * area.height())
        painter.end()
        self.painted.emit(self._state)

    def _write(self, painter: QPainter, place: QRectF, text: str, pixels: float) -> None:
        """Write ``text`` in bold letters ``pixels`` high, or in two lines of smaller ones."""
        font = QFont(self.font())
        font.setBold(True)
        size = int(pixels)
        flags = Qt.AlignmentFlag.AlignVCenter | Qt.TextFlag.TextWordWrap
        while size > _SMALLEST:
            font.setPixelSize(size)
            needed = QFontMetricsF(font).boundingRect(place, flags.value, text)
            if needed.width() <= place.width() and needed.height() <= place.height():
                break
            size -= 1
        painter.setFont(font)
        painter.drawText(place, flags.value, text)


def _shape(painter: QPainter, state: HighVoltage, spot: QRectF, colour: QColor) -> None:
    """Draw the shape of ``state``.

    A dashed ring (not contacted), a ring (0 V), a crossed box (not confirmed, unknown), a triangle
    (armed, between runs), a bolt (on) or an arrow down (ramping).
    """
    pen = QPen(colour, max(2.0, spot.width() / 9))
    if state is HighVoltage.NOT_CONTACTED:
        pen.setStyle(Qt.PenStyle.DotLine)
    painter.setPen(pen)
    painter.setBrush(Qt.BrushStyle.NoBrush)

    def points(*places: tuple[float, float]) -> QPolygonF:
        return QPolygonF(
            [QPointF(spot.left() + x * spot.width(), spot.top() + y * spot.height())
             for x, y in places]
        )  # fmt: skip

    if state in (HighVoltage.NOT_CONTACTED, HighVoltage.CONFIRMED):
        painter.drawEllipse(spot)
        return
    if state in _CROSSED:
        painter.drawRect(spot)
        painter.drawLine(spot.topLeft(), spot.bottomRight())
        painter.drawLine(spot.topRight(), spot.bottomLeft())
        return
    if state in (HighVoltage.ARMED, HighVoltage.BETWEEN):
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
