"""Campaigns killed at random moments, and 500 runs in one process: what is lost, what grows.

``python -m tests.benchmarks.bench_campaign --kills 20 --runs 500``.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import tempfile
import threading
import time
from pathlib import Path

import psutil

from dearig.acquisition.run import RunOptions
from dearig.batch.campaign import Arming, play_campaign
from dearig.batch.journal import JOURNAL
from dearig.config.campaignfile import load_campaign
from dearig.config.rigfile import load_rig_file
from tests.tools.killed_campaign import check_campaign, kill_once, made_plan, play_on


def kills(count: int, seed: int) -> None:
    """Kill a campaign of as many runs ``count`` times, then play it to its end."""
    rng = random.Random(seed)  # noqa: S311
    with tempfile.TemporaryDirectory() as folder:
        runs = 10 * count
        plan = made_plan(Path(folder), runs)
        killed = 0
        while killed < count:
            pause = rng.uniform(0.0, 1.5)
            journal = plan.parent / "out" / JOURNAL
            before = journal.stat().st_size if journal.exists() else 0

            def when(
                process: subprocess.Popen[bytes],
                pause: float = pause,
                journal: Path = journal,
                before: int = before,
            ) -> None:
                """Wait until the campaign goes on, and then for the pause."""
                while process.poll() is None:
                    if journal.exists() and journal.stat().st_size > before:
                        break
                    time.sleep(0.001)
                end = time.monotonic() + pause
                while time.monotonic() < end and process.poll() is None:
                    time.sleep(0.001)

            if not kill_once(plan, when):
                break
            killed += 1
        play_on(plan)
        events = check_campaign(plan, runs)
        lost = events["ended"] - runs
        print(
            f"{killed} kills at random moments (seed {seed}), {runs} runs: none lost or doubled, "
            f"every recording at 0 V; {lost} recordings cut off and repeated, "
            f"{events['not-started']} kills between the journal and the file"
        )


def growth(runs: int) -> None:
    """Play ``runs`` runs in this process, and print what it holds at each quarter."""
    process, rows = psutil.Process(), []
    with tempfile.TemporaryDirectory() as folder:
        plan = load_campaign(made_plan(Path(folder), runs))
        rig_file = load_rig_file(Path(folder) / "rig.toml")
        played = 0

        def progress(stage: str, fraction: float) -> None:
            nonlocal played
            if stage.endswith("recording") and fraction == 0.0:
                played += 1
                if played in {10, runs // 4, runs // 2, 3 * runs // 4, runs}:
                    handles = process.num_fds() if hasattr(process, "num_fds") else 0
                    rows.append(
                        (played, process.memory_info().rss / 1e6, threading.active_count(), handles)
                    )

        began = time.monotonic()
        play_campaign(
            plan, "sim", rig_file, Path(folder) / "out", RunOptions(), Arming(), progress=progress
        )
        took = time.monotonic() - began
    print("run   memory MB   threads   handles")
    for row in rows:
        print("{:4d} {:11.1f} {:9d} {:9d}".format(*row))
    print(f"{runs} runs in {took:.0f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    kills(asked.kills, asked.seed)
    growth(asked.runs)


if __name__ == "__main__":
    main()
