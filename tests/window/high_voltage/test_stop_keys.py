"""Esc and Space stop or disarm on every page and with any focus, and start nothing."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, Qt
from PySide6.QtGui import QInputMethodEvent, QKeyEvent, QShortcut
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from dearig.window.high_voltage.state import HighVoltage
from dearig.window.recordings.page import RecordingsPage
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.study.page import StudyPage
from tests.window.conftest import SHORT

LEFT = Qt.MouseButton.LeftButton
KEYS = (Qt.Key.Key_Escape, Qt.Key.Key_Space)
RUN_MS = 60_000


def places(window: MainWindow) -> list[QWidget]:
    """Widgets of each kind, on each page, which can have the focus."""
    run = window.run_page
    return [
        run.start_button, run.arm_button, run.operator, run.paced, run.overlays.models[0],
        run.display.table, run.display.mark_bar.button, run.plots, window.list,
        window.sequence_page.editor.table, window.page(RigPage).tabs,
        window.page(RecordingsPage), window.page(StudyPage), window,
    ]  # fmt: skip


def focus(window: MainWindow, place: QWidget) -> None:
    for page in window.pages:
        if page is place or page.isAncestorOf(place):
            window.show_page(page)
    place.setFocus()


def test_while_armed_a_stop_key_disarms_whatever_has_the_focus(
    qtbot: QtBot, window: MainWindow
) -> None:
    page = window.run_page
    page.operator.setText("Ada")
    checked = page.paced.isChecked()
    for place in places(window):
        for key in KEYS:
            window.show_page(page)
            qtbot.mouseClick(page.arm_button, LEFT)
            assert page.runner.armed
            focus(window, place)
            qtbot.keyClick(place, key)
            assert page.runner.state is HighVoltage.NOT_CONTACTED, (place, key)
            assert not page.start_button.isEnabled()
            assert not page.runner.running
    assert page.operator.text() == "Ada"  # no space was written
    assert page.paced.isChecked() == checked


@pytest.mark.parametrize("key", KEYS)
def test_in_a_run_a_stop_key_stops_while_a_field_has_the_focus(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow, key: Qt.Key
) -> None:
    page, search = window.run_page, QLineEdit(window)
    search.show()
    page.paced.setChecked(True)
    qtbot.mouseClick(page.arm_button, LEFT)
    qtbot.mouseClick(page.start_button, LEFT)
    window.show_page(window.page(StudyPage))
    search.setFocus()
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
        qtbot.keyClick(search, key)
    assert ended.args[0].headline == "Stopped"
    assert search.text() == ""


def test_a_space_of_an_input_method_stops_too(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    qtbot.mouseClick(page.arm_button, LEFT)
    page.operator.setFocus()
    typed = QInputMethodEvent()
    typed.setCommitString(" ")
    QApplication.sendEvent(page.operator, typed)
    assert not page.runner.armed
    assert " " not in page.operator.text()


@pytest.mark.parametrize("text", ["", "two "])
def test_a_note_takes_a_space_after_a_word_and_no_other(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow, text: str
) -> None:
    page = window.run_page
    page.paced.setChecked(True)
    qtbot.mouseClick(page.arm_button, LEFT)
    qtbot.mouseClick(page.start_button, LEFT)
    note = page.display.mark_bar.note
    note.setFocus()
    qtbot.keyClicks(note, "lamp on")
    assert note.text() == "lamp on"
    assert page.runner.state is HighVoltage.ON
    note.setText(text)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
        qtbot.keyClick(note, Qt.Key.Key_Space)
    assert ended.args[0].headline == "Stopped"


def test_a_field_takes_spaces_while_nothing_is_armed(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    page.operator.setFocus()
    qtbot.keyClicks(page.operator, "a b")
    assert page.operator.text() == "a b"


def test_no_key_but_its_own_starts(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    for key in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Select):
        page.arm_button.setFocus()
        qtbot.keyClick(page.arm_button, key)
        assert not page.runner.armed
        qtbot.mouseClick(page.arm_button, LEFT)
        page.start_button.setFocus()
        qtbot.keyClick(page.start_button, key)
        assert not page.runner.running
        page.stop()
    # F5 arms and F6 starts, each once, however long it is held
    keys = {s.key().toString(): s for s in page.controls.findChildren(QShortcut)}
    assert set(keys) == {"F5", "F6"}
    assert not any(shortcut.autoRepeat() for shortcut in keys.values())
    qtbot.keyClick(page, Qt.Key.Key_F6)
    assert not page.runner.running  # not before it is armed
    qtbot.keyClick(page, Qt.Key.Key_F5)
    assert page.runner.armed
    # the mnemonics of other buttons are no second way
    assert "&" not in page.arm_button.text() + page.start_button.text()


def test_the_whole_stroke_of_a_stop_key_is_taken(qtbot: QtBot, window: MainWindow) -> None:
    """A key that is held repeats itself after it has disarmed, and would write into the field."""
    page = window.run_page
    page.operator.setText("")
    qtbot.mouseClick(page.arm_button, LEFT)
    page.operator.setFocus()

    def send(kind: QEvent.Type, repeated: bool) -> None:
        event = QKeyEvent(
            kind, Qt.Key.Key_Space.value, Qt.KeyboardModifier.NoModifier, " ", repeated
        )
        QCoreApplication.sendEvent(page.operator, event)

    send(QEvent.Type.KeyPress, False)
    assert not page.runner.armed
    for _ in range(3):
        send(QEvent.Type.KeyRelease, True)
        send(QEvent.Type.KeyPress, True)
    send(QEvent.Type.KeyRelease, False)
    assert page.operator.text() == ""
    send(QEvent.Type.KeyPress, False)  # the next one is a space again
    assert page.operator.text() == " "


def test_a_key_that_is_held_does_not_skip_the_ramp(
    qtbot: QtBot, window: MainWindow, plan_of
) -> None:
    page = window.run_page
    plan_of(SHORT)
    page.paced.setChecked(True)
    qtbot.mouseClick(page.arm_button, LEFT)
    qtbot.mouseClick(page.start_button, LEFT)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
        for repeated in (False, True, True):
            QCoreApplication.sendEvent(
                window,
                QKeyEvent(
                    QEvent.Type.KeyPress, Qt.Key.Key_Escape.value,
                    Qt.KeyboardModifier.NoModifier, "", repeated,
                ),
            )  # fmt: skip
    assert "ramped down" in ended.args[0].sentence


def test_the_time_to_start_is_counted_down(
    window: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = SimpleNamespace(at=100.0)
    monkeypatch.setattr("dearig.window.high_voltage.status._now", lambda: now.at)
    page = window.run_page
    qtbot.mouseClick(page.arm_button, LEFT)
    assert "disarms in 30 s" in window.bar.badge.detail
    now.at += 12.0
    qtbot.waitUntil(lambda: "disarms in 18 s" in window.bar.badge.detail)
    assert "disarms in 18 s" in page.badge.detail
    now.at += 20.0
    qtbot.waitUntil(lambda: not page.runner.armed)
    assert not page.start_button.isEnabled()
