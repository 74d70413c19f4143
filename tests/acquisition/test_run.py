"""A run that does not end well: 0 V first, then the file, then a sentence and the right code.

One piece: each way to end a run, with the same few checks of what is left.
"""

from __future__ import annotations

import errno
import io
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.plan import Plan, plan
from dearig.acquisition.run import RunObserver, RunOptions, open_rig, record
from dearig.cli.last_words import LastingStream
from dearig.config.modelfile import save_model
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers import gate
from dearig.drivers.daqmx.guardian import TakeOver
from dearig.drivers.errors import RigError
from dearig.drivers.gate import GatedWaveform
from dearig.drivers.rig import Block, Event, RigIdentity, RigState
from dearig.drivers.settings import CardSettings
from dearig.errors import (
    DearigError,
    DiskFault,
    InputError,
    InstrumentFault,
    Interrupted,
    SafetyStop,
)
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.excitation import Sampled
from dearig.output_state import OutputState
from dearig.recording import open_recording
from dearig.recording.writing.recorder import Recorder, is_writing
from dearig.recording.writing.writer import RecordingWriter
from dearig.sim_backend.rig import SimulatedRig
from tests.tools.command import LOBE, dearig, names, write

LOADED = parse_sequence(LOBE, "lobe", Path())
RIG_FILE = RigFile()


class Troubled:
    """The simulated rig with something that happens at one of its calls; keeps a diary."""

    def __init__(
        self, call: str, trouble: Callable[[], None], block: int = 7, faults: tuple[str, ...] = ()
    ) -> None:
        self.diary: list[str] = []
        self._call = call
        self._trouble = trouble
        self._block = block
        self._blocks = 0
        rig = open_rig("sim", RIG_FILE, RunOptions(faults=faults))
        assert isinstance(rig, SimulatedRig)
        self.inner = rig

    @property
    def state(self) -> RigState:
        return self.inner.state

    @property
    def waiting(self) -> float:
        return self.inner.waiting

    def identify(self) -> RigIdentity:
        return self.inner.identify()

    def _note(self, call: str) -> None:
        self.diary.append(call)
        if call == self._call and (call != "read" or self._blocks == self._block):
            self._trouble()

    def load(self, waveform: GatedWaveform) -> float:
        self._note("load")
        return self.inner.load(waveform)

    def arm(self) -> None:
        self._note("arm")
        self.inner.arm()

    def start(self) -> None:
        self._note("start")
        self.inner.start()

    def read(self) -> Block | None:
        self._blocks += 1
        self._note("read")
        return self.inner.read()

    def stop(self) -> None:
        self.diary.append(f"stop at {self.inner.output:.0f} V")
        self.inner.stop()

    def make_safe(self) -> None:
        self._note("make safe")
        self.inner.make_safe()

    def close(self) -> None:
        self.diary.append("close")
        self.inner.close()


def fault() -> None:
    raise RigError("the card gave no sample for 10 s (-200284): see that it is connected")


def key() -> None:
    signal.raise_signal(signal.SIGINT)


def keys(times: int) -> None:
    for _ in range(times):
        key()


@pytest.fixture(autouse=True)
def _ctrl_c_is_heard() -> Iterator[None]:
    """As in a terminal, whatever whoever started the tests does with the signal."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Run ``dearig record`` on a troubled rig."""

    def run(rig: Troubled):
        monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
        sequence = write(tmp_path / "s.toml", LOBE)
        return dearig("record", sequence, "--out", tmp_path / "run.h5")

    return run


