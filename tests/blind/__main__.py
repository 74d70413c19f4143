"""The blind test: rigs that hide something drawn by a seed, and whether the diagnosis finds it.

    python -m tests.blind                    the table of the README: 60 rigs and 50 clean ones
    python -m tests.blind --cases 10 --clean 0 --train thesis
    python -m tests.blind --cases 0 --clean 0 --per-family 4
    python -m tests.blind --seeds 17,41      these alone
    python -m tests.blind --generator second      laws that neither the library nor generator A has
    python -m tests.blind --cases 0 --clean 20 --noise coarse
    python -m tests.blind --table            the table of what is there

Every case is recorded with ``dearig.acquisition.run.record`` on ``sim:SEED`` and diagnosed by
``dearig diagnose`` in a process of its own. What is done is kept (one JSON each) and skipped the
next time, unless the model or the hidden effects have changed since; ``--keep`` takes it
nevertheless.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

import platformdirs
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from dearig.errors import DearigError
from dearig.sim_backend.laser_noise import NOISES, WHITE
from dearig.sim_backend.truth.cases import GENERATORS
from tests.blind.play import MODES, Bench, Case, case_of
from tests.blind.score import Score, score
from tests.blind.seeds import LOOKED_AT, chosen
from tests.blind.table import line, report


def main() -> None:
    given = _arguments()
    modes = tuple(MODES) if given.train == "both" else (given.train,)
    bench = Bench(given.out, given.rate, given.bare)
    seeds = given.seeds or chosen(
        given.first, given.cases, given.clean, given.per_family, given.generator
    )
    wanted = [Case(seed, mode, given.generator, given.noise) for mode in modes for seed in seeds]
    console = Console(stderr=True)
    if given.table:
        _print(bench, None, given.keep, console)
        return
    open_cases = [case for case in wanted if bench.kept(case, given.keep) is None]
    if any(seed in LOOKED_AT for seed in seeds):
        console.print("some of these seeds were looked at: report figures of others")
    console.print(
        f"{len(wanted)} cases, {len(wanted) - len(open_cases)} of them done; in {bench.folder}"
    )
    try:
        _play_all(bench, open_cases, given.jobs, console)
    except KeyboardInterrupt:
        console.print("interrupted; what is done is kept, and the same command goes on from there")
    _print(bench, wanted, given.keep, console)


def _play_all(bench: Bench, cases: list[Case], jobs: int, console: Console) -> None:
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
    )  # fmt: skip
    # the time left from all that was done: cases come in pairs, and some are much longer
    with Progress(*columns, console=console, speed_estimate_period=3600.0) as bar:
        task = bar.add_task("blind cases", total=len(cases))
        for result in _in_turn(bench, cases, jobs):
            bar.advance(task)
            bar.console.print(line(score(result)), markup=False, highlight=False, soft_wrap=True)


def _in_turn(bench: Bench, cases: list[Case], jobs: int) -> Iterator[dict[str, Any]]:
    """Results as they come; each case waits in a process of its own, ``jobs`` of them at a time."""
    for noise in {case.noise for case in cases}:
        bench.floor_um(noise)
    with ThreadPoolExecutor(jobs) as pool:
        running: set[Future[dict[str, Any]]] = set()
        left = iter(cases)
        try:
            while True:
                for case in left:
                    running.add(pool.submit(bench.play, case))
                    if len(running) == jobs:
                        break
                if not running:
                    return
                ended, running = wait(running, return_when=FIRST_COMPLETED)
                for future in ended:
                    yield future.result()
        finally:
            for future in running:
                future.cancel()


def _print(bench: Bench, wanted: list[Case] | None, keep: bool, console: Console) -> None:
    """The table of ``wanted``, or of all that is there."""
    kept = bench.all_kept()
    if wanted is not None:
        asked = set(wanted)
        kept = [r for r in kept if case_of(r) in asked]
    fresh = [r for r in kept if keep or bench.is_fresh(r)]
    if len(fresh) < len(kept):
        console.print(
            f"{len(kept) - len(fresh)} results of other sources are left out (--keep takes them)"
        )
    scores: list[Score] = [score(r) for r in fresh]
    sys.stdout.write(report(scores) + "\n")
    if any(s.outcome != "right" for s in scores):
        sys.stdout.write(f"\n{bench.again()}\n")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.blind",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--first", type=_natural, default=0, help="first seed [0]")
    add("--cases", type=_natural, default=60, help="seeds from there, whatever they hide [60]")
    add("--clean", type=_natural, default=50, help="further rigs that hide nothing [50]")
    add("--per-family", type=_natural, default=0, help="further rigs of each family [0]")
    add("--seeds", type=_seeds, help="these seeds and no others, such as 3,17")
    add(
        "--generator",
        choices=tuple(GENERATORS),
        default="first",
        help="who draws the effects [first]",
    )
    add("--noise", choices=NOISES, default=WHITE, help="noise of the laser [white]")
    add("--train", choices=(*MODES, "both"), default="both", help="training recordings [both]")
    add("--rate", type=float, choices=(100.0, 200.0, 1000.0), default=200.0, help="Hz [200]")
    add("--jobs", type=int, choices=(1, 2, 3, 4), default=2, help="cases at a time [2]")
    add("--out", type=Path, default=_cache(), help="where results are kept [the user's cache]")
    add("--keep", action="store_true", help="take results of other sources as well")
    add("--bare", action="store_true", help="leave the intervals of parameters out, for speed")
    add("--table", action="store_true", help="print the table of what is there, play nothing")
    return parser.parse_args()


def _cache() -> Path:
    return Path(platformdirs.user_cache_dir("dearig-blind"))


def _natural(text: str) -> int:
    if not text.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r} is not 0 or a whole number above it")
    return int(text)


def _seeds(text: str) -> list[int]:
    return [_natural(part) for part in text.split(",")]


if __name__ == "__main__":
    started = time.monotonic()
    try:
        main()
    except DearigError as error:
        sys.exit(f"{error}")
    Console(stderr=True).print(f"{time.monotonic() - started:.0f} s")
