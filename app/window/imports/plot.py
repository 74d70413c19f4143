"""Plot of what an import would bring in."""

from __future__ import annotations

from PySide6.QtCore import Slot
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.analysis.import_preview import ImportTrial
from dearig.units import SHOWN
from dearig.window.plots.area import PlotArea
from dearig.window.session.state import Session

__all__ = ["ImportPlot"]


class ImportPlot(QWidget):
    """Drive and measured quantity of a ``ImportTrial`` over time."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.shown: ImportTrial | None = None
        self.area = PlotArea(session, "Data of the import")
        self.drive = self.area.add_plot(0, left="Voltage (kV)", weight=3)
        self.measured = self.area.add_plot(1, left="Displacement (mm)", weight=5)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(self.area)
        session.theme_changed.connect(self._draw)

    def show_trial(self, trial: ImportTrial | None) -> None:
        """Draw ``trial``, or nothing."""
        self.shown = trial
        self._draw()
        self.area.auto_range()

    @Slot()
    def _draw(self) -> None:
        trial, theme = self.shown, self._session.theme
        for plot in (self.drive, self.measured):
            plot.clear_all()
        shown = SHOWN[trial.kind if trial else "actuator"]
        self.drive.set_axis("left", shown.drive_label)
        self.measured.set_axis("left", shown.label)
        if trial is None:
            return
        names = (
            (("voltage_command", "voltage"), ("displacement", "displacement"))
            if trial.kind == "actuator"
            else (("stretch", "stretch"), ("nominal_stress", "nominal stress"))
        )
        for plot, factor, colour, (name, words) in zip(
            (self.drive, self.measured),
            (shown.drive_factor, shown.factor),
            (theme.command, theme.measured),
            names,
            strict=True,
        ):
            time, values = trial.curves[name]
            plot.add_curve(words, colour).set_points(time, values * factor)
        if "voltage_monitor" in trial.curves:
            time, volts = trial.curves["voltage_monitor"]
            self.drive.add_curve("monitor", theme.monitor).set_points(
                time, volts * shown.drive_factor
            )
