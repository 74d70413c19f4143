"""Whole stories of runs, as an operator tells them to the window."""

from __future__ import annotations

import gc
import os
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QLabel,
    QLineEdit,
    QMessageBox,
    QPushButton,
)
from pytestqt.qtbot import QtBot

from dearig.recording import open_recording
from dearig.recording.reading.recording import Recording
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.rig.page import RigPage
from dearig.window.run.page import RunPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.deep import mostly_deep
from tests.window.conftest import SHORT, press, strike

LEFT = Qt.MouseButton.LeftButton
RUN_MS = 60_000


def click(qtbot: QtBot, widget: QPushButton) -> None:
    assert widget.isEnabled()
    qtbot.mouseClick(widget, LEFT)


def play(qtbot: QtBot, page: RunPage) -> Path:
    """Arm, start, and wait for the end; the recording."""
    press(qtbot, page.arm_button)
    with qtbot.waitSignal(page.session.recorded, timeout=RUN_MS) as ended:
        press(qtbot, page.start_button)
    path: Path = ended.args[0]
    return path


def seconds(page: RunPage) -> float:
    """How far the run has come."""
    now = None if page.live is None else page.live.now()
    return 0.0 if now is None else now.samples / now.rate


def at_zero(recording: Recording) -> bool:
    assert recording.voltage_command is not None
    return abs(float(recording.voltage_command[-1])) < 1.0


