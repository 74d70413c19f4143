"""Pages are made while the window is idle, and never while STOP may be needed."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.window.recordings.page import RecordingsPage
from dearig.window.session.state import Session
from dearig.window.shell import idle_pages
from dearig.window.shell.frame import MainWindow
from dearig.window.shell.guide import Guide
from dearig.window.shell.idle_pages import IdlePages
from dearig.window.shell.pages import PAGES
from tests.window.conftest import SHORT, press

WAIT = 60_000


@pytest.fixture(autouse=True)
def _when_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """A page follows another at once, and the first not before the test asks for it."""
    monkeypatch.setattr(idle_pages, "_BETWEEN", 1)
    monkeypatch.setattr(idle_pages, "_AFTER", 1_000_000)


def test_pages_are_made_one_by_one_while_nothing_is_armed(session: Session, qtbot: QtBot) -> None:
    made: list[int] = []

    def make() -> bool:
        made.append(len(made))
        return len(made) < 4

    pages = IdlePages(session, make)
    session.set_armed(True)
    pages._timer.start(1)
    qtbot.wait(30)  # so many turns of the timer, in none of which a page may be made
    assert made == []
    session.set_armed(False)
    qtbot.waitUntil(lambda: pages.done, timeout=WAIT)
    assert made == [0, 1, 2, 3]
    qtbot.wait(5)
    assert len(made) == 4


def test_what_is_closed_makes_nothing(session: Session, qtbot: QtBot) -> None:
    made: list[int] = []
    pages = IdlePages(session, lambda: made.append(1) is None)
    pages._timer.start(1)
    pages.close()
    pages.start()
    session.arming.emit()
    qtbot.wait(5)
    assert made == []


@pytest.fixture
def window(session: Session, keep: Callable[[QWidget], None]) -> MainWindow:
    """The window as it opens for an operator."""
    shown = MainWindow(session)
    keep(shown)
    return shown


def test_no_page_is_left_to_be_made_once_the_rig_is_armed(
    window: MainWindow, qtbot: QtBot, plan_of
) -> None:
    assert RecordingsPage not in window._pages
    plan_of(SHORT)
    states: list[int] = []
    window.session.armed_changed.connect(lambda _: states.append(len(window._pages)))
    press(qtbot, window.run_page.arm_button)
    assert states == [len(PAGES)]  # before it was armed, not after
    # Qt lays out and styles a page when it is drawn first: this is done too
    assert all(
        window.page(kind).testAttribute(Qt.WidgetAttribute.WA_WState_Polished) for kind in PAGES
    )


@pytest.mark.deep
def test_an_idle_window_makes_them_all(window: MainWindow, qtbot: QtBot) -> None:
    window.idle_pages._timer.start(1)
    qtbot.waitUntil(lambda: window.idle_pages.done, timeout=WAIT)
    assert set(window._pages) == set(PAGES)
    made = window.findChildren(Guide)
    assert len(made) == 1  # its pictures are read and scaled
    window.show_guide()
    assert window.findChildren(Guide) == made
    assert made[0].isVisible()
