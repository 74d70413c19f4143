"""Plot of a number of many recordings over the time of their runs."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPointF, QSignalBlocker, Qt, Signal, Slot
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from dearig.analysis.summary import QUANTITIES, RecordingSummary, how_it_ended, numbers
from dearig.report.text.numbers import significant
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel
from dearig.window.plots.area import PlotArea
from dearig.window.plots.plot import Plot
from dearig.window.session.state import Session

__all__ = ["TrendPlot"]

_ALL = "All films"
_NAMELESS = "(film without a name)"
_SIZE, _MARK = 9, 17  # px, diameters of a point and of the disc behind a selected one
_NEAR = 12.0  # px from a point within which a click selects it
#: Symbol and name of a point by how the run ended: told apart without colours.
_ENDS = {"": ("o", "finished"), "warning": ("t", "with a warning"), "fault": ("x", "with a fault")}
_BOTTOM = "Start of the run (local time)"


class TrendPlot(QWidget):
    """One point for each run of a film; ``picked`` carries the recording of a clicked point."""

    picked = Signal(Path)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._summaries: tuple[RecordingSummary, ...] = ()
        self._chosen: frozenset[Path] = frozenset()
        self._found: list[tuple[float, float, RecordingSummary]] = []
        self.film = QComboBox()
        self.film.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.film.setToolTip("Film whose runs are shown")
        self.quantity = QComboBox()
        self.quantity.setToolTip("Number of a recording that is shown over time")
        for quantity in QUANTITIES:
            self.quantity.addItem(quantity.label, quantity.key)
            place = self.quantity.count() - 1
            self.quantity.setItemData(place, quantity.tip, Qt.ItemDataRole.ToolTipRole)
        self.quantity.setCurrentIndex(self.quantity.findData("peak_mm"))
        self.words = ElidedLabel("muted")
        self.area = PlotArea(session, "Trend of the recordings")
        self.plot = self.area.add_plot(0, left="Number", bottom=_BOTTOM, group="date", dates=True)
        self.area.canvas.clicked.connect(self._clicked)
        top = QHBoxLayout()
        for text, box in (("&Film", self.film), ("&Quantity", self.quantity)):
            caption = QLabel(text)
            caption.setBuddy(box)
            top.addWidget(caption)
            top.addWidget(box)
        top.addWidget(self.words, 1)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE // 2, SPACE // 2, 0, 0)
        outer.addLayout(top)
        outer.addWidget(self.area, 1)
        self.film.currentIndexChanged.connect(self._another)
        self.quantity.currentIndexChanged.connect(self._another)
        session.theme_changed.connect(self._draw)
        self._another()

    @property
    def points(self) -> list[tuple[Path, float, float]]:
        """The drawn points: recording, Unix time in s, and value in the shown unit."""
        return [(summary.path, started, value) for started, value, summary in self._found]

    def show_summaries(
        self, summaries: Sequence[RecordingSummary], chosen: Sequence[Path] = ()
    ) -> None:
        """Show these recordings, and mark ``chosen``; the film stays if it is among them."""
        self._chosen = frozenset(chosen)
        self._summaries = tuple(s for s in summaries if not s.trouble)
        counts: dict[str, int] = {}
        for summary in self._summaries:
            counts[summary.film] = counts.get(summary.film, 0) + 1
        before = self.film.currentData()
        with QSignalBlocker(self.film):
            self.film.clear()
            self.film.addItem(f"{_ALL} ({len(self._summaries)})", None)
            for name in sorted(counts, key=str.casefold):
                self.film.addItem(f"{name or _NAMELESS} ({counts[name]})", name)
            self.film.setCurrentIndex(0 if before is None else max(self.film.findData(before), 0))
        self._another()

    def show_chosen(self, paths: Sequence[Path]) -> None:
        """Mark the points of the selected recordings, and show the film of the first one."""
        self._chosen = frozenset(paths)
        first = next((s for s in self._summaries if s.path in self._chosen), None)
        shown = self.film.currentData()
        if first is not None and shown is not None and first.film != shown:
            self.film.setCurrentIndex(max(self.film.findData(first.film), 0))
        else:
            self._draw()

    @Slot()
    def _another(self) -> None:
        """Draw another film or quantity, over its whole time."""
        key, film = self.quantity.currentData(), self.film.currentData()
        self._found = []
        without = 0
        for summary in self._summaries:
            if film is not None and summary.film != film:
                continue
            started, value = _started(summary), numbers(summary).get(key)
            if started is None or value is None:
                without += 1
            else:
                self._found.append((started, value, summary))
        self._found.sort(key=lambda row: row[0])
        count = len(self._found)
        text = f"{count} run{'' if count == 1 else 's'}"
        if without:
            text += f"; {without} without this number, or not read yet"
        self.words.show_text(f"{text}. Click a point to select its recording")
        self.area.file_stem = f"trend of {self.quantity.currentText()}"
        self._draw()
        self.area.auto_range()

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        self.plot.clear_all()
        self.plot.set_axis("left", self.quantity.currentText())
        if not self._found:
            return
        time = np.array([row[0] for row in self._found])
        value = np.array([row[1] for row in self._found])
        levels = np.array([how_it_ended(row[2])[0] for row in self._found])
        marked = np.array([row[2].path in self._chosen for row in self._found])
        # the runs of several films are not a series
        if len({row[2].film for row in self._found}) == 1:
            self.plot.add_curve("all runs", theme.muted, in_key=False).set_points(time, value)
        self.plot.add_curve(
            "selected", theme.text, symbol="o", line=False, size=_MARK, in_key=bool(marked.any())
        ).set_points(time[marked], value[marked])
        colours = {"": theme.accent, "warning": theme.warn, "fault": theme.bad}
        for level, (symbol, name) in _ENDS.items():
            chosen = levels == level
            if chosen.any():
                self.plot.add_curve(
                    name, colours[level], symbol=symbol, line=False, size=_SIZE
                ).set_points(time[chosen], value[chosen])

    @Slot(object, QPointF)
    def _clicked(self, plot: Plot, place: QPointF) -> None:
        """Select the recording of the point nearest to ``place`` of the widget."""
        near = [
            (self.area.canvas.place_of(plot, started, value) - place.toPoint(), summary)
            for started, value, summary in self._found
        ]
        away = [(at.x() ** 2 + at.y() ** 2, summary) for at, summary in near]
        best = min(away, key=lambda found: found[0], default=None)
        if best is not None and best[0] <= _NEAR**2:
            summary = best[1]
            number = numbers(summary).get(self.quantity.currentData())
            shown = "" if number is None else significant(number, 4)
            self.words.show_text(f"{summary.name}: {shown}, {how_it_ended(summary)[1]}")
            self.picked.emit(summary.path)


def _started(summary: RecordingSummary) -> float | None:
    """Return the start of a run as Unix time in s; None where it is unknown."""
    if summary.start_is_import:
        return None
    try:
        return datetime.fromisoformat(summary.started).timestamp()
    except (ValueError, OverflowError, OSError):
        return None
