"""A campaign on the simulated rig whose process is killed, and continued.

``python -m tests.benchmarks.bench_campaign`` kills one at many random moments.
"""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

from dearig.batch.journal import JOURNAL
from tests.tools.command import done
from tests.tools.killed_campaign import check_campaign, kill_once, made_plan

RUNS = 3


def test_kill_9_in_the_middle_loses_and_doubles_no_run(tmp_path: Path) -> None:
    plan, out = made_plan(tmp_path, RUNS), tmp_path / "out"

    def when(process: subprocess.Popen[bytes]) -> None:
        """Wait until the second run is near; what the signal meets is chance."""
        while process.poll() is None:
            if (out / JOURNAL).exists() and (out / JOURNAL).read_bytes().count(b"\n") >= 5:
                return
            time.sleep(0.005)  # the campaign itself needs the processor

    assert kill_once(plan, when)
    done("campaign", plan, "--out", out, "--rig-file", tmp_path / "rig.toml", "--resume")
    assert check_campaign(plan, RUNS)["armed"] == 2