@pytest.fixture
def in_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rig is read when the disk has taken the block before, as on a clock in real time."""
    append = Recorder.append

    def written(recorder: Recorder, block: Block) -> None:
        append(recorder, block)
        with recorder._changed:
            recorder._changed.wait_for(lambda: not recorder._queue)

    monkeypatch.setattr(Recorder, "append", written)


def closed_at_zero(rig: Troubled, last: str = "close") -> bool:
    return rig.state is RigState.CLOSED and rig.inner.output == 0.0 and rig.diary[-1] == last


def test_the_first_ctrl_c_ramps_down(command, tmp_path: Path) -> None:
    rig = Troubled("read", key)
    answer = command(rig)
    assert answer.code == 130
    assert "interrupted: the voltage was ramped down to 0 V, and what was recorded" in answer.err
    assert any(line.startswith("stop at 2") for line in rig.diary)
    assert closed_at_zero(rig)
    run = open_recording(tmp_path / "run.h5")
    assert run.complete
    assert run.outcome == "interrupted by the operator; ramped down to 0 V"
    assert any("interrupted by the operator: ramping down" in e.message for e in run.events)
    assert run.voltage_command is not None
    assert run.voltage_command[-1] == pytest.approx(0.0, abs=0.2)
    # not a sample is lost or torn around the moment: what was planned goes on until the ramp
    planned = plan(LOADED, RIG_FILE).admitted().window(0, run.samples)
    same = int(np.argmax(np.abs(run.voltage_command - planned) > 1.0))
    assert same >= 700
    assert np.abs(np.diff(run.voltage_command)).max() < 20.0
    assert f"({run.samples} samples)" in answer.err


@pytest.fixture
def hang_up_ends() -> Iterator[None]:
    """Let SIGHUP end programs, as at a terminal, also where the tests themselves ignore it."""
    if not hasattr(signal, "SIGHUP"):
        yield
        return
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="no such signal there")
@pytest.mark.usefixtures("hang_up_ends")
def test_a_closed_terminal_ramps_down_and_says_so_in_the_recording(command, tmp_path: Path) -> None:
    def hang_up() -> None:
        # the shell sends it, and the system too
        for _ in range(3):
            signal.raise_signal(signal.SIGHUP)

    rig = Troubled("read", hang_up)
    answer = command(rig)
    assert answer.code == 130
    assert "interrupted because the terminal was closed: the voltage was ramped" in answer.err
    assert any(line.startswith("stop at 2") for line in rig.diary)
    assert closed_at_zero(rig)
    run = open_recording(tmp_path / "run.h5")
    assert run.complete
    assert run.outcome == "interrupted because the terminal was closed; ramped down to 0 V"
    assert any("because the terminal was closed: ramping down" in e.message for e in run.events)


@pytest.mark.usefixtures("hang_up_ends")
def test_a_standard_error_without_a_reader_counts_as_a_closed_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Broken(io.StringIO):
        def write(self, text: str) -> int:  # noqa: ARG002
            raise BrokenPipeError(32, "Broken pipe")

    stream = LastingStream(Broken(), ends_run=True)
    rig = Troubled("read", lambda: print("a warning", file=stream))  # type: ignore[call-overload]
    monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
    with pytest.raises(Interrupted, match="because the terminal was closed: the voltage was ramp"):
        record(LOADED, "sim", RIG_FILE, tmp_path / "run.h5")
    print("no one sees it, and it is not an error", file=stream)  # type: ignore[call-overload]
    assert closed_at_zero(rig)
    # under nohup a run goes on
    monkeypatch.setattr("dearig.acquisition.interrupts.signal.getsignal", lambda _: signal.SIG_IGN)
    stream = LastingStream(Broken(), ends_run=True)
    rig = Troubled("read", lambda: print("a warning", file=stream))  # type: ignore[call-overload]
    assert record(LOADED, "sim", RIG_FILE, tmp_path / "on.h5").outcome == "finished"


def test_a_driver_that_runs_at_another_rate_plays_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Faster(Troubled):
        def load(self, waveform: GatedWaveform) -> float:
            return 1.6 * super().load(waveform)

    rig = Faster("never", fault)
    monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
    with pytest.raises(InputError, match="for which the limits were judged"):
        record(LOADED, "sim", RIG_FILE, tmp_path / "run.h5")
    assert "arm" not in rig.diary
    assert closed_at_zero(rig)


def test_the_second_ctrl_c_is_0_volts_at_once(command, tmp_path: Path) -> None:
    rig = Troubled("read", lambda: keys(2))
    answer = command(rig)
    assert answer.code == 130
    assert "interrupted: the output was taken to 0 V at once" in answer.err
    assert rig.diary[-3:] == ["read", "make safe", "close"]
    assert closed_at_zero(rig)
    run = open_recording(tmp_path / "run.h5")
    assert (run.complete, run.samples) == (True, 600)
    assert run.events[-1].message == "interrupted by the operator: 0 V at once"


def test_a_third_ctrl_c_does_not_keep_the_rig_from_safety(command, tmp_path: Path) -> None:
    rig = Troubled("make safe", lambda: keys(3))
    answer = command(rig)
    assert answer.code == 130
    assert closed_at_zero(rig)
    assert open_recording(tmp_path / "run.h5").samples == 1501


def test_a_keyboard_interrupt_of_another_origin(command, tmp_path: Path) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    rig = Troubled("read", interrupt)
    answer = command(rig)
    assert answer.code == 130
    assert closed_at_zero(rig)
    run = open_recording(tmp_path / "run.h5")
    assert run.complete
    assert run.outcome == "interrupted by the operator"
    assert run.events


@pytest.mark.parametrize("call", ["load", "arm"])
def test_ctrl_c_before_the_start_starts_nothing(command, tmp_path: Path, call: str) -> None:
    rig = Troubled(call, key)
    answer = command(rig)
    assert answer.code == 130
    assert "nothing was recorded" in answer.err
    assert "start" not in rig.diary
    assert closed_at_zero(rig)
    assert names(tmp_path) == {"s.toml"}


def test_an_instrument_fault(command, tmp_path: Path) -> None:
    rig = Troubled("read", fault)
    answer = command(rig)
    assert answer.code == 4
    assert "0 V commanded at" in answer.err.splitlines()[0]  # this rig reads no monitor afterwards
    assert "dearig: the card gave no sample for 10 s (-200284)" in answer.err
    assert "the rig was made safe, and what was recorded is in" in answer.err
    assert closed_at_zero(rig)
    run = open_recording(tmp_path / "run.h5")
    assert (run.complete, run.samples) == (True, 600)
    assert run.outcome.startswith("instrument fault: the card gave no sample")
    assert (run.events[-1].level, run.events[-1].sample) == ("fault", 599)
    assert names(tmp_path) == {"s.toml", "run.h5"}


@pytest.mark.parametrize("call", ["load", "arm", "start"])
def test_a_fault_before_the_first_sample_leaves_no_file(command, tmp_path: Path, call: str) -> None:
    rig = Troubled(call, fault)
    answer = command(rig)
    assert answer.code == 4
    assert closed_at_zero(rig)
    assert names(tmp_path) == {"s.toml"}


def test_a_fault_while_ramping_down(command, tmp_path: Path) -> None:
    rig = Troubled("read", key)
    stop = rig.inner.stop

    def stuck() -> None:
        stop()
        fault()

    rig.inner.stop = stuck  # type: ignore[method-assign]
    answer = command(rig)
    assert answer.code == 4
    assert closed_at_zero(rig)
    assert open_recording(tmp_path / "run.h5").samples == 700


def test_a_rig_that_cannot_be_made_safe_is_shouted_about(command, tmp_path: Path) -> None:
    rig = Troubled("make safe", fault)
    answer = command(rig)
    assert answer.code == 4
    assert "THE RIG COULD NOT BE MADE SAFE" in answer.err
    assert "switch the amplifier's high voltage off by hand" in answer.err
    assert "was made safe" not in answer.err
    assert open_recording(tmp_path / "run.h5").samples == 1501


def test_a_rig_that_can_neither_be_made_safe_nor_closed(command, tmp_path: Path) -> None:
    rig = Troubled("make safe", fault)
    rig.close = fault  # type: ignore[method-assign]
    answer = command(rig)
    assert answer.code == 4
    last = answer.err.splitlines()[-1]
    assert last.startswith("dearig: THE RIG COULD NOT BE MADE SAFE")
    assert "0 V IS NOT CONFIRMED, switch the amplifier" in last
    assert f"what was recorded is in {tmp_path / 'run.h5'} (1501 samples)" in last


def test_a_rig_that_cannot_be_closed_is_not_confirmed_either(command) -> None:
    rig = Troubled("read", key)
    rig.close = fault  # type: ignore[method-assign]
    answer = command(rig)
    assert answer.code == 4
    last = answer.err.splitlines()[-1]
    assert last.startswith("dearig: THE RIG COULD NOT BE CLOSED")
    assert "0 V IS NOT CONFIRMED" in last
    assert "interrupted: the voltage was ramped down to 0 V" in last


def test_what_the_guardian_did_is_in_the_recording(command, tmp_path: Path) -> None:
    rig = Troubled("read", fault)
    acted = TakeOver("the run is frozen", 0.0, 0.1, monitor=0.4)
    rig.taken_over = acted  # type: ignore[attr-defined]
    assert command(rig).code == 4
    messages = [e.message for e in open_recording(tmp_path / "run.h5").events]
    assert acted.sentence in messages


@pytest.mark.parametrize(
    ("what", "said", "done", "diary"),
    [
        ("amplifier-trip@0.7", "interlock breakdown: ", "the output was taken at once to 0 V",
         ["read", "make safe", "close"]),
        ("sensor-out-of-range@0.7", "interlock laser: ", "the voltage was ramped down to 0 V",
         ["read", "read", "make safe", "close"]),
    ],
)  # fmt: skip
def test_an_interlock_ends_the_run_at_zero_volts(
    command, tmp_path: Path, what: str, said: str, done: str, diary: list[str]
) -> None:
    rig = Troubled("", lambda: None, faults=(what,))
    answer = command(rig)
    assert answer.code == 3
    assert done in answer.err
    assert "what was recorded is in" in answer.err
    assert closed_at_zero(rig)
    assert rig.diary[-len(diary) :] == diary
    run = open_recording(tmp_path / "run.h5")
    assert run.complete
    assert run.outcome.startswith("stopped by an interlock: ")
    assert any(e.level == "fault" and e.message.startswith(said) for e in run.events)
    if "ramped" in done:
        assert run.voltage_command is not None
        assert run.voltage_command[-1] == pytest.approx(0.0, abs=0.2)


@pytest.mark.usefixtures("in_step")
def test_a_disk_that_gets_full_ends_the_run_before_it_is(
    command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ticks = iter(np.arange(0.0, 100.0, 0.15))
    monkeypatch.setattr(
        "dearig.recording.writing.writer.shutil.disk_usage",
        lambda _: SimpleNamespace(free=80_000_000),
    )
    rig = Troubled("", lambda: None)
    monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
    with pytest.raises(SafetyStop, match=r"free.*ramped down to 0 V"):
        record(LOADED, "sim", RIG_FILE, tmp_path / "run.h5", clock=lambda: next(ticks))
    assert closed_at_zero(rig)
    assert any(line.startswith("stop at") for line in rig.diary)
    assert open_recording(tmp_path / "run.h5").samples > 400


def test_an_observer_receives_every_sample_and_event(tmp_path: Path) -> None:
    class Diary(RunObserver):
        def __init__(self) -> None:
            self.samples = 0
            self.events: list[str] = []
            self.planned: Plan | None = None

        def started(self, planned: Plan, *_: object) -> None:
            self.planned = planned

        def block(self, block: Block) -> None:
            assert block.start == self.samples
            self.samples += block.counts.shape[1]

        def event(self, event: Event) -> None:
            self.events.append(f"{event.level}: {event.message}")

    diary, interrupts = Diary(), Interrupts()
    interrupts.ask()
    with pytest.raises(Interrupted):
        record(LOADED, "sim", RIG_FILE, tmp_path / "a.h5", interrupts=interrupts)
    result = record(
        LOADED, "sim:3", RIG_FILE, tmp_path / "b.h5",
        RunOptions(faults=["late-reply@0.2+0.1"]), observer=diary,
    )  # fmt: skip
    assert diary.samples == result.samples
    assert tuple(diary.events) == result.events
    assert diary.planned is not None
    assert diary.planned.samples == result.samples


def test_an_overlay_model_runs_in_step_and_is_kept(tmp_path: Path) -> None:
    model = Actuator(RIG_FILE.as_film(), RIG_FILE.as_load(), TABLE_3)
    save_model(tmp_path / "m.toml", "overlay", model, {})
    answer = dearig(
        "record", write(tmp_path / "s.toml", LOBE), "--out", tmp_path / "run.h5",
        "--overlay", tmp_path / "m.toml", "--fsync",
    )  # fmt: skip
    assert answer.code == 0
    run = open_recording(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        modelled = file["entry/data/displacement_model"][:]
        kept = file["entry/model"][()].decode()
    assert kept == (tmp_path / "m.toml").read_text(encoding="utf-8")
    # the simulated film is the model: what is left is the laser's noise
    assert run.displacement is not None
    residual = run.displacement - modelled
    assert 0.5e-6 < residual.std() < 1.5e-6
    assert np.ptp(modelled) > 1e-4


def test_an_interrupted_run_keeps_what_the_model_gave_until_then(tmp_path: Path) -> None:
    actuator = Actuator(RIG_FILE.as_film(), RIG_FILE.as_load(), TABLE_3)
    overlay = OverlayModel("x", actuator, toml="name = 'x'")
    interrupts = Interrupts()

    class Hasty(RunObserver):
        def block(self, block: Block) -> None:
            if block.start > 500:
                interrupts.ask()

    with pytest.raises(Interrupted):
        record(
            LOADED, "sim", RIG_FILE, tmp_path / "run.h5", overlay=overlay,
            interrupts=interrupts, observer=Hasty(),
        )  # fmt: skip
    run = open_recording(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["entry/data/displacement_model"].shape == (run.samples,)


def full_disk(*_: object) -> None:
    raise DiskFault("run.h5 cannot be written: No space left on device; see that it has room")


@pytest.mark.usefixtures("in_step")
def test_a_full_disk_does_not_keep_the_voltage_up(
    command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Troubled("", lambda: None)
    append = RecordingWriter.append
    close = RecordingWriter.close

    def failing(self: RecordingWriter, block: Block, modelled: None) -> None:
        if block.start == 600:
            full_disk()
        append(self, block, modelled)

    def noted(self: RecordingWriter, outcome: str, state: OutputState | None = None) -> None:
        rig.diary.append(f"file closed with the rig {rig.state.value}")
        close(self, outcome, state)

    monkeypatch.setattr(RecordingWriter, "append", failing)
    monkeypatch.setattr(RecordingWriter, "close", noted)
    answer = command(rig)
    assert answer.code == 4
    assert "No space left on device" in answer.err
    assert "the rig was made safe, and what was recorded is in" in answer.err
    assert rig.diary[-3:] == ["make safe", "file closed with the rig safe", "close"]
    # the instruments are well: down in a ramp, not in a jolt
    assert any(line.startswith("stop at") for line in rig.diary)
    assert closed_at_zero(rig)
    run = open_recording(tmp_path / "run.h5")
    assert (run.complete, run.samples) == (True, 600)


class Stalled:
    """A disk that takes nothing until it is opened, under a rig that does not wait for it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, rig: Troubled) -> None:
        self.rig = rig
        self.open = threading.Event()
        append = RecordingWriter.append

        def stalled(writer: RecordingWriter, block: Block, modelled: None) -> None:
            self.open.wait()
            append(writer, block, modelled)

        monkeypatch.setattr(RecordingWriter, "append", stalled)
        monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
        # the clock of a paced rig does not wait
        self.options = RunOptions(paced=True)


