"""Esc and Space stop or disarm on every page and with any focus, and start nothing."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, Qt
from PySide6.QtGui import QInputMethodEvent, QKeyEvent, QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from dearig.window.high_voltage.state import HighVoltage
from dearig.window.recordings.page import RecordingsPage
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.study.page import StudyPage
from tests.window.conftest import SHORT, press, put_back, strike

LEFT = Qt.MouseButton.LeftButton
KEYS = (Qt.Key.Key_Escape, Qt.Key.Key_Space)
RUN_MS = 60_000


@pytest.fixture
def window(shared_window: MainWindow, qtbot: QtBot) -> MainWindow:
    """The window of this file: what is pressed leaves no trace in it once it is disarmed."""
    return put_back(shared_window, qtbot)


@pytest.fixture
def session(window: MainWindow) -> Session:
    return window.session


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


def writes(place: QWidget) -> bool:
    return isinstance(place, QLineEdit)


def test_while_armed_a_stop_key_disarms_whatever_has_the_focus(
    qtbot: QtBot, window: MainWindow
) -> None:
    page = window.run_page
    page.operator.setText("Ada")
    checked = page.paced.isChecked()
    for place in places(window):
        for key in KEYS:
            if key == Qt.Key.Key_Space and writes(place):
                continue
            window.show_page(page)
            press(qtbot, page.arm_button)
            assert page.runner.armed
            focus(window, place)
            title = window.stack.currentWidget().title
            strike(place, key)
            assert not page.runner.armed, (place, key)
            assert not page.start_button.isEnabled()
            assert not page.runner.running
            name = "Esc" if key == Qt.Key.Key_Escape else "Space"
            assert f"disarmed by key {name} on {title}, " in window.bar.detail.text()
    assert page.operator.text() == "Ada"
    assert page.paced.isChecked() == checked


def begin(qtbot: QtBot, window: MainWindow) -> None:
    """Begin a run that takes its time."""
    page = window.run_page
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)


def test_a_run_that_a_key_stops_says_which_one_and_where(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow
) -> None:
    page, status = window.run_page, window.run_page.runner.status
    for key, name, other in (
        (Qt.Key.Key_Escape, "Esc", window.page(RecordingsPage)),
        (Qt.Key.Key_Space, "Space", window.page(StudyPage)),
    ):
        window.show_page(page)
        begin(qtbot, window)
        window.show_page(other)
        with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
            strike(other, key)
            during = window.bar.detail.text()
        assert ended.args[0].headline == "Stopped"
        assert f"stopped by key {name} on {other.title}, " in during
        assert f"stopped by key {name} on {other.title}, " in window.bar.detail.text()
    # what is said belongs to one run
    window.show_page(page)
    press(qtbot, page.arm_button)
    assert status.cause == ""


def test_every_other_stop_is_named_too(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow
) -> None:
    page, bar = window.run_page, window.bar
    begin(qtbot, window)
    window.show_page(window.page(StudyPage))
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS):
        qtbot.mouseClick(bar.stop_button, LEFT)
    assert "stopped by STOP on Study, " in bar.detail.text()
    window.show_page(page)
    press(qtbot, page.arm_button)
    quick_ramp.block("test", "a test")
    assert "disarmed: something blocks arming, " in bar.detail.text()
    quick_ramp.unblock("test")
    press(qtbot, page.arm_button)
    quick_ramp.set_sequence(SHORT, Path())
    assert "disarmed: the sequence was changed, " in bar.detail.text()


def test_a_space_writes_where_a_text_field_has_the_focus(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow
) -> None:
    page, search = window.run_page, window.page(RecordingsPage).filter
    begin(qtbot, window)
    note = page.display.mark_bar.note
    for other, field in ((page, note), (window.page(RecordingsPage), search)):
        window.show_page(other)
        strike(field, *" lamp  on ")
        assert field.text() == " lamp  on "
        typed = QInputMethodEvent()
        typed.setCommitString(" ")
        QApplication.sendEvent(field, typed)
        assert field.text() == " lamp  on  "
    assert page.runner.state is HighVoltage.ON
    page.stop()
    qtbot.waitUntil(lambda: not page.runner.running, timeout=RUN_MS)


@pytest.mark.deep
def test_a_space_does_not_write_where_nothing_can_be_written(
    qtbot: QtBot, window: MainWindow
) -> None:
    page = window.run_page
    press(qtbot, page.arm_button)
    page.operator.setReadOnly(True)
    strike(page.operator, Qt.Key.Key_Space)
    assert not page.runner.armed
    # an input method writes past the window, into what has the focus
    press(qtbot, page.arm_button)
    page.operator.setFocus()
    typed = QInputMethodEvent()
    typed.setCommitString(" ")
    QApplication.sendEvent(QApplication.focusObject(), typed)
    assert not page.runner.armed
    page.operator.setReadOnly(False)


def test_esc_closes_what_is_open_before_it_stops(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow
) -> None:
    page, search = window.run_page, window.page(RecordingsPage).filter
    begin(qtbot, window)
    # the guide
    window.show_guide()
    guide = window._guide
    strike(guide.text, Qt.Key.Key_Escape)
    assert not guide.isVisible()
    # a list, and the repetitions of the key that has closed it
    box = page.display.view.span
    box.setFocus()
    box.showPopup()
    qtbot.waitUntil(lambda: QApplication.activePopupWidget() is not None)
    for repeated in (False, True, True):
        QCoreApplication.sendEvent(
            window.windowHandle(),
            QKeyEvent(
                QEvent.Type.KeyPress, Qt.Key.Key_Escape.value,
                Qt.KeyboardModifier.NoModifier, "", repeated,
            ),
        )  # fmt: skip
    assert QApplication.activePopupWidget() is None
    # a search text
    window.show_page(window.page(RecordingsPage))
    search.setText("film 7")
    strike(search, Qt.Key.Key_Escape)
    assert search.text() == ""
    # a cell that is edited
    window.show_page(window.sequence_page)
    assert page.runner.state is HighVoltage.ON
    # and where nothing is open, the run
    window.show_page(window.page(RecordingsPage))
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS):
        strike(search, Qt.Key.Key_Escape)
    assert "stopped by key Esc on Recordings, " in window.bar.detail.text()


@pytest.mark.deep
def test_a_field_takes_spaces_while_nothing_is_armed(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    strike(page.operator, *"a b")
    assert page.operator.text() == "a b"


def test_no_key_but_its_own_starts(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    for key in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Select):
        strike(page.arm_button, key)
        assert not page.runner.armed
        press(qtbot, page.arm_button)
        strike(page.start_button, key)
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
    # the mnemonics of other buttons are not a second way
    assert "&" not in page.arm_button.text() + page.start_button.text()


def test_the_whole_stroke_of_a_stop_key_is_taken(qtbot: QtBot, window: MainWindow) -> None:
    """A key that is held repeats itself after it has disarmed, and would press what has focus."""
    page = window.run_page
    checked = page.paced.isChecked()
    press(qtbot, page.arm_button)
    page.paced.setFocus()

    def send(kind: QEvent.Type, repeated: bool) -> None:
        event = QKeyEvent(
            kind, Qt.Key.Key_Space.value, Qt.KeyboardModifier.NoModifier, " ", repeated
        )
        QCoreApplication.sendEvent(window.windowHandle(), event)

    send(QEvent.Type.KeyPress, False)
    assert not page.runner.armed
    for _ in range(3):
        send(QEvent.Type.KeyRelease, True)
        send(QEvent.Type.KeyPress, True)
    send(QEvent.Type.KeyRelease, False)
    assert page.paced.isChecked() == checked
    send(QEvent.Type.KeyPress, False)  # the next one is a space again
    send(QEvent.Type.KeyRelease, False)
    assert page.paced.isChecked() != checked


def test_a_key_that_is_held_does_not_skip_the_ramp(
    qtbot: QtBot, window: MainWindow, plan_of
) -> None:
    page = window.run_page
    plan_of(SHORT)
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
        for repeated in (False, True, True):
            QCoreApplication.sendEvent(
                window.windowHandle(),
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
    press(qtbot, page.arm_button)
    assert "disarms in 30 s" in window.bar.badge.detail
    now.at += 12.0
    qtbot.waitUntil(lambda: "disarms in 18 s" in window.bar.badge.detail)
    assert "disarms in 18 s" in page.badge.detail
    now.at += 20.0
    qtbot.waitUntil(lambda: not page.runner.armed)
    assert not page.start_button.isEnabled()


def test_a_click_on_stop_stops_with_a_menu_or_a_list_open(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    menu = page.plots.area.tools.menu
    opened = {
        "menu": lambda: menu.popup(window.mapToGlobal(window.rect().center())),
        "list": page.display.view.span.showPopup,
    }
    system = window.windowHandle()
    assert system is not None
    for name, show in opened.items():
        for stop in (window.bar.stop_button, page.stop_button):
            press(qtbot, page.arm_button)
            show()
            QTest.mouseClick(system, LEFT, pos=window.bar.badge.mapTo(window, QPoint(5, 5)))
            assert page.runner.armed  # a click elsewhere only closes it
            if QApplication.activePopupWidget() is None:
                show()
            QTest.mouseClick(system, LEFT, pos=stop.mapTo(window, stop.rect().center()))
            assert not page.runner.armed, name
            assert QApplication.activePopupWidget() is None
            assert "disarmed by STOP" in window.bar.detail.text()
