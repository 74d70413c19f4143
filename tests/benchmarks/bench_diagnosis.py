"""The diagnosis against what one would reach for instead, on the same recordings.

Run as ``python -m tests.benchmarks.bench_diagnosis``. Simulated rigs that hide one effect each (and
one that hides nothing) are recorded as in the blind test. Beside ``dearig diagnose``: more Maxwell
branches (4 and 5, of which the better on the validation recordings is shown, more than anybody who
may not look there could have), every effect fitted alone from the baseline's optimum and chosen by
BIC (what one would write in a week), and three ways to model the baseline's residual. Everything is
trained on the same recordings and simulated freely on the same other ones.

The residual's models need packages of their own: sysidentpy, pysindy and scikit-learn. Install them
next to the project in an environment of its own (they may want another NumPy). One that is missing
is named, and the others run.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dearig.model.diagnosis.evidence import family_of
from dearig.model.diagnosis.fits import Fitter, with_effect
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.diagnosis.shapes import typical_values
from dearig.model.effects import EFFECTS
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.fitting import identify
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator
from tests.benchmarks.residual_peers import PEERS, Course, missing, predicted
from tests.blind.play import MODES, Bench, Case, diagnose, records_of
from tests.blind.seeds import clean_seeds, drawn, family_seeds

FAMILIES = (
    "load_inertia",
    "drag",
    "friction",
    "rate_independent_hysteresis",
    "electrode_resistance",
    "permittivity",
    "creep",
    "sensor_lag",
)
MORE_BRANCHES = (4, 5)
FLAT_ITERATIONS = 30  # of each effect


@dataclass(frozen=True)
class Result:
    """Validation RMS in um (NaN: ran away), seconds, and what it says is missing."""

    rms: float
    seconds: float
    says: str = ""

    def __str__(self) -> str:
        reached = f"{self.rms:.2f}" if math.isfinite(self.rms) else "diverged"
        said = f", *{self.says}*" if self.says else ""
        return f"{reached} ({self.seconds:.0f} s){said}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", help="rigs, such as 3,17 [one of each of eight families]")
    parser.add_argument("--train", choices=MODES, default="rich", help="training [rich]")
    parser.add_argument("--rate", type=float, default=200.0, help="Hz [200]")
    given = parser.parse_args()
    seeds = [family_seeds(family, 1)[0] for family in FAMILIES] + clean_seeds(1)
    if given.seeds:
        seeds = [int(seed) for seed in given.seeds.split(",")]
    for peer in PEERS:
        if package := missing(peer):
            print(f"{peer.name} is left out: {package} is not installed.")
    peers = [peer for peer in PEERS if not missing(peer)]
    named = [peer.name for peer in peers]
    heads = ("hidden (seed)", "before", "branches", "flat BIC", *named, "dearig diagnose")
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), given.rate)
        _baseline(records_of(bench.record(Case(seeds[0], "thesis"), Path(folder))[0]))  # compiles
        for seed in seeds:
            cells = _row(bench, Case(seed, given.train), Path(folder) / str(seed))
            hidden = " + ".join(drawn(seed).families) or "nothing"
            print("| " + " | ".join([f"{hidden} ({seed})", *cells]) + " |", flush=True)
        print(
            f"\nValidation RMS in um, three recordings that count the same; noise "
            f"{bench.floor_um():.2f} um; training on {' and '.join(MODES[given.train])}. Only "
            f"flat BIC and dearig diagnose name a cause: it stands in italics."
        )
    for peer in peers:
        print(f"{peer.name}: {peer.about}.")


def _row(bench: Bench, case: Case, folder: Path) -> list[str]:
    """Cells of one case, from what was before to our own."""
    folder.mkdir()
    train_paths, other_paths = bench.record(case, folder)
    train, others = records_of(train_paths), records_of(other_paths)
    baseline = _baseline(train)
    before = _pooled([r.displacement - _displacement(baseline, r) for r in others])
    cells = [
        f"{before:.2f}",
        str(_more_branches(train, others, baseline.network)),
        str(_flat_bic(train, others, baseline)),
    ]
    courses = [_course(baseline, r) for r in train]
    unseen = [_course(baseline, r) for r in others]
    for peer in PEERS:
        if not missing(peer):
            started = time.perf_counter()
            found = predicted(peer, courses, unseen)
            seconds = time.perf_counter() - started
            left = [c.residual - f for c, f in zip(unseen, found, strict=True)]
            cells.append(str(Result(_pooled(left), seconds)))
    cells.append(str(_ours(train_paths, other_paths, folder)))
    return cells


def _with_branches(count: int) -> Actuator:
    """What is fitted; its numbers do not matter."""
    spring = Spring(1e5, 1e4, "gent")
    network = Network(spring, tuple(Branch(spring, 1.0) for _ in range(count)))
    return Actuator(THESIS_FILM, THESIS_LOAD, network)


def _fitted(
    records: Sequence[ActuatorRecord], branches: int, nested: Network | None = None
) -> Actuator:
    base = _with_branches(branches)
    model = identify(records, base, intervals=False, nested=nested).model
    if not isinstance(model, Actuator):
        raise TypeError("an actuator's records were fitted by something else")
    return model


def _baseline(records: Sequence[ActuatorRecord]) -> Actuator:
    return _fitted(records, 3)


def _more_branches(
    train: Sequence[ActuatorRecord], others: Sequence[ActuatorRecord], nested: Network
) -> Result:
    started = time.perf_counter()
    reached = []
    for count in MORE_BRANCHES:
        model = _fitted(train, count, nested)
        nested = model.network
        reached.append(_pooled([r.displacement - _displacement(model, r) for r in others]))
    return Result(min(reached), time.perf_counter() - started)


def _flat_bic(
    train: Sequence[ActuatorRecord], others: Sequence[ActuatorRecord], plain: Actuator
) -> Result:
    """The one effect, or none, of least n ln(mean square) + k ln n; each begins at the baseline."""
    started = time.perf_counter()
    fitter = Fitter(train, plain, DiagnosisSettings())
    baseline = fitter.baseline(lambda *_: None)
    fits = [baseline]
    for name, effect in EFFECTS.items():
        if "voltage" in effect.drives and not effect.needs:
            values = typical_values(effect)
            problem = fitter.problem(with_effect(baseline.model, name, values))
            start = fitter.start_of(problem, baseline.x, values)
            fits.append(fitter.descend(problem, start, FLAT_ITERATIONS))
    n = baseline.problem.samples
    best = min(fits, key=lambda f: n * math.log(f.cost) + f.free * math.log(n))
    if not isinstance(best.model, Actuator):
        raise TypeError("an actuator's records were fitted by something else")
    left = [r.displacement - _displacement(best.model, r) for r in others]
    says = family_of(best.effects[0]) if best.effects else "nothing"
    return Result(_pooled(left), time.perf_counter() - started, says)


def _ours(train: Sequence[Path], others: Sequence[Path], folder: Path) -> Result:
    answer, error, seconds = diagnose(train, others, folder / "out.json")
    if answer is None:
        return Result(math.nan, seconds, error)
    says = " + ".join(step["family"] for step in answer["steps"])
    if answer["unnamed"]:
        says = f"{says} + unnamed".removeprefix(" + ")
    return Result(answer["final"]["validation"]["rms_um"], seconds, says or answer["verdict"])


def _displacement(model: Actuator, record: ActuatorRecord) -> np.ndarray:
    response = model.simulate(record.drive, record.lag)
    if not response.ok:
        return np.full(record.time.size, np.nan)
    return response.displacement


def _course(baseline: Actuator, record: ActuatorRecord) -> Course:
    base = _displacement(baseline, record)
    return Course(record.time, record.drive.voltage, base, record.displacement - base)


def _pooled(residuals: Sequence[np.ndarray]) -> float:
    """RMS in um over records that count the same."""
    return 1e6 * math.sqrt(float(np.mean([np.mean(r**2) for r in residuals])))


if __name__ == "__main__":
    main()