LONG = """\
name = "long hold"
lead_in_s = 0.4
tail_s = 0.1
[[segment]]
kind = "ramp"
to_kV = 2.0
duration_s = 0.5
[[segment]]
kind = "hold"
voltage_kV = 2.0
duration_s = 14.0
[[segment]]
kind = "ramp"
to_kV = 0.0
duration_s = 0.5
"""


def test_a_stalled_disk_does_not_delay_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Stalled(monkeypatch, rig := Troubled("make safe", lambda: disk.open.set()))
    result = record(LOADED, "sim", RIG_FILE, tmp_path / "run.h5", disk.options)
    assert closed_at_zero(rig)
    assert not any(line.startswith("stop at") for line in rig.diary)
    run = open_recording(tmp_path / "run.h5")
    assert (run.samples, run.outcome) == (result.samples, "finished") == (1501, "finished")


def test_a_disk_that_stalls_for_too_long_ends_the_run_by_a_ramp(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Stalled(monkeypatch, rig := Troubled("make safe", lambda: disk.open.set()))
    loaded = parse_sequence(LONG, "hold", Path())
    with pytest.raises(DiskFault, match=rf"disk of {tmp_path} is 12 s behind.*was made safe"):
        record(loaded, "sim", RIG_FILE, tmp_path / "run.h5", disk.options)
    assert closed_at_zero(rig)
    assert "stop at 2000 V" in rig.diary
    run = open_recording(tmp_path / "run.h5")
    assert run.complete
    assert run.outcome.startswith(f"ended early: the disk of {tmp_path} is 12 s behind the run")
    assert any(e.message.endswith("ramping down to 0 V") for e in run.events)
    # the ramp is recorded, and no sample is missing before it
    assert run.voltage_command is not None
    assert run.voltage_command[-1] == pytest.approx(0.0, abs=0.2)
    assert np.abs(np.diff(run.voltage_command)).max() < 20.0


def test_ctrl_c_twice_stops_waiting_for_a_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = Stalled(monkeypatch, rig := Troubled("", lambda: None))

    def pressing(stage: str, fraction: float) -> None:
        if stage == "writing":
            assert rig.inner.output == fraction == 0.0
            assert rig.diary[-1] == "make safe"
            key()

    with pytest.raises(
        DiskFault, match=r"not taken the last 1501 of 1501 .* made safe, and none of"
    ):
        record(LOADED, "sim", RIG_FILE, tmp_path / "run.h5", disk.options, progress=pressing)
    assert closed_at_zero(rig)
    assert is_writing()
    disk.open.set()
    next(thread for thread in threading.enumerate() if thread.name == "recording").join()
    assert open_recording(tmp_path / "run.h5").samples == 1501


@pytest.mark.skipif(sys.platform == "win32", reason="an open file cannot be deleted there")
@pytest.mark.usefixtures("in_step")
@pytest.mark.parametrize("goes_on", [False, True])
def test_a_run_whose_file_is_deleted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, goes_on: bool
) -> None:
    path = tmp_path / "run.h5"
    rig = Troubled("read", path.unlink)
    monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
    ticks = iter(np.arange(0.0, 100.0, 0.3))
    mode = {"recording": {"lost_file": "new_file" if goes_on else "ramp"}}
    said = f"{path} was deleted by another program during the run"
    run = lambda: record(  # noqa: E731
        LOADED, "sim", RigFile.model_validate(mode), path, clock=lambda: next(ticks)
    )
    if goes_on:
        result = run()
        assert result.path == tmp_path / "run-continued.h5"
        assert result.samples == 1501
        assert any(said in event for event in result.events)
        parts = [open_recording(tmp_path / f"run-{n}.h5") for n in ("saved", "continued")]
        assert sum(part.samples for part in parts) == 1501
    else:
        with pytest.raises(DiskFault, match=f"{said}; the rig was made safe, and what was") as end:
            run()
        saved = open_recording(tmp_path / "run-saved.h5")
        assert f"is in {saved.path} ({saved.samples} samples)" in str(end.value)
        assert saved.voltage_command is not None
        assert saved.voltage_command[-1] == pytest.approx(0.0, abs=0.2)
        assert any(line.startswith("stop at") for line in rig.diary)
    assert closed_at_zero(rig)
    assert not path.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="an open file cannot be deleted there")
