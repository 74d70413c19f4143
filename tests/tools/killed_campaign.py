"""A campaign on the simulated rig in a process that is killed again and again."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from dearig.batch.journal import JOURNAL
from dearig.batch.watching import seen
from dearig.errors import InputError
from dearig.recording.content.text import text_of
from dearig.recording.reading.opening import read_from
from dearig.recording.reading.reader import open_recording
from tests.tools.command import LOBE, SLOW_RIG, write

PLAN = """\
name = "killed"
sequence = "lobe.toml"
repeat = {runs}
repeat_lost = 10
"""

__all__ = ["check_campaign", "kill_once", "made_plan", "play_on"]


def made_plan(folder: Path, runs: int) -> Path:
    """A plan of so many short runs, with its sequence and its rig file."""
    write(folder / "lobe.toml", LOBE)
    write(folder / "rig.toml", SLOW_RIG)
    return write(folder / "plan.toml", PLAN.format(runs=runs))


def command(plan: Path) -> list[str]:
    out = plan.parent / "out"
    begun = (out / JOURNAL).exists() and b'"planned"' in (out / JOURNAL).read_bytes()
    return [
        sys.executable, "-m", "dearig", "campaign", str(plan), "--out", str(out), "--rig-file",
        str(plan.parent / "rig.toml"), *(["--resume"] if begun else []),
    ]  # fmt: skip


def kill_once(plan: Path, when: Callable[[subprocess.Popen[bytes]], None]) -> bool:
    """Play, and kill the process once ``when`` returns; False if the campaign ended before."""
    process = subprocess.Popen(
        command(plan), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=plan.parent
    )
    when(process)
    ended = process.poll() is not None
    process.send_signal(getattr(signal, "SIGKILL", signal.SIGTERM))
    process.wait()
    return not ended


def play_on(plan: Path) -> None:
    """Play to the end."""
    found = subprocess.run(command(plan), capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr


def check_campaign(plan: Path, runs: int) -> Counter[str]:
    """Check that every run is there once, whole and at 0 V; return the entries of the journal."""
    out = plan.parent / "out"
    queue = seen(out).queue
    assert [run.state for run in queue.listed] == ["done"] * runs
    entries = [json.loads(line) for line in (out / JOURNAL).read_text("utf-8").splitlines()]
    done = Counter(e["run"] for e in entries if e["event"] == "ended" and e["state"] == "done")
    assert done == Counter(list(queue.order))
    kept = {run.recording for run in queue.listed}
    assert len(kept) == runs
    for path in out.glob("*.h5"):
        try:
            recording = open_recording(path)
        except InputError:  # killed before its first sample
            assert path.name not in kept
            continue
        output = read_from(path, lambda file: text_of(file["entry"].attrs.get("output_state", "")))
        assert output in ("confirmed", "")
        # one that is not of a run was killed: a whole one would be a run that was doubled
        finished = recording.complete and recording.outcome == "finished"
        assert finished == (path.name in kept), path
    return Counter(e["event"] for e in entries)
