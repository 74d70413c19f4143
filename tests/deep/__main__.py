"""Run the deep tests: ``python -m tests.deep`` all of them, ``--today`` the share of this day.

The share of a day is every 84th test, so that twelve weeks run all; ``--day 2026-11-28`` runs
that of another day, ``--seed N`` so large a share drawn by a number. Other arguments go to pytest.
"""

from __future__ import annotations

import argparse
import datetime
import os
import subprocess
import sys
from pathlib import Path

from tests.deep.share import DAYS, VARIABLE

ROOT = Path(__file__).parents[2]


def files() -> list[str]:
    """Return the files of tests that have deep ones: the others need not be read."""
    found = (ROOT / "tests").rglob("test_*.py")
    return sorted(
        str(path.relative_to(ROOT)) for path in found if "deep" in path.read_text(encoding="utf-8")
    )


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.deep", description=__doc__)
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--today", action="store_true", help="the share of this day (UTC)")
    which.add_argument("--day", type=datetime.date.fromisoformat, help="the share of another day")
    which.add_argument("--seed", type=int, help="a share drawn by a number")
    options, others = parser.parse_known_args()
    day = datetime.datetime.now(datetime.UTC).date() if options.today else options.day
    share = ""
    if day is not None:
        share = f"day {day.toordinal() % DAYS}"
        print(f"deep tests of {day}: share {day.toordinal() % DAYS + 1} of {DAYS}", flush=True)
    elif options.seed is not None:
        share = f"seed {options.seed}"
        print(f"deep tests drawn by seed {options.seed}: one in {DAYS}", flush=True)
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-n",
        "2",
        "--dist",
        "loadfile",
        "-m",
        "deep or more_examples",
        *(others or files()),
    ]
    # two processes have two cores: threads of linear algebra would wait for each other
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", VARIABLE: share}
    return subprocess.run(command, cwd=ROOT, check=False, env=environment).returncode


if __name__ == "__main__":
    sys.exit(main())
