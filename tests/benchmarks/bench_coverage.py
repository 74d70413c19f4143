"""How often the 95 % intervals of `identify` and `diagnose` hold the truth, on simulated rigs.

Run as ``python -m tests.benchmarks.bench_coverage --rigs 100``, with ``--diagnose`` for the other.
Each rig has a film of two to four branches (``--branches``, ``--near``) and one noise, drawn by its
seed; ``--diagnose`` gives it one effect of a list besides, in turn. With ``--hidden`` the rigs
are those of the blind test that hide an effect: `identify` has a model without it, and only the
intervals of fits that it does not call rejected are counted. Each rig makes the thesis's
identification record, with a lead-in of 2 s, white noise, and the steps of a 16-bit converter,
which holds the voltage; displacement is counted from the mean of the lead-in, as in a recording.
With ``--table`` the voltage is straight between samples, which the record does not say. The truth
is inside the model's class: what is counted is whether the intervals are honest, not whether the
model is right. With each share stands its own 95 % interval (Clopper and Pearson), and the RMS of
the errors in units of what the interval says. Where the model has the law of the rig, its chi-
square is compared with the least of a fit that starts at the true numbers. The parameters of a rig
miss together, so that a count of intervals scatters more than it says; what is independent is one
number of each rig: by how much chi-square is larger at the true numbers than at the fit, which has
the chi-square distribution of the parameters.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.stats import beta, chi2

from dearig.acquisition.run import RunOptions
from dearig.acquisition.run import record as run
from dearig.config.rigfile import load_rig_file
from dearig.config.sequencefile import load_sequence
from dearig.model import kernel
from dearig.model.diagnosis import diagnose
from dearig.model.effects import EffectValues
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD, Network
from dearig.model.fitting import Estimate, Identification, identify
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.rejection import misfit_p
from dearig.model.fitting.slow_noise import WhitenedProblem
from dearig.model.readings.records import ActuatorRecord, counted
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Sequence
from dearig.model.verdict import is_rejected
from dearig.sim_backend.truth.cases import address_of
from tests.blind.play import HERE, records_of
from tests.blind.seeds import drawn

EFFECTS_DRAWN: tuple[EffectValues, ...] = (
    (("load inertia", (("moving_mass", 0.15),)),),
    (("sensor lag", (("time_constant", 8e-3),)),),
    (("electrode resistance", (("resistance", 2e7),)),),
    (("linear drag", (("drag", 3000.0),)),),
)
CONVERTER_STEP = 80e-3 / 2**16  # m: +-40 mm over 16 bits
_NORMAL_95 = 1.96


@dataclass
class Count:
    """How often the interval of one parameter held the truth; errors in standard deviations."""

    held: int = 0
    of: int = 0
    errors: list[float] = field(default_factory=list)

    def add(self, estimate: Estimate, truth: float) -> None:
        """Count one estimate."""
        self.of += 1
        self.held += estimate.low <= truth <= estimate.high
        half = 0.5 * (estimate.high - estimate.low)
        if math.isfinite(half) and half > 0.0:
            self.errors.append(_NORMAL_95 * (truth - estimate.value) / half)

    def row(self, name: str) -> str:
        """Return the row of the table."""
        low = beta.ppf(0.025, self.held, self.of - self.held + 1) if self.held else 0.0
        high = 1.0 if self.held == self.of else beta.ppf(0.975, self.held + 1, self.of - self.held)
        rms = math.sqrt(float(np.mean(np.square(self.errors)))) if self.errors else math.nan
        return (
            f"| {name} | {self.held} of {self.of} | {100.0 * self.held / self.of:.0f} | "
            f"{100.0 * low:.0f} to {100.0 * high:.0f} | {rms:.2f} |"
        )


def rig_of(
    seed: int, effects: EffectValues = (), branches: int = 3, near: bool = False
) -> tuple[Actuator, float]:
    """Return the rig of ``seed`` and its noise in m; ``near`` brings two times within a tenth."""
    rng = np.random.default_rng(seed)
    moduli = rng.uniform((35e3, 20e3, 10e3, 5e3), (60e3, 60e3, 40e3, 20e3))
    times = np.exp(rng.uniform(np.log((0.15, 0.8, 4.0)), np.log((0.5, 2.5, 12.0))))
    noise = math.exp(rng.uniform(math.log(0.7e-6), math.log(3e-6)))
    if branches == 4:
        moduli = np.append(moduli, rng.uniform(5e3, 20e3))
        times = np.insert(times, 0, math.exp(rng.uniform(math.log(0.03), math.log(0.08))))
    moduli, times = moduli[: branches + 1], times[:branches]
    if near:
        times[1] = times[0] * rng.uniform(1.01, 1.1)
    network = Network.gent(tuple(moduli), (1e4,) * moduli.size, tuple(times))
    return Actuator(THESIS_FILM, THESIS_LOAD, network, effects), noise


def record_of(model: Actuator, noise: float, rate: float, seed: int, hold: bool) -> ActuatorRecord:
    """Return the thesis's record of ``model`` as a recording gives it to a fit."""
    drive = Drive(*Sequence.thesis().sample(rate), hold=hold)
    answer = model.simulate(drive)
    if not answer.ok:
        raise RuntimeError(f"rig {seed}: {answer.status_text}")
    rng = np.random.default_rng((seed, 1))
    read = answer.displacement + noise * rng.standard_normal(drive.time.size)
    read = CONVERTER_STEP * np.round(read / CONVERTER_STEP)
    lead_in = int(np.flatnonzero(drive.voltage)[0])
    floor = float(np.std(read[:lead_in], ddof=2))
    return ActuatorRecord(f"rig {seed}", drive, counted(read, lead_in), floor, lead_in=lead_in)


