"""How near the film comes to a target under the voltage that was computed for it.

Run as ``python -m tests.benchmarks.bench_inversion``. The thesis's model with each effect alone,
and with pairs of effects, follows sines of 0.1, 1 and 10 Hz about 0.45 mm; the voltage is simulated
forward, and the largest distance from the target is taken where that can be reached. Each effect
has its typical size, and comes ``--pairs`` times with others, drawn by ``--seed``.

What is farther than 0.05 um is listed, for pairs only where neither effect is farther by itself.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dearig.model.control import invert
from dearig.model.control.linear import repeatable_part
from dearig.model.errors import ModelError
from dearig.model.simulation.actuator import Drive
from tests.tools.effect_cases import BY_VOLTAGE, THESIS, numbers
from tests.tools.targets import LEAD_IN, RATE, path, task

CLOSE = 0.05e-6  # m
SETTLED, BEFORE = 0.2, 0.1  # s: after the start at 0 V, before what is unreachable
SINES = {0.1: 50e-6, 1.0: 50e-6, 10.0: 5e-6}  # Hz to the amplitude in m
SECONDS = {0.1: 14.0, 1.0: 4.0, 10.0: 4.0}  # of the path: a period of the slowest


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=1, help="pairs of each effect [1]")
    parser.add_argument("--seed", type=int, default=0, help="of the pairs [0]")
    given = parser.parse_args()
    far: set[str] = set()
    print("| effects | " + " | ".join(f"{f:g} Hz" for f in SINES) + " |\n|---" + "|---" * 3 + "|")
    counts = []
    for title, cases in (
        ("alone", [(name,) for name in BY_VOLTAGE]),
        ("pairs", list(_pairs(given.pairs, np.random.default_rng(given.seed)))),
    ):
        near = 0
        for names in cases:
            missed = [_missed(names, frequency) for frequency in SINES]
            if max(missed) < CLOSE:
                near += 1
                continue
            if title == "alone":
                far.update(names)
            elif far.intersection(names):
                continue
            cells = " | ".join(f"{m * 1e6:.2f}" if math.isfinite(m) else "none" for m in missed)
            print(f"| {' and '.join(names)} | {cells} |", flush=True)
        known = sum(bool(far.intersection(names)) for names in cases)
        counts.append(f"{title}: {near} of {len(cases)} nearer, {known} have an effect that is not")
    print(f"\nLargest distances in um. Within 0.05 um at every frequency, {'; '.join(counts)}.")


def _pairs(of_each: int, generator: np.random.Generator) -> Iterator[tuple[str, str]]:
    for name in BY_VOLTAGE:
        others = [other for other in BY_VOLTAGE if other != name]
        for other in generator.choice(others, of_each, replace=False):
            yield name, str(other)


def _missed(names: tuple[str, ...], frequency: float) -> float:
    """Return the largest distance in m from a sine of ``frequency`` Hz; inf where none is met."""
    effects = tuple((name, tuple(numbers(name).items())) for name in names)
    model = replace(THESIS, effects=effects)
    try:
        found = invert(model, task(path(frequency, SINES[frequency], seconds=SECONDS[frequency])))
    except ModelError:
        return math.inf
    reading = repeatable_part(model).simulate(Drive(found.time, found.voltage, hold=True))
    start = LEAD_IN / RATE + SETTLED
    stop = min([u.start for u in found.unreachable if u.start > start], default=math.inf) - BEFORE
    compared = (found.time > start) & (found.time < stop)
    if not reading.ok or not compared.any():
        return math.inf
    return float(np.abs(reading.displacement - found.target)[compared].max())


if __name__ == "__main__":
    main()
