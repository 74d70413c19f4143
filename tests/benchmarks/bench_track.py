"""Tracking on simulated rigs that hide an effect, against what one would use instead.

Run as ``python -m tests.benchmarks.bench_track``. Each rig is recorded under the thesis's
excitation, with ``--train rich`` under the rich one too. Two models are fitted to that: the
thesis's, and one with an effect. With ``--fit family`` (the default, and quick) the effect is the
law of the hidden family that fits best, and both fits start from the springs of the rig: this shows
what a right model is worth. With ``--fit diagnosis`` it is what ``dearig diagnose`` finds.

The target has sines of 0.3 to 5 Hz that were in no recording. Played are a linear map, both models,
five iterations of learning from each, and two peers:

- a PI loop in software, tuned on steps of the rig itself: 50 readings a second, each answered 20 ms
  later;
- learning without a model: the voltage squared is corrected by the last error over the static gain,
  through a low-pass filter of 3 Hz without phase.

Errors are target minus measured, RMS, where the model with the effect can follow. "Beyond the
noise" is the root of the difference of the squares of error and noise.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.diagnose import diagnose_recordings
from dearig.analysis.records import as_record
from dearig.analysis.track import track
from dearig.analysis.track_target import limits_of
from dearig.analysis.tracking import TrackOutcome
from dearig.config.modelfile import ModelFile
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.config.targetfile import LoadedTarget, target_of
from dearig.drivers.settings import CardSettings
from dearig.model import kernel
from dearig.model.actuator import Actuator
from dearig.model.control.bands import low_pass
from dearig.model.effects import EFFECTS
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import Layout
from dearig.model.fitting.problem import Problem
from dearig.model.records import Record
from dearig.recording import open_recording
from dearig.sim_backend.factory import plant_of
from dearig.sim_backend.plant import Plant
from tests.blind.seeds import drawn, family_seeds

FAMILIES = (
    "load_inertia",
    "drag",
    "electrode_resistance",
    "permittivity",
    "creep",
    "sensor_lag",
    "friction",
    "rate_independent_hysteresis",
    "dielectric_relaxation",
    "leakage",
    "softening",
    "thermal",
)
RATE = 200.0  # Hz
TRAINING = {"thesis": ("thesis",), "rich": ("thesis", "rich")}
ITERATIONS = 5
NOISE = 1.05e-6  # m: of a reading, for the peers that are not recorded
LOOP = 50.0  # Hz, of the PI loop
LATENCY = 1  # periods of the loop, from a reading to the voltage that answers it


@dataclass(frozen=True)
class Row:
    """Errors in um of one rig."""

    seed: int
    noise: float
    linear: float
    thesis: float
    diagnosed: float
    learned: tuple[float, ...]  # of each iteration, from the diagnosed model
    from_thesis: tuple[float, ...]
    pi: float
    model_free: tuple[float, ...]
    quiet: tuple[float, float]  # of the first and the last voltage, without noise and drift
    found: str


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, default=6, help="how many families, one rig each [6]")
    parser.add_argument("--seeds", help="rigs, such as 3,17, in place of those")
    parser.add_argument("--train", choices=TRAINING, default="thesis", help="training [thesis]")
    parser.add_argument("--fit", choices=FITS, default="family", help="the models [family]")
    given = parser.parse_args()
    seeds = [family_seeds(family, 1)[0] for family in FAMILIES[: given.rigs]]
    if given.seeds:
        seeds = [int(seed) for seed in given.seeds.split(",")]
    heads = (
        "hidden (seed)", "found", "noise", "linear map", "thesis's model", "with the effect",
        f"learned {ITERATIONS}, with it", f"learned {ITERATIONS}, thesis's", "PI loop",
        f"model-free {ITERATIONS}",
    )  # fmt: skip
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    rows = []
    for seed in seeds:
        started = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            row = _row(seed, TRAINING[given.train], FITS[given.fit], Path(folder))
        rows.append(row)
        hidden = " + ".join(drawn(seed).families) or "nothing"
        figures = (
            row.noise, row.linear, row.thesis, row.diagnosed, row.learned[-1], row.from_thesis[-1],
            row.pi, row.model_free[-1],
        )  # fmt: skip
        cells = [f"{hidden} ({seed})", row.found, *(f"{f:.2f}" for f in figures)]
        took = time.perf_counter() - started
        print("| " + " | ".join(cells) + f" | <!-- {took:.0f} s -->", flush=True)
    _summary(rows)


def _summary(rows: list[Row]) -> None:
    """Print the figures that the benchmark is for."""
    ratios = [_beyond(r.diagnosed, r.noise) / max(_beyond(r.thesis, r.noise), 1e-9) for r in rows]
    within = sum(r.learned[-1] <= 1.5 * r.noise for r in rows)
    print(
        f"\nIn um RMS. Error beyond the noise with the effect over that of the thesis's model: "
        f"median {np.median(ratios):.2f}, of each rig {', '.join(f'{r:.2f}' for r in ratios)}; "
        f"larger than 1 in {sum(r > 1.0 for r in ratios)} of {len(rows)} rigs."
    )
    print(
        f"After {ITERATIONS} iterations at most 1.5 times the noise: {within} of {len(rows)} rigs; "
        f"the best iteration worse than the first run: "
        f"{sum(min(r.learned) > 1.05 * r.diagnosed for r in rows)}; the last worse than the first: "
        f"{sum(r.learned[-1] > 1.05 * r.diagnosed for r in rows)}."
    )
    print(
        f"Without noise and drift of the sensor, the voltages of the first and the last run miss "
        f"the target by {', '.join(f'{r.quiet[0]:.2f} and {r.quiet[1]:.2f}' for r in rows)} um; "
        f"the last by more, and by more than a fifth of the noise: "
        f"{sum(r.quiet[1] > max(r.quiet[0], 0.2 * r.noise) for r in rows)}."
    )
    for r in rows:
        print(
            f"{r.seed}: learned from the model with the effect "
            f"{', '.join(f'{e:.2f}' for e in r.learned)}; from the thesis's "
            f"{', '.join(f'{e:.2f}' for e in r.from_thesis)}; model-free "
            f"{', '.join(f'{e:.2f}' for e in r.model_free)} um"
        )


def _beyond(error: float, noise: float) -> float:
    return math.sqrt(max(error * error - noise * noise, 0.0))


def _row(seed: int, training: tuple[str, ...], fit: Fit, folder: Path) -> Row:
    """Errors of everything on the rig ``sim:seed``."""
    address, rig = f"sim:{seed}", RigFile(card=CardSettings(sample_rate_Hz=RATE))
    train = []
    for i, name in enumerate(training):
        path = folder / f"{name}.h5"
        record(load_sequence(name), address, rig, path, RunOptions(seed=i))
        train.append(path)
    thesis, model = fit(seed, train)
    target = _target(rig, address)
    ours = track(
        target, model, address, rig, folder / "ours", RunOptions(seed=10), iterations=ITERATIONS,
        compare=thesis, nearest=True,
    )  # fmt: skip
    theirs = track(
        target, thesis, address, rig, folder / "theirs", RunOptions(seed=30),
        iterations=ITERATIONS, nearest=True,
    )  # fmt: skip
    of = _Errors(ours)
    linear, fitted, first, *learned = (of(run.measured) for run in ours.runs)
    plant, _ = plant_of(address, rig.as_film(), rig.as_load())
    peers = _Peers(plant, ours, rig, seed)
    return Row(
        seed, ours.noise * 1e6, linear, fitted, first, tuple(learned),
        tuple(of(run.measured) for run in theirs.runs[1:]), of(peers.pi()),
        tuple(of(row) for row in peers.learning()),
        (of(peers.quiet(ours.runs[2].voltage)), of(peers.quiet(ours.runs[-1].voltage))),
        ", ".join(name for name, _ in model.model.effects) or "nothing",
    )  # fmt: skip


def _by_diagnosis(seed: int, train: list[Path]) -> tuple[ModelFile, ModelFile]:
    """Thesis's model and that of a diagnosis, fitted to the same recordings."""
    found = diagnose_recordings(train)
    return ModelFile("thesis's model", found.finding.baseline.model), found.model


