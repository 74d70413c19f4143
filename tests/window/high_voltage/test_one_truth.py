"""A number on the screen belongs to a rig, a run and a moment; nothing next to it contradicts."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from dearig.acquisition.check import check_rig
from dearig.config.rigfile import RigFile
from dearig.output_state import Known, OutputState
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.high_voltage.status import OutputReading
from dearig.window.rig.page import RigPage
from dearig.window.run.live import RunSnapshot
from dearig.window.session.text_file import EditedFile
from dearig.window.shell.frame import MainWindow
from tests.window.conftest import SHORT, press

RUN_MS = 60_000
NOTHING = "—"


def play(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    press(qtbot, page.arm_button)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS):
        press(qtbot, page.start_button)


def readouts(window: MainWindow) -> set[str]:
    return {readout.text for readout in window.run_page.controls.numbers.values()}


def test_another_rig_has_no_number_of_the_one_before(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page, bar, session = window.run_page, window.bar, window.session
    plan_of(SHORT)
    play(qtbot, window)
    assert page.result.text()
    assert bar.monitor.text() == "0.00 kV"
    session.set_address("sim:7")
    for _ in range(3):
        assert bar.badge.state is HighVoltage.NOT_CONTACTED
        assert (bar.monitor.text(), bar.time.text()) == ("— kV", "")
        assert readouts(window) == {NOTHING}
        shown = (page.controls.time_left, page.controls.of_sample, page.result)
        assert [words.text() for words in shown] == ["", "", ""]
        assert not page.show_button.isVisible()
        qtbot.wait(150)  # longer than the readouts take to be shown again


@pytest.mark.deep
def test_another_rig_file_has_none_either(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    plan_of(SHORT)
    play(qtbot, window)
    window.session.set_rig_file(None, "", RigFile())
    assert readouts(window) == {NOTHING}


def test_no_other_rig_while_something_plays(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    """The page is disabled meanwhile; a file that was being read before may still arrive."""
    page, session, rig = window.run_page, window.session, window.page(RigPage)
    weak = "[interlocks]\narc_action = 'ramp'\n"
    before = (session.address, session.rig_text, session.rig_file)
    changes: tuple[Callable[[], object], ...] = (
        lambda: session.set_address("sim:7"),
        lambda: session.set_rig_file(Path("weak.toml"), weak, RigFile()),
        lambda: rig._opened(weak, EditedFile("rig file", weak, Path("weak.toml"))),
        lambda: (rig.seed.setValue(9), rig.kinds.button(1).setChecked(True), rig.choose()),
        rig._saved,
    )
    plan_of(SHORT)
    page.paced.setChecked(True)
    for change in changes[:2]:  # a rig that is armed is disarmed
        press(qtbot, page.arm_button)
        assert session.armed
        change()
        assert not session.armed
        assert not page.start_button.isEnabled()
        session.set_address(before[0])
        session.set_rig_file(None, before[1], RigFile())
        plan_of(SHORT)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    qtbot.waitUntil(lambda: "left" in page.controls.time_left.text(), timeout=RUN_MS)
    number = page.runner.status.run_number
    for change in changes:
        change()
        assert (session.address, session.rig_text, session.rig_file) == before
        assert window.bar.badge.state is HighVoltage.ON
        assert page.runner.status.run_number == number
        assert page.controls.rig.full_text == "sim with the rig file of the thesis"
    assert rig.kinds.checkedId() == 0
    qtbot.waitUntil(lambda: not page.runner.running, timeout=RUN_MS)
    assert window.bar.badge.state is HighVoltage.CONFIRMED
    session.set_address("sim:7")
    assert window.bar.badge.state is HighVoltage.NOT_CONTACTED


def test_a_number_is_not_of_now_once_no_samples_come(
    window: MainWindow, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr("dearig.window.high_voltage.status._now", lambda: now[0])
    status, bar = window.run_page.runner.status, window.bar
    status.set_phase(HighVoltage.ON)
    reading = OutputReading(4520.0, 2.1, 25.8, 0.001)
    for waited, moment, silence in (
        (0.0, "2.1 of 25.8 s", ""),
        (0.9, "2.1 of 25.8 s", ""),
        (3.2, "last sample,\n2.10 s", "no sample for 3 s"),
        (61.0, "last sample,\n2.10 s", "no sample for 61 s"),
    ):
        now[0] = 100.0 + waited
        status.show_reading(reading)
        assert bar.badge.state is HighVoltage.ON
        assert (bar.monitor.text(), bar.time.text()) == ("4.52 kV", moment)
        assert silence in bar.detail.text()
        assert status.current == (silence == "")
    status.show_reading(OutputReading(4510.0, 63.1, 99.0, 0.001))
    assert (bar.time.text(), status.silence) == ("63.1 of 99.0 s", "")
    status.set_phase(None)


def test_the_number_at_rest_is_the_one_that_confirmed_zero_volts(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page, bar, status = window.run_page, window.bar, window.run_page.runner.status
    plan_of(SHORT)
    play(qtbot, window)
    # as after an end without a ramp: the last sample was taken at full voltage
    status.show_reading(OutputReading(4520.0, 0.4, 1.0))
    status.set_output(OutputState(Known.CONFIRMED, time.time(), 60.0, tolerance=100.0))
    clock = status.output.time
    assert bar.badge.state is HighVoltage.CONFIRMED
    assert bar.monitor.text() == "0.06 kV"
    assert bar.time.text() == f"monitor at\n{clock}"
    assert "(0.06 kV, within 0.1 kV of 0)" in bar.detail.text()
    numbers = page.controls.numbers
    assert numbers["monitor"].text == "0.060"
    assert {numbers[name].text for name in ("command", "current", "displacement")} == {NOTHING}
    assert page.controls.of_sample.text() == f"monitor at {clock}"


@pytest.mark.deep
def test_no_number_of_the_last_run_stands_under_the_next_one(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page, bar, status = window.run_page, window.bar, window.run_page.runner.status
    plan_of(SHORT)
    play(qtbot, window)
    assert readouts(window) != {NOTHING}
    # a campaign: its first run has begun, and no sample has come
    status.set_between("the first run starts by itself")
    assert not page.result.text()
    status.set_phase(HighVoltage.ON)
    assert (bar.monitor.text(), bar.time.text()) == ("— kV", "")
    assert readouts(window) == {NOTHING}
    assert page.controls.of_sample.text() == ""
    assert page.controls.time_left.text() == ""
    # between two of its runs, the last sample is not next to 0 V
    status.show_reading(OutputReading(4520.0, 0.4, 1.0))
    assert bar.monitor.text() == "4.52 kV"
    status.set_output(OutputState(Known.CONFIRMED, time.time(), 2.0, tolerance=100.0))
    status.set_between("the next run starts by itself")
    assert bar.monitor.text() == "0.00 kV"
    status.set_phase(None)


def test_a_lost_rig_is_unknown_everywhere_while_the_run_still_waits(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page, bar, status = window.run_page, window.bar, window.run_page.runner.status
    plan_of(SHORT)
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    qtbot.waitUntil(lambda: "left" in page.controls.time_left.text(), timeout=RUN_MS)
    status.set_output(OutputState(Known.UNKNOWN, time.time()))
    assert bar.badge.state is HighVoltage.UNKNOWN
    assert page.display.view.words.text().startswith("Ending")
    page._update_readouts()
    assert page.controls.time_left.text() == "Output unknown, the run is ending"
    assert page.controls.segment.full_text == ""
    page.stop()
    qtbot.waitUntil(lambda: not page.runner.running, timeout=RUN_MS)


@pytest.mark.parametrize("volts", [0.0, 60.0, 900.0])
def test_a_check_says_what_the_monitor_read(volts: float, monkeypatch: pytest.MonkeyPatch) -> None:
    read: dict[str, float] = {"voltage_monitor": volts, "current_monitor": 0.0, "displacement": 0.0}
    monkeypatch.setattr("dearig.sim_backend.kind._at_zero", lambda *_: (1000.0, read))
    output = check_rig("sim", RigFile()).output
    assert output is not None
    assert output.known is (Known.UNKNOWN if volts > 100.0 else Known.CONFIRMED)
    assert (output.monitor, output.tolerance) == (volts, 100.0)


def test_a_check_that_has_read_0_volts_clears_not_read_yet(
    qtbot: QtBot, window: MainWindow
) -> None:
    bar = window.bar
    assert "was not read" in bar.detail.text()
    window.show_page(window.page(RigPage))
    qtbot.waitUntil(lambda: window.page(RigPage).outcome is not None, timeout=RUN_MS)
    assert bar.badge.state is HighVoltage.CONFIRMED
    assert "0 V confirmed by the monitor at" in bar.detail.text()
    assert bar.monitor.text() == "0.00 kV"
    # of the rig that was checked
    window.session.set_address("sim:3")
    assert bar.badge.state is HighVoltage.NOT_CONTACTED


def test_a_check_of_a_rig_that_was_left_says_nothing(qtbot: QtBot, window: MainWindow) -> None:
    page = window.page(RigPage)
    page.check()
    window.session.set_address("sim:3")
    qtbot.waitUntil(lambda: not page._checks.busy, timeout=RUN_MS)
    qtbot.wait(50)
    assert window.bar.badge.state is HighVoltage.NOT_CONTACTED


def test_a_snapshot_does_not_bring_numbers_back(qtbot: QtBot, window: MainWindow) -> None:
    """What is drawn late belongs to the run that it is of."""
    controls, status = window.run_page.controls, window.run_page.runner.status
    status.set_phase(HighVoltage.ON)
    status.show_reading(OutputReading(4520.0, 0.4, 1.0))
    controls.show_numbers(RunSnapshot(400, 1000, 1000.0, {"monitor": 4520.0}, (), ()))
    assert controls.numbers["monitor"].text == "4.520"
    assert controls.of_sample.text() == "now"
    status.set_phase(HighVoltage.ON)  # the next run
    assert controls.numbers["monitor"].text == NOTHING
    status.set_phase(None)