def truths(model: Actuator) -> dict[str, float]:
    """Return the true values by the names of a fit."""
    network = model.network
    found = {f"mu_{i}": s.modulus for i, s in enumerate(network.springs)}
    found |= {f"T_{i}": t for i, t in enumerate(network.times, 1)}
    for name, values in model.effects:
        found |= {f"{name}: {key}": value for key, value in values}
    return found


def count(
    counts: dict[str, Count], estimates: Iterable[Estimate], truth: dict[str, float]
) -> list[str]:
    """Count the estimates of parameters whose truth is known; return those that missed."""
    missed = []
    for e in estimates:
        if e.name in truth:
            counts.setdefault(e.name, Count()).add(e, truth[e.name])
            if not e.low <= truth[e.name] <= e.high:
                missed.append(e.name)
    return missed


def above_best(record: ActuatorRecord, found: Actuator, true: Actuator) -> float:
    """Return chi-square of the model ``found``, less that of a fit from the ``true`` numbers."""
    problem = WhitenedProblem([record], FitLayout(true), workers=1, fidelity=kernel.CAREFUL)
    layout = problem.layout
    limits = np.array([q.kind == "J" for q in layout.quantities])
    start = np.clip(layout.coordinates(layout.initial()), layout.lower, layout.upper)
    best = descend(problem, start, limits, 60, 0.1, 1e-4)
    own = WhitenedProblem([record], FitLayout(found), workers=1, fidelity=kernel.CAREFUL)
    here = own.costs(own.layout.coordinates(own.layout.initial())[None])[0]
    return float(here - best.cost) * problem.samples


def from_truth(record: ActuatorRecord, found: Actuator, true: Actuator) -> tuple[float, int]:
    """Return by how much chi-square is larger at the ``true`` numbers, and how many they are.

    Over the mean square of the fit: what a short lead-in says of the noise scatters by some
    per cent.
    """
    at_fit, at_truth = (
        WhitenedProblem([record], FitLayout(model), workers=1, fidelity=kernel.CAREFUL)
        for model in (found, true)
    )
    here, there = (
        p.costs(p.layout.coordinates(p.layout.initial())[None])[0] for p in (at_fit, at_truth)
    )
    limits = sum(q.kind == "J" for q in at_fit.layout.quantities)
    return float(there / here - 1.0) * at_fit.samples, at_fit.layout.size - limits


def hiding(seed: int, generator: str) -> tuple[Actuator, ActuatorRecord, str]:
    """Return the plain film of the rig of ``seed``, its record, and what the rig hides."""
    case = drawn(seed, generator)
    with tempfile.TemporaryDirectory() as folder:
        path, rig = Path(folder) / "run.h5", Path(folder) / "rig.toml"
        text = (HERE / "rig.toml").read_text(encoding="utf-8")
        rig.write_text(f"{text}\n[card]\nsample_rate_Hz = 200.0\n", encoding="utf-8")
        options = RunOptions(rig.read_text(encoding="utf-8"), seed=seed)
        address = address_of(seed, generator)
        run(load_sequence("thesis"), address, load_rig_file(rig), path, options)
        (record,) = records_of([path])
    return Actuator(case.film, case.load, case.network), record, " + ".join(case.families)


def _misfit(record: ActuatorRecord, fit: Identification) -> float | None:
    """Return the probability of residuals as large and correlated as those of ``fit``."""
    if not isinstance(fit.model, Actuator):
        raise TypeError("an actuator's record was fitted by something else")
    left = record.displacement - fit.model.simulate(record.drive, record.lag).displacement
    return misfit_p(left, left[: record.lead_in])


