"""Table of a folder of recordings: columns, sorting and search."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QModelIndex,
    QPersistentModelIndex,
    QPointF,
    QRectF,
    QSize,
    Qt,
    QTimer,
    Signal,
    Slot,
)
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem

from dearig.analysis.summary import RecordingSummary, how_it_ended, numbers
from dearig.recording.content.fields import TEXTS
from dearig.recording.content.timestamps import local_time
from dearig.report.text.numbers import NO_VALUE, significant
from dearig.units import SHOWN
from dearig.window.kit.widgets import plain_tip
from dearig.window.session.state import Session

__all__ = ["COLUMNS", "ENDED", "PATH", "SUMMARY", "FolderModel", "ListColumn", "ThumbnailDelegate"]

_Index = QModelIndex | QPersistentModelIndex

SUMMARY = int(Qt.ItemDataRole.UserRole)
PATH = SUMMARY + 1
_DISPLAY, _TIP, _ALIGNMENT, _FOREGROUND = (
    int(role)
    for role in (
        Qt.ItemDataRole.DisplayRole,
        Qt.ItemDataRole.ToolTipRole,
        Qt.ItemDataRole.TextAlignmentRole,
        Qt.ItemDataRole.ForegroundRole,
    )
)
#: Roles that cells have; a view asks for twice as many in each of its drawings.
_ROLES = frozenset((_DISPLAY, _TIP, _ALIGNMENT, _FOREGROUND, SUMMARY, PATH))
_RIGHT = int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
_ROOT = QModelIndex()
#: Wait before rows are sorted again after summaries have come: rows must not jump at every one.
_SETTLE_MS = 300


@dataclass(frozen=True)
class ListColumn:
    """A column: ``head`` (also its name in the settings), ``tip``, and default width in pixels.

    ``shown``: it is among the columns of the first start. ``number``: right-aligned, and sorted by
    ``key``. ``wide``: it takes a part of the width that is left. ``text`` and ``key`` take the
    summary.
    """

    head: str
    tip: str
    width: int
    text: Callable[[RecordingSummary], str]
    key: Callable[[RecordingSummary], Any] | None = None
    shown: bool = True
    number: bool = False
    wide: bool = False
    title: str = ""

    @property
    def name(self) -> str:
        """Name in menus."""
        return self.title or self.head


def _number(
    head: str, key: str, tip: str, digits: int = 3, *, shown: bool = True, width: int = 66
) -> ListColumn:
    def value(summary: RecordingSummary) -> float | None:
        return numbers(summary).get(key)

    def text(summary: RecordingSummary) -> str:
        found = value(summary)
        return "" if found is None else significant(found, digits)

    return ListColumn(head, tip, width, text, value, shown, number=True)


def _text_column(key: str) -> ListColumn:
    def text(summary: RecordingSummary) -> str:
        return " ".join(summary.texts.get(key, "").split())

    field = TEXTS[key]
    # 8 px a character, and 2 px next to them
    width = 8 * field.characters + 2
    return ListColumn(field.label, field.tip, width, text, shown=field.shown, wide=field.wide)


def _errors(summary: RecordingSummary) -> float | None:
    return None if summary.errors is None else summary.errors.rms


def _rms(summary: RecordingSummary) -> str:
    if summary.errors is None:
        return NO_VALUE if summary.unfit else ""
    shown = SHOWN[summary.kind]
    mark = "*" if summary.fitted else ""
    return f"{significant(summary.errors.rms * shown.error_factor)} {shown.error_unit}{mark}"


def _ended(summary: RecordingSummary) -> str:
    # a sign next to the colour, for readers who cannot tell the colours apart
    level, words = how_it_ended(summary)
    sign = {"fault": "\N{MULTIPLICATION X}", "warning": "!"}.get(level, "\N{CHECK MARK}")
    return f"{sign} {words}"


def _severity(summary: RecordingSummary) -> tuple[int, str]:
    level, words = how_it_ended(summary)
    return ("", "warning", "fault").index(level), words.casefold()


def _seconds(summary: RecordingSummary) -> str:
    return "" if summary.trouble else f"{significant(summary.duration)} s"


def _start(summary: RecordingSummary) -> str:
    return f"{local_time(summary.started)}{' (import)' if summary.start_is_import else ''}"


#: All columns, in their order.
COLUMNS = (
    ListColumn(
        "", "Measured displacement (or stress) over time", 72, lambda _: "", lambda s: s.name,
        title="Thumbnail",
    ),
    ListColumn("Recording", "Path of the file in the folder, without its ending", 150,
           lambda s: s.name, lambda s: s.name.casefold(), wide=True),
    ListColumn("Sequence", "Name of the sequence", 130, lambda s: s.title, wide=True),
    *(_text_column(key) for key, field in TEXTS.items() if field.shown),
    ListColumn("Start", "Start of the run: local time, with its offset from UTC; (import): that of "
           "the import, since the file does not tell it", 178,
           _start, lambda s: s.started),
    ListColumn("Duration", "Duration in s", 66, _seconds, lambda s: s.duration, number=True),
    _number("Peak kV", "peak_kV", "Largest commanded voltage in kV"),
    _number("Peak mm", "peak_mm", "Largest displacement in mm", width=70),
    _number("Peak mA", "current_mA", "Largest current that was measured, in mA", shown=False),
    ListColumn("RMS error",
           "RMS error of the chosen model, in µm (kPa for a film driven by stretch); "
           "* the model was fitted to this recording", 80, _rms, _errors, number=True),
    _number("NRMSE %", "nrmse_pct", "RMS error in % of the measured range", shown=False, width=72),
    _number("RMS / noise", "over_noise", "RMS error over the noise floor; 1 is the best possible",
            shown=False, width=92),
    _number("Noise µm", "noise_um", "Noise of the displacement at 0 V, in µm", shown=False,
            width=78),
    ListColumn("How it ended", "How the run ended, and its events", 128, _ended, _severity,
           wide=True),
    ListColumn("Tags", "Tags; select recordings and press Ctrl+T to change them", 84,
           lambda s: ", ".join(s.tags), wide=True),
    *(_text_column(key) for key, field in TEXTS.items() if not field.shown),
)  # fmt: skip
_HEADS = tuple(column.head for column in COLUMNS)
_NAME, _START, ENDED = (_HEADS.index(head) for head in ("Recording", "Start", "How it ended"))


class FolderModel(QAbstractTableModel):
    """The files of a folder that match a search, sorted by a column.

    Cells are empty until a file is read. ``arranged``: rows have come, gone or moved, and the view
    has lost its selection.
    """

    arranged = Signal()

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session
        self._files: dict[Path, tuple[float, int]] = {}
        self._summaries: dict[Path, RecordingSummary] = {}
        self._rows: list[Path] = []
        self._row: dict[Path, int] = {}
        self._words: tuple[str, ...] = ()
        self._cells: dict[Path, tuple[str, ...]] = {}  # texts of a file; a drawing asks for them
        self._texts: dict[Path, str] = {}
        self._column, self._order = _START, Qt.SortOrder.DescendingOrder
        self._settle = QTimer(self, singleShot=True, interval=_SETTLE_MS)
        self._settle.timeout.connect(self._arrange)
        session.theme_changed.connect(self._redraw)

    @property
    def total(self) -> int:
        """Number of files, with those that the search hides."""
        return len(self._files)

    @property
    def shown(self) -> list[RecordingSummary]:
        """Summaries of the rows that have one, in the order of the table."""
        return [self._summaries[path] for path in self._rows if path in self._summaries]

    @property
    def sorting(self) -> tuple[str, bool]:
        """Head of the column that rows are sorted by, and True for a descending order."""
        return _HEADS[self._column], self._order == Qt.SortOrder.DescendingOrder

    def set_files(
        self, files: dict[Path, tuple[float, int]], summaries: dict[Path, RecordingSummary]
    ) -> None:
        """Show ``files`` (path to time of change and size), with the ``summaries`` known so far."""
        self._files, self._summaries = dict(files), dict(summaries)
        self._cells.clear()
        self._texts.clear()
        self._arrange()
        self._redraw()

    def set_summary(self, summary: RecordingSummary) -> None:
        """Show the summary of one file; rows are sorted again a little later."""
        if summary.path not in self._files:
            return
        self._summaries[summary.path] = summary
        self._cells.pop(summary.path, None)
        self._texts.pop(summary.path, None)
        self._searched(summary.path)  # now, so that the first search does not make all of them
        row = self._row.get(summary.path)
        if row is not None:
            self.dataChanged.emit(self.index(row, 0), self.index(row, len(COLUMNS) - 1))
        self._settle.start()

    @Slot(str)
    def find(self, text: str) -> None:
        """Show the rows that contain all words of ``text`` in any column, shown or not."""
        self._words = tuple(text.casefold().split())
        self._arrange()

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Sort by a column; rows without a value come last."""
        self._column, self._order = column, order
        self._arrange()

    def row_of(self, path: Path) -> int | None:
        """Return the row of ``path``; None if it is not shown."""
        return self._row.get(path)

    def path_at(self, row: int) -> Path:
        """Return the path of the file in ``row``."""
        return self._rows[row]

    def headings(self, head: str) -> int:
        """Return the place of the column with this head. Raises ``ValueError`` if there is none."""
        return _HEADS.index(head)

    def rowCount(self, parent: _Index = _ROOT) -> int:  # noqa: N802
        return 0 if parent.isValid() else len(self._rows)

    def columnCount(self, parent: _Index = _ROOT) -> int:  # noqa: N802
        return 0 if parent.isValid() else len(COLUMNS)

    def headerData(  # noqa: N802
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if orientation != Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.DisplayRole:
            return COLUMNS[section].head
        if role == Qt.ItemDataRole.ToolTipRole:
            return f"{COLUMNS[section].tip}. Click to sort, right-click to choose columns"
        return None

    def data(self, index: _Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if role not in _ROLES or not index.isValid():
            return None
        column = index.column()
        if role == _ALIGNMENT:
            return _RIGHT if COLUMNS[column].number else None
        if role == _FOREGROUND and column != ENDED:
            return None
        path = self._rows[index.row()]
        if role == _DISPLAY:
            return self._texts_of(path)[column]
        if role == PATH:
            return path
        summary = self._summaries.get(path)
        if role == SUMMARY:
            return summary
        if role == _TIP:
            return plain_tip(_tip(path, summary, column))
        if summary is not None:
            theme, level = self._session.theme, how_it_ended(summary)[0]
            colour = {"fault": theme.bad, "warning": theme.warn}.get(level)
            return None if colour is None else QColor(colour)
        return None

    def _texts_of(self, path: Path) -> tuple[str, ...]:
        """Return the texts of a file's cells."""
        cells = self._cells.get(path)
        if cells is None:
            summary = self._summaries.get(path)
            cells = tuple(self._text(path, summary, column) for column in range(len(COLUMNS)))
            self._cells[path] = cells
        return cells

    def _text(self, path: Path, summary: RecordingSummary | None, column: int) -> str:
        if summary is None:
            return path.stem if column == _NAME else "…" if column == ENDED else ""
        if column == _START and not summary.started:
            return local_time(datetime.fromtimestamp(self._files[path][0], UTC).isoformat())
        return COLUMNS[column].text(summary)

    def _searched(self, path: Path) -> str:
        """Return the text of a file that a search looks through."""
        if path not in self._texts:
            self._texts[path] = "\n".join(self._texts_of(path)).casefold()
        return self._texts[path]

    def _key(self, path: Path) -> Any:
        """Return the value by which a file is sorted; None without one."""
        summary = self._summaries.get(path)
        if self._column == _START:
            return self._started(path, summary)
        if summary is None or (summary.trouble and self._column not in (0, _NAME, ENDED)):
            return path.stem.casefold() if self._column in (0, _NAME) else None
        column = COLUMNS[self._column]
        if column.key is not None:
            return column.key(summary)
        return column.text(summary).casefold() or None

    def _started(self, path: Path, summary: RecordingSummary | None) -> float:
        """Return the start of a run as Unix time in s; of other files the last change."""
        if summary is not None and summary.started:
            try:
                return datetime.fromisoformat(summary.started).timestamp()
            except (ValueError, OverflowError, OSError):
                pass  # no time that this system knows: the last change has to do
        return self._files[path][0]

    @Slot()
    def _arrange(self) -> None:
        """Sort and filter; the view is told only if rows have come, gone or moved."""
        self._settle.stop()
        found = [
            path
            for path in self._files
            if all(word in self._searched(path) for word in self._words)
        ]
        # by name first: rows of equal value stay where they are
        found.sort(key=lambda path: path.as_posix().casefold())
        keys = {path: self._key(path) for path in found}
        known = [path for path in found if keys[path] is not None]
        known.sort(key=lambda path: keys[path], reverse=self.sorting[1])
        rows = known + [path for path in found if keys[path] is None]
        if rows == self._rows:
            return
        self.beginResetModel()
        self._rows = rows
        self._row = {path: row for row, path in enumerate(rows)}
        self.endResetModel()
        self.arranged.emit()

    @Slot()
    def _redraw(self) -> None:
        if self._rows:
            last = self.index(len(self._rows) - 1, len(COLUMNS) - 1)
            self.dataChanged.emit(self.index(0, 0), last)


def _tip(path: Path, summary: RecordingSummary | None, column: int) -> str:
    if summary is None:
        return f"{path}: not read yet"
    if summary.trouble:
        return summary.trouble
    head = COLUMNS[column].head
    if head in ("RMS error", "NRMSE %", "RMS / noise"):
        if summary.unfit:
            return summary.unfit
        if summary.fitted:
            return "The model was fitted to this recording; this error is not validation"
        return COLUMNS[column].tip
    if column == ENDED:
        lines = [f"{event.time:.4g} s, {event.level}: {event.message}" for event in summary.events]
        return "\n".join([summary.outcome, *lines])
    if COLUMNS[column].wide and head not in ("Recording", "Notes"):
        return f"{COLUMNS[column].name}: {COLUMNS[column].text(summary) or NO_VALUE}"
    known = {field.label: summary.texts.get(key, "") for key, field in TEXTS.items()}
    known["Tags"] = ", ".join(summary.tags)
    return "\n".join([str(path), *(f"{label}: {text}" for label, text in known.items() if text)])


class ThumbnailDelegate(QStyledItemDelegate):
    """Draws a recording's thumbnail."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session
        # lines in a unit square, with what they were made of
        self._lines: dict[Path, tuple[RecordingSummary, QPolygonF]] = {}

    def sizeHint(self, option: QStyleOptionViewItem, index: _Index) -> QSize:  # noqa: ARG002, N802
        return QSize(84, 30)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: _Index) -> None:
        super().paint(painter, option, index)
        summary = index.data(SUMMARY)
        area = QRectF(option.rect).adjusted(4, 4, -4, -4)
        if not isinstance(summary, RecordingSummary) or summary.thumbnail[0].size < 2:
            return
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        theme, selected = self._session.theme, QStyle.StateFlag.State_Selected
        colour = theme.on_accent if option.state & selected else theme.accent
        pen = QPen(QColor(colour), 1.0)
        pen.setCosmetic(True)
        painter.setPen(pen)
        painter.translate(area.bottomLeft())
        painter.scale(area.width(), -area.height())
        painter.drawPolyline(self._line(summary))
        painter.restore()

    def _line(self, summary: RecordingSummary) -> QPolygonF:
        of, line = self._lines.get(summary.path, (None, QPolygonF()))
        if of is not summary:
            x, y = summary.thumbnail
            points = zip(x.tolist(), y.tolist(), strict=True)
            line = QPolygonF([QPointF(a, b) for a, b in points])
            self._lines[summary.path] = summary, line
        return line


def shown_columns(names: Iterable[str]) -> list[bool]:
    """Return which columns are shown, from the names that were kept; the default without any."""
    kept = [name for name in names if name in {column.name for column in COLUMNS}]
    if not kept:
        return [column.shown for column in COLUMNS]
    return [column.name in kept for column in COLUMNS]