def test_from_the_first_start_to_the_first_recording(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    assert page.isVisible()  # a first start shows what is to be done
    assert window.session.address == "sim"
    assert page.runner.state is HighVoltage.NOT_CONTACTED
    assert not page.start_button.isEnabled()  # never in one step
    page.operator.setText("Ada")
    page.film.setText("film 3")
    path = play(qtbot, page)
    recording = open_recording(path)
    assert recording.outcome == "finished"
    assert (recording.film_id, recording.provenance["operator"]) == ("film 3", "Ada")
    assert path.parent == window.session.folder
    assert str(path) in page.result.text()
    assert page.runner.state is HighVoltage.CONFIRMED
    # the model that ran next to it is kept with it
    assert recording.displacement_model is not None
    assert "modulus_Pa" in recording.model_toml
    # what was drawn is what was recorded
    assert page.live is not None
    qtbot.waitUntil(lambda: seconds(page) > recording.duration)
    _, moved = page.live.view("displacement", 0.0, 60.0)
    # from the rest as the first tenth of a second knows it, not yet as the whole lead-in does
    assert moved.max() == pytest.approx(recording.displacement.max(), abs=2e-7)
    now = page.live.now()
    assert now is not None
    assert now.errors[0].rms == pytest.approx(1e-6, rel=0.2)  # the simulated noise


@pytest.mark.deep
def test_the_page_fits_a_small_screen_before_in_and_after_a_run(
    qtbot: QtBot, window: MainWindow
) -> None:
    page, sizes = window.run_page, []
    shown = page.visibleRegion().boundingRect  # without what a scroll bar hides
    window.show_page(page)
    page.runner.state_changed.connect(lambda: sizes.append((page.height(), shown().height())))
    play(qtbot, page)
    sizes.append((page.height(), shown().height()))
    assert len(sizes) > 2
    assert all(height == visible for height, visible in sizes), sizes


def test_a_wrong_sequence_is_refused_marked_and_mended(qtbot: QtBot, window: MainWindow) -> None:
    page, session = window.sequence_page, window.session
    window.show_page(page)
    qtbot.keyClick(page.editor.table, Qt.Key.Key_Down)
    assert page.editor.form is not None
    field = page.editor.form.field("amplitudes_kV")
    assert isinstance(field, QLineEdit)

    def retype(text: str) -> None:
        field.selectAll()
        with qtbot.waitSignal(session.preview_changed, timeout=RUN_MS):
            qtbot.keyClicks(field, text)
        qtbot.waitUntil(
            lambda: session.preview is not None and session.preview.toml == session.sequence_toml
        )

    retype("6, 6.5, 7, 9, 8")
    assert "voltage reaches 9 kV" in page.preview.state.text()
    assert "8.5 kV is allowed" in page.preview.state.text()
    assert page.preview.plots.marks == 2  # both periods
    assert not window.run_page.arm_button.isEnabled()
    retype("6, 6.5, seven, 9, 8")
    assert "is not a number" in page.editor.form.fault("amplitudes_kV")
    assert page.editor.table.item(0, 0).text() == "✗ 1"
    retype("6, 6.5, 7, 7.5, 8")
    assert "Within all limits" in page.preview.state.text()
    assert page.preview.plots.marks == 0
    assert window.run_page.arm_button.isEnabled()


SEGMENTS = {
    "lead-in": 'kind = "hold"\nduration_s = 1.0\n',
    "half_sine": 'kind = "half_sine"\namplitude_kV = 7.0\nfrequency_Hz = 0.2\n',
    "thesis": 'kind = "thesis"\n',
    "sine": 'kind = "sine"\namplitude_kV = 3.0\noffset_kV = 3.0\nphase_deg = -90.0\n'
    "frequency_Hz = 0.5\ncycles = 3.0\n",
    "triangle": 'kind = "triangle"\namplitude_kV = 7.0\nfrequency_Hz = 0.2\n',
    "ramp": 'kind = "ramp"\nto_kV = 7.0\nduration_s = 5.0\n',
    "hold": 'kind = "ramp"\nto_kV = 6.0\nduration_s = 0.1\n[[segment]]\nkind = "hold"\n'
    "duration_s = 5.0\n",
    "steps": 'kind = "steps"\nlevels_kV = [4.0, 6.0, 8.0, 0.0]\ndwell_s = 2.0\n',
    "chirp": 'kind = "ramp"\nto_kV = 4.0\nduration_s = 0.1\n[[segment]]\nkind = "chirp"\n'
    "amplitude_kV = 3.0\nfrom_Hz = 0.5\nto_Hz = 5.0\nduration_s = 5.0\n",
    "multisine": 'kind = "ramp"\nto_kV = 4.0\nduration_s = 0.1\n[[segment]]\nkind = "multisine"\n'
    "amplitude_kV = 3.0\nfrequencies_Hz = [0.5, 1.1]\nduration_s = 5.0\n",
}
BACK = '[[segment]]\nkind = "ramp"\nto_kV = 0.0\nduration_s = 1.0\n'


@pytest.mark.parametrize("kind", mostly_deep(SEGMENTS, ["half_sine"]))
def test_stop_ends_any_segment(
    qtbot: QtBot,
    quick_ramp: Session,
    run_page: RunPage,
    plan_of: Callable[[str], None],
    kind: str,
) -> None:
    page, ends = run_page, kind not in ("ramp", "hold", "chirp", "multisine")
    lead = 5.0 if kind == "lead-in" else 0.2
    plan_of(
        f'name = "{kind}"\nlead_in_s = {lead}\n[[segment]]\n{SEGMENTS[kind]}'
        + ("" if ends else BACK)
    )
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    qtbot.waitUntil(lambda: seconds(page) >= 0.6, timeout=RUN_MS)
    assert page.runner.state is HighVoltage.ON
    if kind != "lead-in":
        assert kind in page.controls.segment.full_text or not page.segment.text()
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
        click(qtbot, page.stop_button)
        assert page.runner.state is HighVoltage.RAMPING
    assert page.runner.state is HighVoltage.CONFIRMED
    recording = open_recording(ended.args[0].path)
    assert "interrupted by the operator" in recording.outcome
    assert at_zero(recording)
    assert recording.duration < 3.0
    if kind != "lead-in":
        assert np.max(recording.voltage_command) > 50.0  # it was in the segment indeed


@pytest.mark.parametrize(
    "key", mostly_deep([Qt.Key.Key_Escape, Qt.Key.Key_Space], [Qt.Key.Key_Escape])
)
def test_stop_by_key_from_another_page(qtbot: QtBot, window: MainWindow, key: Qt.Key) -> None:
    page = window.run_page
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    window.show_page(window.page(RigPage))
    qtbot.waitUntil(lambda: seconds(page) > 0.0, timeout=RUN_MS)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
        strike(window.page(RigPage), key)
    assert ended.args[0].headline == "Stopped"


def test_a_second_stop_is_0_volts_at_once(qtbot: QtBot, window: MainWindow) -> None:
    page = window.run_page
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    qtbot.waitUntil(lambda: seconds(page) > 2.3, timeout=RUN_MS)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS) as ended:
        click(qtbot, page.stop_button)
        assert "NOW" in page.stop_button.text()
        click(qtbot, page.stop_button)
    assert "at once" in ended.args[0].sentence
    assert page.runner.state is HighVoltage.CONFIRMED
    assert page.stop_button.text().endswith("STOP")
    recording = open_recording(ended.args[0].path)
    assert recording.outcome == "interrupted by the operator"