def _by_family(seed: int, train: list[Path]) -> tuple[ModelFile, ModelFile]:
    """Thesis's model and that with the best law of the hidden families, both fitted."""
    case = drawn(seed)
    bare = Actuator(case.film, case.load, case.network)
    records = [as_record(open_recording(path)) for path in train]
    _, thesis = _fitted(bare, records)
    laws = [
        name
        for name, effect in EFFECTS.items()
        if effect.family in case.families and "voltage" in effect.drives
        and effect.is_reproducible and not effect.is_general
    ]  # fmt: skip
    found = [_fitted(replace(bare, effects=((law, _typical(law)),)), records) for law in laws]
    _, best = min([*found, (math.inf, thesis)], key=lambda one: one[0])
    return ModelFile("thesis's model", thesis), ModelFile("with the effect", best)


def _typical(law: str) -> tuple[tuple[str, float], ...]:
    """Values of a law to start from."""
    values = []
    for p in EFFECTS[law].parameters:
        plain = p.starts and p.neutral is None and p.relative_to in ("", "spectrum")
        value = p.starts[0] if plain else p.typical + (p.neutral or 0.0)
        values.append((p.name, min(max(value, p.bounds[0]), p.bounds[1])))
    return tuple(values)


def _fitted(start: Actuator, records: list[Record]) -> tuple[float, Actuator]:
    """Mean square over noise, and the model that is fitted from ``start``."""
    layout = Layout(start)
    problem = Problem(records, layout, workers=1, fidelity=kernel.QUICK)
    held = np.zeros(layout.size, dtype=bool)
    held[layout.column("J")] = True
    fit = descend(problem, layout.coordinates(layout.initial()), held, iterations=40, quick=True)
    model = layout.model(layout.values(fit.x))
    if not isinstance(model, Actuator):
        raise TypeError("a fit of actuators gives one")
    return fit.cost, model


