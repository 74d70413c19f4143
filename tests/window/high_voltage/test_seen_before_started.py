"""Nothing is armed or started by a key or click that was made before its state could be seen."""

from __future__ import annotations

import time

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from dearig.window.campaign.page import CampaignPage
from dearig.window.high_voltage.status import REACTION
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.deep import mostly_deep
from tests.window.conftest import press, put_back

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def window(shared_window: MainWindow, qtbot: QtBot) -> MainWindow:
    """The window of this file: what is pressed leaves no trace in it once it is disarmed."""
    return put_back(shared_window, qtbot)


@pytest.fixture
def session(window: MainWindow) -> Session:
    return window.session


def busy(seconds: float) -> None:
    """Block the interface thread, as a page does that opens, or a program that is stopped."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        pass


def settle(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    qtbot.waitUntil(lambda: page.arm_button.isEnabled() and page.arm_button.answers)


def test_start_waits_until_armed_was_on_the_screen(qtbot: QtBot, window: MainWindow) -> None:
    page, status = window.run_page, window.run_page.runner.status
    settle(qtbot, window)
    qtbot.keyClick(page, Qt.Key.Key_F5)
    assert page.runner.armed
    # the key of the second step, before one event of painting was handled
    qtbot.keyClick(page, Qt.Key.Key_F6)
    qtbot.mouseClick(page.start_button, LEFT)
    page.start()  # nor by the program
    assert not page.runner.running
    QApplication.processEvents()  # painted now, and not answered yet
    qtbot.keyClick(page, Qt.Key.Key_F6)
    assert not page.runner.running
    qtbot.waitUntil(page.start_button.isEnabled)
    assert status.may_start
    qtbot.keyClick(page, Qt.Key.Key_F6)
    assert page.runner.running


def test_start_waits_for_ever_while_armed_is_not_on_the_screen(
    qtbot: QtBot, window: MainWindow
) -> None:
    page, status = window.run_page, window.run_page.runner.status
    settle(qtbot, window)
    page.arm_button.click()
    window.hide()
    qtbot.wait(round(4 * REACTION * 1000))
    assert page.runner.armed
    assert not status.may_start
    window.show()
    qtbot.waitUntil(lambda: status.may_start)
    page.stop()


@pytest.mark.parametrize("steps", mostly_deep(["F5 F6", "F5", "click"], ["F5 F6"]))
def test_what_was_pressed_while_the_window_was_busy_is_dropped(
    qtbot: QtBot, window: MainWindow, steps: str
) -> None:
    page, said = window.run_page, []
    window.session.message.connect(said.append)
    settle(qtbot, window)
    busy(2 * REACTION)
    # what waited in the queue of the window system
    if steps == "click":
        QTest.mouseClick(page.arm_button, LEFT)
    else:
        for key in steps.split():
            QTest.keyClick(page, getattr(Qt.Key, f"Key_{key}"))
    assert not page.runner.armed
    assert "while the window was busy" in said[0]
    # nor in the first moment after it, in which the queue is still being emptied
    QApplication.processEvents()
    QTest.keyClick(page, Qt.Key.Key_F5)
    assert not page.runner.armed
    settle(qtbot, window)
    qtbot.keyClick(page, Qt.Key.Key_F5)
    assert page.runner.armed


def test_a_start_that_waited_in_the_queue_is_dropped(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    press(qtbot, page.arm_button)
    qtbot.waitUntil(page.start_button.isEnabled)
    busy(2 * REACTION)
    QTest.keyClick(page, Qt.Key.Key_F6)
    QTest.mouseClick(page.start_button, LEFT)
    assert page.runner.armed
    assert not page.runner.running


def test_a_campaign_is_started_by_what_was_seen_too(qtbot: QtBot, window: MainWindow) -> None:
    controls = window.page(CampaignPage).controls
    window.show_page(window.page(CampaignPage))
    controls.operator.setText("Ada")
    press(qtbot, controls.arm)
    qtbot.mouseClick(controls.start, LEFT)
    window.page(CampaignPage).start()
    assert not window.run_page.runner.running
    qtbot.waitUntil(controls.start.isEnabled)
    busy(2 * REACTION)
    qtbot.mouseClick(controls.start, LEFT)
    assert not window.run_page.runner.running
    window.run_page.stop()
