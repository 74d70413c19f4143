"""Plot of one recording with the models before and after a diagnosis, and their residuals."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Slot
from PySide6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from dearig.analysis.outcomes import Comparison
from dearig.report.text.numbers import significant
from dearig.units import SHOWN
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel, name_list
from dearig.window.plots.area import PlotArea
from dearig.window.plots.plot import LegendEntry
from dearig.window.session.state import Session

__all__ = ["BeforeAfterPlot"]

_Pair = tuple[Comparison, Comparison | None]


class BeforeAfterPlot(QWidget):
    """Shows one of several recordings; the second model of a pair may be None."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._pairs: tuple[_Pair, ...] = ()
        self.record = name_list()
        self.record.setToolTip(
            "Validation recordings, which no fit and no selection used, come first"
        )
        of = QLabel("Recor&ding")
        of.setBuddy(self.record)
        self.error_summary = ElidedLabel("muted")
        top = QHBoxLayout()
        top.addWidget(of)
        top.addWidget(self.record)
        top.addWidget(self.error_summary, 1)
        self.area = PlotArea(session, "Measurement, models and residuals")
        labels = ("Voltage (kV)", "Displacement (mm)", "Residual (µm)", "Residual (µm)")
        # each residual has a plot: one would hide the other, which is about as large
        self.plots = [
            self.area.add_plot(row, left=label, weight=weight)
            for row, (label, weight) in enumerate(zip(labels, (3, 6, 4, 4), strict=True))
        ]
        self.area.share_y(*self.plots[2:])
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
        for plot in self.plots:
            plot.clear_all()
        index = self.record.currentIndex()
        if not 0 <= index < len(self._pairs):
            self.error_summary.show_text("")
            return
        before, after = self._pairs[index]
        shown = SHOWN[before.kind]
        drive, both, *residuals = self.plots
        drive.set_axis("left", shown.drive_label)
        both.set_axis("left", shown.label)
        time = before.time
        drive.add_curve("commanded", theme.command).set_points(
            time, before.drive * shown.drive_factor
        )
        both.add_curve("measured", theme.measured).set_points(time, before.measured * shown.factor)
        said = []
        for error, comparison, colour, name in (
            (residuals[0], before, theme.models[0], "before" if after is not None else "model"),
            (residuals[1], after, theme.models[1], "after"),
        ):
            self.area.show_plot(error, comparison is not None)
            if comparison is None:
                continue
            error.set_axis("left", f"Residual ({shown.error_unit})")
            both.add_curve(name, colour).set_points(time, comparison.model * shown.factor)
            left = (comparison.measured - comparison.model) * shown.error_factor
            error.add_curve(f"residual, {name}", colour).set_points(time, left)
            rms = significant(comparison.errors.rms * shown.error_factor)
            said.append(f"{name} {rms} {shown.error_unit} RMS")
            if before.noise:
                level = before.noise * shown.error_factor
                error.add_levels(theme, "Noise floor", -level, level)
                error.add_entry(LegendEntry("noise floor", theme.muted, dashed=True))
        if before.noise:
            level = before.noise * shown.error_factor
            said.append(f"noise {significant(level)} {shown.error_unit}")
        self.error_summary.show_text("   ".join(said))
        self.area.file_stem = f"{before.name} residuals"
        self.area.auto_range()
