"""Exit codes and the way to 0 V do not depend on who reads what the command says."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from dearig.recording import open_recording
from tests.deep import mostly_deep
from tests.tools.command import LOBE, write

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="shells of POSIX")

ARC = ("--fault", "arc@0.8")
FULL = Path("/dev/full")
STREAMS = ["2>&-", ">&-", ">&- 2>&-", "<&- >&- 2>&-", "2>/dev/full", ">/dev/full 2>/dev/full"]


def shell(streams: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run the command in a shell with its streams redirected."""
    line = [sys.executable, "-m", "dearig", *(str(a) for a in arguments)]
    return subprocess.run(
        ["sh", "-c", f'"$@" {streams}', "sh", *line], capture_output=True, text=True, check=False
    )


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full")
@pytest.mark.parametrize("streams", mostly_deep(STREAMS, ["2>&-"]))
def test_an_arc_ends_with_its_code_without_any_stream(tmp_path: Path, streams: str) -> None:
    lobe, out = write(tmp_path / "lobe.toml", LOBE), tmp_path / "run.h5"
    ended = shell(streams, "record", lobe, *ARC, "--out", out)
    assert ended.returncode == 3
    assert "Traceback" not in ended.stdout + ended.stderr
    recording = open_recording(out)
    assert recording.complete
    assert "arc" in recording.outcome or "interlock" in recording.outcome
    # nothing that was meant for the terminal is in a file that took its number
    assert b"dearig: " not in out.read_bytes()[:8]


@pytest.mark.deep
@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full")
def test_refusals_and_results_keep_their_codes_too(tmp_path: Path) -> None:
    none = tmp_path / "none.h5"
    for streams in (">&- 2>&-", "2>/dev/full"):
        assert shell(streams, "info", none).returncode == 2
        assert shell(streams, "--version").returncode == 0
    full = shell(">/dev/full", "--version")
    assert full.returncode == 4
    assert full.stderr.count("\n") == 1
    assert "standard output or a temporary file could not be written" in full.stderr


def test_the_reader_of_a_pipe_may_leave_during_a_run(tmp_path: Path) -> None:
    lobe, out = write(tmp_path / "lobe.toml", LOBE), tmp_path / "run.h5"
    ended = shell("| true", "record", lobe, *ARC, "--out", out, "--json", "-")
    assert "Traceback" not in ended.stderr
    assert "interlock" in open_recording(out).outcome


def test_ctrl_c_that_is_held_down_ends_with_a_sentence_on_the_output(tmp_path: Path) -> None:
    long = LOBE.replace("frequency_Hz = 1.0", "frequency_Hz = 0.02")
    sequence, out = write(tmp_path / "s.toml", long), tmp_path / "run.h5"
    code = (
        "import signal\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from dearig.sim_backend.rig import SimulatedRig\n"
        "read = SimulatedRig.read\n"
        "def told(self):\n"
        "    block = read(self)\n"
        "    if block is not None and block.start == 300:\n"
        "        print('reads', flush=True)\n"
        "    return block\n"
        "SimulatedRig.read = told\n"
        "from dearig.cli.main import main\n"
        "main()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, "record", str(sequence), "--out", str(out), "--paced"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ),
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == "reads\n"
        while process.poll() is None:
            process.send_signal(signal.SIGINT)  # as fast as this goes
        said = process.stderr.read()
    assert process.returncode == 130
    assert "Traceback" not in said
    assert "0 V" in said.splitlines()[-1]
    # two presses more are the wish not to wait for the disk: then the file is not closed
    assert open_recording(out).samples > 0
