"""Table model of a folder of recordings: thumbnail, sequence, film, errors, state."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import (
    QAbstractTableModel,
    QModelIndex,
    QPersistentModelIndex,
    QPointF,
    QRectF,
    QSize,
    Qt,
    Slot,
)
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem

from dearig.analysis.summary import RecordingSummary
from dearig.recording.timestamps import local_time
from dearig.report.numbers import NO_VALUE, significant
from dearig.units import SHOWN
from dearig.window.session import Session
from dearig.window.widgets import plain_tip

__all__ = ["COLUMNS", "PATH", "SORT", "SUMMARY", "FolderModel", "ThumbnailDelegate"]

_Index = QModelIndex | QPersistentModelIndex

SUMMARY = int(Qt.ItemDataRole.UserRole)
PATH = SUMMARY + 1
SORT = SUMMARY + 2
_ROOT = QModelIndex()

#: Heads and tooltips of the columns.
COLUMNS = (
    ("", "Measured displacement (or stress) over time"),
    ("Recording", "Name of the file"),
    ("Sequence", "Name of the sequence"),
    ("Film", "Name of the film"),
    ("Start", "Start of the run: local time, with its offset from UTC"),
    ("Duration", "Duration in s"),
    ("RMS", "RMS error of the chosen model, in µm (kPa for a film driven by stretch)"),
    ("NRMSE", "RMS error in % of the measured range"),
    ("RMS / noise", "RMS error divided by the noise floor; 1 is the best possible"),
    ("State", "End of the run, and its events"),
)
_NAME, _SEQUENCE, _FILM, _START, _DURATION, _RMS, _NRMSE, _NOISE, _STATE = range(1, 10)


class FolderModel(QAbstractTableModel):
    """One row for each file; cells are empty until the file is read."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session
        self._paths: list[Path] = []
        self._row: dict[Path, int] = {}
        self._changed: dict[Path, float] = {}
        self._summaries: dict[Path, RecordingSummary] = {}
        session.theme_changed.connect(self._redraw)

    def set_files(
        self, files: dict[Path, tuple[float, int]], summaries: dict[Path, RecordingSummary]
    ) -> None:
        """Show ``files`` (path to time of change and size), with the ``summaries`` known so far."""
        paths = sorted(files, key=lambda path: (-files[path][0], path.name))
        changed = {path: about[0] for path, about in files.items()}
        if paths == self._paths:
            self._summaries, self._changed = dict(summaries), changed
            self._redraw()
            return
        # only new and missing files change rows, so that a selection stays
        for row in reversed(range(len(self._paths))):
            if self._paths[row] not in files:
                self.beginRemoveRows(_ROOT, row, row)
                del self._paths[row]
                self.endRemoveRows()
        self._summaries, self._changed = dict(summaries), changed
        known = set(self._paths)
        fresh = [path for path in paths if path not in known]
        if fresh:
            self.beginInsertRows(_ROOT, len(self._paths), len(self._paths) + len(fresh) - 1)
            self._paths.extend(fresh)
            self.endInsertRows()
        self._row = {path: i for i, path in enumerate(self._paths)}

    def set_summary(self, summary: RecordingSummary) -> None:
        """Show the summary of one file."""
        row = self._row.get(summary.path)
        if row is not None:
            self._summaries[summary.path] = summary
            self.dataChanged.emit(self.index(row, 0), self.index(row, len(COLUMNS) - 1))

    def clear_errors(self) -> None:
        """Remove all errors; they belong to a model that is no longer chosen."""
        self._summaries = {
            path: replace(g, errors=None, unfit="", fitted=False)
            for path, g in self._summaries.items()
        }
        self._redraw()

    def rowCount(self, parent: _Index = _ROOT) -> int:  # noqa: N802
        return 0 if parent.isValid() else len(self._paths)

    def columnCount(self, parent: _Index = _ROOT) -> int:  # noqa: N802
        return 0 if parent.isValid() else len(COLUMNS)

    def headerData(  # noqa: N802
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if orientation != Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.DisplayRole:
            return COLUMNS[section][0]
        if role == Qt.ItemDataRole.ToolTipRole:
            return COLUMNS[section][1]
        return None

    def data(self, index: _Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        path = self._paths[index.row()]
        summary, column = self._summaries.get(path), index.column()
        if role == PATH:
            return path
        if role == SUMMARY:
            return summary
        if role == SORT:
            return self._sort_key(path, summary, column)
        if role == Qt.ItemDataRole.DisplayRole:
            return self._text(path, summary, column)
        if role == Qt.ItemDataRole.ToolTipRole:
            return plain_tip(_tip(path, summary, column))
        if role == Qt.ItemDataRole.TextAlignmentRole and _DURATION <= column <= _NOISE:
            return int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        if role == Qt.ItemDataRole.ForegroundRole and column == _STATE and summary is not None:
            theme, level = self._session.theme, _level(summary)
            colour = {"fault": theme.bad, "warning": theme.warn}.get(level)
            return None if colour is None else QColor(colour)
        return None

    def _text(self, path: Path, summary: RecordingSummary | None, column: int) -> str:
        if column == _NAME:
            return path.stem
        if column == 0:
            return ""
        if summary is None:
            return "…" if column == _STATE else ""
        if column == _STATE:
            return _state(summary)
        if column == _START:
            return _when(summary.started, self._changed.get(path, 0.0))
        if summary.trouble:
            return ""
        if column == _SEQUENCE:
            return summary.title
        if column == _FILM:
            return summary.film
        if column == _DURATION:
            return f"{significant(summary.duration)} s"
        return _error(summary, column)

    def _sort_key(self, path: Path, summary: RecordingSummary | None, column: int) -> Any:
        if column == _START:
            return self._changed.get(path, 0.0)
        if summary is None or summary.trouble:
            return path.stem if column in (0, _NAME) else (-1.0 if column >= _DURATION else "")
        if column == _DURATION:
            return summary.duration
        if _RMS <= column <= _NOISE:
            e = summary.errors
            if e is None:
                return -1.0
            over = e.rms / summary.noise if summary.noise else -1.0
            return {_RMS: e.rms, _NRMSE: e.nrmse_pct, _NOISE: over}[column]
        if column == _STATE:
            return float(("", "info", "warning", "fault").index(_level(summary)))
        return {_SEQUENCE: summary.title, _FILM: summary.film}.get(column, path.stem)

    @Slot()
    def _redraw(self) -> None:
        if self._paths:
            last = self.index(len(self._paths) - 1, len(COLUMNS) - 1)
            self.dataChanged.emit(self.index(0, 0), last)


def _level(summary: RecordingSummary) -> str:
    if summary.trouble:
        return "fault"
    levels = {event.level for event in summary.events}
    if "fault" in levels:
        return "fault"
    if "warning" in levels or not summary.complete:
        return "warning"
    return "info" if levels else ""


def _state(summary: RecordingSummary) -> str:
    # a sign beside the colour, for readers who cannot tell the colours apart
    sign = {"fault": "\N{MULTIPLICATION X} ", "warning": "! "}.get(_level(summary), "")
    if summary.trouble:
        return f"{sign}cannot be read"
    said = [] if summary.complete else ["incomplete"]
    count = sum(event.level != "info" for event in summary.events)
    if count:
        said.append(f"{count} event{'' if count == 1 else 's'}")
    return f"{sign}{', '.join(said)}" if said else "\N{CHECK MARK} finished"


def _error(summary: RecordingSummary, column: int) -> str:
    if summary.errors is None:
        return NO_VALUE if summary.unfit else ""
    shown, e = SHOWN[summary.kind], summary.errors
    if column == _RMS:
        mark = "*" if summary.fitted else ""
        return f"{significant(e.rms * shown.error_factor)} {shown.error_unit}{mark}"
    if column == _NRMSE:
        return f"{significant(e.nrmse_pct)} %"
    return significant(e.rms / summary.noise) if summary.noise else NO_VALUE


def _tip(path: Path, summary: RecordingSummary | None, column: int) -> str:
    if summary is None:
        return f"{path}: not read yet"
    if summary.trouble:
        return summary.trouble
    if _RMS <= column <= _NOISE:
        if summary.unfit:
            return summary.unfit
        if summary.fitted:
            return "The model was fitted to this recording; this error is no validation"
        return COLUMNS[column][1]
    if column == _STATE:
        told = [f"{event.time:.4g} s, {event.level}: {event.message}" for event in summary.events]
        return "\n".join([summary.outcome, *told[:12]])
    notes = f"\nNotes: {summary.notes}" if summary.notes else ""
    by = f"\nOperator: {summary.operator}" if summary.operator else ""
    return f"{path}{by}{notes}"


def _when(started: str, changed: float) -> str:
    """Return the start of the run, or the time of the file's last change, in local time."""
    return local_time(started or datetime.fromtimestamp(changed, UTC).isoformat())


class ThumbnailDelegate(QStyledItemDelegate):
    """Draws a recording's thumbnail."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session

    def sizeHint(self, option: QStyleOptionViewItem, index: _Index) -> QSize:  # noqa: ARG002, N802
        return QSize(84, 30)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: _Index) -> None:
        super().paint(painter, option, index)
        summary = index.data(SUMMARY)
        area = QRectF(option.rect).adjusted(4, 4, -4, -4)
        if not isinstance(summary, RecordingSummary) or summary.thumbnail[0].size < 2:
            return
        time, values = summary.thumbnail
        span, height = np.ptp(time) or 1.0, np.ptp(values) or 1.0
        x = area.left() + (time - time[0]) / span * area.width()
        y = area.bottom() - (values - values.min()) / height * area.height()
        line = QPolygonF([QPointF(float(a), float(b)) for a, b in zip(x, y, strict=True)])
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        theme, selected = self._session.theme, QStyle.StateFlag.State_Selected
        colour = theme.on_accent if option.state & selected else theme.accent
        painter.setPen(QPen(QColor(colour), 1.0))
        painter.drawPolyline(line)
        painter.restore()
