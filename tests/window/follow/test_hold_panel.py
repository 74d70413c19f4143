"""The hold on the page Follow: checked, armed on the page Run with its feedback, and measured."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import RigFile
from dearig.drivers.settings import CardSettings, LimitsSettings
from dearig.errors import InputError
from dearig.recording import open_recording
from dearig.window.follow.hold_jobs import measure_hold
from dearig.window.follow.page import FollowPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.window.conftest import press
from tests.window.follow.test_page import Here, words
from tests.window.run.test_stories import click, play

_PATIENCE = 120_000  # ms; of a machine that may be busy
RIG = RigFile(card=CardSettings(sample_rate_Hz=200.0), limits=LimitsSettings(ramp_down_s=0.1))


def idle(qtbot: QtBot, page: FollowPage) -> None:
    qtbot.waitUntil(page.hold.check_button.isEnabled, timeout=_PATIENCE)


@pytest.fixture
def page(session: Session, keep: Callable[[QWidget], None]) -> FollowPage:
    """The page alone, in the mode of a hold."""
    session.set_rig_file(None, "", RIG)
    shown = FollowPage(session, worker=Here(QObject(session)))
    shown.modes.setCurrentWidget(shown.hold)
    shown.resize(1190, 690)
    keep(shown)
    return shown


def test_a_hold_is_checked_armed_on_run_watched_and_measured(
    qtbot: QtBot, window: MainWindow, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, run, page = window.session, window.run_page, window.page(FollowPage)
    session.set_rig_file(None, "", RIG)
    page.hold.worker = Here(page)
    window.show_page(page)
    page.modes.setCurrentWidget(page.hold)
    panel = page.hold
    panel.displacement.setValue(0.3)
    panel.duration.setValue(12.0)
    click(qtbot, panel.check_button)
    idle(qtbot, page)
    assert panel.message.text() == ""
    assert panel.headline.text() == "0.3 mm can be held for 12.0 s"
    assert "0.6 s after its readings" in words(panel.words)
    click(qtbot, panel.run_button)
    assert run.isVisible()
    assert "Feedback holds 0.3 mm for 12.0 s" in run.hold_state.text()
    qtbot.waitUntil(
        lambda: (
            session.preview is not None
            and session.preview.toml == session.sequence_toml
            and run.arm_button.isEnabled()
        ),
        timeout=_PATIENCE,
    )
    path = play(qtbot, run)
    qtbot.waitUntil(lambda: panel.outcome is not None, timeout=_PATIENCE)
    idle(qtbot, page)
    assert "error" in run.hold_state.text()
    outcome, forecast = panel.outcome, panel.forecast
    assert outcome is not None
    assert forecast is not None
    assert outcome.feedback is not None
    assert outcome.settled_rms < 2.0 * outcome.noise
    assert "feedback" in open_recording(path).provenance
    assert run.live is not None
    assert run.live.answers().shape == (outcome.feedback.answers, 3)
    assert "0.3 mm: error" in panel.headline.text()
    assert panel.report_button.isEnabled()
    opened: list[str] = []
    monkeypatch.setattr(
        "dearig.window.follow.hold_panel.write_hold_report", lambda outcome, **_: outcome.recording
    )
    monkeypatch.setattr(
        "dearig.window.kit.browser.QDesktopServices.openUrl",
        lambda url: not opened.append(url.toLocalFile()),
    )
    click(qtbot, panel.report_button)
    qtbot.waitUntil(lambda: opened == [str(path)], timeout=_PATIENCE)
    # of a run that ended early, the error until the last answer counts
    early = measure_hold(forecast, path, None, 15.0)
    assert early.duration == 11.0
    assert early.feedback is None
    assert early.settled_rms == pytest.approx(outcome.settled_rms, rel=0.3)
    with pytest.raises(InputError, match="before the loop had settled"):
        measure_hold(forecast, path, None, 11.0)
    # the newest answer stands until another run is armed, or the hold is removed
    run._refresh()
    assert "error" in run.hold_state.text()
    press(qtbot, run.arm_button)
    qtbot.waitUntil(lambda: "Feedback holds 0.3 mm" in run.hold_state.text(), timeout=_PATIENCE)
    session.set_notes("Ada", "another film", "")
    run._update_readouts()
    assert run.hold_state.text() == ""


def test_any_change_of_what_is_played_removes_the_feedback(
    qtbot: QtBot, page: FollowPage, session: Session
) -> None:
    panel = page.hold
    panel.duration.setValue(12.0)
    click(qtbot, panel.check_button)
    idle(qtbot, page)
    assert panel.forecast is not None
    plan = panel.forecast.plan

    def shown() -> bool:
        session.set_sequence(plan.sequence.toml, Path())
        session.set_hold(plan)
        return session.hold is plan

    assert shown()
    session.set_sequence(plan.sequence.toml + "# edited\n", Path())
    assert session.hold is None
    assert shown()
    session.set_address("sim:8")
    assert session.hold is None
    assert shown()
    session.set_rig_file(None, "", RigFile())
    assert session.hold is None
    assert shown()
    session.set_notes("Ada", "film 4", "")
    assert session.hold is None
    assert "has changed" in panel.state.text()
    assert not panel.run_button.isEnabled()


def test_what_cannot_be_held_is_said_before_anything_is_played(
    qtbot: QtBot, page: FollowPage, session: Session
) -> None:
    panel, target = page.hold, page.target.toml
    panel.displacement.setValue(20.0)
    click(qtbot, panel.check_button)
    idle(qtbot, page)
    assert "20 mm cannot be held" in panel.message.text()
    assert not panel.run_button.isEnabled()
    panel.displacement.setValue(0.3)
    session.set_rig_file(
        None, "", RIG.model_copy(update={"limits": LimitsSettings(time_at_voltage_max_s=5.0)})
    )
    click(qtbot, panel.check_button)
    idle(qtbot, page)
    assert "time at 1 kV or more" in panel.message.text()
    assert page.target.toml == target  # the other mode is as it was
