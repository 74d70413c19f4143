"""Live values at rest: what is shown belongs to this rig and this moment, and nothing is output."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from dearig.config.rigfile import RigFile
from dearig.drivers.errors import RigError
from dearig.drivers.settings import RigSettings
from dearig.output_state import OutputState
from dearig.sim_backend.clock import PacedClock
from dearig.sim_backend.daqmx.protocol.interceptor import Interceptor
from dearig.sim_backend.rig import SimulatedRig
from dearig.window.high_voltage.state import HighVoltage
from dearig.window.rig import live_inputs
from dearig.window.rig.live_inputs import LiveInputs
from dearig.window.rig.page import RigPage
from dearig.window.session.state import Session
from dearig.window.shell.frame import MainWindow
from tests.tools.daqmx import served
from tests.window.conftest import SHORT, press

WAIT = 60_000
OUTPUT = re.compile(r"Create(AO|DO|CO)|Write|ResetDevice|Watchdog|SelfTest")
Keep = Callable[[QWidget], None]


class MadeInputs:
    """Inputs whose blocks a test hands out."""

    rate = 100.0

    def __init__(self) -> None:
        coefficients = dict.fromkeys(RigSettings().channel_names, (0.0, 10.0 / 32768.0))
        self.channels = RigSettings().channels(coefficients)[1:]
        self.blocks: list[np.ndarray | RigError] = []
        self.closed = threading.Event()

    def give(self, counts: int | RigError, samples: int = 10) -> None:
        spread = np.arange(samples, dtype=np.int16) % 2 * 2 - 1
        block = np.tile(spread, (len(self.channels), 1))
        self.blocks.append(counts if isinstance(counts, RigError) else block + np.int16(counts))

    def read(self) -> np.ndarray:
        if not self.blocks:
            self.closed.wait(0.01)
            return np.empty((len(self.channels), 0), dtype=np.int16)
        block = self.blocks.pop(0)
        if isinstance(block, RigError):
            raise block
        return block

    def close(self) -> None:
        self.closed.set()


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> MadeInputs:
    inputs = MadeInputs()
    monkeypatch.setattr(live_inputs, "open_inputs", lambda *_: inputs)
    return inputs


class HandClock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> HandClock:
    return HandClock()


@pytest.fixture
def live(session: Session, keep: Keep, clock: HandClock) -> LiveInputs:
    shown = LiveInputs(session, clock=clock)
    shown.resize(700, 500)
    keep(shown)
    return shown


def cells(live: LiveInputs, row: int) -> list[str]:
    return [live.table.item(row, column).text() for column in range(3)]


def drawn(live: LiveInputs) -> int:
    return 0 if not live.plots.curves else live.plots.curves[0].points[0].size


def started(live: LiveInputs, qtbot: QtBot) -> None:
    qtbot.mouseClick(live.start_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: live.table.rowCount() > 0 and drawn(live) > 0, timeout=WAIT)


def test_value_noise_and_trace_of_each_channel_are_shown(
    live: LiveInputs, made: MadeInputs, qtbot: QtBot
) -> None:
    made.give(0)
    started(live, qtbot)
    assert [cells(live, row)[0] for row in range(3)] == [
        "Voltage monitor", "Current monitor", "Laser, not zeroed",
    ]  # fmt: skip
    # one count to both sides: its standard deviation is one count
    scaling = made.channels[0].scaling
    noise = scaling.gain * scaling.coefficients[1]
    assert float(cells(live, 0)[2].split()[0]) == pytest.approx(noise, rel=0.02)
    assert cells(live, 0)[1:] == ["0.0000 kV", "0.31 V"]
    made.give(32766)
    qtbot.waitUntil(lambda: cells(live, 1)[1].startswith("▲ end of range, "), timeout=WAIT)
    qtbot.waitUntil(lambda: drawn(live) == 20, timeout=WAIT)


def test_numbers_vanish_when_samples_stop_coming(
    live: LiveInputs, made: MadeInputs, qtbot: QtBot, clock: HandClock
) -> None:
    made.give(0)
    started(live, qtbot)
    clock.now = 3.0
    qtbot.waitUntil(lambda: cells(live, 0)[1:] == ["—", "—"], timeout=WAIT)
    assert live.message.text() == "No sample for 3 s"


def test_a_fault_ends_the_reading_with_its_sentence(
    live: LiveInputs, made: MadeInputs, qtbot: QtBot
) -> None:
    made.give(0)
    started(live, qtbot)
    made.give(RigError("card Dev1: it was unplugged"))
    qtbot.waitUntil(lambda: not live.reading, timeout=WAIT)
    assert live.message.text() == "Stopped: card Dev1: it was unplugged"
    assert live.table.rowCount() == 0
    assert made.closed.is_set()
    assert live.start_button.text() == "R&ead inputs"


ENDS: dict[str, Callable[[LiveInputs], object]] = {
    "arming": lambda live: live._session.set_armed(True),
    "a run": lambda live: live._session.set_running(True),
    "another rig": lambda live: live._session.set_address("sim:3"),
    "another rig file": lambda live: live._session.set_rig_file(None, "", RigFile()),
    "another page": lambda live: live.hide(),
}


@pytest.mark.parametrize("name", ENDS)
def test_what_begins_ends_the_reading_and_its_numbers(
    live: LiveInputs, made: MadeInputs, qtbot: QtBot, name: str
) -> None:
    made.give(0)
    started(live, qtbot)
    told: list[OutputState] = []
    live._session.output_read.connect(told.append)
    made.give(5000)  # what comes too late is not shown, and nothing is told of it
    ENDS[name](live)
    assert not live.reading
    assert live.table.rowCount() == 0
    assert live.plots.curves == []
    live.wait()
    assert made.closed.is_set()
    qtbot.wait(1)
    assert (live.table.rowCount(), told) == (0, [])
    if live._session.busy:
        assert not live.start_button.isEnabled()
        live.start()
        assert not live.reading


def test_the_monitor_tells_the_state_of_the_output(
    session: Session, live: LiveInputs, made: MadeInputs, qtbot: QtBot, clock: HandClock
) -> None:
    told: list[OutputState] = []
    session.output_read.connect(told.append)
    clock.now = 10.0
    made.give(0)
    started(live, qtbot)
    assert [state.confirmed for state in told] == [True]
    clock.now = 12.0
    for _ in range(12):
        made.give(5000)  # a voltage that this program has not commanded
    qtbot.waitUntil(lambda: len(told) == 2, timeout=WAIT)
    assert not told[1].confirmed
    assert told[1].monitor is not None
    assert told[1].monitor > 100.0


def test_the_page_checks_only_after_the_reading_has_let_the_inputs_go(
    session: Session, keep: Keep, made: MadeInputs, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = RigPage(session)
    page.resize(1200, 700)
    keep(page)
    qtbot.waitUntil(lambda: page.outcome is not None, timeout=WAIT)
    page.instruments.setCurrentWidget(page.live)
    made.give(0)
    started(page.live, qtbot)
    free: list[bool] = []
    check = page.check.__globals__["check_rig"]
    monkeypatch.setitem(
        page.check.__globals__, "check_rig",
        lambda *given: (free.append(made.closed.is_set()), check(*given))[1],
    )  # fmt: skip
    qtbot.mouseClick(page.check_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: not page._checks.busy, timeout=WAIT)
    assert free == [True]
    assert page.instruments.currentIndex() == 0


def test_on_the_simulated_rig_nothing_is_played_and_the_page_can_be_left(
    window: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = window.page(RigPage)
    window.show_page(page)
    qtbot.waitUntil(lambda: page.outcome is not None, timeout=WAIT)
    played: list[str] = []
    for call in ("load", "arm", "start"):
        monkeypatch.setattr(SimulatedRig, call, lambda *_, call=call: played.append(call))
    page.instruments.setCurrentWidget(page.live)
    started(page.live, qtbot)
    for row in range(page.live.table.rowCount()):
        assert float(cells(page.live, row)[2].split()[0]) > 0.0
    status = window.run_page.runner.status
    assert status.state is HighVoltage.CONFIRMED
    window.show_page(window.run_page)
    assert not page.live.reading
    assert played == []


def test_on_a_card_only_inputs_are_made_and_a_run_follows(
    window: MainWindow, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch, plan_of: Callable
) -> None:
    calls: list[str] = []
    before = Interceptor.intercept_service

    def note(self, continuation, details):
        calls.append(details.method.rpartition("/")[2])
        return before(self, continuation, details)

    monkeypatch.setattr(Interceptor, "intercept_service", note)
    session = window.session
    rig_file = RigFile.model_validate({"film": {"name": "film 3"}})
    with served(rig_file, clock=PacedClock()) as card:
        session.set_rig_file(None, "", rig_file)
        session.set_address(f"daqmx:Dev1@127.0.0.1:{card.server.port}")
        page = window.page(RigPage)
        window.show_page(page)
        page.instruments.setCurrentWidget(page.live)
        started(page.live, qtbot)
        page.live.stop()
        page.live.wait()
        assert "CreateAIVoltageChan" in calls
        assert [name for name in calls if OUTPUT.search(name)] == []
        # the arming ends a reading, and the run finds the card free
        started(page.live, qtbot)
        window.run_page.film.setText("film 3")
        plan_of(SHORT)
        press(qtbot, window.run_page.arm_button)
        assert not page.live.reading
        press(qtbot, window.run_page.start_button)
        qtbot.waitUntil(lambda: not window.run_page.runner.running, timeout=WAIT)
        assert window.run_page.runner.status.output.confirmed
        assert "Finished" in window.run_page.result.text()