@pytest.mark.parametrize(
    ("fault", "headline", "words", "ramps"),
    mostly_deep(
        [
            pytest.param("arc@1+0.5", "Stopped by an interlock", "breakdown", False, id="arc"),
            pytest.param("sensor-out-of-range@1", "Stopped by an interlock", "laser", True),
            pytest.param("electrode-open@0", "Stopped by an interlock", "follow", True),
            pytest.param("ai-overflow@1", "Instrument fault", "overwritten", False),
        ],
        ["arc"],
    ),
)
def test_what_goes_wrong_is_said_and_the_rig_is_safe(
    qtbot: QtBot,
    run_page: RunPage,
    plan_of: Callable[[str], None],
    fault: str,
    headline: str,
    words: str,
    ramps: bool,
) -> None:
    page = run_page
    plan_of(SHORT.replace("frequency_Hz = 2.0", "frequency_Hz = 0.2"))
    states: list[HighVoltage] = []
    page.runner.state_changed.connect(states.append)
    page.faults = (fault,)
    path = play(qtbot, page)
    assert page.result.text().startswith(headline)
    assert words in page.result.text() + " ".join(a.message for a in page.alarms.alarms)
    assert page.runner.state is HighVoltage.CONFIRMED
    assert (HighVoltage.RAMPING in states) == ramps  # also where no one has pressed STOP
    recording = open_recording(path)
    assert recording.events
    assert recording.outcome != "finished"
    page.faults = ()
    assert not page.arm_button.isEnabled()  # until somebody has looked at the rig
    page.runner.status.acknowledge("Ada")
    assert open_recording(play(qtbot, page)).outcome == "finished"  # and it goes on


def test_a_rig_that_is_not_there(qtbot: QtBot, run_page: RunPage) -> None:
    page = run_page
    run_page.session.set_address("daqmx:Dev1")
    qtbot.waitUntil(lambda: run_page.session.preview is not None, timeout=RUN_MS)
    press(qtbot, page.arm_button)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS):
        press(qtbot, page.start_button)
    assert "no film is declared" in page.result.text()
    assert page.show_button.isHidden()
    assert page.arm_button.isEnabled()