@pytest.mark.usefixtures("in_step")
def test_a_run_whose_file_is_deleted_and_cannot_be_saved_is_not_said_to_be_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    path = tmp_path / "run.h5"
    rig = Troubled("read", path.unlink)
    monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
    monkeypatch.setattr("dearig.recording.writing.writer.rescued", refused)
    ticks = iter(np.arange(0.0, 100.0, 0.3))
    with pytest.raises(DiskFault) as end:
        record(LOADED, "sim", RigFile.model_validate({}), path, clock=lambda: next(ticks))
    assert str(end.value) == (
        f"{path} was deleted by another program during the run; the rig was made safe, and no "
        f"copy could be saved (Permission denied): what was recorded is lost"
    )
    assert closed_at_zero(rig)


def test_a_disk_that_is_full_to_the_end_keeps_the_counts(
    command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_room(*_: object, **__: object) -> None:
        raise InputError("run.h5 cannot be written: No space left on device")

    monkeypatch.setattr("dearig.recording.writing.writer.finish", no_room)
    rig = Troubled("read", fault)
    answer = command(rig)
    # what ended the run is said first, and the disk after it
    assert answer.code == 4
    assert answer.err.index("no sample for 10 s") < answer.err.index("No space left")
    assert closed_at_zero(rig)
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["entry/data/displacement_counts"].shape == (600,)
    assert open_recording(tmp_path / "run.h5").samples == 600


def test_a_fault_of_the_program_itself_ends_at_0_volts_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Troubled("read", lambda: {}["no one foresaw this"])
    monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
    with pytest.raises(KeyError):
        record(LOADED, "sim", RIG_FILE, tmp_path / "run.h5")
    assert closed_at_zero(rig)
    assert any(line.startswith("stop at") for line in rig.diary)
    assert open_recording(tmp_path / "run.h5").outcome == "ended early by a fault of the program"


def test_a_segment_that_changes_during_a_run_ends_it_at_0_volts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # pieces so short that the waveform is computed again while it is played
    monkeypatch.setattr(gate, "_PIECE", 64)
    monkeypatch.setattr(gate, "_KEPT", 2)
    write(tmp_path / "w.csv", "time_s,voltage_kV\n0,0\n1,5\n2,0\n")
    loaded = parse_sequence('name = "x"\n[[segment]]\nkind = "csv"\nfile = "w.csv"', "x", tmp_path)
    points = loaded.sequence.segments[0]
    assert isinstance(points, Sampled)

    class Meddler(RunObserver):
        def block(self, block: Block) -> None:
            if block.start > 2500:
                points.voltages[1] = 5001.0

    rig = Troubled("never", key)
    monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_, **__: rig)
    with pytest.raises(InstrumentFault, match="not those that passed the gate"):
        record(loaded, "sim", RIG_FILE, tmp_path / "run.h5", observer=Meddler())
    assert closed_at_zero(rig)
    run = open_recording(tmp_path / "run.h5")
    assert "not those that passed the gate" in run.outcome
    assert run.voltage_command is not None
    points.voltages[1] = 5000.0
    np.testing.assert_allclose(
        run.voltage_command, loaded.sample(1000.0)[1][: run.samples], atol=0.2
    )


