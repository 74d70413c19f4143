"""Trends of made campaigns: how often intervals hold the truth, and what is said in error.

``python -m tests.benchmarks.bench_trends --campaigns 100``. Each campaign is a table of 200 runs
over 20 films in a room that warms and moistens: values, errors and intervals are drawn, not fitted.
``--fitted FILMS`` simulates a campaign with the model, six days of each film, fits the days of a
film together with mu_0 and permittivity of each day, and trends what was fitted.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from dearig.batch.changes import find_jumps, jump_penalty
from dearig.batch.fits import parameter_columns
from dearig.batch.numbers import parameter_of
from dearig.batch.trends import find_trends
from dearig.model.film.material import Network
from dearig.model.fitting import fit_shared
from dearig.model.simulation.actuator import Actuator
from tests.tools.engine import PLAIN, record_of, thesis_drive
from tests.tools.machine import cores_and_load
from tests.tools.made_campaign import TRUTH, made_rows

OF_THE_ROOM = ("temperature", "humidity")
KINDS = ("single", "simultaneous")  # intervals of an effect
SOURCE = Path("made.csv")


def coverage(campaigns: int) -> None:
    held: Counter[str] = Counter()
    said: Counter[str] = Counter()
    at_once: Counter[str] = Counter()
    jumps = own = 0
    for seed in range(campaigns):
        found = find_trends(made_rows(seed), source=SOURCE, numbers=list(TRUTH))
        held_by = {kind: {"room": True, "all": True} for kind in KINDS}
        for trend in found.trends:
            jumps += len(trend.changes)
            own += sum(len(effect.own) for effect in trend.effects)
            for effect in trend.effects:
                label = effect.column.label
                true = 100.0 * math.expm1(TRUTH[trend.name].get(label, 0.0))
                held[f"{trend.name} over {label}"] += effect.low <= true <= effect.high
                said[f"{trend.name} over {label}: {effect.verdict}"] += 1
                ends = ((effect.low, effect.high), effect.simultaneous)
                for kind, (low, high) in zip(KINDS, ends, strict=True):
                    held_by[kind]["all"] &= low <= true <= high
                    held_by[kind]["room"] &= low <= true <= high or label not in OF_THE_ROOM
        for kind, which in held_by.items():
            at_once[f"the four of the room, {kind}"] += which["room"]
            at_once[f"all eight, {kind}"] += which["all"]
    print(f"{campaigns} campaigns of 200 runs over 20 films; the interval holds the truth in")
    for name, count in held.items():
        print(f"  {name:30s} {count:4d} of {campaigns} ({100.0 * count / campaigns:.1f} %)")
    print(f"  mean of the eight              {100.0 * np.mean([*held.values()]) / campaigns:.1f} %")
    print("campaigns in which all of these intervals hold the truth at once:")
    for name, count in at_once.items():
        print(f"  {name:36s} {count:4d} of {campaigns} ({100.0 * count / campaigns:.1f} %)")
    print(f"change points said of films without one: {jumps} in {40 * campaigns} series")
    print(f"slopes said to be one film's own: {own} in {40 * campaigns * 4} of films and columns")
    print("verdicts:")
    for name, count in sorted(said.items()):
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
    shares = []
    for runs in (8, 20, 50, 200, 500):
        penalty = jump_penalty(runs, 1)
        wrong = sum(bool(find_jumps(random.normal(size=runs), penalty)) for _ in range(count))
        shares.append(f"{runs} runs {100.0 * wrong / count:.2f} %")
    print(f"a change point in a series without one ({count} series each): {', '.join(shares)}")


def large(films: int, runs: int) -> None:
    rows = made_rows(0, films=films, runs=runs)
    for what in ("first", "again"):
        began, used = time.perf_counter(), time.process_time()
        find_trends(rows, source=SOURCE, numbers=["mu_0_kPa"])
        took, used = time.perf_counter() - began, time.process_time() - used
        print(
            f"{len(rows):,} rows of {films} films, one number, {what}: {used:.2f} s of a core "
            f"({took:.2f} s under the load below)"
        )


def fitted(films: int, days: int = 6) -> None:
    """A campaign whose recordings are simulated, with noise, and fitted together film by film."""
    random = np.random.default_rng(11)
    drive = thesis_drive(rate=40.0)
    rows = []
    began = time.process_time()
    for film in range(films):
        level = 0.06 * random.standard_normal(2)
        temperatures = random.normal(22.0, 2.5, days)
        humidities = random.normal(45.0, 8.0, days)
        room = list(zip(temperatures, humidities, strict=True))
        records = [
            record_of(_film_on_a_day(level, *day), drive, seed=100 * film + i)
            for i, day in enumerate(room)
        ]
        fit = fit_shared(records, PLAIN, ["mu_0", "permittivity"], workers=1)
        for (t, h), estimates in zip(room, fit.estimates, strict=True):
            row = {"recording": f"{len(rows):03d}", "film": f"F{film}", "temperature_degC": t,
                   "relative_humidity_percent": h}  # fmt: skip
            row |= parameter_columns([parameter_of(each) for each in estimates])
            rows.append(row)
    took = time.process_time() - began
    print(
        f"{len(rows)} simulated recordings of {films} films ({drive.time[-1]:.0f} s each), fitted "
        f"film by film with mu_0 and permittivity of each day: {took:.0f} s of a core"
    )
    held = 0
    for trend in find_trends(rows, source=SOURCE, numbers=list(TRUTH)).trends:
        for effect in trend.effects:
            true = 100.0 * math.expm1(TRUTH[trend.name][effect.column.label])
            held += effect.low <= true <= effect.high
            print(
                f"  {trend.name} over {effect.column.label}: {effect.slope:.4f} % "
                f"({effect.low:.4f} to {effect.high:.4f}), true {true:.4f}; {effect.verdict}"
            )
    print(f"  {held} of 4 intervals hold the truth")


def _film_on_a_day(level: np.ndarray, temperature: float, humidity: float) -> Actuator:
    factors = {
        name: math.exp(
            slopes["temperature"] * (temperature - 22.0) + slopes["humidity"] * (humidity - 45.0)
        )
        for name, slopes in TRUTH.items()
    }
    stiff = math.exp(level[0])
    first, *others = (stiff * s.modulus for s in PLAIN.network.springs)
    network = Network.gent(
        (factors["mu_0_kPa"] * first, *others), [s.limit for s in PLAIN.network.springs],
        [math.exp(level[1]) * t for t in PLAIN.network.times],
    )  # fmt: skip
    film = replace(PLAIN.film, permittivity=factors["permittivity"] * PLAIN.film.permittivity)
    return replace(PLAIN, network=network, film=film)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=100)
    parser.add_argument("--fitted", type=int, default=0, metavar="FILMS")
    asked = parser.parse_args()
    if asked.fitted:
        fitted(asked.fitted)
        return
    campaigns = asked.campaigns
    began = time.perf_counter()
    coverage(campaigns)
    print(f"{(time.perf_counter() - began) / campaigns:.2f} s for each campaign")
    singles(max(campaigns // 5, 1))
    series_without_change(1000)
    large(100, 100)
    print(cores_and_load())


if __name__ == "__main__":
    main()
