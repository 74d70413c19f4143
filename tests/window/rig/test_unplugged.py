"""A rig behind the real driver: a run that goes well, and one whose rig is unplugged."""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import RigFile
from dearig.drivers.daqmx.guardian import GuardianProcess
from dearig.recording import open_recording
from dearig.sim_backend.clock import PacedClock
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.run.page import RunPage
from tests.deep import mostly_deep
from tests.tools.daqmx import served
from tests.window.conftest import SHORT, press

RIG_FILE = RigFile.model_validate(
    {
        "film": {"name": "film 3"},
        "guardian": {"link_timeout_s": 0.5, "timeout_s": 1.0, "retry_s": 0.5},
    }
)
WAIT = 120_000


@pytest.fixture(autouse=True)
def _guardians_end(monkeypatch: pytest.MonkeyPatch, qtbot: QtBot) -> Iterator[None]:
    """A guardian whose card is gone goes on trying to reach it; here no one will plug it in."""
    left: list[subprocess.Popen[str]] = []
    close = GuardianProcess.close

    def close_and_tell(self: GuardianProcess) -> None:
        close(self)
        left.append(self._process)

    monkeypatch.setattr(GuardianProcess, "close", close_and_tell)
    yield
    for process in left:
        process.kill()
        process.wait()
    qtbot.waitUntil(lambda: all(t.name != "guardian" for t in threading.enumerate()))
    for process in left:
        if process.stdout is not None:
            process.stdout.close()


def play(qtbot: QtBot, page: RunPage, port: int) -> None:
    session = page.session
    page.film.setText("film 3")
    session.set_rig_file(None, "", RIG_FILE)
    session.set_sequence(SHORT, Path())
    session.set_address(f"daqmx:Dev1@127.0.0.1:{port}")
    qtbot.waitUntil(lambda: page.arm_button.isEnabled(), timeout=WAIT)
    assert page.paced.isHidden()  # a real rig takes its time
    press(qtbot, page.arm_button)
    with qtbot.waitSignal(page.runner.ended, timeout=WAIT):
        press(qtbot, page.start_button)


@pytest.mark.deep
def test_a_run_on_a_card(qtbot: QtBot, run_page: RunPage) -> None:
    with served(RIG_FILE, clock=PacedClock()) as there:
        play(qtbot, run_page, there.server.port)
    assert run_page.result.text().startswith("Finished"), run_page.result.text()
    assert run_page.runner.state is HighVoltage.CONFIRMED
    assert run_page.badge.state is HighVoltage.CONFIRMED
    recording = open_recording(next(run_page.session.folder.glob("*.h5")))
    assert recording.outcome == "finished"


@pytest.mark.parametrize(
    "fault", mostly_deep(["server-gone@0.5", "server-frozen@0.5"], ["server-frozen@0.5"])
)
def test_a_rig_that_is_unplugged_in_mid_run(qtbot: QtBot, run_page: RunPage, fault: str) -> None:
    with served(RIG_FILE, clock=PacedClock(), faults=(fault,)) as there:
        play(qtbot, run_page, there.server.port)
    assert run_page.result.text().startswith("Instrument fault"), run_page.result.text()
    # no one can say what is on the wire now
    assert run_page.runner.state is HighVoltage.UNKNOWN
    assert "by hand" in run_page.badge.toolTip()
    # and it is not known any better because somebody armed and thought again
    for _ in range(2):
        qtbot.mouseClick(run_page.arm_button, Qt.MouseButton.LeftButton)
    assert run_page.runner.state is HighVoltage.UNKNOWN
