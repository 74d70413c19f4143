"""The page Follow: from a target to runs that learn, each armed by the operator."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QObject, Qt, QTimer
from PySide6.QtWidgets import QLabel, QWidget
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import RigFile
from dearig.drivers.settings import CardSettings, LimitsSettings
from dearig.errors import DearigError
from dearig.progress import quiet
from dearig.recording import open_recording
from dearig.window.follow.page import FollowPage
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.jobs.worker import Job, Worker
from dearig.window.jobs.worker_process import Request
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.tools.targets import UP_AND_DOWN
from tests.window.conftest import press
from tests.window.made_recordings import made
from tests.window.run.test_stories import click, play, seconds

_PATIENCE = 120_000  # ms; of a machine that may be busy
RIG = RigFile(card=CardSettings(sample_rate_Hz=200.0), limits=LimitsSettings(ramp_down_s=0.1))
FAST = UP_AND_DOWN.replace("duration_s = 2.5", "duration_s = 0.2")


class Here(Worker):
    """Does its jobs in this process, with copies of what a process of its own would get."""

    def submit(self, function: Callable[..., Any], *given: Any, **_: bool) -> Job:
        job = Job(self, Request(0, function, given), whole=False)
        QTimer.singleShot(0, lambda: self._do(job, function, given))
        return job

    def _do(self, job: Job, function: Callable[..., Any], given: tuple[Any, ...]) -> None:
        try:
            result = function(*pickle.loads(pickle.dumps(given)), progress=quiet)  # noqa: S301
            job.finished.emit(pickle.loads(pickle.dumps(result)))  # noqa: S301
        except DearigError as error:
            job.failed.emit(str(error))


@pytest.fixture
def page(session: Session, keep: Callable[[QWidget], None]) -> FollowPage:
    """The page alone, with a target that a film can follow."""
    session.set_rig_file(None, "", RIG)
    owner = QObject(session)
    shown = FollowPage(session, worker=Here(owner))
    shown.resize(1190, 690)
    keep(shown)
    shown.target.edit.setPlainText(UP_AND_DOWN)
    return shown


def done(qtbot: QtBot, page: FollowPage, widget: QWidget) -> None:
    """Click, and wait for the end of the work."""
    assert widget.isEnabled()
    qtbot.mouseClick(widget, Qt.MouseButton.LeftButton)
    idle(qtbot, page)


def idle(qtbot: QtBot, page: FollowPage) -> None:
    qtbot.waitUntil(page.compute_button.isEnabled, timeout=_PATIENCE)


def words(widget: QWidget) -> str:
    return "\n".join(label.text() for label in widget.findChildren(QLabel))


def test_runs_are_shown_armed_one_by_one_stopped_and_learned_from(
    qtbot: QtBot, window: MainWindow, quick_ramp: Session
) -> None:
    session, page, run = window.session, window.page(FollowPage), window.run_page
    page._worker = Here(page)
    session.set_address("sim:8")
    session.set_rig_file(None, "", RIG)
    window.show_page(page)
    page.target.edit.setPlainText(UP_AND_DOWN.replace("to_mm = 0.3", "to_kV = 3.0"))
    done(qtbot, page, page.compute_button)
    assert "write to_mm" in page.message.text()
    assert not page.run_button.isEnabled()
    page.target.edit.setPlainText(UP_AND_DOWN)
    done(qtbot, page, page.compute_button)
    assert page.message.text() == ""
    assert "can follow the whole target" in page.headline.text()
    assert "voltage (kV)" in page.next_run.findChild(type(page.runs)).item(0, 0).text()  # type: ignore[union-attr]

    def show() -> None:
        """Go to the page Run with the next voltage."""
        click(qtbot, page.run_button)
        assert run.isVisible()
        assert not run.runner.armed  # it is armed there, by the operator
        qtbot.waitUntil(
            lambda: (
                session.preview is not None
                and session.preview.toml == session.sequence_toml
                and run.arm_button.isEnabled()
            ),
            timeout=_PATIENCE,
        )

    def runs() -> int:
        assert page.followed is not None
        return len(page.followed.tracking.runs)

    show()
    assert "up and down, model" in run.display.view.words.text()
    first = play(qtbot, run)
    qtbot.waitUntil(lambda: runs() == 1, timeout=_PATIENCE)
    idle(qtbot, page)
    assert "up and down, model" in open_recording(first).title
    click(qtbot, run.follow_button) if run.follow_button.isVisible() else window.show_page(page)
    assert page.runs.rowCount() == 1
    assert "learned, iteration 1" in words(page.next_run)

    # STOP in the second run: 0 V, and what was learned is kept
    show()
    run.paced.setChecked(True)
    press(qtbot, run.arm_button)
    with qtbot.waitSignal(session.recorded, timeout=_PATIENCE) as ended:
        press(qtbot, run.start_button)
        qtbot.waitUntil(lambda: seconds(run) > 0.7, timeout=_PATIENCE)
        click(qtbot, run.stop_button)
    qtbot.waitUntil(lambda: bool(page.message.text()), timeout=_PATIENCE)
    stopped = open_recording(ended.args[0])
    assert stopped.voltage_command is not None
    assert abs(float(stopped.voltage_command[-1])) < 1.0
    assert run.runner.state is HighVoltage.CONFIRMED
    assert "ended early" in page.message.text()
    assert runs() == 1

    # the same voltage once more, without computing it again
    run.paced.setChecked(False)
    play(qtbot, run)
    qtbot.waitUntil(lambda: runs() == 2, timeout=_PATIENCE)
    idle(qtbot, page)
    assert page.followed is not None
    before, after = page.followed.tracking.runs
    assert after.rms < 0.5 * before.rms

    # the best voltage again: on Run, and nothing is learned from it
    window.show_page(page)
    click(qtbot, page.again_button)
    assert session.sequence_path is not None
    assert session.sequence_path.name == "learned-1.toml"
    session.recorded.emit(after.recording)  # it was played once more
    assert page.compute_button.isEnabled()  # no work was begun
    assert runs() == 2


def test_what_cannot_be_followed_is_shown_before_anything_is_played(
    qtbot: QtBot, page: FollowPage
) -> None:
    page.target.edit.setPlainText(FAST)
    done(qtbot, page, page.compute_button)
    assert "cannot follow 1 part" in page.headline.text()
    assert "no voltage pushes it" in words(page.next_run)
    assert "The film cannot follow the whole target" in page.state.text()
    assert not page.run_button.isEnabled()
    page.nearest.setChecked(True)
    assert page.state.text() == ""
    assert page.run_button.isEnabled()
    with qtbot.waitSignal(page.play_sequence) as told:
        click(qtbot, page.run_button)
    file = page._session.folder / "follow-1" / "model.toml"
    assert told.args == [file.read_text(encoding="utf-8"), file]


def test_the_gate_refuses_before_a_run_is_shown(qtbot: QtBot, page: FollowPage) -> None:
    brief = LimitsSettings(time_at_voltage_max_s=0.5)
    page._session.set_rig_file(None, "", RIG.model_copy(update={"limits": brief}))
    done(qtbot, page, page.compute_button)
    assert "Refused by the limits of the rig file: time at 1 kV or more" in page.state.text()
    assert not page.run_button.isEnabled()


def test_a_changed_target_or_rig_is_computed_again(qtbot: QtBot, page: FollowPage) -> None:
    session = page._session
    done(qtbot, page, page.compute_button)
    assert page.run_button.isEnabled()
    page.target.edit.setPlainText(UP_AND_DOWN.replace("0.3", "0.2"))
    assert "compute the voltage again" in page.state.text()
    assert not page.run_button.isEnabled()
    page.target.edit.setPlainText(UP_AND_DOWN)
    assert page.run_button.isEnabled()
    # nothing is learned from a run on another rig
    click(qtbot, page.run_button)
    session.set_address("sim:8")
    session.recorded.emit(made(session.folder, "other"))
    assert "Nothing is learned from the last run" in page.message.text()
    assert "compute the voltage again" in page.state.text()
    # and nothing from another sequence
    session.set_address("sim")
    session.set_notes("Ada", "film 3", "")  # what the operator writes changes no voltage
    session.recorded.emit(session.folder / "other.h5")
    idle(qtbot, page)
    assert page.followed is not None
    assert page.followed.tracking.runs == ()
    assert page.message.text() == ""


def test_a_target_is_read_written_and_asked_for(
    qtbot: QtBot, page: FollowPage, tmp_path: Path, answers: Any
) -> None:
    path = tmp_path / "path.toml"
    page.target.files.write(path)
    qtbot.waitUntil(lambda: "path.toml" in page.target.files.name.text(), timeout=_PATIENCE)
    assert path.read_text(encoding="utf-8") == UP_AND_DOWN
    page.target.edit.setPlainText(FAST)
    page.target.open_file(path)  # the answer is no
    assert "target path.toml (changed: segment 2 duration (s))" in answers.questions[0]
    assert page.target.toml == FAST
    path.write_text(f"{UP_AND_DOWN}# by another program\n", encoding="utf-8")
    page.target.files.write(path)
    qtbot.waitUntil(
        lambda: "nothing was written" in page.target.files.trouble.text(), timeout=_PATIENCE
    )
    assert path.read_text(encoding="utf-8").endswith("# by another program\n")
    answers.next = True
    table = tmp_path / "table.csv"
    table.write_text("time_s,displacement_um\n0,0\n1,200\n2,40\n8,0\n", encoding="utf-8")
    page.target.open_file(table)
    done(qtbot, page, page.compute_button)
    assert page.message.text() == ""
    assert page.headline.text().startswith("table: ")


def test_models_of_studies_and_files_can_be_chosen(
    qtbot: QtBot, page: FollowPage, tmp_path: Path
) -> None:
    from tests.tools.command import film_model, thesis_model

    page.model.use(film_model(tmp_path / "film.toml"))
    done(qtbot, page, page.compute_button)
    assert "bare film" in page.message.text()
    path = thesis_model(tmp_path / "model.toml")
    page.model.use(path)
    done(qtbot, page, page.compute_button)
    with qtbot.waitSignal(page.use_model) as told:
        click(qtbot, page.run_button)
    assert told.args == [path]
