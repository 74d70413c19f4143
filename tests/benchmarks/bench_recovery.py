"""Whether an identification finds the truth again, and whether its intervals hold it.

Run as ``python -m tests.benchmarks.bench_recovery [SEEDS]``. Each seed is one noise on the thesis's
identification record (1 kHz, 1 um) made by Table 3's film, whose branches are sorted by relaxation
time, as fits are. The fitted model also predicts a record like validation B with other noise. RMS
errors are given over the noise: 1 is all that can be reached.
"""

import math
import sys
import time
from collections import Counter

import numpy as np

from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Network
from dearig.model.fitting import identify
from dearig.model.readings.measures import errors
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import THESIS_FREQUENCIES, Sequence

RATE = 1000.0
NOISE = 1e-6
SEEDS = 20
TOGETHER = ("mu_0", "mu_1", "mu_2", "T_1", "T_2")


def truths(network: Network) -> dict[str, float]:
    """The numbers of ``network`` by name, branches in order of relaxation time."""
    branches = sorted(network.branches, key=lambda b: b.relaxation_time)
    springs = (network.equilibrium, *(b.spring for b in branches))
    found = {f"mu_{i}": s.modulus for i, s in enumerate(springs)}
    found |= {f"J_{i}": s.limit for i, s in enumerate(springs)}
    return found | {f"T_{i}": b.relaxation_time for i, b in enumerate(branches, 1)}


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    actuator = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    truth = truths(TABLE_3)
    drive = Drive(*Sequence.thesis().sample(RATE), hold=True)
    clean = actuator.simulate(drive).displacement
    check = Drive(*Sequence.thesis((7e3,) * 5, THESIS_FREQUENCIES).sample(RATE), hold=True)
    clean_check = actuator.simulate(check).displacement
    inside: Counter[str] = Counter()
    determined: Counter[str] = Counter()
    together = 0
    fits, checks, spent = [], [], []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        measured = clean + NOISE * rng.standard_normal(clean.size)
        validation = clean_check + NOISE * rng.standard_normal(clean_check.size)
        before = time.perf_counter()
        fit = identify([ActuatorRecord(f"seed {seed}", drive, measured, NOISE)], actuator)
        spent.append(time.perf_counter() - before)
        model = fit.model
        if not isinstance(model, Actuator):
            raise TypeError("an actuator's record was fitted by something else")
        fits.append(errors(measured, model.simulate(drive).displacement).rms / NOISE)
        checks.append(errors(validation, model.simulate(check).displacement).rms / NOISE)
        held = {e.name for e in fit.estimates if e.low <= truth[e.name] <= e.high}
        inside.update(held)
        determined.update(e.name for e in fit.estimates if e.determined)
        together += held.issuperset(TOGETHER)
        outside = [n for n in truth if n not in held]
        print(
            f"seed {seed:>2}: {spent[-1]:5.1f} s, {fit.simulations:>6} simulations, "
            f"fit {fits[-1]:.4f}, validation {checks[-1]:.4f}, "
            f"outside: {', '.join(outside) or '-'}",
            flush=True,
        )
    print(f"\n{'parameter':<12}{'truth':>12}{'inside':>9}{'determined':>13}   of {seeds} seeds")
    for name, value in truth.items():
        print(f"{name:<12}{value:>12.5g}{inside[name]:>9}{determined[name]:>13}")
    print(f"{', '.join(TOGETHER)} all inside: {together} of {seeds} seeds")
    print(f"{'':<12}{'least':>10}{'median':>10}{'most':>10}   target")
    for name, values, target in (
        ("fit", fits, "0.95 .. 1.05"),
        ("validation", checks, "0.95 .. 1.05"),
        ("seconds", spent, ""),
    ):
        middle = float(np.median(values))
        print(f"{name:<12}{min(values):>10.4f}{middle:>10.4f}{max(values):>10.4f}   {target}")
    expected = 0.95 * seeds
    spread = math.sqrt(0.95 * 0.05 * seeds)
    print(f"an honest 95 % interval holds the truth {expected:.0f} +- {spread:.0f} times")


if __name__ == "__main__":
    main()