def test_errors_carry_the_codes_of_the_contract() -> None:
    codes = {kind: kind.exit_code for kind in (InputError, InstrumentFault, DiskFault, Interrupted)}
    assert list(codes.values()) == [2, 4, 4, 130]
    assert all(issubclass(kind, DearigError) for kind in codes)


def test_the_output_is_looked_at_before_the_rig_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def opened(*_: object, **__: object) -> None:
        raise AssertionError("nothing may be touched")

    monkeypatch.setattr("dearig.acquisition.run.open_rig", opened)
    write(tmp_path / "run.h5", "a treasure")
    with pytest.raises(InputError, match="exists already"):
        record(LOADED, "sim", RIG_FILE, tmp_path / "run.h5")
    assert (tmp_path / "run.h5").read_text(encoding="utf-8") == "a treasure"


def test_the_gate_judges_the_stretched_film() -> None:
    # 8.3 kV on 1 mm is 8.3 MV/m; the film is a fifth thinner under its load, and more when pulled
    rig = RigFile.model_validate({"limits": {"true_field_max_MV_per_m": 9.0}})
    loaded = parse_sequence(LOBE.replace("3.0", "8.3"), "high lobe", Path())
    with pytest.raises(InputError, match=r"true field reaches 1[01]\.\d+ MV/m at .*9 MV/m"):
        plan(loaded, rig).admitted()
    assert plan(loaded, RIG_FILE).admitted().window().max() == pytest.approx(8300.0)


def test_a_rig_that_cannot_hang_is_refused(tmp_path: Path) -> None:
    # a load that Table 3's network carries only at a stretch that no gate lets pass
    rig = RigFile.model_validate(
        {"film": {"thickness_mm": 0.0001}, "card": {"sample_rate_Hz": 200.0}}
    )
    with pytest.raises(InputError, match="is refused"):
        record(LOADED, "sim:3", rig, tmp_path / "run.h5")
    assert names(tmp_path) == set()


def test_a_run_knows_its_rate() -> None:
    rig = RigFile(card=CardSettings(sample_rate_Hz=250.0))
    waveform = plan(LOADED, rig).admitted()
    assert (waveform.rate, waveform.samples) == (250.0, 376)
