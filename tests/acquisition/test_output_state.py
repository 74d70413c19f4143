"""What is known of the output after a run: measured, carried by result and errors, recorded."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import h5py
import pytest

from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.run import RunObserver, RunOptions, RunResult, open_rig, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.daqmx.guardian import TakeOver
from dearig.drivers.errors import RigError
from dearig.drivers.rig import Block
from dearig.errors import DearigError, InstrumentFault, NotSafe, SafetyStop
from dearig.output_state import Known, OutputState
from dearig.recording import open_recording
from dearig.sim_backend.rig import SimulatedRig
from tests.tools.command import LOBE

LOADED = parse_sequence(LOBE, "lobe", Path())


class Wrapped:
    """The simulated rig, as the driver of another distribution may be: without ``zero_reading``."""

    def __init__(self, faults: tuple[str, ...] = ()) -> None:
        rig = open_rig("sim", RigFile(), RunOptions(faults=faults))
        assert isinstance(rig, SimulatedRig)
        self.inner = rig
        for name in ("identify", "load", "arm", "start", "read", "stop", "make_safe", "close"):
            setattr(self, name, getattr(rig, name))

    state = property(lambda self: self.inner.state)
    waiting = property(lambda self: self.inner.waiting)

    # replaced in ``__init__``; a rig is known by its methods
    def _none(self) -> None: ...

    identify = load = arm = start = read = stop = make_safe = close = _none


class Unreachable(Wrapped):
    """A rig that cannot be made safe; its guardian goes on trying and ``reports`` in the end."""

    def __init__(self, reports: list[TakeOver | None]) -> None:
        super().__init__()
        self.taken_over: TakeOver | None = None
        self.guardian_tries = False
        self.polls = 0
        self._reports = reports
        self.make_safe = self._fail  # type: ignore[method-assign]

    def _fail(self) -> None:
        self.guardian_tries = self.taken_over is None
        raise RigError("the server does not answer")

    def await_guardian(self, within: float) -> TakeOver | None:  # noqa: ARG002
        self.polls += 1
        if self._reports:
            self.taken_over = self._reports.pop(0)
            self.guardian_tries = self.taken_over is None
        return self.taken_over


class Watcher(RunObserver):
    def __init__(self, on_block: Callable[[], None] | None = None) -> None:
        self.states: list[OutputState] = []
        self._on_block = on_block

    def block(self, block: Block) -> None:  # noqa: ARG002
        if self._on_block is not None:
            self._on_block()

    def output(self, state: OutputState) -> None:
        self.states.append(state)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Record on a rig; return the result or the error, and what an observer was told."""

    def played(
        rig: object = None, watcher: Watcher | None = None, **more
    ) -> tuple[RunResult | DearigError, list[OutputState]]:
        if rig is not None:
            monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
        watcher = watcher or Watcher()
        try:
            ended: RunResult | DearigError = record(
                LOADED, "sim", RigFile(), tmp_path / "run.h5", observer=watcher, **more
            )
        except DearigError as error:
            ended = error
        assert ended.output_state is not None
        return ended, watcher.states

    return played


def attributes(tmp_path: Path) -> dict[str, object]:
    with h5py.File(tmp_path / "run.h5") as file:
        return {
            k: v.decode() if isinstance(v, bytes) else v for k, v in file["entry"].attrs.items()
        }


def messages(tmp_path: Path) -> str:
    return "\n".join(f"{e.level}: {e.message}" for e in open_recording(tmp_path / "run.h5").events)


