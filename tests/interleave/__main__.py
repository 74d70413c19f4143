"""Record, recover, export, import, index, verify and ``record --force``, two of each at once.

    python -m tests.interleave --cases 2000 --seed 0
    python -m tests.interleave --case 17

Every case has a folder of its own, in which 14 commands work on two recordings. They start at
random moments; a quarter of them is killed, a quarter is stopped for a while. Then every file is
checked: nothing flushed is lost, nothing is damaged, and no command said what is not so.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import sys
import tempfile
from pathlib import Path

from dearig.recording import open_recording
from tests.interleave.check import check
from tests.interleave.commands import NAMES, Ended, plan, play, prepare
from tests.recording.test_lock import killed_run

__all__ = ["case", "main", "tell"]


def case(seed: int, work: Path, given: Path, paced: bool = True) -> tuple[list[Ended], list[str]]:
    """Play the case ``seed`` in ``work``; how its commands ended, and what is wrong.

    ``given`` is the folder of ``prepare``.
    """
    rng = random.Random(seed)  # noqa: S311
    folder, notes = work / "files", work / "notes"
    folder.mkdir()
    notes.mkdir()
    there: dict[str, int] = {}
    for name in NAMES:
        source = rng.choice((None, given / "whole.h5", given / "killed.h5"))
        if source is not None:
            shutil.copyfile(source, folder / name)
            there[name] = open_recording(source).samples
    ended = play(plan(rng, given, paced), folder, notes)
    return ended, check(folder, ended, there)


def tell(ended: list[Ended]) -> str:
    """Return how the commands ended, a line each."""
    lines = [
        f"{one.began:6.3f} to {one.ended:6.3f} s: {one.code:3d} {' '.join(one.command.arguments)}"
        f" {[(round(at, 3), number) for at, number in one.command.signals]}: "
        f"{one.said.strip()[-200:]!r} {one.runs}"
        for one in sorted(ended, key=lambda one: one.began)
    ]
    return "\n".join(lines)


def main() -> int:
    """Play the cases that are asked for; 1 if anything is wrong."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="the first case")
    parser.add_argument("--case", type=int, help="this one case, told in full")
    parser.add_argument("--log", type=Path, metavar="FILE", help="append a line for each case")
    asked = parser.parse_args()
    seeds = [asked.case] if asked.case is not None else range(asked.seed, asked.seed + asked.cases)
    harmed = done = 0
    totals: dict[str, dict[int, int]] = {}
    with tempfile.TemporaryDirectory() as made:
        given = Path(made) / "given"
        given.mkdir()
        prepare(given)
        killed_run(given)
        for seed in seeds:
            work = Path(made) / f"{seed}"
            work.mkdir()
            ended, wrong = case(seed, work, given)
            done += 1
            harmed += bool(wrong)
            for one in ended:
                codes = totals.setdefault(one.command.kind, {})
                codes[one.code] = codes.get(one.code, 0) + 1
            if asked.log is not None:
                with asked.log.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps({"case": seed, "wrong": wrong}) + "\n")
            if wrong:
                print(f"case {seed}: " + "\n  ".join(wrong), flush=True)
            if wrong or asked.case is not None:
                print(tell(ended), flush=True)
            shutil.rmtree(work)
    for kind, codes in sorted(totals.items()):
        print(f"{kind}: " + ", ".join(f"{n} with {code}" for code, n in sorted(codes.items())))
    print(f"{done} cases, {harmed} with a fault")
    return int(harmed > 0)


if __name__ == "__main__":
    sys.exit(main())
