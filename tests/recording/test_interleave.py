"""A few cases of commands on the same files at once; ``python -m tests.interleave`` plays many."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.deep import mostly_deep

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked and watched by pidfd")
@pytest.mark.parametrize("cases", mostly_deep([1, 4], []))
def test_no_recording_is_harmed_by_commands_at_once(cases: int) -> None:
    # a process of its own: it forks, and must have no threads
    command = [sys.executable, "-m", "tests.interleave", "--cases", str(cases), "--seed", "7"]
    played = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert played.returncode == 0, played.stdout + played.stderr
    assert f"{cases} cases, 0 with a fault" in played.stdout
