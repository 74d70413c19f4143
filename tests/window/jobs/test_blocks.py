"""Blocks and banners: what keeps the rig from being armed, on the Run page and on every page."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton, QWidget
from pytestqt.qtbot import QtBot

from dearig.window.high_voltage.state import HighVoltage
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow


def test_a_block_refuses_arming_and_says_why_on_every_page(
    window: MainWindow, qtbot: QtBot
) -> None:
    page, session = window.run_page, window.session
    session.block("voltage_max", "voltage_max of the rig file is not a number", "Rig")
    assert not page.arm_button.isEnabled()
    page.arm_button.click()
    assert page.runner.state is not HighVoltage.ARMED
    assert "voltage_max" in page.blocked.text()
    for other in window.pages:
        window.show_page(other)
        assert window.banners.isVisible()
    go = next(b for b in window.banners.findChildren(QPushButton) if b.isVisible())
    qtbot.mouseClick(go, Qt.MouseButton.LeftButton)
    assert window.page(RigPage).isVisible()

    session.unblock("voltage_max")
    assert not window.banners.isVisible()
    assert page.arm_button.isEnabled()


def test_a_block_disarms_a_rig_that_is_armed(window: MainWindow) -> None:
    page = window.run_page
    page.arm_button.click()
    assert page.runner.state is HighVoltage.ARMED
    window.session.block("draft", "segment 2 is not complete")
    assert page.runner.state is not HighVoltage.ARMED
    assert not page.start_button.isEnabled()


def test_a_wrong_name_of_a_card_blocks_arming_before_the_page_rig_is_shown(
    session: Session, keep: Callable[[QWidget], None]
) -> None:
    assert not RigPage.needed(session)  # a simulated rig has no name of a card
    session.set_address("daqmx:Dev1/ao0")
    keep(shown := MainWindow(session))
    assert "is not the address of a card" in session.blocks["rig address"].sentence
    assert not shown.run_page.arm_button.isEnabled()


def test_a_banner_stays_until_it_is_hidden(window: MainWindow) -> None:
    window.banners.show_text("disk", "The disk is slow")
    window.banners.show_text("disk", "The disk is very slow")
    assert window.banners.texts == ["The disk is very slow"]
    for page in window.pages:
        window.show_page(page)
        assert window.banners.isVisible()
    window.banners.hide_text("disk")
    assert not window.banners.isVisible()
