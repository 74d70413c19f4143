"""The bar on every page: what was measured of the high voltage, the latched alarm, and STOP."""

from __future__ import annotations

import logging
import math
import subprocess
import sys
import time
from collections.abc import Callable

import pytest
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QFont, QFontMetrics
from PySide6.QtWidgets import QApplication, QDialog, QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from dearig.output_state import Known, OutputState
from dearig.recording import open_recording
from dearig.recording.verify import verify
from dearig.window.high_voltage.state import HighVoltage, kilovolts
from dearig.window.high_voltage.status import HighVoltageStatus, LatchedAlarm
from dearig.window.rig.page import RigPage
from dearig.window.run.page import RunPage
from dearig.window.run.runner import Runner
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.window.conftest import SHORT, press

LEFT = Qt.MouseButton.LeftButton
RUN_MS = 60_000
ARC = "arc@0.5+0.2"


def play(qtbot: QtBot, page: RunPage) -> None:
    press(qtbot, page.arm_button)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS):
        press(qtbot, page.start_button)


def test_stop_can_be_clicked_on_every_page(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page, bar = window.run_page, window.bar
    plan_of(SHORT)
    page.paced.setChecked(True)
    for other in window.pages:
        window.show_page(page)
        press(qtbot, page.arm_button)
        window.show_page(other)
        assert bar.badge.state is HighVoltage.ARMED
        press(qtbot, page.start_button)
        with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
            assert bar.badge.state is HighVoltage.ON
            # what lies at this place of the window is STOP: nothing covers it
            centre = bar.stop_button.mapTo(window, bar.stop_button.rect().center())
            assert window.childAt(centre) is bar.stop_button
            qtbot.mousePress(bar.stop_button, LEFT)  # it does not wait for the release
            qtbot.mouseRelease(bar.stop_button, LEFT)
        assert ended.args[0].headline == "Stopped"


def test_the_bar_shows_the_monitor_and_the_time_and_greys_what_was_read_after_it(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page, bar = window.run_page, window.bar
    plan_of(SHORT.replace("frequency_Hz = 2.0", "frequency_Hz = 0.2"))  # above 1 kV for 2 s
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    window.show_page(window.page(RigPage))
    qtbot.waitUntil(
        lambda: float(bar.monitor.text().split()[0].replace("—", "0")) > 1.0, timeout=RUN_MS
    )
    assert bar.time.text().endswith("s")
    assert bar.monitor.property("role") != "muted"
    qtbot.waitUntil(lambda: not page.runner.running, timeout=RUN_MS)
    output = page.runner.status.output
    assert output is not None
    assert bar.time.text() == f"monitor at\n{output.time}"
    assert bar.monitor.property("role") == "muted"
    assert page.controls.of_sample.text() == f"monitor at {output.time}"
    assert page.controls.numbers["monitor"]._value.property("role") == "muted"


def test_a_state_at_rest_is_a_measurement_with_its_time(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page, bar = window.run_page, window.bar
    assert bar.badge.state is HighVoltage.NOT_CONTACTED
    assert "was not read" in bar.detail.text()
    plan_of(SHORT)
    play(qtbot, page)
    output = page.runner.status.output
    assert output is not None
    assert bar.badge.state is HighVoltage.CONFIRMED
    assert bar.detail.text().startswith(f"0 V confirmed by the monitor at {output.time}")
    # it is that of this rig, not of another one
    window.session.set_address("sim:7")
    assert bar.badge.state is HighVoltage.NOT_CONTACTED
    window.session.set_address("sim")
    assert bar.badge.state is HighVoltage.CONFIRMED


def test_an_interlock_latches_until_somebody_acknowledges_it(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None],
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    page, bar, session = window.run_page, window.bar, window.session
    plan_of(SHORT)
    page.faults = (ARC,)
    play(qtbot, page)
    page.faults = ()
    path = next(session.folder.glob("*.h5"))
    assert "Stopped by an interlock" in bar.alarm.full_text
    assert bar.badge.state is HighVoltage.CONFIRMED  # the monitor was read after it
    for _ in range(2):
        for other in window.pages:
            window.show_page(other)
            assert bar.alarm.isVisible()
            qtbot.keyClick(window, Qt.Key.Key_F5)
            page.arm_button.click()
            assert not page.runner.armed
    assert "acknowledge" in page.blocked.text()
    plan_of(SHORT.replace("6.0", "5.0"))
    session.set_address("sim:3")
    assert bar.alarm.isVisible()
    session.set_address("sim")

    def sign() -> None:
        dialog = next(
            w for w in QApplication.topLevelWidgets() if isinstance(w, QDialog) and w.isVisible()
        )
        assert not dialog.accept_button.isEnabled()  # a name is needed
        dialog.findChild(QLineEdit).setText("Grace")
        dialog.accept_button.click()

    session.set_notes("", "", "")
    QTimer.singleShot(0, sign)
    with caplog.at_level(logging.WARNING):
        qtbot.mouseClick(bar.acknowledge_button, LEFT)
    assert not bar.alarm.isVisible()
    assert page.alarms.pending == 0  # the list of alarms has it too
    assert "Grace acknowledged the alarm: Stopped by an interlock" in caplog.text
    qtbot.waitUntil(lambda: page.arm_button.isEnabled(), timeout=RUN_MS)
    bar.close_work()
    recording = open_recording(path)
    assert recording.events[-1].message.startswith("Grace acknowledged: Stopped by an interlock")
    assert verify(path).sound


def test_a_time_of_day_that_is_to_come_says_that_the_clock_was_set_back(session: Session) -> None:
    status = HighVoltageStatus(session)
    for later, said in ((0.0, False), (3600.0, True)):
        status.set_output(OutputState(Known.UNKNOWN, time.time() + later))
        assert ("clock was set back" in status.words) is said


def test_an_end_without_a_reading_latches_too(qtbot: QtBot, session: Session) -> None:
    status = HighVoltageStatus(session)
    status.set_phase(HighVoltage.ON)
    status.set_output(OutputState(Known.COMMANDED, 0.0))
    status.set_phase(None)
    assert status.state is HighVoltage.COMMANDED
    assert "not confirmed" in status.detail


def test_what_is_unknown_is_shown_while_the_run_still_waits(session: Session) -> None:
    """The guardian may try for 20 s; the operator must not see HIGH VOLTAGE of a dead link."""
    status = HighVoltageStatus(session)
    status.set_phase(HighVoltage.RAMPING)
    status.set_output(OutputState(Known.UNKNOWN, 0.0))
    assert status.state is HighVoltage.UNKNOWN
    assert "switch the amplifier off" in status.detail
    assert not status.live


#: Another window, which is killed in a run on a card.
KILLED = """
import os, signal, sys
from pathlib import Path
from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QApplication
from dearig.window.high_voltage.status import HighVoltageStatus
from dearig.window.session.state import Session
application = QApplication([])
settings = QSettings(sys.argv[1], QSettings.Format.IniFormat)
sessions = [Session(Path(), settings, address=address) for address in sys.argv[2:]]
statuses = [HighVoltageStatus(session) for session in sessions]
for status in statuses:
    status.run_begins()
print("playing", flush=True)
sys.stdin.read(1)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_window_that_was_killed_in_a_run_is_told_at_the_next_start(session: Session) -> None:
    settings = session.settings
    settings.sync()
    killed = subprocess.Popen(
        [sys.executable, "-c", KILLED, settings.fileName(), "daqmx:Dev1", "daqmx:Dev2"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert killed.stdout is not None
    assert killed.stdout.readline().strip() == "playing"
    settings.sync()
    # while it plays, nothing has ended
    assert HighVoltageStatus(session).alarm is None
    killed.communicate("k")
    # on the simulated rig that a start begins with, before any card is chosen
    status = HighVoltageStatus(session)
    assert status.alarm is not None
    assert status.alarm.text.startswith(
        "The program ended during what was started on daqmx:Dev1 at "
    )
    assert status.state is HighVoltage.NOT_CONTACTED  # of the simulated rig
    assert session.blocks
    session.set_address("daqmx:Dev1")
    assert status.state is HighVoltage.UNKNOWN
    status.acknowledge("Ada")
    assert status.alarm is not None  # that of the other card
    assert "on daqmx:Dev2" in status.alarm.text
    status.acknowledge("Ada")
    assert not session.blocks
    again = Session(session.folder, settings, address="daqmx:Dev1")
    assert HighVoltageStatus(again).alarm is None


@pytest.mark.parametrize("seen", [True, False])
def test_while_another_window_plays_on_the_card_nothing_here_is_of_now(
    session: Session, seen: bool
) -> None:
    settings = session.settings
    session.set_address("daqmx:Dev1")
    status = HighVoltageStatus(session)
    runner = Runner(session)
    status.set_output(OutputState(Known.CONFIRMED, 0.0, 0.0))
    assert runner.arm(armed=True)
    settings.sync()
    other = subprocess.Popen(
        [sys.executable, "-c", KILLED, settings.fileName(), "daqmx:Dev1"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert other.stdout is not None
    assert other.stdout.readline().strip() == "playing"
    if seen:
        # between two looks nothing is begun either, and the note is that of the other window
        assert not runner.status.run_begins()
        status._look_at_clock()
        assert status.state is HighVoltage.UNKNOWN
        assert math.isnan(status.number[0])
        assert "another window plays (seen " in status.words
        assert "another window" in session.blocks["played elsewhere"].sentence
        assert not runner.armed
        status._keep(None)
        session.set_address("sim")
        assert not session.blocks
        session.set_address("daqmx:Dev1")
        assert session.blocks
    # it is killed in its run: this window says so, and has measured nothing since
    other.communicate("k")
    status._look_at_clock()
    assert "played elsewhere" not in session.blocks
    assert status.alarm is not None
    assert status.alarm.text.startswith("The program ended during what was started on daqmx:Dev1")
    status.acknowledge("Ada")
    assert not session.blocks


def test_after_the_run_of_another_window_the_output_is_to_be_read_again(session: Session) -> None:
    session.set_address("daqmx:Dev1")
    other = HighVoltageStatus(session)
    assert other.run_begins()
    status = HighVoltageStatus(Session(session.folder, session.settings, address="daqmx:Dev1"))
    assert status.state is HighVoltage.UNKNOWN
    other.run_ended(None)
    status._look_at_clock()
    assert status.state is HighVoltage.NOT_CONTACTED
    assert "not read since another window played" in status.words
    status.set_output(OutputState(Known.CONFIRMED, 0.0, 0.0))
    assert status.state is HighVoltage.CONFIRMED


def test_a_run_on_a_card_that_ends_well_leaves_nothing(session: Session) -> None:
    session.set_address("daqmx:Dev1")
    status = HighVoltageStatus(session)
    status.run_begins()
    status.run_ended(None)
    assert HighVoltageStatus(session).alarm is None


def test_an_alarm_is_not_released_without_a_name(session: Session) -> None:
    status = HighVoltageStatus(session)
    status.run_ended(LatchedAlarm("Stopped by an interlock", "arc", 0.0, "sim"))
    assert status.acknowledge("  ") is None
    assert status.alarm is not None
    assert session.blocks


@pytest.mark.parametrize("volts", [-0.4, 0.0, 0.4, -4.9])
def test_zero_is_never_minus_zero(volts: float) -> None:
    assert kilovolts(volts) == "0.00 kV"


def test_the_bar_is_inside_the_smallest_screen(qtbot: QtBot, window: MainWindow) -> None:
    """1366x768 at a scale of 1.5, without the panel of a desktop and the frame of a window."""
    smallest = window.minimumSizeHint()
    assert smallest.width() <= 910
    assert smallest.height() <= 440
    window.resize(910, 440)
    bar = window.bar
    for alarm in (None, LatchedAlarm("Stopped by an interlock", "arc " * 100, 0.0, "sim")):
        window.run_page.runner.status.run_ended(alarm)
        for state in HighVoltage:
            bar.badge.show_state(state)
            for part in (bar.stop_button, bar.badge, bar.monitor):
                corner = part.mapTo(window, QPoint(0, 0))
                area = window.rect()
                assert area.contains(corner)
                assert area.contains(corner + QPoint(part.width() - 1, part.height() - 1))
        words = QFontMetrics(bar.stop_button.font()).horizontalAdvance("⬣  0 V NOW")
        assert bar.stop_button.width() >= words
    window.run_page.runner.status.run_ended(None)


@pytest.mark.deep
def test_words_on_the_badge_fit(qtbot: QtBot, window: MainWindow) -> None:
    """Every state is written whole: its letters become smaller where they would be cut."""
    badge = window.bar.badge
    font = QFont(badge.font())
    font.setBold(True)
    font.setPixelSize(12)
    for state in HighVoltage:
        assert QFontMetrics(font).horizontalAdvance(state.value) < badge.width() - badge.height()


def test_a_long_headline_is_not_cut(qtbot: QtBot, run_page: RunPage) -> None:
    shown: QWidget = run_page.controls.time_left
    assert run_page.controls.time_left.wordWrap()
    run_page.controls.time_left.setText("Stopped by an interlock")
    qtbot.waitUntil(lambda: shown.height() >= shown.heightForWidth(shown.width()))
