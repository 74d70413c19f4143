"""What a watcher sees of a run that goes on, and that it changes nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dearig.batch.watching import RecordingWatch
from dearig.drivers.rig import Block, Event
from tests.tools.command import dearig, done, refused
from tests.tools.played import Bench, Killed
from tests.tools.recordings import run_counts, writer


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
