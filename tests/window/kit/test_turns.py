"""Work is done in turns of its own while the rig is busy, and nothing of it is lost."""

from __future__ import annotations

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QAbstractScrollArea
from pytestqt.qtbot import QtBot

from dearig.window.kit.turns import Turns
from dearig.window.plots.area import PlotArea
from dearig.window.recordings.page import RecordingsPage
from dearig.window.session.state import Session
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


def test_plots_that_are_shown_while_armed_appear_one_by_one_and_all_are_in_a_picture(
    qtbot: QtBot, session: Session
) -> None:
    area = PlotArea(session, "test")
    plots = [area.add_plot(row, left="Voltage (kV)") for row in range(3)]
    qtbot.addWidget(area)
    area.show()
    assert [plot.opacity() for plot in plots] == [1.0] * 3
    area.hide()
    session.armed = True
    area.show()
    assert [plot.opacity() for plot in plots] == [0.0] * 3
    qtbot.waitUntil(lambda: plots[0].opacity() == 1.0)
    area.hide()  # before all are drawn
    area.show()
    area.image()
    assert [plot.opacity() for plot in plots] == [1.0] * 3
    area.hide()
    area.show()
    qtbot.waitUntil(lambda: [plot.opacity() for plot in plots] == [1.0] * 3)
