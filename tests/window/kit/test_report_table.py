"""Tables of a report in the window."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QGuiApplication, QPalette
from pytestqt.qtbot import QtBot

from dearig.report.text.tables import Row, Table
from dearig.window.kit.report_table import ReportTable

TABLE = Table(
    "Candidates",
    (("Effect", ""), ("RMS", "µm"), ("Verdict", "")),
    (
        Row(("leakage", "1.07", "chosen"), mark=True),
        Row(("creep", "(-0.00003)", "no better"), "what it is", muted=True),
    ),
)


@pytest.fixture
def table(qtbot: QtBot) -> ReportTable:
    table = ReportTable(whole=True)
    qtbot.addWidget(table)
    table.show_table(TABLE)
    return table


def test_heads_have_their_units_and_rows_their_details(table):
    assert [table.horizontalHeaderItem(i).text() for i in range(3)] == [
        "Effect", "RMS µm", "Verdict",
    ]  # fmt: skip
    assert table.item(1, 0).toolTip() == "what it is"
    assert table.item(0, 0).font().bold()
    assert not table.item(1, 0).font().bold()


def test_numbers_stand_right_and_words_left(table):
    right = Qt.AlignmentFlag.AlignRight
    sides = [
        [bool(Qt.AlignmentFlag(table.item(i, k).textAlignment()) & right) for k in range(3)]
        for i in range(2)
    ]
    assert sides == [[False, True, False], [False, True, False]]


def test_what_is_selected_can_be_copied(table, qtbot):
    table.selectAll()
    qtbot.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    assert QGuiApplication.clipboard().text() == (
        "leakage\t1.07\tchosen\ncreep\t(-0.00003)\tno better"
    )


def test_another_theme_sets_back_in_its_own_colour(table):
    palette = QPalette(table.palette())
    palette.setColor(QPalette.ColorRole.PlaceholderText, QColor("#123456"))
    table.setPalette(palette)
    assert table.item(1, 2).foreground().color().name() == "#123456"
    assert table.item(0, 2).foreground().style() == Qt.BrushStyle.NoBrush


def test_a_whole_table_is_as_high_as_its_rows(table):
    table.show()
    last = table.visualItemRect(table.item(1, 0))
    assert table.viewport().rect().contains(last)
    assert table.viewport().height() - last.bottom() <= 2