def test_a_finished_run_carries_the_reading_that_confirmed_zero_volts(
    run, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        ended, states = run()
    assert isinstance(ended, RunResult)
    state = ended.output_state
    assert states == [state]
    assert state.known is Known.CONFIRMED
    assert state.monitor is not None
    assert state.monitor != 0.0  # a reading, with its noise
    assert state.tolerance == 100.0  # V, of the limits
    read = f"{round(state.monitor * 1e-3, 2) + 0.0:.2f} kV, within 0.1 kV of 0"
    assert state.sentence == f"0 V confirmed by the monitor at {state.time} ({read})"
    noted = attributes(tmp_path)
    assert noted["output_state"] == "confirmed"
    assert noted["output_set_by"] == "run"
    assert noted["output_monitor_V"] == state.monitor
    assert str(noted["output_state_time"]).startswith("20")
    assert state.sentence in caplog.text


def test_an_interlock_carries_it_too_and_the_recording_has_an_event(run, tmp_path: Path) -> None:
    ended, _ = run(options=RunOptions(faults=("amplifier-trip@0.7",)))
    assert isinstance(ended, SafetyStop)
    assert ended.output_state.confirmed
    assert f"info: output: {ended.output_state.sentence}" in messages(tmp_path)


def test_without_a_reading_of_the_driver_the_last_samples_decide(run, tmp_path: Path) -> None:
    ended, _ = run(Wrapped())
    assert ended.output_state.known is Known.CONFIRMED  # they are those of the tail at 0 V
    (tmp_path / "run.h5").unlink()

    # an end without a ramp: the last sample was taken with the voltage up
    ended, _ = run(Wrapped(("amplifier-trip@0.7",)))
    assert isinstance(ended, SafetyStop)
    assert ended.output_state.known is Known.COMMANDED
    assert "not confirmed" in ended.output_state.sentence
    assert attributes(tmp_path)["output_state"] == "commanded"
    assert "warning: output: 0 V commanded" in messages(tmp_path)


def test_a_rig_that_cannot_be_made_safe_is_unknown(run, tmp_path: Path) -> None:
    ended, states = run(Unreachable([TakeOver("asked", 0.0, 20.0, "the server is gone")]))
    assert isinstance(ended, NotSafe)
    assert ended.output_state.known is Known.UNKNOWN
    assert "switch the amplifier off" in ended.output_state.sentence
    assert [state.known for state in states] == [Known.UNKNOWN] * 2
    # unknown since one moment, whatever tells it
    assert {state.at for state in states} == {ended.output_state.at}
    assert f"fault: output: {ended.output_state.sentence}" in messages(tmp_path)
    assert attributes(tmp_path)["output_state"] == "unknown"
    assert "COULD NOT BE TAKEN TO 0 V" in messages(tmp_path)


def test_a_guardian_that_succeeds_later_is_told_and_recorded(
    run, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    acted = TakeOver("the run could not bring the output to 0 V itself", 1e9, 8.0, monitor=1.5)
    ended, states = run(Unreachable([None, None, acted]))
    assert isinstance(ended, InstrumentFault)
    # it was unknown until the guardian reported
    assert [state.known for state in states[:2]] == [Known.UNKNOWN, Known.CONFIRMED]
    assert states[1] == OutputState(Known.CONFIRMED, 1e9 + 8.0, 1.5, True, 100.0)
    noted = attributes(tmp_path)
    assert (noted["output_state"], noted["output_set_by"]) == ("confirmed", "guardian")
    assert acted.sentence in messages(tmp_path)
    assert "0 V IS NOT CONFIRMED" in caplog.text
    assert acted.sentence in caplog.text


def test_a_fault_of_the_instrument_makes_the_output_unknown_at_once(run) -> None:
    rig = Wrapped()

    def fails() -> Block:
        raise RigError("the link is lost")

    rig.read = fails  # type: ignore[method-assign]
    ended, states = run(rig)
    assert isinstance(ended, InstrumentFault)
    # unknown while 0 V is being set, which may take seconds; then what was found
    assert [state.known for state in states] == [Known.UNKNOWN, Known.COMMANDED]


def test_the_operator_need_not_wait_for_the_guardian(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hours = itertools.count(0.0, 3600.0)  # another time at each look
    monkeypatch.setattr("dearig.acquisition.output.time", SimpleNamespace(time=hours.__next__))
    interrupts = Interrupts()
    rig = Unreachable([])
    wait = rig.await_guardian

    def impatient(within: float) -> TakeOver | None:
        interrupts.ask()
        return wait(within)

    rig.await_guardian = impatient  # type: ignore[method-assign]
    ended, states = run(rig, interrupts=interrupts)
    assert isinstance(ended, NotSafe)
    assert rig.polls == 2
    assert attributes(tmp_path)["output_state"] == "unknown"
    # unknown since one moment, wherever it is told
    assert {state.at for state in states} == {ended.output_state.at}
    assert f"fault: output: {ended.output_state.sentence}" in messages(tmp_path)