def count_hidden(counts: dict[str, Count], seeds: Iterable[int], generator: str) -> None:
    """Count the intervals of fits that lack what each rig hides, and that are not rejected."""
    rejected = fitted = 0
    for seed in seeds:
        if not drawn(seed, generator).families:
            continue
        model, record, hidden = hiding(seed, generator)
        fitted += 1
        # most models are rejected, and their intervals take most of the time
        if is_rejected(_misfit(record, identify([record], model, workers=1, intervals=False))):
            rejected += 1
            print(f"{seed}: {hidden}, rejected", flush=True)
            continue
        fit = identify([record], model, workers=1)
        p = _misfit(record, fit)
        missed = count(counts, fit.estimates, truths(model))
        print(f"{seed}: {hidden}, not rejected (p = {p}), missed {missed or 'none'}", flush=True)
    print(f"\n{rejected} of {fitted} models are rejected.")


def main() -> None:
    """Count, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, default=100, help="rigs [100]")
    parser.add_argument("--first", type=int, default=0, help="first seed [0]")
    parser.add_argument("--rate", type=float, default=1000.0, help="Hz [1000]")
    parser.add_argument("--branches", type=int, choices=(2, 3, 4), default=3, help="[3]")
    parser.add_argument("--near", action="store_true", help="two relaxation times nearly equal")
    parser.add_argument("--diagnose", action="store_true", help="diagnose rigs with one effect")
    parser.add_argument(
        "--table", action="store_true", help="do not say that the voltage is held between samples"
    )
    parser.add_argument(
        "--hidden", choices=("first", "second"), help="rigs that hide an effect, by this generator"
    )
    parser.add_argument("--workers", type=int, default=2, help="threads of a fit [2]")
    given = parser.parse_args()
    counts: dict[str, Count] = {}
    others, above, distances = 0, [], []
    seeds = range(given.first, given.first + given.rigs)
    if given.hidden:
        count_hidden(counts, seeds, given.hidden)
    for seed in () if given.hidden else seeds:
        started = time.perf_counter()
        effects = EFFECTS_DRAWN[seed % len(EFFECTS_DRAWN)] if given.diagnose else ()
        model, noise = rig_of(seed, effects, given.branches, given.near)
        record = record_of(model, noise, given.rate, seed, not given.table)
        base = replace(model, effects=())
        if given.diagnose:
            finding = diagnose([record], base, workers=given.workers)
            names = tuple(name for name, _ in finding.final.model.effects)
            said = f"{' + '.join(names) or 'nothing'} for {effects[0][0]}"
            if names == (effects[0][0],):
                missed = count(counts, finding.final.estimates, truths(model))
                above.append(above_best(record, finding.final.model, model))
                distances.append(from_truth(record, finding.final.model, model))
            else:
                # another law's parameters have no truth
                others, missed = others + 1, []
        else:
            fit = identify([record], base, workers=given.workers)
            said = f"cost {fit.cost:.3f}, correlation {fit.correlation:.2f}"
            missed = count(counts, fit.estimates, truths(model))
            above.append(above_best(record, fit.model, model))
            distances.append(from_truth(record, fit.model, model))
        spent = time.perf_counter() - started
        over = f"{above[-1]:.2f}" if above else "?"
        print(
            f"{seed}: {said}, missed {missed or 'none'}, chi-square {over}, {spent:.1f} s",
            flush=True,
        )
    print("\n| parameter | held | % | 95 % of that | RMS of errors |\n|---|---|---|---|---|")
    total = Count()
    for name, one in counts.items():
        print(one.row(name))
        total.held, total.of = total.held + one.held, total.of + one.of
        total.errors += one.errors
    if total.of:
        print(total.row("all"))
    if above:
        near = sum(a <= 1.0 for a in above)
        print(f"\nChi-square within 1 of the least from the truth: {near} of {len(above)}.")
        print(f"The largest excess is {max(above):.2f}.")
    if distances:
        far, numbers = np.array(distances).T
        beyond = int(np.count_nonzero(far > chi2.ppf(0.95, numbers)))
        print(
            f"Chi-square is {np.mean(far):.2f} larger at the true numbers, {np.mean(numbers):.2f} "
            f"expected (p = {chi2.sf(far.sum(), numbers.sum()):.2g}); beyond 95 % of its "
            f"distribution are {beyond} of {far.size} rigs, {0.05 * far.size:.1f} expected."
        )
    if others:
        print(f"\n{others} rigs were explained by another law and are not counted.")


if __name__ == "__main__":
    main()
