"""A disk that stalls, fails or fills up under a run: what is kept, and what the run is told."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dearig.drivers.rig import Block, Event
from dearig.errors import DiskFault, InstrumentFault
from dearig.recording import open_recording
from dearig.recording.verify import verify
from dearig.recording.writing.recorder import HOLDS, LAST_BLOCKS, Recorder, _End, is_writing
from dearig.recording.writing.writer import RecordingWriter
from tests.tools.recordings import RATE, Clock, run_counts, writer

SIZE = 100  # samples of a block: a tenth of a second


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """The disk: it takes blocks only while the gate is open."""
    opened = threading.Event()
    append = RecordingWriter.append

    def stalled(recorder: RecordingWriter, block: Block, *rest: np.ndarray | None) -> None:
        opened.wait()
        append(recorder, block, *rest)

    monkeypatch.setattr(RecordingWriter, "append", stalled)
    yield opened
    opened.set()
    for thread in threading.enumerate():
        if thread.name == "recording":
            thread.join()


def blocks(seconds: float, start: int = 0) -> Iterator[Block]:
    counts = run_counts(round(seconds * RATE))
    for i in range(0, counts.shape[1], SIZE):
        events = (Event(start + i, "info", f"block {i // SIZE}"),) if i % 1000 == 0 else ()
        yield Block(start + i, counts[:, i : i + SIZE], events)


def test_a_stall_of_ten_seconds_loses_nothing(tmp_path: Path, gate: threading.Event) -> None:
    recorder = Recorder(writer(tmp_path / "run.h5", samples_expected=10_000))
    reused = np.empty((4, SIZE), dtype=np.int16)
    for block in blocks(10.0):
        reused[:] = block.counts
        recorder.append(Block(block.start, reused, block.events))
        recorder.event(block.start, "warning", "noted after its block")
        assert recorder.fault is None
    assert (recorder.samples, recorder.received) == (0, 10_000)
    gate.set()
    recorder.drain()
    recorder.close("finished")
    assert not is_writing()
    assert verify(tmp_path / "run.h5").sound
    run = open_recording(tmp_path / "run.h5")
    assert (run.samples, run.outcome, run.complete) == (10_000, "finished", True)
    expected = run.channels[0].scaling.physical(run_counts(10_000)[0])
    np.testing.assert_array_equal(run.voltage_command, expected)
    assert [e.message for e in run.events[:3]] == ["block 0", *["noted after its block"] * 2]


def test_a_longer_stall_is_a_fault_and_the_ramp_is_kept(
    tmp_path: Path, gate: threading.Event
) -> None:
    recorder = Recorder(writer(tmp_path / "run.h5"), ramp_s=0.5)
    for block in blocks(HOLDS + 5.0):
        recorder.append(block)
        # one block is out of the queue: the one that the disk does not take
        assert (recorder.fault is None) == (recorder.received <= HOLDS * RATE)
    with pytest.raises(DiskFault, match=rf"the disk of {tmp_path} is 12 s behind the run"):
        recorder.check()
    gate.set()
    recorder.close("ended early", "the disk stalled", "fault")
    run = open_recording(tmp_path / "run.h5")
    assert run.samples == recorder.samples == (HOLDS + 0.5 + LAST_BLOCKS) * RATE
    assert (run.events[-1].message, run.events[-1].sample) == ("the disk stalled", run.samples - 1)


def test_memory_is_bounded_whatever_the_disk_does(tmp_path: Path, gate: threading.Event) -> None:
    recorder = Recorder(writer(tmp_path / "run.h5"))
    for block in blocks(100.0):
        recorder.append(block)
    held = sum(item.counts.nbytes for item in recorder._queue if isinstance(item, Block))
    assert held == 2 * 4 * RATE * (HOLDS + LAST_BLOCKS)
    gate.set()
    recorder.close("finished")


def test_the_operator_stops_waiting(tmp_path: Path, gate: threading.Event) -> None:
    recorder = Recorder(writer(tmp_path / "run.h5"))
    for block in blocks(1.0):
        recorder.append(block)
    shown: list[tuple[str, float]] = []
    answers = iter([False, False, True])
    with pytest.raises(DiskFault, match="had not taken the last 1000 of 1000 samples"):
        recorder.drain(lambda: next(answers), lambda *at: shown.append(at))
    assert shown == [("writing", 0.0)] * 3
    with pytest.raises(DiskFault, match="stopped waiting"):
        recorder.close("ended early")
    assert is_writing()
    assert recorder.samples == 0
    gate.set()
    recorder._thread.join()
    assert open_recording(tmp_path / "run.h5").outcome == "ended early"


def test_an_overlay_model_that_is_late_is_not_called_a_disk(tmp_path: Path) -> None:
    begun, opened = threading.Event(), threading.Event()

    def model(block: Block) -> np.ndarray:
        begun.set()
        opened.wait()
        return np.zeros(block.counts.shape[1])

    made = writer(tmp_path / "run.h5")
    made._overlay = True
    recorder = Recorder(made, model=model)
    try:
        for block in blocks(1.0):
            recorder.append(block)
        begun.wait()
        assert recorder.left_text == (
            f"the overlay model is still computed for 1000 of 1000 samples, which are then written "
            f"to {tmp_path / 'run.h5'}"
        )
        with pytest.raises(
            DiskFault, match="overlay model had not been computed for the last 1000"
        ):
            recorder.drain(lambda: True)
    finally:
        opened.set()
    recorder._end = _End("ended early", "", "warning")
    recorder._thread.join()
    assert "overlay model" not in recorder.left_text


def test_what_is_written_and_not_flushed_does_not_count_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, stalled, opened = writer(tmp_path / "run.h5"), threading.Event(), threading.Event()
    made._now = clock = Clock()  # type: ignore[assignment]
    recorder = Recorder(made)
    recorder.append(Block(0, run_counts(100)))
    recorder.drain()
    flush = RecordingWriter._flush

    def stall(recorder: RecordingWriter) -> None:
        stalled.set()
        opened.wait()
        flush(recorder)

    monkeypatch.setattr(RecordingWriter, "_flush", stall)
    clock.moment += 1.0
    recorder.append(Block(100, run_counts(100)))
    stalled.wait()
    assert recorder.samples == 200
    with pytest.raises(DiskFault, match="had not taken the last 200 of 200 samples"):
        recorder.drain(lambda: True)
    assert recorder.samples == 0
    opened.set()
    recorder._thread.join(0.0)
    with pytest.raises(DiskFault):
        recorder.close("ended early")
    recorder._thread.join()


def test_missing_samples_are_a_fault(tmp_path: Path) -> None:
    recorder = Recorder(writer(tmp_path / "run.h5"))
    recorder.append(Block(0, run_counts(100)))
    with pytest.raises(InstrumentFault, match="sample 150, expected sample 100: 50 samples are"):
        recorder.append(Block(150, run_counts(100)))
    with pytest.raises(InstrumentFault, match="60 samples came twice"):
        recorder.append(Block(40, run_counts(100)))
    recorder.close("ended early")
    assert [(e.sample, e.level, e.message) for e in open_recording(recorder.path).events] == [
        (100, "fault", "50 samples are missing from here on; the run was ended"),
        (100, "fault", "60 samples came twice from here on; the run was ended"),
    ]


def test_a_rig_without_a_clock_waits_for_the_disk(tmp_path: Path) -> None:
    recorder = Recorder(writer(tmp_path / "run.h5"), waits=True)
    for block in blocks(HOLDS + 5.0):
        recorder.append(block)
    assert recorder.fault is None
    recorder.close("finished")
    assert open_recording(tmp_path / "run.h5").samples == (HOLDS + 5.0) * RATE


def test_it_does_not_wait_for_a_disk_that_stands_still(
    tmp_path: Path, gate: threading.Event
) -> None:
    clock = Clock()

    def hurried() -> bool:
        clock.moment += 5.0
        return False

    recorder = Recorder(writer(tmp_path / "run.h5"), waits=True, hurried=hurried, clock=clock)
    began = clock.moment
    for block in blocks(HOLDS):
        recorder.append(block)
    assert clock.moment == began
    recorder.append(Block(recorder.received, run_counts(100)))
    assert clock.moment == began + 15.0
    assert isinstance(recorder.fault, DiskFault)
    gate.set()
    recorder.close("ended early")


def test_the_disk_is_looked_at_every_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[int] = []

    def usage(_: object) -> SimpleNamespace:
        looks.append(len(looks))
        if len(looks) > 3:
            raise FileNotFoundError(2, "No such file or directory")
        return SimpleNamespace(free=7_000_000)

    clock = Clock()
    recorder = Recorder(writer(tmp_path / "run.h5"), clock=clock)
    monkeypatch.setattr(RecordingWriter, "_check_room", lambda _: None)
    monkeypatch.setattr(shutil, "disk_usage", usage)

    def after(seconds: float) -> int | None:
        clock.moment += seconds
        recorder.append(Block(recorder.received, run_counts(100)))
        recorder.drain()
        return recorder.free_bytes()

    assert [after(s) for s in (0.5, 0.25, 0.25, 0.5, 0.5)] == [
        None, None, 7_000_000, None, 7_000_000,
    ]  # fmt: skip
    after(1.0)
    assert recorder.fault is None
    after(1.0)
    with pytest.raises(DiskFault, match=r"disk of .* does not answer \(No such file"):
        recorder.check()
    recorder.close("ended early")
    assert open_recording(tmp_path / "run.h5").samples == 700


def test_without_a_sample_there_is_no_recording(tmp_path: Path) -> None:
    recorder = Recorder(writer(tmp_path / "run.h5"))
    recorder.event(0, "warning", "nothing came")
    recorder.close("no samples")
    recorder.close("no samples")
    assert not list(tmp_path.iterdir())
