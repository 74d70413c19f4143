"""Trends of made campaigns: how often intervals hold the truth, and what is said in error.

``python -m tests.benchmarks.bench_trends --campaigns 100``. Each campaign is a table of 200 runs
over 20 films in a room that warms and moistens: values, errors and intervals are drawn, not fitted.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections import Counter
from pathlib import Path

import numpy as np

from dearig.batch.changes import find_jumps, jump_penalty
from dearig.batch.trends import find_trends
from tests.tools.made_campaign import TRUTH, made_rows

OF_THE_ROOM = ("temperature", "humidity")
SOURCE = Path("made.csv")


def coverage(campaigns: int) -> None:
    held: Counter[str] = Counter()
    told: Counter[str] = Counter()
    whole = jumps = own = 0
    for seed in range(campaigns):
        found = find_trends(made_rows(seed), source=SOURCE, numbers=list(TRUTH))
        inside = True
        for trend in found.trends:
            jumps += len(trend.changes)
            own += sum(len(effect.own) for effect in trend.effects)
            for effect in trend.effects:
                label = effect.column.label
                true = 100.0 * math.expm1(TRUTH[trend.name].get(label, 0.0))
                is_held = effect.low <= true <= effect.high
                held[f"{trend.name} over {label}"] += is_held
                told[f"{trend.name} over {label}: {effect.verdict}"] += 1
                inside &= is_held or label not in OF_THE_ROOM
        whole += inside
    print(f"{campaigns} campaigns of 200 runs over 20 films; the interval holds the truth in")
    for name, count in held.items():
        print(f"  {name:30s} {count:4d} of {campaigns} ({100.0 * count / campaigns:.1f} %)")
    room = [c for n, c in held.items() if n.endswith(OF_THE_ROOM)]
    print(f"  the four of the room together  {100.0 * np.mean(room) / campaigns:.1f} % on average")
    print(f"  all four at once in            {whole} of {campaigns} (0.95^4 = 81 %)")
    print(f"change points said of films without one: {jumps} in {40 * campaigns} series")
    print(f"slopes said to be one film's own: {own} in {40 * campaigns * 4} of films and columns")
    print("verdicts:")
    for name, count in sorted(told.items()):
        print(f"  {name}: {count}")


def singles(campaigns: int) -> None:
    """What is found of one film with a slope of its own, and of another one that jumps."""
    slopes = jumps = 0
    for seed in range(campaigns):
        rows = made_rows(seed, own={"F05": 0.03}, jump=("F12", 5, -0.08))
        (trend,) = find_trends(rows, source=SOURCE, numbers=["mu_0_kPa"]).trends
        temperature = trend.effects[0]
        slopes += [s.film for s in temperature.own] == ["F05"]
        jumps += [(c.film, c.first) for c in trend.changes] == [("F12", "F12-06.h5")]
    print(
        f"one film's own slope (+3 % per degree) told, and no other one: {slopes} of {campaigns}; "
        f"a jump by -8 % placed at its run, and no other one: {jumps} of {campaigns}"
    )


def series_without_change(count: int) -> None:
    random = np.random.default_rng(0)
    told = []
    for runs in (8, 20, 50, 200, 500):
        penalty = jump_penalty(runs, 1)
        wrong = sum(bool(find_jumps(random.normal(size=runs), penalty)) for _ in range(count))
        told.append(f"{runs} runs {100.0 * wrong / count:.2f} %")
    print(f"a change point in a series without one ({count} series each): {', '.join(told)}")


def large(films: int, runs: int) -> None:
    rows = made_rows(0, films=films, runs=runs)
    for what in ("first", "again"):
        began = time.perf_counter()
        find_trends(rows, source=SOURCE, numbers=["mu_0_kPa"])
        took = time.perf_counter() - began
        print(f"{len(rows):,} rows of {films} films, one number, {what}: {took:.2f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=100)
    campaigns = parser.parse_args().campaigns
    began = time.perf_counter()
    coverage(campaigns)
    print(f"{(time.perf_counter() - began) / campaigns:.2f} s for each campaign")
    singles(max(campaigns // 5, 1))
    series_without_change(1000)
    large(100, 100)
    print(f"{os.cpu_count()} cores" + (
        f", load {os.getloadavg()[0]:.0f}" if hasattr(os, "getloadavg") else ""
    ))  # fmt: skip


if __name__ == "__main__":
    main()
