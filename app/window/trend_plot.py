"""Plot of a number of many recordings over the time of their runs."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import pyqtgraph as pg
from PySide6.QtCore import QSignalBlocker, Qt, Signal, Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from dearig.analysis.summary import QUANTITIES, RecordingSummary, how_it_ended, numbers
from dearig.report.numbers import significant
from dearig.window.session import Session
from dearig.window.theme import SPACE, pen, style_plot
from dearig.window.widgets import label

__all__ = ["TrendPlot"]

_ALL = "All films"
_NAMELESS = "(film without a name)"
_SIZE = 9  # px, diameter of a point
#: Signs of a point by how the run ended: told apart without colours.
_SYMBOLS = {"": "o", "warning": "t", "fault": "x"}


class TrendPlot(QWidget):
    """One point for each run of a film; ``picked`` carries the recording of a clicked point."""

    picked = Signal(Path)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._summaries: tuple[RecordingSummary, ...] = ()
        self._chosen: frozenset[Path] = frozenset()
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
        self.words = label("", "muted")
        self.area = pg.GraphicsLayoutWidget()
        self.area.setAccessibleName("Trend of the recordings")
        self.plot: pg.PlotItem = self.area.addPlot(
            axisItems={"bottom": pg.DateAxisItem(orientation="bottom")}
        )
        self.plot.setLabel("bottom", "Start of the run (local time)")
        self._line = pg.PlotDataItem()
        self._points = pg.ScatterPlotItem(hoverable=True, tip=None, pxMode=True)
        self._points.sigClicked.connect(self._clicked)
        self._points.sigHovered.connect(self._hovered)
        self.plot.addItem(self._line)
        self.plot.addItem(self._points)
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
        self.film.currentIndexChanged.connect(self._draw)
        self.quantity.currentIndexChanged.connect(self._draw)
        session.theme_changed.connect(self._draw)
        self._draw()

    @property
    def points(self) -> list[tuple[Path, float, float]]:
        """The drawn points: recording, Unix time in s, and value in the shown unit."""
        return [(spot.data(), spot.pos().x(), spot.pos().y()) for spot in self._points.points()]

    def show_summaries(self, summaries: Sequence[RecordingSummary]) -> None:
        """Show these recordings; the chosen film stays if it is among them."""
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
            self.film.setCurrentIndex(max(self.film.findData(before), 0) if before else 0)
        self._draw()

    def show_chosen(self, paths: Sequence[Path]) -> None:
        """Mark the points of the selected recordings, and show the film of the first one."""
        self._chosen = frozenset(paths)
        first = next((s for s in self._summaries if s.path in self._chosen), None)
        if first is not None and self.film.currentData() is not None:
            with QSignalBlocker(self.film):
                self.film.setCurrentIndex(max(self.film.findData(first.film), 0))
        self._draw()

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        self.area.setBackground(QColor(theme.surface))
        style_plot(self.plot, theme)
        key, film = self.quantity.currentData(), self.film.currentData()
        self.plot.setLabel("left", self.quantity.currentText())
        found = []
        without = 0
        for summary in self._summaries:
            if film is not None and summary.film != film:
                continue
            started, value = _started(summary), numbers(summary).get(key)
            if started is None or value is None:
                without += 1
            else:
                found.append((started, value, summary))
        found.sort(key=lambda row: row[0])
        colours = {"": theme.accent, "warning": theme.warn, "fault": theme.bad}
        spots = []
        for started, value, summary in found:
            level = how_it_ended(summary)[0]
            chosen = summary.path in self._chosen
            spots.append(
                {
                    "pos": (started, value), "data": summary.path, "symbol": _SYMBOLS[level],
                    "size": _SIZE + 5 * chosen, "brush": pg.mkBrush(QColor(colours[level])),
                    "pen": pg.mkPen(QColor(theme.text), width=2) if chosen else pen(colours[level]),
                }
            )  # fmt: skip
        self._points.setData(spots)
        # the runs of several films are no series
        series = found if film is not None or len({s.film for *_, s in found}) < 2 else []
        self._line.setData([row[0] for row in series], [row[1] for row in series])
        self._line.setPen(pen(theme.muted))
        self.plot.enableAutoRange()
        words = f"{len(found)} run{'' if len(found) == 1 else 's'}"
        if without:
            words += f"; {without} without this number, or not read yet"
        self.words.setText(f"{words}. Click a point to select its recording")

    @Slot(object, object, object)
    def _clicked(self, _: object, spots: Sequence[pg.SpotItem], __: object) -> None:
        if len(spots):
            self.picked.emit(spots[0].data())

    @Slot(object, object, object)
    def _hovered(self, _: object, spots: Sequence[pg.SpotItem], __: object) -> None:
        if not len(spots):
            return
        path, value = spots[0].data(), spots[0].pos().y()
        summary = next((s for s in self._summaries if s.path == path), None)
        if summary is not None:
            self.words.setText(
                f"{summary.name}: {significant(value, 4)}, {how_it_ended(summary)[1]}"
            )


def _started(summary: RecordingSummary) -> float | None:
    """Return the start of a run as Unix time in s; None where it is unknown."""
    try:
        return datetime.fromisoformat(summary.started).timestamp()
    except (ValueError, OverflowError, OSError):
        return None
