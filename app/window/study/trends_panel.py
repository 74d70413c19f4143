"""Trends of a study of many recordings: a number against what may change it, with its band."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QSignalBlocker, Qt, Slot
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QComboBox, QLabel, QSplitter, QVBoxLayout, QWidget

from dearig.batch.table_file import read_table
from dearig.batch.trend import Trend
from dearig.batch.trends import Trends, find_trends
from dearig.report.text.tables import Table
from dearig.report.text.trends import (
    change_table,
    effect_table,
    number_name,
    own_table,
    proposal_texts,
    trend_title,
    trends_texts,
)
from dearig.window.documents.dialogs import choose_file, save_as
from dearig.window.jobs.background import Background
from dearig.window.kit.flow import Flow
from dearig.window.kit.report_page import ReportPage
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import Message, button, label
from dearig.window.plots.area import PlotArea
from dearig.window.plots.plot import LegendEntry
from dearig.window.session.state import Session

__all__ = ["TrendsPanel"]

_EVERY = "All films"
_INTRODUCTION = (
    "Open the table of a study of many recordings, a file study.csv. Its parameters and errors are "
    "shown against temperature, humidity, cycles and days: what is common to all films, what is "
    "one film's own, change points, and what to vary next.",
)
_BAND_ALPHA = 60  # of 255
_PLOT, _WORDS = 380, 260  # px, default heights of plot and words
_SIZE = 7  # px, diameter of a point


@dataclass(frozen=True)
class _Read:
    """Trends of the table at ``path``."""

    path: Path
    trends: Trends


class TrendsPanel(QWidget):
    """Plot of one number against one column, above sentences and tables of all of them."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._read: _Read | None = None
        self._work = Background(self)
        self._work.done.connect(self._done)
        self._work.failed.connect(self._failed)
        self.open_button = button(
            "Open &table …", "Choose the table of a study of many recordings (CSV, Parquet)"
        )
        self.open_button.clicked.connect(self._ask)
        self.report_button = button("Save re&port …", "Write these trends as an HTML report")
        self.report_button.clicked.connect(self._ask_report)
        self.number, self.column, self.film = QComboBox(), QComboBox(), QComboBox()
        top = Flow()
        top.add(self.open_button)
        for text, box, tip in (
            ("&Number", self.number, "Parameter or error that is shown"),
            ("A&gainst", self.column, "What may change it; the other columns are at their means"),
            ("&Film", self.film, "Film whose points are marked"),
        ):
            box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
            box.setToolTip(tip)
            caption = QLabel(text)
            caption.setBuddy(box)
            top.add(caption, box)
        top.add(self.report_button)
        self.message = Message()
        self.words = label("", "muted")
        self.words.setWordWrap(True)
        self.area = PlotArea(session, "Trends")
        self.plot = self.area.add_plot(0, left="Number", bottom="Column", group="column")
        self.page = ReportPage()
        self.split = QSplitter(Qt.Orientation.Vertical)
        upper = QWidget()
        inside = QVBoxLayout(upper)
        inside.setContentsMargins(0, 0, 0, 0)
        inside.addWidget(self.area, 1)
        inside.addWidget(self.words)
        self.split.addWidget(upper)
        self.split.addWidget(self.page)
        self.split.setSizes([_PLOT, _WORDS])
        upper.setMinimumHeight(_PLOT // 2)
        self.split.setChildrenCollapsible(False)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(SPACE // 2, SPACE // 2, 0, 0)
        outer.addLayout(top)
        outer.addWidget(self.message)
        outer.addWidget(self.split, 1)
        self.number.currentIndexChanged.connect(self._another_number)
        self.column.currentIndexChanged.connect(self._another)
        self.film.currentIndexChanged.connect(self._draw)
        session.theme_changed.connect(self._draw)
        self._enable()

    def close_work(self) -> None:
        """Wait for what is computed in the background."""
        self._work.close()

    # table

    @Slot()
    def _ask(self) -> None:
        path = choose_file(
            self, self._session, "Open the table of a study", self._session.folder,
            "Tables (*.csv *.parquet)",
        )  # fmt: skip
        if path is not None:
            self.open(path)

    def open(self, path: Path) -> None:
        """Read the table at ``path``, and compute its trends in the background."""
        self.message.show_text(f"Computing the trends of {path} …", "good")
        self.open_button.setEnabled(False)
        self._work.start(lambda: _Read(path, find_trends(read_table(path), source=path)))

    @Slot(object)
    def _done(self, found: object) -> None:
        self.open_button.setEnabled(True)
        if isinstance(found, Path):
            self.message.show_text(f"Saved {found}", "good")
            return
        if not isinstance(found, _Read):
            return
        self.message.show_text("")
        self._read = found
        trends = found.trends
        with QSignalBlocker(self.number), QSignalBlocker(self.film):
            self.number.clear()
            self.number.addItems([number_name(trend.name) for trend in trends.trends])
            self.film.clear()
            self.film.addItem(f"{_EVERY} ({len(set(trends.films))})", None)
            for name in sorted(set(trends.films), key=str.casefold):
                self.film.addItem(name or "(film without a name)", name)
        tables = (effect_table(trends), own_table(trends), change_table(trends))
        pieces: list[str | Table] = [*trends_texts(trends)]
        pieces += [Table("What to vary next", (("", ""),), ()), *proposal_texts(trends)]
        pieces += [table for table in tables if table is not None]
        self.page.show_pieces(pieces)
        self._another_number()
        self._enable()

    @Slot(str)
    def _failed(self, sentence: str) -> None:
        self.open_button.setEnabled(True)
        self.message.show_text(sentence)

    @Slot()
    def _ask_report(self) -> None:
        read = self._read
        if read is None:
            return
        proposed = read.path.parent / "trends.html"
        path = save_as(self, self._session, "Save the report", proposed, "HTML (*.html)", ".html")
        if path is not None:
            self._work.start(_writer(read, path))

    def _enable(self) -> None:
        there = self._read is not None
        for box in (self.number, self.column, self.film, self.report_button):
            box.setEnabled(there)
        self.area.setVisible(there)
        if not there:
            self.page.show_pieces(_INTRODUCTION)

    # plot

    @property
    def shown(self) -> Trend | None:
        """Trend of the chosen number."""
        if self._read is None or self.number.currentIndex() < 0:
            return None
        return self._read.trends.trends[self.number.currentIndex()]

    @Slot()
    def _another_number(self) -> None:
        """Offer the columns of another number; the chosen one stays if it has it."""
        trend = self.shown
        if trend is None:
            return
        before = self.column.currentText()
        with QSignalBlocker(self.column):
            self.column.clear()
            self.column.addItems([effect.column.label for effect in trend.effects])
            self.column.setCurrentIndex(max(self.column.findText(before), 0))
        self._another()

    @Slot()
    def _another(self) -> None:
        """Draw another number or column, over its whole range."""
        self._draw()
        self.area.auto_range()

    @Slot()
    def _draw(self) -> None:
        self.plot.clear_all()
        trend, i = self.shown, self.column.currentIndex()
        if trend is None or i < 0:
            return
        theme, effect = self._session.theme, trend.effects[i]
        unit = f" ({effect.column.unit})" if effect.column.unit else ""
        self.plot.set_axis("left", number_name(trend.name))
        self.plot.set_axis("bottom", f"{effect.column.label}{unit}")
        self.words.setText(f"{trend_title(trend)}. Films and other columns are taken off.")
        self.area.file_stem = f"{number_name(trend.name, unit=False)} against {effect.column.label}"
        is_seen = effect.verdict not in ("none", "doubtful")
        colour = theme.accent if is_seen else theme.muted
        curve = trend.curve(i)
        edges = [
            self.plot.add_curve(name, colour, in_key=False) for name in ("low 95 %", "high 95 %")
        ]
        for edge, y in zip(edges, (curve.low, curve.high), strict=True):
            edge.set_points(curve.x, y)
        band = QColor(colour)
        band.setAlpha(_BAND_ALPHA)
        self.plot.addItem(pg.FillBetweenItem(*edges, brush=band), ignoreBounds=True)
        said = "common effect" if is_seen else "no effect is seen"
        self.plot.add_curve(said, colour).set_points(curve.x, curve.y)
        self.plot.add_entry(
            LegendEntry("95 % band", band.name(QColor.NameFormat.HexArgb), area=True)
        )
        x, y = trend.adjusted(i)
        films = np.array(trend.model.films)[trend.model.sample.film]
        chosen = self.film.currentData()
        own = {slope.film for slope in effect.own}
        marked = films == chosen if chosen is not None else np.isin(films, list(own))
        name = "runs" if chosen is None else "runs of other films"
        self.plot.add_curve(
            name, theme.muted if chosen is not None else theme.text, symbol="o", line=False,
            size=_SIZE,
        ).set_points(x[~marked], y[~marked])  # fmt: skip
        if marked.any():
            text = "films with an effect of their own" if chosen is None else f"runs of {chosen}"
            self.plot.add_curve(
                text, theme.warn, symbol="t", line=False, size=_SIZE + 2
            ).set_points(x[marked], y[marked])


def _writer(read: _Read, path: Path) -> Callable[[], Path]:
    def write() -> Path:
        from dearig.report.pages.trends import write_trends_report

        return write_trends_report(read.trends, f"Trends of {read.path.parent.name}", path)

    return write
