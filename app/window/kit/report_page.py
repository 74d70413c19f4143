"""Scrollable page of sentences and report tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QScrollArea, QVBoxLayout, QWidget

from dearig.report.text.tables import Table
from dearig.units import readable
from dearig.window.kit.report_table import ReportTable
from dearig.window.kit.theme import SPACE
from dearig.window.kit.widgets import label

__all__ = ["ReportPage"]


class ReportPage(QScrollArea):
    """Scrollable sentences and tables."""

    def __init__(self) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.show_pieces(())

    def show_pieces(self, pieces: Sequence[str | Table], warnings: tuple[str, ...] = ()) -> None:
        """Replace the contents."""
        for step in self.steps(pieces, warnings):
            step()

    def steps(
        self, pieces: Sequence[str | Table], warnings: tuple[str, ...] = ()
    ) -> list[Callable[[], None]]:
        """Return the steps that replace the contents, one for each piece."""
        inner = QWidget()
        column = QVBoxLayout(inner)
        column.setSpacing(SPACE)

        def add(piece: str | Table) -> None:
            if isinstance(piece, str):
                column.addWidget(_paragraph(piece, ""))
                return
            column.addWidget(label(piece.title, "heading"))
            if piece.rows:
                table = ReportTable(whole=True)
                table.show_table(piece)
                column.addWidget(table)
                # the page scrolls sideways and not the table
                inner.setMinimumWidth(max(inner.minimumWidth(), table.maximumWidth()))
            if piece.note:
                column.addWidget(_paragraph(piece.note, "muted"))

        def end() -> None:
            for warning in warnings:
                column.addWidget(_paragraph(f"! {warning}", "warn"))
            column.addStretch(1)

        return [lambda: self.setWidget(inner), *(partial(add, piece) for piece in pieces), end]


def _paragraph(text: str, role: str) -> QLabel:
    made = label(readable(text), role)
    made.setWordWrap(True)
    made.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return made
