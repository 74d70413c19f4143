"""What a watcher sees of a run that goes on, and that it changes nothing."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from dearig.batch.watching import RecordingWatch, SourceWatch
from dearig.cli.watch import _look
from dearig.drivers.rig import Block, Event
from dearig.report.pages.watch_state import watch_json
from tests.tools.command import dearig, done, refused
from tests.tools.played import Bench, Killed
from tests.tools.recordings import Clock, run_counts, writer


def test_a_watcher_sees_what_was_flushed_and_the_end(tmp_path: Path) -> None:
    path, counts = tmp_path / "run.h5", run_counts(3000)
    recorder = writer(path)
    watch = RecordingWatch(path)
    recorder.append(Block(0, counts[:, :1500], (Event(100, "warning", "near"),)))
    recorder._flush_all(1.8e9)
    before = path.read_bytes()
    state = watch.look()
    assert path.read_bytes() == before
    assert (state.samples, state.ended) == (1500, False)
    assert state.time == pytest.approx(1.499)
    command = counts[0, :1500] * 10.0 / 32768 * 1000.0
    assert state.now["voltage_command"] == pytest.approx(command[-1])
    assert state.peak["voltage_command"] == pytest.approx(command[np.argmax(np.abs(command))])
    assert [e.message for e in state.events] == ["near"]
    recorder.append(Block(1500, counts[:, 1500:]))
    recorder.close()
    state = watch.look()
    assert (state.samples, state.ended) == (3000, True)
    assert state.recent["displacement"].extremes[0].size > 10


def test_values_of_a_run_that_writes_no_more_are_not_those_of_now(
    tmp_path: Path,
) -> None:
    # a frozen run: its guardian has set 0 V, and the file still ends at full voltage
    path, clock = tmp_path / "run.h5", Clock(100.0)
    recorder = writer(path)
    recorder.append(Block(0, run_counts(3000)[:, :1500]))
    recorder._flush_all(1.8e9)
    watch = SourceWatch(path)
    watch._watch = RecordingWatch(path, now=lambda: 1.8e9, clock=clock)

    def shown() -> str:
        stream = StringIO()
        console = Console(file=stream, width=120)
        console.print(_look(watch, console))
        return stream.getvalue()

    assert "recording, 1.5 s" in shown()
    assert "not live" not in shown()
    assert watch_json(watch)["recording"]["live"] is True
    clock.moment += 6.0
    assert "no new data for 6 s, 1.5 s" in shown()
    assert "not live, these are the last samples; look at the amplifier" in shown()
    found = watch_json(watch)["recording"]
    assert (found["live"], found["age_s"]) == (False, pytest.approx(6.0))
    recorder.close()
    assert "ended" in shown()
    assert "not live, these are the last samples" in shown()
    assert watch_json(watch)["recording"]["live"] is False


def test_a_file_that_is_not_there_yet_is_no_end_of_the_watch(tmp_path: Path) -> None:
    assert "is not there" in RecordingWatch(tmp_path / "none.h5").look().trouble


def test_the_command_shows_a_campaign_with_the_run_that_goes_on(bench: Bench) -> None:
    bench.fates["three-0002"] = "killed"
    with pytest.raises(Killed):
        bench.play()
    found = done("watch", bench.out, "--json", "-")
    assert found.json["format"] == "dearig-watch/1"
    campaign = found.json["campaign"]
    assert campaign["status"] == "killed"
    assert [run["state"] for run in campaign["runs"]] == ["done", "running", "waiting"]
    recording = found.json["recording"]
    assert (recording["samples"], recording["ended"]) == (300, False)
    assert "continue with dearig campaign --resume" in found.err.lower()


def test_the_command_shows_the_newest_recording_of_a_folder(made_runs, tmp_path: Path) -> None:
    whole, _ = made_runs
    (tmp_path / "run.h5").write_bytes(whole.read_bytes())
    shown = done("watch", tmp_path).out
    assert "run.h5: ended, 0.6 s, 600 samples" in " ".join(shown.split())
    assert "near the limit" in shown
    refused(dearig("watch", tmp_path / "no.h5"), "is not there")
    (tmp_path / "empty").mkdir()
    refused(dearig("watch", tmp_path / "empty"), "neither a campaign nor a recording")
