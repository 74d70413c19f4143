"""Alarms: what happened, when, how grave it was, and who has acknowledged it."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from datetime import datetime

from PySide6.QtCore import QObject, QSize, Qt, Signal, Slot
from PySide6.QtGui import QColor, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from dearig.printable import printable
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import ElidedLabel, button, plain_tip
from dearig.window.session.state import Session

__all__ = ["AcknowledgeBar", "Alarm", "AlarmLog", "AlarmTable"]

log = logging.getLogger(__name__)

_ALARMS_MAX = 500  # the oldest are dropped
_HEADINGS = ("Time of day", "Run time", "Level", "Message", "Acknowledged by")
_MESSAGE = 3  # column that takes the remaining width
_SIGNS = {"info": "info", "warning": "⚠ warning", "fault": "✗ fault"}
_ROWS_LEAST, _ROWS_USUAL = 2, 3


@dataclass(frozen=True)
class Alarm:
    """What happened ``at`` a local time, and at ``run_time`` s of a run; None outside a run.

    ``level`` is info, warning or fault. Warnings and faults are to be acknowledged;
    ``acknowledged`` says by whom and when.
    """

    at: datetime
    level: str
    message: str
    run_time: float | None = None
    acknowledged: str = ""

    @property
    def pending(self) -> bool:
        """True for a warning or fault that no one has acknowledged."""
        return self.level != "info" and not self.acknowledged


class AlarmLog(QObject):
    """Alarms of the window since its start, the oldest first.

    ``added`` carries a new alarm, ``dropped``: the oldest is no longer kept, ``changed`` follows
    every other change, ``acknowledged`` carries the alarms that were acknowledged and the name.
    """

    added = Signal(object)
    dropped = Signal()
    changed = Signal()
    acknowledged = Signal(object, str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._alarms: list[Alarm] = []

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """All alarms that are kept."""
        return tuple(self._alarms)

    @property
    def pending(self) -> int:
        """Number of warnings and faults that no one has acknowledged."""
        return sum(alarm.pending for alarm in self._alarms)

    def add(
        self,
        level: str,
        message: str,
        run_time: float | None = None,
        at: datetime | None = None,
        acknowledged: str = "",
    ) -> None:
        """Add an alarm that happened ``at`` a local time, by default now."""
        moment = at or datetime.now().astimezone()
        alarm = Alarm(moment, level, printable(message), run_time, acknowledged)
        self._alarms.append(alarm)
        self.added.emit(alarm)
        if len(self._alarms) > _ALARMS_MAX:
            del self._alarms[0]
            self.dropped.emit()

    def acknowledge(self, who: str, at: datetime | None = None) -> None:
        """Mark all pending alarms as acknowledged by ``who``, and log that."""
        moment = at or datetime.now().astimezone()
        done: list[Alarm] = []
        for place, alarm in enumerate(self._alarms):
            if alarm.pending:
                by = f"{who}, {moment:%H:%M:%S}"
                self._alarms[place] = replace(alarm, acknowledged=by)
                done.append(self._alarms[place])
        if not done:
            return
        for alarm in done:
            log.info("%s acknowledged by %s: %s", alarm.level, who, alarm.message)
        self.changed.emit()
        self.acknowledged.emit(tuple(done), who)


class AlarmTable(QTableWidget):
    """Table of an ``AlarmLog``, the newest last and in view."""

    def __init__(self, alarms: AlarmLog, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(0, len(_HEADINGS), parent)
        self._log = alarms
        self._session = session
        self.setAccessibleName("Alarms and events")
        self.setHorizontalHeaderLabels(_HEADINGS)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setTabKeyNavigation(False)
        self.setWordWrap(True)
        rows = self.verticalHeader()
        rows.hide()
        self._row = self.fontMetrics().height() + 4
        rows.setDefaultSectionSize(self._row)
        rows.setMinimumSectionSize(self._row)
        header = self.horizontalHeader()
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        header.setHighlightSections(False)
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setResizeContentsPrecision(0)  # of the rows in view
        header.setSectionResizeMode(_MESSAGE, QHeaderView.ResizeMode.Stretch)
        self.setMinimumHeight(self._height(_ROWS_LEAST))
        alarms.added.connect(self._add)
        alarms.dropped.connect(lambda: self.removeRow(0))
        alarms.changed.connect(self._show_all)
        session.theme_changed.connect(self._show_all)

    def sizeHint(self) -> QSize:  # noqa: N802
        return QSize(400, self._height(_ROWS_USUAL))

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        return QSize(300, self._height(_ROWS_LEAST))

    def rows(self) -> list[tuple[str, ...]]:
        """Return the texts of all cells, row by row."""
        found = []
        for row in range(self.rowCount()):
            items = [self.item(row, column) for column in range(len(_HEADINGS))]
            found.append(tuple("" if item is None else item.text() for item in items))
        return found

    def _height(self, rows: int) -> int:
        return self.horizontalHeader().sizeHint().height() + rows * self._row + 4

    @Slot()
    def _show_all(self) -> None:
        self.setRowCount(0)
        for alarm in self._log.alarms:
            self._add(alarm)

    @Slot(object)
    def _add(self, alarm: Alarm) -> None:
        theme = self._session.theme
        row = self.rowCount()
        self.insertRow(row)
        texts = (
            f"{alarm.at:%H:%M:%S}",
            "" if alarm.run_time is None else f"{alarm.run_time:.2f} s",
            _SIGNS.get(alarm.level, alarm.level),
            alarm.message,
            alarm.acknowledged,
        )
        colour = QColor({"fault": theme.bad, "warning": theme.warn}.get(alarm.level, theme.text))
        for column, text in enumerate(texts):
            item = QTableWidgetItem(text)
            item.setForeground(colour)
            if alarm.pending:
                font = item.font()
                font.setBold(True)
                item.setFont(font)
            item.setToolTip(plain_tip(f"{alarm.at:%Y-%m-%d %H:%M:%S %z}  {alarm.message}"))
            self.setItem(row, column, item)
        self.resizeRowToContents(row)
        self.scrollToBottom()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        super().resizeEvent(event)
        self.resizeRowsToContents()


class AcknowledgeBar(QWidget):
    """Number of the alarms that wait, and the button that acknowledges them.

    The name is that of the field *Operator*: without one the bar says so.
    """

    def __init__(self, alarms: AlarmLog, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._log = alarms
        self._session = session
        self.words = ElidedLabel("warn", hugging=True)
        self.button: QPushButton = button(
            "Ac&knowledge", "Acknowledge all alarms of the list, with the operator's name"
        )
        self.button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # no stop key may press it
        self.button.clicked.connect(self._acknowledge)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(SPACE)
        row.addWidget(self.words)
        row.addWidget(self.button)
        for signal in (alarms.added, alarms.changed, session.notes_changed):
            signal.connect(self._refresh)
        self._refresh()

    @Slot()
    def _refresh(self) -> None:
        pending, named = self._log.pending, bool(self._session.operator.strip())
        text = f"{pending} to acknowledge" if pending else ""
        if pending and not named:
            text += ": enter your name in Operator"
        self.words.show_text(text)
        self.words.setVisible(bool(text))
        self.button.setEnabled(pending > 0 and named)

    @Slot()
    def _acknowledge(self) -> None:
        self._log.acknowledge(self._session.operator.strip())
