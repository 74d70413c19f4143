"""Plot of one recording with the models before and after a diagnosis, and their residuals."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from dearig.analysis.outcomes import Comparison
from dearig.report.numbers import significant
from dearig.units import SHOWN
from dearig.window.plotting import add_curve, add_legend, add_noise, clear_plot, stacked_plots
from dearig.window.session import Session
from dearig.window.theme import SPACE
from dearig.window.widgets import label

__all__ = ["BeforeAfterPlot"]

_Pair = tuple[Comparison, Comparison | None]


class BeforeAfterPlot(QWidget):
    """Shows one of several recordings; the second model of a pair may be None."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._pairs: tuple[_Pair, ...] = ()
        self.record = QComboBox()
        self.record.setToolTip(
            "Validation recordings, which no fit and no selection used, come first"
        )
        of = QLabel("Recor&ding")
        of.setBuddy(self.record)
        self.error_summary = label("", "muted")
        top = QHBoxLayout()
        top.addWidget(of)
        top.addWidget(self.record)
        top.addWidget(self.error_summary, 1)
        self.area, self.plots = stacked_plots((2, 4, 3))
        self.area.setAccessibleName("Measurement, models and residuals")
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE, SPACE, SPACE, SPACE)
        outer.addLayout(top)
        outer.addWidget(self.area, 1)
        self.record.currentIndexChanged.connect(self._draw)
        session.theme_changed.connect(self._draw)

    def show_pairs(self, pairs: tuple[_Pair, ...]) -> None:
        """Show these pairs, starting with the first."""
        self._pairs = pairs
        with QSignalBlocker(self.record):
            self.record.clear()
            for one, _ in pairs:
                role = "training" if one.role == "train" else "validation"
                self.record.addItem(f"{one.name} ({role})")
        self._draw()

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        self.area.setBackground(QColor(theme.surface))
        for plot in self.plots:
            clear_plot(plot, theme)
        index = self.record.currentIndex()
        if not 0 <= index < len(self._pairs):
            self.error_summary.setText("")
            return
        before, after = self._pairs[index]
        shown = SHOWN[before.kind]
        drive, both, error = self.plots
        drive.setLabel("left", shown.drive_label)
        both.setLabel("left", shown.label)
        error.setLabel("left", f"Residual ({shown.error_unit})")
        error.setLabel("bottom", "Time (s)")
        add_legend(both, theme)
        time = before.time
        add_curve(drive, time, before.drive * shown.drive_factor, theme.command)
        add_curve(both, time, before.measured * shown.factor, theme.measured, "measured")
        said = []
        for comparison, colour, name in (
            (before, theme.models[0], "before" if after is not None else "model"),
            (after, theme.models[1], "after"),
        ):
            if comparison is None:
                continue
            add_curve(both, time, comparison.model * shown.factor, colour, name)
            left = (comparison.measured - comparison.model) * shown.error_factor
            add_curve(error, time, left, colour)
            rms = significant(comparison.errors.rms * shown.error_factor)
            said.append(f"{name} {rms} {shown.error_unit} RMS")
        if before.noise:
            level = before.noise * shown.error_factor
            add_noise(error, theme, -level, level)
            said.append(f"noise {significant(level)} {shown.error_unit}")
        self.error_summary.setText("   ".join(said))
        self.plots[0].setXRange(time[0], time[-1], padding=0.0)
        for plot in self.plots:
            plot.enableAutoRange(axis="y")
