"""The replay of every write boundary of a run, and real kills of runs under full load.

``python -m tests.crash replay [--blocks N]`` notes every write, truncation, renaming and removal
of a run that replaces an older recording, makes them again one by one, and after each one checks
that nothing flushed is lost and that ``recover`` repairs the file. Each write is made in two halves
as well with --torn. ``python -m tests.crash kills [--kills N]`` kills that many runs which write as
fast as they can.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from dearig.recording import open_recording
from tests.crash.changes import Change, again, changes_of
from tests.crash.check import check, told
from tests.tools.recordings import write_run

ROOT = Path(__file__).parents[2]
VICTIM = (sys.executable, "-m", "tests.crash.victim")


def replay(
    work: Path, blocks: int, size: int, overwrite: bool, torn: bool, every: int = 1
) -> tuple[int, int]:
    """Crash points that were checked, and how many had something to lose; raises for a failure.

    Of the crash points every ``every``-th is checked.
    """
    noted, folder, scratch = (work / name for name in ("noted", "again", "scratch"))
    for made in (noted, folder, scratch):
        made.mkdir()
    options = []
    if overwrite:
        write_run(noted / "run.h5")
        write_run(folder / "run.h5")
        options = ["--overwrite"]
    command = [*VICTIM, str(noted / "run.h5"), str(blocks), str(size), *options]
    path = folder / "run.h5"
    points = rich = 0
    for n, change in enumerate(changes_of(command, noted, ROOT)):
        for part in _parts(change, torn):
            again(part, folder)
            points += 1
            if points % every:
                continue
            try:
                rich += bool(check_with_old(path, blocks, size, scratch, overwrite))
            except Exception as error:
                raise RuntimeError(
                    f"after change {n} ({change.what} {change.name} at {change.offset}, "
                    f"{len(change.data)} bytes): {error}"
                ) from error
    return points // every, rich


def _parts(change: Change, torn: bool) -> list[Change]:
    half = len(change.data) // 2
    # a write of the page cache is not torn within a page; superblock and headers are shorter
    if not torn or change.what != "W" or len(change.data) <= 4096:
        return [change]
    return [replace(change, data=change.data[:half]), change]


def check_with_old(path: Path, blocks: int, size: int, scratch: Path, overwrite: bool) -> int:
    """The same check, where an older recording must be there until it is replaced."""
    if overwrite and not told(path).flushed:
        old = path.with_name(f"{path.name}.old")
        kept = old if old.exists() else path
        if kept == old or open_recording(path).samples == 3000:
            assert open_recording(kept).samples == 3000
            return 0
    if not path.exists():
        return 0
    return check(path, size, scratch, blocks * size)


def kills(work: Path, count: int, size: int, seed: int) -> tuple[int, int, int]:
    """Kills, those while it closed, and samples in all; raises for a failure."""
    rng = random.Random(seed)  # noqa: S311
    closing = samples = 0
    for n in range(count):
        folder, scratch = work / f"kill{n}", work / f"scratch{n}"
        folder.mkdir()
        scratch.mkdir()
        path = folder / "run.h5"
        blocks = rng.choice((200, 2000, 10**9))
        command = [*VICTIM, str(path), str(blocks), str(size), "--real"]
        victim = subprocess.Popen(command, cwd=ROOT)
        said = path.with_name("run.h5.said")
        try:
            # let it come to its run, then leave the moment to chance
            while not said.exists() and victim.poll() is None:
                pass
            victim.wait(rng.uniform(0.0, 0.7))
        except subprocess.TimeoutExpired:
            victim.kill()
        victim.wait()
        try:
            if path.exists():
                total = blocks * size if blocks < 10**9 else None
                samples += check(path, size, scratch, total)
                closing += told(path).closing
        except Exception as error:
            raise RuntimeError(f"kill {n} of {path}: {error}") from error
        for made in (*folder.iterdir(), *scratch.iterdir()):
            made.unlink()
    return count, closing, samples


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("how", choices=("replay", "kills"))
    parser.add_argument("--blocks", type=int, default=160)
    parser.add_argument("--size", type=int)
    parser.add_argument("--torn", action="store_true")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        work = Path(made)
        if asked.how == "replay":
            for name, overwrite, size in (
                ("slow", False, 250), ("fast", False, 7000), ("replacing", True, 250),
            ):  # fmt: skip
                (work / name).mkdir()
                points, rich = replay(
                    work / name, asked.blocks, asked.size or size, overwrite, asked.torn
                )
                print(
                    f"{name}: {points} crash points, {rich} with samples to lose, 0 failures",
                    flush=True,
                )
        else:
            count, closing, samples = kills(work, asked.kills, asked.size or 10_000, asked.seed)
            print(
                f"{count} kills ({closing} of runs that were closing or had closed), "
                f"{samples} samples found, none lost that were flushed"
            )


if __name__ == "__main__":
    main()