#: How the models of a rig are fitted: thesis's and that with an effect, from seed and recordings.
Fit = Callable[[int, list[Path]], tuple[ModelFile, ModelFile]]
FITS: dict[str, Fit] = {"family": _by_family, "diagnosis": _by_diagnosis}


class _Errors:
    """RMS in um of target minus measured, where the diagnosed model can follow."""

    def __init__(self, outcome: TrackOutcome) -> None:
        self._found = outcome.inversion

    def __call__(self, measured: np.ndarray) -> float:
        known = self._found.reachable & np.isfinite(measured)
        return float(np.sqrt(np.mean((self._found.reference - measured)[known] ** 2))) * 1e6


def _target(rig: RigFile, address: str) -> LoadedTarget:
    """A path of the size that the film reaches at half of its highest voltage."""
    plant, _ = plant_of(address, rig.as_film(), rig.as_load())
    largest = 0.6 * _static(plant, 0.75 * rig.limits.voltage_max_kV * 1e3)
    parts = [(0.3, 2.0, 0.25), (1.0, 3.0, 0.15), (2.5, 5.0, 0.06), (5.0, 10.0, 0.02)]
    pieces = [np.linspace(0.0, 1.0, round(2.0 * RATE))]
    for frequency, cycles, part in parts:
        t = np.arange(round(cycles / frequency * RATE)) / RATE
        fade = np.clip(np.minimum(t, t[-1] - t) * frequency, 0.0, 1.0)
        pieces.append(1.0 + part * fade * np.sin(2.0 * np.pi * frequency * t))
    pieces.append(0.1 + 0.9 * np.linspace(1.0, 0.0, round(5.0 * RATE)) ** 2)
    pieces.append(0.1 * np.linspace(1.0, 0.0, round(8.0 * RATE)) ** 2)
    path = largest * np.concatenate(pieces)
    path = low_pass(np.pad(path, 10), RATE, 20.0)
    path[0] = path[-1] = 0.0
    return target_of(np.arange(path.size) / RATE, path, "sines of 0.3 to 5 Hz")


