"""Table of the runs of a campaign: as they are planned, or as the journal says."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QItemSelection,
    QItemSelectionModel,
    QModelIndex,
    QPersistentModelIndex,
    Qt,
    Signal,
    Slot,
)
from PySide6.QtGui import QColor, QKeyEvent
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableView, QWidget

from dearig.batch.forecast import Forecast
from dearig.batch.queue import DONE, LOST, RUNNING, SKIPPED, STOPPED, WAITING, Queue, RunState
from dearig.config.campaignfile import Campaign
from dearig.report.text.numbers import significant
from dearig.window.kit.fields import as_labelled, shown_value
from dearig.window.kit.widgets import plain_tip
from dearig.window.session.state import Session

__all__ = ["CampaignTable", "QueueRows", "RunRow", "rows_of_plan"]

_HEADS = ("Run", "State", "Time", "Disk", "Settings", "Result")
_WIDTHS = (190, 105, 65, 75, 280)  # px; the last column takes what is left
_HEIGHT_MIN = 110  # px
_NUMBERS = 3  # of a run that are shown; the tooltip has all
#: States of a run to words and the colour of the theme.
_STATES = {
    WAITING: ("waiting", ""),
    RUNNING: ("▶ running", "accent"),
    "cut off": ("✗ cut off", "warn"),  # no program plays it
    DONE: ("✓ done", "good"),
    LOST: ("✗ lost", "bad"),
    STOPPED: ("✗ stopped", "bad"),
    SKIPPED: ("- left out", "muted"),
    "planned": ("…", "muted"),
    "admitted": ("✓ within limits", "good"),
    "refused": ("✗ refused", "bad"),
}

_Index = QModelIndex | QPersistentModelIndex
_TOP = QModelIndex()


@dataclass(frozen=True)
class RunRow:
    """A row: name and state of a run, duration in s, bytes of its recording, settings, result.

    ``recording`` is its file, relative to the campaign's folder, "" for none. ``details`` is the
    whole result.
    """

    name: str
    state: str
    duration: float
    size: int
    settings: str
    result: str = ""
    details: str = ""
    recording: str = ""


def rows_of_plan(campaign: Campaign, forecast: Forecast | None) -> list[RunRow]:
    """Return the runs of a plan, as they are forecast; None while the forecast is made."""
    rows = []
    for i, run in enumerate(campaign.runs):
        reason = "" if forecast is None else forecast.refused[i]
        state = "planned" if forecast is None else "refused" if reason else "admitted"
        rows.append(
            RunRow(
                run.name,
                state,
                0.0 if forecast is None else forecast.durations[i],
                0 if forecast is None else forecast.sizes[i],
                _settings(run.settings, run.warm_up),
                reason,
                reason,
            )
        )
    return rows


class QueueRows:
    """Makes the rows of a campaign; those of runs that have not changed are used again.

    A campaign may have thousands of runs, and the window must answer to STOP at any time.
    """

    def __init__(self) -> None:
        self._known: dict[str, tuple[tuple[object, ...], RunRow]] = {}

    def of(self, queue: Queue, sizes: Mapping[str, int], is_played: bool) -> list[RunRow]:
        """Return the runs of ``queue`` in their order; ``sizes`` are bytes of their recordings.

        Where the campaign is not played now, a run without an end was cut off.
        """
        return [self._row(queue.runs[name], sizes.get(name, 0), is_played) for name in queue.order]

    def _row(self, run: RunState, size: int, is_played: bool) -> RunRow:
        state = run.state if is_played or run.state != RUNNING else "cut off"
        key = (state, run.reason, run.recording, run.extremes, len(run.numbers), size)
        known = self._known.get(run.name)
        if known is not None and known[0] == key:
            return known[1]
        played = run.state in (DONE, LOST, STOPPED) and not run.extremes
        row = RunRow(
            run.name,
            state,
            run.duration,
            size,
            _settings(run.settings, run.warm_up),
            _result(run, _NUMBERS),
            _result(run, len(run.numbers)),
            run.recording if played else "",
        )
        self._known[run.name] = key, row
        return row


def _settings(settings: Mapping[str, Any], warm_up: bool) -> str:
    """Return the settings of a run in words: segment 1: amplitude (kV) 6."""
    if warm_up:
        return "warm-up"
    named = ((_SEGMENT.sub(_segment, path), value) for path, value in settings.items())
    return "; ".join(f"{as_labelled(name)} {shown_value(value)}" for name, value in named)


_SEGMENT = re.compile(r"^segment\.(\d+)\.")


def _segment(match: re.Match[str]) -> str:
    return f"segment {int(match[1]) + 1}: "


def _result(run: RunState, most: int) -> str:
    numbers = ", ".join(
        f"{name} {significant(value, 4)}" for name, value in list(run.numbers.items())[:most]
    )
    return "; ".join(part for part in (run.reason, numbers) if part)


class _Rows(QAbstractTableModel):
    """Rows of the table."""

    def __init__(self, session: Session, parent: QWidget) -> None:
        super().__init__(parent)
        self._session = session
        self.rows: list[RunRow] = []

    def show_rows(self, rows: list[RunRow]) -> None:
        if [row.name for row in rows] == [row.name for row in self.rows]:
            self.rows = rows
            last = self.index(max(len(rows) - 1, 0), len(_HEADS) - 1)
            self.dataChanged.emit(self.index(0, 0), last)
            return
        self.beginResetModel()
        self.rows = rows
        self.endResetModel()

    def rowCount(self, parent: _Index = _TOP) -> int:  # noqa: N802
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: _Index = _TOP) -> int:  # noqa: N802
        return 0 if parent.isValid() else len(_HEADS)

    def headerData(  # noqa: N802
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if role != Qt.ItemDataRole.DisplayRole:
            return None
        return _HEADS[section] if orientation == Qt.Orientation.Horizontal else str(section + 1)

    def data(self, index: _Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        row, column = self.rows[index.row()], index.column()
        words, colour = _STATES[row.state]
        if role == Qt.ItemDataRole.DisplayRole:
            return (
                row.name, words, f"{row.duration:.1f} s" if row.duration else "",
                f"{row.size / 1e6:.3g} MB" if row.size else "", row.settings, row.result,
            )[column]  # fmt: skip
        if role == Qt.ItemDataRole.ToolTipRole:
            return plain_tip((row.name, words, "", "", row.settings, row.details)[column])
        if role == Qt.ItemDataRole.TextAlignmentRole and column in (2, 3):
            return int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        if role == Qt.ItemDataRole.ForegroundRole and colour and column == 1:
            return QColor(getattr(self._session.theme, colour))
        return None


class CampaignTable(QTableView):
    """Shows runs; several can be selected.

    ``chosen_changed``: others are selected; ``opened`` carries the recording of the run that was
    double-clicked, relative to the campaign's folder.
    """

    chosen_changed = Signal()
    opened = Signal(str)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._rows = _Rows(session, self)
        self.setModel(self._rows)
        self.setAccessibleName("Runs of the campaign")
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setAlternatingRowColors(True)
        self.setShowGrid(False)
        self.setWordWrap(False)
        self.setTabKeyNavigation(False)
        self.setMinimumHeight(_HEIGHT_MIN)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.verticalHeader().setDefaultSectionSize(26)
        header = self.horizontalHeader()
        header.setHighlightSections(False)
        # a header asks of each column whether all rows are selected
        header.setSelectionModel(QItemSelectionModel(self._rows, header))
        header.setStretchLastSection(True)
        for column, width in enumerate(_WIDTHS):
            header.resizeSection(column, width)
        self.selectionModel().selectionChanged.connect(self.chosen_changed)
        self.activated.connect(self._activated)
        session.theme_changed.connect(self.viewport().update)

    @property
    def rows(self) -> list[RunRow]:
        """Rows that are shown."""
        return self._rows.rows

    @property
    def chosen(self) -> list[RunRow]:
        """The selected runs, in their order."""
        places = sorted(index.row() for index in self.selectionModel().selectedRows())
        return [self.rows[place] for place in places]

    def show_rows(self, rows: list[RunRow]) -> None:
        """Replace the rows; runs that are selected stay so."""
        names = {row.name for row in self.chosen}
        moved = [row.name for row in rows] != [row.name for row in self.rows]
        self._rows.show_rows(rows)
        if moved and names:
            self.choose(names)

    def choose(self, names: Iterable[str]) -> None:
        """Select the runs with these names."""
        wanted, selection = set(names), QItemSelection()
        for place, row in enumerate(self.rows):
            if row.name in wanted:
                index = self._rows.index(place, 0)
                selection.select(index, self._rows.index(place, len(_HEADS) - 1))
        flags = QItemSelectionModel.SelectionFlag
        self.selectionModel().select(selection, flags.ClearAndSelect | flags.Rows)

    def show_run(self, name: str) -> None:
        """Scroll to the run ``name``."""
        for place, row in enumerate(self.rows):
            if row.name == name:
                self.scrollTo(self._rows.index(place, 0))

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._activated(self.currentIndex())
            return
        super().keyPressEvent(event)

    @Slot(QModelIndex)
    def _activated(self, index: QModelIndex) -> None:
        if index.isValid() and self.rows[index.row()].recording:
            self.opened.emit(self.rows[index.row()].recording)
