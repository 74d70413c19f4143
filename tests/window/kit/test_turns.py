"""Work is done in turns of its own while the rig is busy, and nothing of it is lost."""

from __future__ import annotations

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QAbstractScrollArea
from pytestqt.qtbot import QtBot

from dearig.window.kit.turns import Turns
from dearig.window.recordings.page import RecordingsPage
from dearig.window.shell.frame import MainWindow
from tests.window.conftest import press


def test_something_else_is_heard_between_two_pieces_while_busy(qtbot: QtBot) -> None:
    done: list[str] = []
    busy = True
    turns = Turns(lambda: busy)

    def first() -> None:
        done.append("first")
        QTimer.singleShot(0, lambda: done.append("STOP"))

    turns.add((first, lambda: done.append("second"), lambda: done.append("third")))
    assert done == []
    qtbot.waitUntil(lambda: "third" in done)
    assert done.index("STOP") < done.index("third")
    turns.add((lambda: done.append("late"),))
    turns.clear()
    turns.add((lambda: done.append("kept"),))
    turns.finish()
    busy = False
    turns.add((lambda: done.append("at once"),))
    assert done[-2:] == ["kept", "at once"]


def test_all_of_a_page_that_is_opened_while_armed_is_drawn_in_the_end(
    qtbot: QtBot, window: MainWindow
) -> None:
    page = window.page(RecordingsPage)
    press(qtbot, window.run_page.arm_button)
    window.show_page(page)
    parts = (page, *page.findChildren(QAbstractScrollArea))
    assert not any(part.updatesEnabled() for part in parts)
    window.show_page(window.run_page)  # before it is drawn
    window.show_page(page)
    qtbot.waitUntil(lambda: all(part.updatesEnabled() for part in parts))
    assert window.run_page.updatesEnabled()
    window.resize(window.width() + 50, window.height())
    shown = window.stack.findChildren(QAbstractScrollArea)
    assert not any(part.updatesEnabled() for part in shown)
    qtbot.waitUntil(lambda: all(part.updatesEnabled() for part in (window.stack, *shown)))