def test_a_folder_that_cannot_be_used(qtbot: QtBot, run_page: RunPage, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    run_page.session.set_folder(tmp_path / "file" / "folder")
    page = run_page
    press(qtbot, page.arm_button)
    with qtbot.waitSignal(page.runner.ended, timeout=RUN_MS):
        press(qtbot, page.start_button)
    assert "choose another one" in page.result.text()
    assert page.runner.state is HighVoltage.NOT_CONTACTED


def test_a_defect_of_the_program_leaves_nothing_taken_for_safe(
    qtbot: QtBot, run_page: RunPage, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("a defect")

    monkeypatch.setattr("dearig.window.run.runner.record", broken)
    press(qtbot, run_page.arm_button)
    with qtbot.captureExceptions() as caught:
        with qtbot.waitSignal(run_page.runner.ended, timeout=RUN_MS):
            press(qtbot, run_page.start_button)
        qtbot.waitUntil(lambda: bool(caught))
    assert "an error in the program" in run_page.result.text()
    assert run_page.runner.state is HighVoltage.UNKNOWN
    assert not run_page.session.running


def test_two_models_of_one_name_stay_apart(qtbot: QtBot, run_page: RunPage, tmp_path: Path) -> None:
    thesis = run_page.session.thesis_model
    for place, mass in enumerate((150, 250)):
        path = tmp_path / f"{mass}.toml"
        path.write_text(thesis.toml.replace("mass_kg = 0.2", f"mass_kg = 0.{mass}"))
        run_page.show_model(path, place)
    qtbot.waitUntil(lambda: [m.path for m in run_page.session.overlays if m.path] != [])
    qtbot.waitUntil(lambda: len(run_page.session.overlays) == 2)
    masses = [choice.currentData().actuator.load.mass for choice in run_page.overlays.models]
    assert masses == [0.15, 0.25]


def answer(button: str) -> None:
    """Click ``button`` of the question that is open, as soon as there is one."""

    def look() -> None:
        shown = (w for w in QApplication.topLevelWidgets() if w.isVisible())
        asked = next((w for w in shown if isinstance(w, QMessageBox)), None)
        if asked is not None:
            named = [b for b in asked.buttons() if b.text() == button]
            # a dialog that stays open would hang the test for ever
            (named or asked.buttons())[0].click()
            assert named, [b.text() for b in asked.buttons()]
        else:
            QTimer.singleShot(20, look)

    QTimer.singleShot(0, look)


@pytest.mark.parametrize(
    ("button", "closes"),
    mostly_deep(
        [pytest.param("Close", True, id="Close"), pytest.param("Keep open", False)], ["Close"]
    ),
)
def test_closing_in_mid_run_makes_safe_whatever_the_answer(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow, button: str, closes: bool
) -> None:
    page = window.run_page
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    qtbot.waitUntil(lambda: seconds(page) > 0.2, timeout=RUN_MS)
    answer(button)
    window.close()
    qtbot.waitUntil(lambda: not page.runner.running, timeout=RUN_MS)
    assert page.runner.state is HighVoltage.CONFIRMED
    path = next(window.session.folder.glob("*.h5"))
    assert at_zero(open_recording(path))
    if closes:
        qtbot.waitUntil(lambda: not window.isVisible(), timeout=RUN_MS)
    else:
        assert window.isVisible()
        assert page.arm_button.isEnabled()


def test_a_signal_closes_the_window_while_it_asks(
    qtbot: QtBot, quick_ramp: Session, window: MainWindow
) -> None:
    """At the end of a session no one answers, and the system kills what does not end."""
    page = window.run_page
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    qtbot.waitUntil(lambda: seconds(page) > 0.2, timeout=RUN_MS)

    def leave() -> None:
        if any(w.isVisible() for w in window.findChildren(QMessageBox)):
            window.leave()
        else:
            QTimer.singleShot(20, leave)

    QTimer.singleShot(0, leave)
    late = QTimer(window, interval=10_000, singleShot=True)
    late.timeout.connect(lambda: answer("Keep open"))  # the test ends also where it fails
    late.start()
    window.close()
    late.stop()
    qtbot.waitUntil(lambda: not window.isVisible(), timeout=RUN_MS)
    assert page.runner.state is HighVoltage.CONFIRMED
    assert at_zero(open_recording(next(window.session.folder.glob("*.h5"))))


def test_what_was_armed_is_disarmed_when_the_sequence_changes(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page = window.run_page
    press(qtbot, page.arm_button)
    assert page.runner.state is HighVoltage.ARMED
    assert window.bar.badge.state is HighVoltage.ARMED  # in sight from every page
    plan_of(SHORT)
    assert page.runner.state is HighVoltage.NOT_CONTACTED
    assert not page.start_button.isEnabled()
    press(qtbot, page.arm_button)
    press(qtbot, page.arm_button)  # taken back by hand
    assert page.runner.state is HighVoltage.NOT_CONTACTED


@pytest.mark.deep
def test_another_model_in_mid_run_starts_from_its_beginning(
    qtbot: QtBot, quick_ramp: Session, run_page: RunPage
) -> None:
    page, session = run_page, run_page.session
    page.paced.setChecked(True)
    press(qtbot, page.arm_button)
    press(qtbot, page.start_button)
    qtbot.waitUntil(lambda: seconds(page) > 0.5, timeout=RUN_MS)
    page.overlays.models[1].setCurrentIndex(1)
    page.overlays.models[1].activated.emit(1)
    assert len(session.overlays) == 2
    live = page.live
    assert live is not None

    def same() -> bool:
        (x, one), (again, two) = (live.view(f"model {i}", 0.0, 0.4) for i in (0, 1))
        return x.size > 300 and np.array_equal(x, again) and np.array_equal(one, two)

    qtbot.waitUntil(same, timeout=RUN_MS)
    assert page.controls.numbers["rms 1"].isVisible()
    page.stop()
    qtbot.waitUntil(lambda: not page.runner.running, timeout=RUN_MS)


def test_a_model_file_that_is_none_is_told_where_it_was_asked(
    qtbot: QtBot, run_page: RunPage, tmp_path: Path
) -> None:
    (tmp_path / "m.toml").write_text('format = "dearig-model/9"\n')
    run_page.show_model(tmp_path / "m.toml")
    qtbot.waitUntil(lambda: "dearig-model/9" in run_page.overlays.message.text())
    assert len(run_page.session.overlays) == 1


def resident() -> float:
    """Memory of this process in MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads /proc")
@pytest.mark.deep
def test_twenty_runs_leave_nothing_behind(
    qtbot: QtBot, window: MainWindow, plan_of: Callable[[str], None]
) -> None:
    page = window.run_page
    plan_of(SHORT)
    for _ in range(4):  # until everything that is made once has been made
        play(qtbot, page)
    gc.collect()
    threads, before = threading.active_count(), resident()
    children = len(window.findChildren(object))
    for _ in range(20):
        play(qtbot, page)
    qtbot.waitUntil(lambda: len(window.findChildren(object)) <= children)
    gc.collect()
    assert threading.active_count() <= threads
    assert resident() - before < 20.0
    assert len(list(window.session.folder.glob("*.h5"))) == 24


@pytest.mark.deep
def test_the_layout_is_remembered_and_can_be_reset(
    qtbot: QtBot, session: Session, window: MainWindow, keep: Callable
) -> None:
    window.resize(1200, 690)
    qtbot.keyClick(window, Qt.Key.Key_2, Qt.KeyboardModifier.ControlModifier)
    assert window.sequence_page.isVisible()
    window.close()
    again = MainWindow(session)
    keep(again)
    assert again.sequence_page.isVisible()
    assert again.height() == 690  # and as wide as the screen of a test lets it be
    again.reset_layout()
    assert again.run_page.isVisible()
    assert again.pos() != QPoint(-1, -1)


@pytest.mark.deep
@pytest.mark.parametrize("models", [1, 2])
def test_nothing_is_cut_in_the_smallest_window(
    qtbot: QtBot, window: MainWindow, models: int
) -> None:
    window.session.set_overlays(window.session.overlays * models)
    window.resize(100, 100)
    for page in window.pages:
        window.show_page(page)
        qtbot.waitUntil(page.isVisible)
        qtbot.wait(1)  # what is laid out later is laid out now
        for made in page.findChildren(QLabel) + page.findChildren(QAbstractButton):
            wraps = isinstance(made, QLabel) and made.wordWrap()
            if made.isVisible() and made.text() and not wraps:
                assert made.width() >= made.minimumSizeHint().width(), (page.title, made.text())
    assert window.width() <= 1280
    assert window.height() <= 700  # of 768, without the bars of a screen


@pytest.mark.deep
def test_colours_follow_the_choice(qtbot: QtBot, window: MainWindow) -> None:
    with qtbot.waitSignal(window.session.theme_changed):
        window.set_colour_scheme("dark")
    assert window.session.theme.dark
    with qtbot.waitSignal(window.session.theme_changed):
        window.set_colour_scheme("light")
    assert not window.session.theme.dark


@pytest.mark.deep
def test_colours_wait_for_a_run_as_restyling_would_keep_stop_waiting(
    qtbot: QtBot, window: MainWindow
) -> None:
    press(qtbot, window.run_page.arm_button)
    sheet = QApplication.instance().styleSheet()  # type: ignore[union-attr]
    window.set_colour_scheme("dark")
    assert not window.session.theme.dark
    assert QApplication.instance().styleSheet() == sheet  # type: ignore[union-attr]
    assert window.status.full_text == "The colours change once the rig is disarmed"
    window.run_page.runner.disarm("the test")
    assert window.session.theme.dark
    window.set_colour_scheme("light")
