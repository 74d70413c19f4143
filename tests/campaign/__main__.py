"""The fault campaign: every kind of trouble at random moments, over many seeds.

    python -m tests.campaign --seeds 20 --out DIR            every kind, 20 seeds each
    python -m tests.campaign --kinds client-killed --seeds 300 --out DIR
    python -m tests.campaign --table --out DIR               what was seen so far

It takes up where it was left: cases that have been run are not run again.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from tests.campaign.cases import KINDS, Outcome, run_case


def main() -> int:
    """Run what is asked for and print the table; 1 when a case went wrong."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="where it all goes")
    parser.add_argument("--seeds", type=int, default=20, help="cases of each kind")
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time, all in real time")
    parser.add_argument("--table", action="store_true", help="run nothing")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    log = options.out / "outcomes.jsonl"
    outcomes = list(_seen(log))
    if not options.table:
        done = {(outcome.kind, outcome.seed) for outcome in outcomes}
        todo = [
            (kind, seed)
            for seed in range(options.seeds)
            for kind in options.kinds
            if (kind, seed) not in done
        ]
        with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
            cases = [pool.submit(run_case, *case, options.out) for case in todo]
            try:
                for case in track(
                    as_completed(cases), "campaign", total=len(cases), console=Console(stderr=True)
                ):
                    outcome = case.result()
                    outcomes.append(outcome)
                    with log.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(asdict(outcome)) + "\n")
                    if outcome.wrong:
                        said = "; ".join(outcome.wrong)
                        print(f"{outcome.kind} {outcome.seed}: {said}", flush=True)
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
    print(table([o for o in outcomes if o.kind in options.kinds]))
    return int(any(outcome.wrong for outcome in outcomes))


def _seen(log: Path) -> Iterator[Outcome]:
    if log.exists():
        for line in log.read_text(encoding="utf-8").splitlines():
            yield Outcome(**json.loads(line))


def table(outcomes: list[Outcome]) -> str:
    """The outcomes as the README shows them."""
    lines = [
        "| trouble | runs | well | exit | to 0 V, median / longest, s | allowed, s |",
        "|---|---|---|---|---|---|",
    ]
    for kind, expected in KINDS.items():
        these = [outcome for outcome in outcomes if outcome.kind == kind]
        if not these:
            continue
        well = sum(not outcome.wrong for outcome in these)
        codes = " ".join(sorted({str(outcome.exit_code) for outcome in these}))
        times = [o.to_zero for o in these if o.to_zero is not None]
        took, allowed = "never left it", "-"
        if times and expected.bound < np.inf:
            took, allowed = f"{np.median(times):.2f} / {max(times):.2f}", f"{expected.bound:.2f}"
        elif times:
            took = "ran to its end"
        lines.append(f"| {kind} | {len(these)} | {well} | {codes} | {took} | {allowed} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
