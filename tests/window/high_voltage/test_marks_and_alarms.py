"""Marks and notes during a run, and the list of alarms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import datetime

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.recording import open_recording
from dearig.recording.reading.marks import Mark, marks_in
from dearig.window.high_voltage.alarms import AcknowledgeBar, AlarmLog, AlarmTable
from dearig.window.recordings.page import RecordingsPage
from dearig.window.run.page import RunPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.window.conftest import SHORT, press
from tests.window.run.test_stories import RUN_MS, click, seconds

LONG = SHORT.replace("frequency_Hz = 2.0", "frequency_Hz = 0.05")


@pytest.fixture
def going(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None], quick_ramp: Session
) -> Iterator[RunPage]:
    """A run in real time that has begun."""
    page = window.run_page
    page.operator.setText("Ada")
    plan_of(LONG)
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    qtbot.waitUntil(lambda: seconds(page) > 0.2, timeout=RUN_MS)
    yield page
    page.stop()  # once more: 0 V at once
    page.stop()
    qtbot.waitUntil(lambda: not page.runner.running, timeout=RUN_MS)


def marks_of(qtbot: QtBot, page: RunPage) -> tuple[Mark, ...]:
    """Stop the run, and read the marks of its recording."""
    with qtbot.waitSignal(page.session.recorded, timeout=RUN_MS) as ended:
        page.stop()
    return marks_in(open_recording(ended.args[0]).events)


def stroke(qtbot: QtBot, window: MainWindow, key: Qt.Key) -> None:
    focused = window.focusWidget()
    assert isinstance(focused, QWidget)
    qtbot.keyClick(focused, key)


def test_m_sets_a_mark_and_the_field_takes_its_note(
    qtbot: QtBot, window: MainWindow, going: RunPage
) -> None:
    bar = going.display.mark_bar
    before = seconds(going)
    stroke(qtbot, window, Qt.Key.Key_M)
    assert bar.note.hasFocus()
    assert bar.note.placeholderText() == "Note on mark 1: Enter keeps it, Esc stops the run"
    qtbot.keyClicks(bar.note, "a spark, my left hand edge")  # with an M and spaces in it
    qtbot.keyClick(bar.note, Qt.Key.Key_Return)
    assert going.stop_button.hasFocus()
    stroke(qtbot, window, Qt.Key.Key_M)
    qtbot.waitUntil(lambda: "mark 2" in going.plots.marks, timeout=RUN_MS)
    assert going.plots.marks == ["a spark, my left hand edge", "mark 2"]
    assert going.runner.running
    first, second = marks_of(qtbot, going)
    assert (first.note, second.note) == ("a spark, my left hand edge", "")
    assert before - 0.2 < first.time < before + 3.0
    assert not bar.button.isEnabled()


@pytest.mark.deep
def test_m_marks_from_every_page_and_the_button_does_the_same(
    qtbot: QtBot, window: MainWindow, going: RunPage
) -> None:
    for page in window.pages:
        window.show_page(page)
        window.list.setFocus()
        qtbot.keyClick(window.list, Qt.Key.Key_M)
    window.show_page(going)
    qtbot.mouseClick(going.display.mark_bar.button, Qt.MouseButton.LeftButton)
    assert [m.number for m in marks_of(qtbot, going)] == [*range(1, len(window.pages) + 2)]


def test_a_note_without_a_mark_sets_one_and_text_fields_keep_their_letters(
    qtbot: QtBot, window: MainWindow, going: RunPage
) -> None:
    window.show_page(window.page(RecordingsPage))
    window.show_page(going)
    note = going.display.mark_bar.note
    stroke(qtbot, window, Qt.Key.Key_N)
    assert note.hasFocus()
    qtbot.keyClicks(note, "lamp on")
    assert note.text() == "lamp on"
    qtbot.keyClick(note, Qt.Key.Key_Return)
    assert [m.note for m in marks_of(qtbot, going)] == ["lamp on"]


@pytest.mark.deep
def test_a_note_that_is_not_finished_when_the_run_ends_is_kept(
    qtbot: QtBot, window: MainWindow, going: RunPage
) -> None:
    stroke(qtbot, window, Qt.Key.Key_M)
    qtbot.keyClicks(going.display.mark_bar.note, "it tea")
    assert [m.note for m in marks_of(qtbot, going)] == ["it tea"]
    assert going.display.mark_bar.note.text() == ""


def test_without_a_run_m_does_nothing(qtbot: QtBot, window: MainWindow) -> None:
    bar = window.run_page.display.mark_bar
    qtbot.keyClick(window.list, Qt.Key.Key_M)
    assert not bar.note.isEnabled()
    assert "while a run goes on" in bar.note.placeholderText()
    bar.mark()  # by a key that was pressed in the last moment
    assert window.status.full_text == "No mark was set: no run is in progress"


def test_alarms_of_a_run_have_time_level_and_acknowledgement(
    qtbot: QtBot, run_page: RunPage, plan_of: Callable[[str], None]
) -> None:
    plan_of(SHORT)
    run_page.faults = ("arc@0.45",)
    press(qtbot, run_page.arm_button)
    began = datetime.now().astimezone()
    with qtbot.waitSignal(run_page.runner.ended, timeout=RUN_MS):
        press(qtbot, run_page.start_button)
    alarms, table, bar = run_page.alarms, run_page.display.table, run_page.display.acknowledge
    trip = next(a for a in alarms.alarms if "interlock" in a.message)
    assert began <= trip.at <= datetime.now().astimezone()
    assert trip.run_time is not None
    row = next(r for r in table.rows() if "interlock" in r[3])
    assert row[:3] == (f"{trip.at:%H:%M:%S}", f"{trip.run_time:.2f} s", "✗ fault")
    assert row[4] == ""
    assert alarms.pending >= 2  # the trip, and the end of the run
    assert not bar.button.isEnabled()
    assert bar.words.full_text.endswith("to acknowledge: enter your name in Operator")
    run_page.operator.setText("Ada")
    click(qtbot, bar.button)
    assert alarms.pending == 0
    row = next(r for r in table.rows() if "interlock" in r[3])
    assert row[4].startswith("Ada, ")
    assert bar.words.full_text == ""


@pytest.mark.deep
def test_an_acknowledgement_during_a_run_is_recorded(qtbot: QtBot, going: RunPage) -> None:
    going.alarms.add("warning", "the room is warm", 1.0)
    going.alarms.acknowledge("Ada")
    with qtbot.waitSignal(going.session.recorded, timeout=RUN_MS) as ended:
        going.stop()
    messages = [e.message for e in open_recording(ended.args[0]).events]
    assert "1 alarm acknowledged by Ada" in messages


def test_the_operators_own_stop_needs_no_acknowledgement(qtbot: QtBot, going: RunPage) -> None:
    marks_of(qtbot, going)
    assert any("interrupted by the operator" in a.message for a in going.alarms.alarms)
    assert going.alarms.pending == 0


def test_an_error_of_the_program_is_an_alarm_once(run_page: RunPage, qtbot: QtBot) -> None:
    def fail() -> None:
        raise ValueError("a slot has failed")

    run_page.session.program_errors.install()
    try:
        for _ in range(2):
            QTimer.singleShot(0, fail)
        qtbot.waitUntil(lambda: bool(run_page.alarms.alarms))
        qtbot.wait(1)
    finally:
        run_page.session.program_errors.close()
    (alarm,) = run_page.alarms.alarms
    assert alarm.level == "fault"
    assert "a slot has failed" in alarm.message


def test_a_long_list_keeps_the_newest_and_its_last_row_in_view(
    session: Session, qtbot: QtBot
) -> None:
    alarms = AlarmLog()
    table, bar = AlarmTable(alarms, session), AcknowledgeBar(alarms, session)
    for widget in (table, bar):
        qtbot.addWidget(widget)
    for number in range(505):
        alarms.add("info", f"event {number} \x1b[31m")
    assert len(alarms.alarms) == table.rowCount() == 500
    assert table.rows()[-1][3] == "event 504 \\x1b[31m"
    assert table.rows()[0][3].startswith("event 5 ")
    assert not bar.button.isEnabled()
