"""Marks and notes that are set during a run, by whatever thread, without a window."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.marks import RunMarks
from dearig.acquisition.plan import plan
from dearig.acquisition.run import RunObserver, RunOptions, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.rig import Block, Event
from dearig.errors import InputError, Interrupted
from dearig.recording import open_recording
from dearig.recording.reading.marks import NOTE_BYTES, Mark, marks_in
from dearig.recording.reading.recording import RecordedEvent, Recording
from tests.tools.command import LOBE

LOADED = parse_sequence(LOBE, "lobe", Path())


class AtBlock(RunObserver):
    """Does something once the run has received ``number`` blocks, and hears the events."""

    def __init__(self, **does: Callable[[], object]) -> None:
        self._does = {int(name.removeprefix("block_")): what for name, what in does.items()}
        self._number = 0
        self.starts: list[int] = []
        self.heard: list[Event] = []

    def block(self, block: Block) -> None:
        self._number += 1
        self.starts.append(block.start)
        if self._number in self._does:
            self._does[self._number]()

    def event(self, event: Event) -> None:
        self.heard.append(event)


def recorded(tmp_path: Path, marks: RunMarks, **does: Callable[[], object]) -> Recording:
    observer = AtBlock(**does)
    result = record(
        LOADED, "sim", RigFile(), tmp_path / "run.h5", observer=observer, marks=marks
    )  # fmt: skip
    recording = open_recording(result.path)
    assert [e.message for e in recording.events] == [e.message for e in observer.heard]
    return recording


def test_a_mark_is_an_event_at_the_newest_sample_that_was_received(tmp_path: Path) -> None:
    marks, reached = RunMarks(), []
    observer = AtBlock(
        block_3=lambda: (reached.append(observer.starts[-1] - 1), marks.mark()),
        block_5=lambda: marks.mark("film  creaks\n"),
    )
    result = record(
        LOADED, "sim", RigFile(), tmp_path / "run.h5", observer=observer, marks=marks
    )  # fmt: skip
    recording = open_recording(result.path)
    first, second = marks_in(recording.events)
    assert first == Mark(1, reached[0], reached[0] / result.rate_Hz)
    assert (second.note, second.words) == ("film creaks", "film creaks")
    assert second.sample > first.sample
    assert [e.level for e in recording.events] == ["info", "info"]


def test_a_note_that_comes_later_is_recorded_at_its_mark(tmp_path: Path) -> None:
    marks = RunMarks()
    recording = recorded(
        tmp_path, marks, block_2=marks.mark, block_6=lambda: marks.note(1, "a spark, left edge")
    )
    assert [e.message for e in recording.events] == ["mark 1", "mark 1: a spark, left edge"]
    assert recording.events[0].sample == recording.events[1].sample
    assert [m.note for m in marks_in(recording.events)] == ["a spark, left edge"]


def test_a_note_that_is_still_typed_at_the_end_of_the_run_is_kept(tmp_path: Path) -> None:
    marks = RunMarks()
    recording = recorded(
        tmp_path, marks,
        block_2=marks.mark,
        block_3=lambda: (marks.draft(1, "a sp"), marks.draft(1, "a spark")),
        block_4=marks.mark,
        block_5=lambda: (marks.draft(2, "nothing"), marks.note(2, "")),
    )  # fmt: skip
    assert [(m.number, m.note) for m in marks_in(recording.events)] == [(1, "a spark"), (2, "")]


def test_without_a_run_nothing_is_marked(tmp_path: Path) -> None:
    marks = RunMarks()
    assert marks.mark() is None
    assert not marks.remark("before the run")
    recording = recorded(tmp_path, marks, block_2=marks.mark, block_3=lambda: marks.remark("seen"))
    assert [e.message for e in recording.events] == ["mark 1", "seen"]
    assert not marks.open
    assert marks.mark() is None
    assert not marks.note(1, "too late")
    assert not marks.draft(1, "too late")


def test_marks_of_a_run_that_is_stopped_are_kept(tmp_path: Path) -> None:
    marks, interrupts = RunMarks(), Interrupts()
    out = tmp_path / "run.h5"
    with pytest.raises(Interrupted):
        record(
            LOADED, "sim", RigFile(), out, marks=marks, interrupts=interrupts,
            observer=AtBlock(block_4=lambda: (interrupts.ask(), marks.mark("I stop it"))),
        )  # fmt: skip
    assert [m.note for m in marks_in(open_recording(out).events)] == ["I stop it"]


def test_marks_of_several_threads_are_all_there(tmp_path: Path) -> None:
    marks = RunMarks()

    def many() -> None:
        threads = [
            threading.Thread(target=lambda: [marks.mark() for _ in range(5)]) for _ in "1234"
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    recording = recorded(tmp_path, marks, block_3=many)
    assert [m.number for m in marks_in(recording.events)] == list(range(1, 21))


def test_a_note_that_does_not_fit_is_refused_whole(tmp_path: Path) -> None:
    marks = RunMarks()
    marks.reach(10)
    number = marks.mark("ü" * (NOTE_BYTES // 2))
    assert number == 1
    for refused in (marks.mark, marks.remark, lambda text: marks.note(1, text)):
        with pytest.raises(ValueError, match=f"at most {NOTE_BYTES} bytes"):
            refused("ü" * NOTE_BYTES)
    with pytest.raises(ValueError, match="mark 2 was not set"):
        marks.note(2, "which?")


def test_events_that_only_look_like_marks_are_none() -> None:
    events = (
        RecordedEvent(1, 0.1, "fault", "mark 1"),
        RecordedEvent(2, 0.2, "info", "marked 1"),
        RecordedEvent(3, 0.3, "info", "mark 12: two: colons"),
    )
    assert marks_in(events) == (Mark(12, 3, 0.3, "two: colons"),)


def test_only_the_waveform_that_was_armed_is_played(tmp_path: Path) -> None:
    armed = plan(LOADED, RigFile()).admitted().digest
    other = parse_sequence(LOBE.replace("3.0", "3.001"), "lobe", Path())
    assert plan(other, RigFile()).admitted().digest != armed
    slower = RigFile.model_validate({"card": {"sample_rate_Hz": 500.0}})
    assert plan(LOADED, slower).admitted().digest != armed
    options = RunOptions(waveform_digest=armed)
    out = tmp_path / "run.h5"
    with pytest.raises(InputError, match="not the one that was armed"):
        record(other, "sim", RigFile(), out, options)
    assert not out.exists()
    record(LOADED, "sim", RigFile(), out, options)
    assert open_recording(out).outcome == "finished"
