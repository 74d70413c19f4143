"""Plot of displacement against voltage or its square, with the areas of the loops."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Slot
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from dearig.analysis.loops import Loops
from dearig.report.text.numbers import significant
from dearig.window.kit.widgets import label
from dearig.window.plots.area import PlotArea
from dearig.window.session.state import Session

__all__ = ["LoopPlot", "area_text"]

_SQUARED = "\N{SUPERSCRIPT TWO}"
_TIP = (
    "Hysteresis area of one cycle: the integral of displacement over voltage, or over its square, "
    "around the loop. It is positive where displacement lags the voltage."
)


def area_text(loops: Loops, squared: bool) -> str:
    """Return the mean hysteresis area of a cycle with its unit, and its range over the cycles."""
    if not loops.cycles:
        return "no complete cycle"
    unit = f"kV{_SQUARED}\N{DOT OPERATOR}mm" if squared else "kV\N{DOT OPERATOR}mm"
    scale = 1e-6 * 1e3 if squared else 1e-3 * 1e3
    areas = [scale * (c.area_squared if squared else c.area) for c in loops.cycles]
    text = f"area {significant(scale * loops.mean_area(squared))} {unit} per cycle"
    if len(areas) > 1:
        low, high = significant(min(areas)), significant(max(areas))
        text += f" ({len(areas)} cycles, {low} to {high})"
    return text.replace("-", "\N{MINUS SIGN}")


class LoopPlot(QWidget):
    """Shows the loops of one or several recordings, with their areas in the key."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._shown: tuple[Loops, ...] = ()
        self.against = QComboBox()
        self.against.addItem("voltage", False)
        self.against.addItem("voltage squared", True)
        self.against.setToolTip("Horizontal axis; Maxwell stress goes with the square of voltage")
        caption = QLabel("Displacement &against")
        caption.setBuddy(self.against)
        self.note = label("Area: positive where displacement lags", "muted", _TIP)
        row = QHBoxLayout()
        for widget in (caption, self.against):
            row.addWidget(widget)
        row.addStretch(1)
        row.addWidget(self.note)
        self.area = PlotArea(session, "Displacement against voltage")
        self.plot = self.area.add_plot(
            0, left="Displacement (mm)", bottom="Voltage (kV)", group="voltage"
        )
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(2)
        outer.addLayout(row)
        outer.addWidget(self.area, 1)
        self.against.currentIndexChanged.connect(self._another_axis)
        session.theme_changed.connect(self._draw)

    def show_loops(self, loops: Sequence[Loops], keep_range: bool = False) -> None:
        """Draw ``loops``, one for each recording; a range that was chosen is kept, or not."""
        self._shown = tuple(loops)
        self._draw()
        if not keep_range:
            self.area.auto_range()

    @Slot()
    def _another_axis(self) -> None:
        self._draw()
        self.area.auto_range()

    @Slot()
    def _draw(self) -> None:
        theme, squared = self._session.theme, bool(self.against.currentData())
        self.plot.clear_all()
        self.plot.set_axis(
            "bottom", f"Voltage squared (kV{_SQUARED})" if squared else "Voltage (kV)"
        )
        for i, loops in enumerate(self._shown):
            alone = len(self._shown) == 1
            colour = theme.measured if alone else theme.curves[i % len(theme.curves)]
            volts = loops.voltage * 1e-3
            self.plot.add_curve(f"{loops.name}: {area_text(loops, squared)}", colour).set_points(
                volts**2 if squared else volts, loops.displacement * 1e3
            )
        self.area.file_stem = (
            f"{self._shown[0].name} loops" if len(self._shown) == 1 else "loops"
        )  # fmt: skip
        self.area.fit()
