"""The page Campaign: a plan, a batch that is armed once, its runs, and what ends them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.acquisition.interrupts import Interrupts
from dearig.batch.after import AfterRun
from dearig.batch.journal import JOURNAL
from dearig.batch.watching import seen
from dearig.config.campaignfile import parse_campaign
from dearig.config.rigfile import RigFile
from dearig.drivers.settings import CardSettings, LimitsSettings
from dearig.errors import Interrupted
from dearig.recording import open_recording
from dearig.window.campaign.compute import ComputeProcess
from dearig.window.campaign.page import CampaignPage
from dearig.window.high_voltage.bar import HighVoltageBar
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.jobs.worker_process import WorkerMessage
from dearig.window.run.runner import Play, Runner
from dearig.window.session.state import Session
from dearig.window.session.text_file import EditedFile
from dearig.window.shell.frame import MainWindow
from tests.deep import mostly_deep
from tests.window.conftest import press
from tests.window.run.test_stories import click

_PATIENCE = 120_000  # ms; of a machine that may be busy
RIG = RigFile(card=CardSettings(sample_rate_Hz=200.0), limits=LimitsSettings(ramp_down_s=0.1))
LOBE = """\
name = "lobe"
lead_in_s = 0.3
tail_s = 0.2
[[segment]]
kind = "half_sine"
amplitude_kV = 4.0
frequency_Hz = 2.0
"""
LONG = LOBE.replace("frequency_Hz = 2.0", "frequency_Hz = 0.1")
PLAN = """\
name = "few"
sequence = "lobe.toml"
[grid]
"segment.0.amplitude_kV" = [3.0, 4.0, 5.0]
"""
NAMES = ["few-0001", "few-0002", "few-0003"]


@pytest.fixture
def runner(session: Session) -> Iterator[Runner]:
    session.set_rig_file(None, "", RIG)
    made = Runner(session, session)
    yield made
    made.stop("the end of a test")
    made.wait()


@pytest.fixture
def page(
    session: Session, runner: Runner, keep: Callable[[QWidget], None], tmp_path: Path, qtbot: QtBot
) -> CampaignPage:
    """The page alone, with three short runs that are within all limits, and the bar."""
    bar = HighVoltageBar(runner.status, session)  # where ARMED is seen
    keep(bar)
    (tmp_path / "lobe.toml").write_text(LOBE, "utf-8")
    shown = CampaignPage(session, runner)
    write(shown, PLAN, tmp_path)
    shown.resize(1190, 690)
    keep(shown)
    surveyed(qtbot, shown)
    return shown


def write(page: CampaignPage, plan: str, folder: Path) -> None:
    page.plan.restore(plan, EditedFile("plan", plan, None, folder))


def surveyed(qtbot: QtBot, page: CampaignPage) -> None:
    qtbot.waitUntil(lambda: page._survey is not None and not page.surveyor.waits, timeout=_PATIENCE)


def states(page: CampaignPage) -> list[str]:
    return [row.state for row in page.table.rows]


def begin(qtbot: QtBot, page: CampaignPage) -> None:
    press(qtbot, page.controls.arm)
    press(qtbot, page.controls.start)


def ended(qtbot: QtBot, runner: Runner) -> None:
    qtbot.waitUntil(lambda: not runner.running, timeout=_PATIENCE)


def far(page: CampaignPage, seconds: float) -> bool:
    """True once a run has come that far."""
    live = None if page._thread is None else page._thread.live
    now = None if live is None else live.now()
    return now is not None and now.samples / now.rate > seconds


def test_a_batch_is_foreseen_armed_and_played_as_by_the_command(
    qtbot: QtBot, page: CampaignPage, runner: Runner, session: Session
) -> None:
    assert states(page) == ["admitted"] * 3
    assert "few: 3 runs" in page.headline.text()
    assert "3.00 s without computations" in page.summary.text()
    assert "voltage 5 of" in page.summary.text()
    assert page.controls.runs.value() == 3
    assert not page.controls.start.isEnabled()  # never in one step
    shown: list[HighVoltage] = []
    runner.state_changed.connect(shown.append)
    page.controls.operator.setText("Ada")
    begin(qtbot, page)
    assert session.running
    ended(qtbot, runner)
    assert page.message.text() == "Finished: all runs were played."
    assert states(page) == ["done"] * 3
    assert shown[0] is HighVoltage.ARMED
    assert shown.count(HighVoltage.ON) == 3
    assert HighVoltage.BETWEEN in shown
    assert runner.state is HighVoltage.CONFIRMED
    assert page.folder == session.folder / "campaign-1"
    outcome = seen(page.folder)
    assert outcome.status == "complete"
    assert outcome.queue == page.queue
    peaks = [
        float(np.max(open_recording(page.folder / f"{name}.h5").voltage_command))  # type: ignore[arg-type]
        for name in NAMES
    ]
    assert peaks == pytest.approx([3000.0, 4000.0, 5000.0], rel=1e-3)
    assert open_recording(page.folder / "few-0001.h5").provenance["operator"] == "Ada"
    surveyed(qtbot, page)
    assert not page.controls.arm.isEnabled()
    assert page.controls.blocked.text() == "No run waits."


@pytest.mark.deep
def test_the_present_run_is_shown_live_on_its_page_and_on_run(
    qtbot: QtBot, window: MainWindow, tmp_path: Path
) -> None:
    """Its curves and numbers, with the overlay models, as those of any run."""
    window.session.set_rig_file(None, "", RIG)
    page, run = window.page(CampaignPage), window.run_page
    (tmp_path / "lobe.toml").write_text(LOBE, "utf-8")
    write(page, PLAN, tmp_path)
    window.show_page(page)
    surveyed(qtbot, page)
    page.controls.operator.setText("Ada")
    page.controls.paced.setChecked(True)
    begin(qtbot, page)
    plots = page.present_run.plots
    qtbot.waitUntil(lambda: plots.curve("displacement")[0].size > 100, timeout=_PATIENCE)
    assert page.present_run.isVisible()
    number = page.controls.numbers["displacement"]
    qtbot.waitUntil(lambda: number.text != "—", timeout=_PATIENCE)  # in this run or the next
    window.show_page(run)
    qtbot.waitUntil(lambda: run.plots.curve("model 0")[0].size > 100, timeout=_PATIENCE)
    words = run.display.view.words
    running = [f"Running: {name}" for name in NAMES]
    qtbot.waitUntil(lambda: words.text() in running, timeout=_PATIENCE)  # not between two
    qtbot.waitUntil(lambda: run.controls.numbers["rms 0"].text != "—", timeout=_PATIENCE)
    qtbot.waitUntil(lambda: words.text() == f"Running: {NAMES[2]}", timeout=_PATIENCE)
    ended(qtbot, run.runner)
    assert words.text().startswith(f"Last run: {NAMES[2]}, ended at ")
    assert page.controls.numbers["displacement"].text == "—"
    started = [a.message for a in run.alarms.alarms if "run started" in a.message]
    assert started == [f"{name}: run started" for name in NAMES]


def test_what_is_refused_stands_in_the_table_and_nothing_can_be_armed(
    qtbot: QtBot, page: CampaignPage, tmp_path: Path
) -> None:
    write(page, PLAN.replace("4.0", "99.0"), tmp_path)
    assert not page.controls.arm.isEnabled()
    surveyed(qtbot, page)
    assert states(page) == ["admitted", "refused", "admitted"]
    assert "99 kV" in page.table.rows[1].result
    assert "1 run cannot be played, the first of them as sequence" in page.controls.blocked.text()
    assert not page.controls.arm.isEnabled()
    write(page, PLAN.replace("lobe.toml", "lob.toml"), tmp_path)
    surveyed(qtbot, page)
    assert page.table.rows == []
    assert "neither a preset nor a file next to the plan" in page.controls.blocked.text()
    write(page, PLAN, tmp_path)
    surveyed(qtbot, page)
    assert page.controls.arm.isEnabled()


def test_an_armed_batch_is_that_which_was_declared_and_no_run(
    qtbot: QtBot, page: CampaignPage, runner: Runner, session: Session
) -> None:
    press(qtbot, page.controls.arm)
    assert runner.armed_for(Play.CAMPAIGN)
    assert not runner.armed_for(Play.RUN)
    assert not runner.arm(True, Play.RUN)
    page.controls.runs.setValue(2)  # another batch than the one that was armed
    assert not runner.armed
    qtbot.keyClick(page, Qt.Key.Key_F5)
    assert runner.armed_for(Play.CAMPAIGN)
    runner.stop("a test")
    assert not runner.armed
    # the survey of a plan that was changed while it was made
    found = page._survey
    assert found is not None
    page.plan.edit.setPlainText(PLAN.replace("5.0", "4.5"))
    page.surveyor.done.emit(found)
    assert not page.controls.arm.isEnabled()
    surveyed(qtbot, page)
    assert "4.5" in page.table.rows[2].settings
    # in use by something else
    assert runner.arm(True, Play.RUN)
    assert not page.controls.arm.isEnabled()
    assert "A run is armed" in page.controls.blocked.text()
    runner.stop("a test")


def test_the_queue_is_paused_reordered_cut_and_ended(
    qtbot: QtBot, page: CampaignPage, runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dearig.window.documents.dialogs.ask", lambda *_: True)
    page.controls.paced.setChecked(True)
    begin(qtbot, page)
    qtbot.waitUntil(lambda: far(page, 0.0), timeout=_PATIENCE)
    click(qtbot, page.controls.pause)
    page.table.choose(["few-0003"])
    click(qtbot, page.controls.first)
    page.table.choose(["few-0002"])
    click(qtbot, page.controls.skip)
    qtbot.waitUntil(lambda: page._stage == "paused", timeout=_PATIENCE)
    assert [row.name for row in page.table.rows] == ["few-0001", "few-0003", "few-0002"]
    assert states(page) == ["done", "waiting", "skipped"]
    assert runner.state is HighVoltage.BETWEEN
    assert "the campaign is paused" in runner.status.words
    assert page.folder is not None
    assert seen(page.folder).status == "paused"
    assert seen(page.folder).queue == page.queue
    click(qtbot, page.controls.end)
    ended(qtbot, runner)
    assert page.message.text() == "Ended: 1 run waits; arm and start again to go on."


def test_stop_ends_run_and_campaign_at_zero_and_it_goes_on_later(
    qtbot: QtBot, page: CampaignPage, runner: Runner, tmp_path: Path
) -> None:
    (tmp_path / "lobe.toml").write_text(LONG, "utf-8")
    write(page, PLAN.replace('name = "few"', 'name = "long"'), tmp_path)
    surveyed(qtbot, page)
    page.controls.paced.setChecked(True)
    begin(qtbot, page)
    qtbot.waitUntil(lambda: far(page, 0.5), timeout=_PATIENCE)
    runner.stop("a test")
    assert runner.state is HighVoltage.RAMPING
    ended(qtbot, runner)
    assert runner.state is HighVoltage.CONFIRMED
    assert page.folder is not None
    assert states(page) == ["lost", "waiting", "waiting"]
    assert "Stopped: 2 runs wait" in page.message.text()
    folder = page.folder
    # another window opens it
    page._new()
    assert states(page) == []
    page.open_campaign(folder)
    qtbot.waitUntil(lambda: page.folder == folder, timeout=_PATIENCE)
    surveyed(qtbot, page)
    assert states(page) == ["lost", "waiting", "waiting"]
    assert page.controls.runs.value() == 2
    page.controls.paced.setChecked(False)
    begin(qtbot, page)
    ended(qtbot, runner)
    assert states(page) == ["lost", "done", "done"]


@pytest.mark.parametrize(
    ("entries", "state", "words"),
    mostly_deep(
        [
            pytest.param(
                3, "cut off", "ended during run few-0001. When the campaign is started again"
            ),
            pytest.param(4, "cut off", "ended after run few-0001, before its results were noted"),
            pytest.param(5, "done", "ended between two runs", id="between"),
        ],
        ["between"],
    ),
)
def test_a_killed_campaign_says_what_happened_and_what_its_start_does(
    qtbot: QtBot, page: CampaignPage, runner: Runner, entries: int, state: str, words: str
) -> None:
    begin(qtbot, page)
    ended(qtbot, runner)
    folder = page.folder
    assert folder is not None
    journal = folder / JOURNAL
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:entries]))
    page._new()
    page.open_campaign(folder)
    qtbot.waitUntil(lambda: page.folder == folder, timeout=_PATIENCE)
    surveyed(qtbot, page)
    assert states(page)[0] == state
    assert words in page.message.text()
    assert ("few-0001 was cut off" in page.summary.text()) == (state == "cut off")


def test_an_interlock_halts_until_a_person_says_what_was_seen(
    qtbot: QtBot, page: CampaignPage, runner: Runner, session: Session
) -> None:
    page.faults = ("arc@0.45",)
    begin(qtbot, page)
    ended(qtbot, runner)
    assert states(page)[0] == "stopped"
    surveyed(qtbot, page)
    page.faults = ()
    assert runner.status.alarm is not None
    runner.status.acknowledge("Ada")
    assert not page.controls.arm.isEnabled()
    assert "halted" in page.controls.halt.text().lower()
    page.controls.operator.setText("Ada")
    page.controls.seen.setText("the film is whole")
    begin(qtbot, page)
    ended(qtbot, runner)
    assert states(page) == ["stopped", "done", "done"]


def test_what_is_computed_after_a_run_is_ended_by_stop_and_its_faults_are_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lobe.toml").write_text(LOBE, "utf-8")
    campaign = parse_campaign(PLAN + "[after]\nidentify = true\n", "the plan", tmp_path)
    interrupts = Interrupts()
    apart = ComputeProcess(interrupts)
    ours, theirs = Pipe()
    monkeypatch.setattr(apart, "_started", lambda: ours)
    stages: list[str] = []

    def compute(*answers: WorkerMessage) -> AfterRun:
        for answer in answers:
            theirs.send(answer)
        return apart(
            campaign, tmp_path / "a.h5", tmp_path, "", RIG, lambda stage, _: stages.append(stage)
        )

    done = AfterRun(numbers={"mu_0_kPa": 40.0})
    assert (
        compute(WorkerMessage(1, "progress", ("fitting", 0.5)), WorkerMessage(1, "done", done))
        == done
    )
    assert stages == ["fitting"]
    assert theirs.recv().given[1] == tmp_path / "a.h5"
    assert compute(WorkerMessage(2, "broken", ("an error", "trace"))).problems == ["an error"]
    interrupts.ask()
    with pytest.raises(Interrupted, match="at 0 V"):
        compute()


def test_the_window_closes_in_a_campaign_at_zero_and_the_journal_goes_on(
    qtbot: QtBot, window: MainWindow, tmp_path: Path
) -> None:
    page, runner = window.page(CampaignPage), window.run_page.runner
    window.session.set_rig_file(None, "", RIG)
    (tmp_path / "lobe.toml").write_text(LONG, "utf-8")
    write(page, PLAN, tmp_path)
    window.show_page(page)
    surveyed(qtbot, page)
    page.controls.paced.setChecked(True)
    press(qtbot, page.controls.arm)
    window.show_page(window.run_page)
    qtbot.keyClick(window, Qt.Key.Key_F6)  # what is armed is not a run
    assert not runner.running
    assert not window.run_page.arm_button.isEnabled()
    window.show_page(page)
    press(qtbot, page.controls.start)
    qtbot.waitUntil(lambda: far(page, 0.5), timeout=_PATIENCE)
    window.show_page(window.run_page)
    assert "a campaign goes on" in window.run_page.blocked.text()
    assert not window.run_page.arm_button.isEnabled()
    folder = page.folder
    window.leave()
    qtbot.waitUntil(lambda: not window.isVisible(), timeout=_PATIENCE)
    assert not runner.running
    assert folder is not None
    outcome = seen(folder)
    assert outcome.status == "interrupted"
    cut = open_recording(folder / "few-0001.h5")
    assert cut.voltage_command is not None
    assert abs(float(cut.voltage_command[-1])) < 1.0