def _static(plant: Plant, voltage: float) -> float:
    """Displacement in m of the film after 5 s at ``voltage`` V, reached in 1 s."""
    time = np.arange(round(6.0 * RATE)) / RATE
    volts = voltage * np.minimum(time, 1.0)
    motion, _ = plant.advance(time, volts, True)
    return float(motion.displacement[-1])


class _Peers:
    """What one would use without a model, on the film of a rig with noise on every reading."""

    def __init__(self, plant: Plant, outcome: TrackOutcome, rig: RigFile, seed: int) -> None:
        self.plant, self.found = plant, outcome.inversion
        self.limits = limits_of(rig)
        self.rng = np.random.default_rng(seed)
        self.largest = self.limits.voltage
        at = 0.5 * self.largest
        self.gain = _static(plant, at) / at**2  # m/V^2
        self.inside = self.found.voltage > 0.0

    def play(self, voltage: np.ndarray) -> np.ndarray:
        """Reading (N,) m under ``voltage`` (N,) V."""
        plant = self.plant.renewed(np.random.default_rng(self.rng.integers(2**31)))
        motion, _ = plant.advance(self.found.time, voltage, True)
        return motion.displacement + NOISE * self.rng.standard_normal(voltage.size)

    def quiet(self, voltage: np.ndarray) -> np.ndarray:
        """Displacement (N,) m under ``voltage`` (N,) V, without noise and drift of a sensor."""
        motion, _ = self.plant.advance(self.found.time, voltage, True)
        return motion.displacement

    def learning(self) -> list[np.ndarray]:
        """Readings (N,) m of the iterations after the linear map."""
        u = np.maximum(self.found.reference, 0.0) / self.gain
        rows = []
        for _ in range(ITERATIONS + 1):
            rows.append(self.play(self._within(u)))
            error = np.where(self.found.reachable, self.found.reference - rows[-1], 0.0)
            u = u + low_pass(error, RATE, 3.0) / self.gain
        return rows[1:]

    def _within(self, u: np.ndarray) -> np.ndarray:
        ceiling = np.where(self.inside, self.largest, 0.0)
        return self.limits.nearest(np.sqrt(np.maximum(u, 0.0)), ceiling, RATE)

    def pi(self) -> np.ndarray:
        """Reading (N,) m of the PI loop with the gains that were best on a step."""
        step = np.where(
            np.arange(round(4.0 * RATE)) > 0.5 * RATE, 0.5 * self.found.target.max(), 0.0
        )
        best, gains = math.inf, (0.0, 0.0)
        for proportional in (0.0, 0.1, 0.2, 0.4, 0.8):
            for integral in (1.0, 2.0, 4.0, 8.0, 16.0):
                missed = step - self._closed(step, proportional, integral)
                size = float(np.mean(np.abs(missed)))
                if size < best:
                    best, gains = size, (proportional, integral)
        return self._closed(self.found.reference, *gains)

    def _closed(self, wanted: np.ndarray, proportional: float, integral: float) -> np.ndarray:
        """Reading (N,) m of a loop; gains of a unit static gain, and of that per s."""
        every = round(RATE / LOOP)
        plant, reading = self.plant, np.zeros(wanted.size)
        summed, waiting = 0.0, [0.0] * (LATENCY + 1)
        for k in range(0, wanted.size - 1, every):
            stop = min(k + every, wanted.size - 1)
            seen = reading[k] + NOISE * self.rng.standard_normal()
            error = wanted[k] - seen
            asked = (proportional * error + summed) / self.gain
            # the integral stands still where the voltage is at a limit
            if 0.0 <= asked <= self.largest**2 or asked * error < 0.0:
                summed += integral * error / LOOP
            waiting = [*waiting[1:], math.sqrt(min(max(asked, 0.0), self.largest**2))]
            time = np.arange(k, stop + 1) / RATE
            motion, plant = plant.advance(time, np.full(time.size, waiting[0]), True)
            reading[k : stop + 1] = motion.displacement
        return reading + NOISE * self.rng.standard_normal(wanted.size)


if __name__ == "__main__":
    main()
