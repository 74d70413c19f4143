"""Processor time of the tests at several revisions.

    python -m tests.benchmarks.bench_suite b2a0705 HEAD

Each revision is cloned, gets an environment of its own, and runs its ``.ci/test.py`` twice: with no
compiled kernels (a newcomer's run), and with those that the first run left. Needs Linux or macOS.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]


def measured(clone: Path, cache: Path) -> tuple[float, str]:
    """Run the tests of ``clone``; s of all processes (user and system), and pytest's last line."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run(
        [sys.executable, ".ci/test.py"], cwd=clone, capture_output=True, text=True, check=False,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return took, (ended.stdout.strip().splitlines() or [""])[-1].strip(" =")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("revisions", nargs="+", help="the first one is what others are compared to")
    asked = parser.parse_args()
    print("| revision | kernels | processor time (s) | of the first | tests |")
    print("|---|---|---|---|---|")
    first: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as made:
        for place, revision in enumerate(asked.revisions):
            clone, cache = Path(made, f"clone{place}"), Path(made, f"kernels{place}")
            cache.mkdir(mode=0o700)
            subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
            checkout = ["git", "checkout", "--quiet", "--detach", revision]
            subprocess.run(checkout, cwd=clone, check=True)
            prepare = "import bootstrap; bootstrap.prepare('test')"
            subprocess.run([sys.executable, "-c", prepare], cwd=clone / ".ci", check=True)
            for kernels in ("none", "there"):
                took, told = measured(clone, cache)
                part = took / first.setdefault(kernels, took)
                print(f"| {revision} | {kernels} | {took:.0f} | {part:.2f} | {told} |", flush=True)


if __name__ == "__main__":
    main()
