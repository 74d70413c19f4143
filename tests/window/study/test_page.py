"""The page Study as its user meets it, up to the experiment that it proposes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QWidget
from pytestqt.qtbot import QtBot

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.outcomes import DiagnoseOutcome
from dearig.analysis.study import Study
from dearig.analysis.summary import assess
from dearig.config.modelfile import load_model
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.errors import SafetyStop
from dearig.report.study_file import save_study
from dearig.report.study_view import view_of
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from dearig.window.study.page import StudyPage
from tests.report.test_study_file import made as study_on_paper
from tests.tools.diagnosis import EXPERIMENT, diagnose_outcome
from tests.window.conftest import press
from tests.window.made_recordings import LOBES, SLOW_RIG, made, of_rig

pytestmark = pytest.mark.usefixtures("kept_processes")

_PATIENCE = 240_000  # ms; a search on a machine that may be busy

Keep = Callable[[QWidget], None]


def open_page(session: Session, keep: Keep, qtbot: QtBot) -> StudyPage:
    page = open_page_without_recordings(session, keep)
    listed(page, qtbot)
    return page


def open_page_without_recordings(session: Session, keep: Keep) -> StudyPage:
    page = StudyPage(session)
    page.resize(1190, 690)
    keep(page)
    return page


def listed(page: StudyPage, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: page.recordings.rowCount() > 0, timeout=_PATIENCE)


def click(qtbot: QtBot, widget: QWidget) -> None:
    assert widget.isEnabled()
    qtbot.mouseClick(widget, Qt.MouseButton.LeftButton)


def studied(page: StudyPage, qtbot: QtBot) -> Study:
    """Press Start, and wait for what is found."""
    with qtbot.waitSignal(page._session.study_finished, timeout=_PATIENCE) as told:
        click(qtbot, page.start)
    found: Study = told.args[0]
    return found


def words(widget: QWidget) -> str:
    return "\n".join(label.text() for label in widget.findChildren(QLabel))


def test_a_result_that_arrives_during_a_run_is_shown_tab_after_tab(session, keep, qtbot, tmp_path):
    page = open_page_without_recordings(session, keep)
    outcome = diagnose_outcome(title="bench")
    view = view_of(study_on_paper(tmp_path / "study-1", outcome))
    session.set_armed(True)
    page.show_view(view)
    assert page.headline.text() == view.headline
    assert words(page.verdict)
    assert not words(page.ranking)  # STOP is heard before
    qtbot.waitUntil(lambda: bool(words(page.experiment)))
    assert words(page.ranking)


def test_a_fit_with_its_check_from_ticks_to_files(session, keep, qtbot, tmp_path):
    low, high = made(session.folder, "low", 4.0), made(session.folder, "high", 7.0)
    page = open_page(session, keep, qtbot)
    assert not page.start.isEnabled()  # nothing is checked
    page.recordings.check([low], [high])
    # a recording is fitted or checked, never both
    page.recordings.check([low, high], [high])
    assert page.task().train == (low,)
    assert page.task().validation == (high,)
    page.identify.setChecked(True)
    page.branches.setValue(1)

    found = studied(page, qtbot)
    assert not page.job.cancel_button.isEnabled()
    assert page.headline.text() == "lobes of 4.0 kV, 1 branch"
    assert "not used in the fit" in words(page.verdict)
    # what only a diagnosis has is not there
    assert [page.tabs.tabText(i) for i in range(5) if page.tabs.isTabVisible(i)] == [
        "Result", "Curves", "Residual",
    ]  # fmt: skip
    assert [page.curves.record.itemText(i) for i in range(2)] == [
        "high (validation)", "low (training)",
    ]  # fmt: skip
    assert [len(p.drawn) for p in page.residual.time] == [1, 0]
    assert found.report.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert load_model(found.model).model.network.branches
    assert found.model == session.folder / "study-1" / "model.toml"
    assert found.outcome.model_path == str(found.model)

    page.save(tmp_path / "mine.toml")
    assert load_model(tmp_path / "mine.toml").name == load_model(found.model).name
    page.save(tmp_path / "gone" / "mine.toml")
    assert "cannot be written: there is no folder" in page.message.text()
    with qtbot.waitSignal(page.use_model) as told:
        click(qtbot, page.overlay_button)
    assert told.args == [found.model]
    assert not page.run_button.isEnabled()


def test_what_cannot_be_studied_is_said_and_leaves_nothing(session, keep, qtbot):
    path = of_rig(session.folder, "thesis", "sim")
    copy = session.folder / "copy.h5"
    copy.write_bytes(path.read_bytes())
    page = open_page(session, keep, qtbot)
    qtbot.waitUntil(lambda: page.recordings.rowCount() == 2, timeout=_PATIENCE)
    page.recordings.check([path], [copy])
    click(qtbot, page.start)
    qtbot.waitUntil(lambda: "is a copy of" in page.message.text(), timeout=_PATIENCE)
    assert not list(session.folder.glob("study-*"))
    # the page is ready for the next
    page.recordings.check([path], [])
    assert page.start.isEnabled()

    # a search that is cancelled at once leaves nothing either
    click(qtbot, page.start)
    qtbot.waitUntil(
        lambda: page.job.bar.value() > 0 or page.message.text() != "", timeout=_PATIENCE
    )
    assert page.message.text() == ""
    click(qtbot, page.job.cancel_button)
    click(qtbot, page.job.cancel_button)
    assert page.message.text() == "Cancelled; nothing was saved."
    assert not list(session.folder.glob("study-*"))
    assert page.start.isEnabled()


def test_a_study_is_reopened_and_the_old_result_is_labelled(session, keep, qtbot):
    """With a result made on paper: the search has tests of its own."""
    folder = session.folder / "study-1"
    save_study(view_of(study_on_paper(folder, diagnose_outcome())))
    page = open_page_without_recordings(session, keep)
    qtbot.waitUntil(lambda: bool(page.studies.actions()), timeout=_PATIENCE)
    (action,) = page.studies.actions()
    assert action.text().startswith("study-1, ")
    action.trigger()
    qtbot.waitUntil(page.report_button.isEnabled, timeout=_PATIENCE)
    shown = page.headline.text()
    assert shown.startswith("Residual explained; by which effect these data cannot tell")
    assert "cannot separate sensor lag from amplifier" in words(page.verdict)
    assert page.curves.record.count() == 3
    assert len(page.residual.time[0].drawn) == 1
    assert page.proposed() == EXPERIMENT.sequence
    assert "study-1" in page.about.text()

    # while a new study runs, and after it has failed, the result is the previous one
    low = made(session.folder, "low", 4.0)
    qtbot.waitUntil(lambda: page.recordings.rowCount() == 1, timeout=_PATIENCE)
    page.recordings.check([low], [])
    click(qtbot, page.start)
    assert page.headline.text() == f"Previous result: {shown}"
    assert page.about.text().startswith("This is study-1, ")
    click(qtbot, page.job.cancel_button)
    click(qtbot, page.job.cancel_button)
    assert page.message.text() == "Cancelled; nothing was saved."
    assert page.headline.text().startswith("Previous result: ")


@pytest.mark.deep
def test_a_recording_that_ended_in_an_arc_is_marked_and_warned_of(session, keep, qtbot):
    arc = session.folder / "arc.h5"
    loaded = parse_sequence(LOBES.format(top=6.0), "arc", Path())
    with pytest.raises(SafetyStop):
        record(loaded, "sim", RigFile(), arc, RunOptions(faults=["arc@1.7"]))
    page = open_page(session, keep, qtbot)
    name = page.recordings.item(0, 0)
    assert not page.warning.isVisible()
    page.recordings.check([arc], [])
    qtbot.waitUntil(page.warning.isVisible, timeout=_PATIENCE)
    assert name.text() == "arc (interlock)"
    assert "arc ended in an interlock at 1.7" in page.warning.text()
    assert "the last 0.5 s may show the fault, not the film" in page.warning.text()
    assert "ended in an interlock" in name.toolTip()
    assert page.ended_early.isVisible()
    assert page.task().ended_early == "cut"
    page.ended_early.setCurrentIndex(1)
    assert page.task().ended_early == "leave-out"
    page.recordings.check([], [])
    assert not page.warning.isVisible()
    assert not page.ended_early.isVisible()


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.deep
def test_from_a_diagnosis_to_the_proposed_experiment_and_a_better_overlay(
    window: MainWindow, session: Session, qtbot: QtBot
) -> None:
    # its amplifier saturates behind its monitor, which looks like a permittivity of the film
    address = "sim:251188"
    session.set_rig_file(None, "", SLOW_RIG)
    session.set_address(address)
    path = of_rig(session.folder, "thesis", address)
    page, run = window.page(StudyPage), window.run_page
    window.show_page(page)
    page._library.refresh()
    listed(page, qtbot)
    page.recordings.check([path], [])
    outcome = studied(page, qtbot).outcome
    assert isinstance(outcome, DiagnoseOutcome)
    assert outcome.finding.steps
    assert outcome.experiment is not None, outcome.experiment_text
    assert outcome.experiment.name in words(page.experiment)
    assert [len(p.drawn) for p in page.residual.time] == [1, 1]

    # the improved model with the next measurement
    click(qtbot, page.overlay_button)
    found = page._shown
    assert found is not None
    qtbot.waitUntil(lambda: any(m.path == found.model for m in session.overlays), timeout=_PATIENCE)

    # the experiment, filled in and not armed
    assert session.address == address
    click(qtbot, page.run_button)
    assert window.stack.currentWidget() is run
    qtbot.waitUntil(
        lambda: session.preview is not None and session.preview.toml == outcome.experiment.sequence,
        timeout=_PATIENCE,
    )
    assert run.runner.state is HighVoltage.NOT_CONTACTED
    press(qtbot, run.arm_button)
    with qtbot.waitSignal(session.recorded, timeout=_PATIENCE) as told:
        press(qtbot, run.start_button)
    recorded: Path = told.args[0]
    before, after = assess(recorded, None).errors, assess(recorded, found.model).errors
    assert before is not None
    assert after is not None
    assert after.rms < 0.5 * before.rms
    # it ran next to the measurement as it runs afterwards
    live = run.live
    assert live is not None
    qtbot.waitUntil(lambda: live.now() is not None and bool(live.now().errors), timeout=_PATIENCE)
    place = [m.path for m in session.overlays].index(found.model)
    qtbot.waitUntil(
        lambda: live.now().errors[place].rms == pytest.approx(after.rms, rel=0.05),
        timeout=_PATIENCE,
    )


def test_the_room_of_the_parts_is_kept_until_it_is_reset(session, keep, qtbot):
    first = StudyPage(session)
    first.resize(1190, 690)
    keep(first)
    default = first.split.sizes()
    first.split.setSizes([default[0] + 150, default[1] - 150])
    first.split.splitterMoved.emit(default[0] + 150, 1)  # as a drag ends
    moved = first.split.sizes()
    second = StudyPage(session)
    second.resize(1190, 690)
    keep(second)
    assert second.split.sizes() == moved != default
    second.reset_layout()
    assert second.split.sizes() == default


def test_what_is_known_of_parameters_goes_into_the_fit(
    session: Session, keep: Keep, qtbot: QtBot, tmp_path: Path
) -> None:
    page = open_page_without_recordings(session, keep)
    assert page.task().parameters == {}
    file = tmp_path / "known.toml"
    file.write_text("[mu_1_kPa]\nmean = 20.0\nsd = 2.0\n[T_1_s]\nfixed = 0.5\n", "utf-8")
    page.known.open_file(file)
    assert page.task().parameters == {
        "mu_1_kPa": {"mean": 20.0, "sd": 2.0},
        "T_1_s": {"fixed": 0.5},
    }
    assert page.known.shown.full_text == "μ₁ (kPa): 20 ± 2; T₁ (s): 0.5, not fitted"
    faulty = tmp_path / "faulty.toml"
    faulty.write_text("[mu_1_kPa]\nmiddle = 20.0\n", "utf-8")
    page.known.open_file(faulty)
    assert "middle is not a key" in page.known.trouble.text()
    assert page.known.path == file
    file.write_text("[mu_1_kPa]\nmean = 'much'\n", "utf-8")  # since it was chosen
    page.begin()
    assert "mu_1_kPa.mean" in page.message.text()
    assert page.job.job is None
    click(qtbot, page.known.clear_button)
    assert page.task().parameters == {}
