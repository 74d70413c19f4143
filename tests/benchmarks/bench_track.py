"""Tracking on simulated rigs that hide an effect, against what one would use instead.

Run as ``python -m tests.benchmarks.bench_track``. Each rig is recorded under the thesis's
excitation. Two models are fitted to that: the thesis's, and one with an effect. With
``--fit diagnosis`` (the default) it is what ``dearig diagnose`` finds with ``EFFORT``. With
``--fit family`` it is the law of the hidden family that fits best, and both fits start from the
springs of the rig: this shows what a right model is worth.

The target has sines of 0.25 to 5 Hz that are in no recording. Played are a linear map, both models,
five iterations of learning, and the peers of ``track_peers``: a PID loop in software, alone and
with the linear map added, and learning without a model. The peers have the film of the rig, its
noise, its limits and the same path; they get the nearest feasible one for nothing.

Rigs are the first ``--rigs`` from ``--first`` on that hide something; one on which an interlock
ends a run is left out, and its seed printed. ``--out FILE`` keeps a line of JSON for each rig:
those that are in it are not played again. ``--models FOLDER`` keeps the fitted models: rigs whose
models are in it are not fitted again. Tuning the PID loops takes most of the time, and ``--pid``
leaves them out after so many rigs.

Errors are target minus measured, RMS, where the model with the effect can follow. "Beyond the
noise" is the root of the difference of the squares of error and noise, that of all runs together.
The noise is that of a reading at rest without what is periodic. The floor is the smallest error
that a voltage was found to leave on the film itself (``track_floor``), with the noise: what no
learning can take off. Where the learned error is at most 1.5 times the noise, the floor is not
computed, and stands for the noise. "Film" are errors without noise and without what the sensor adds
whatever the film does: drift, interference, and jumps of the sensor. They tell whether the film
itself is where it was told to be; a reading that repeats such an error in every run, as those of
these rigs do, hides that.

``--feedforward`` plays nothing: it computes the errors of the film itself under the voltages of
both models, in a second a rig.

The first run is of the model that ``dearig track --compare`` has chosen by the run of the thesis's
model, see ``dearig.analysis.tracking``.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import count, islice
from pathlib import Path as FilePath
from unittest.mock import patch

import numpy as np

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.diagnose import diagnose_recordings
from dearig.analysis.readings.record import Readings
from dearig.analysis.track import track
from dearig.analysis.track_target import limits_of, task_of
from dearig.analysis.tracking import TrackedRun
from dearig.config.modelfile import ModelFile, load_model, save_model
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.config.targetfile import LoadedTarget, target_of
from dearig.drivers.settings import CardSettings
from dearig.errors import SafetyStop
from dearig.model import kernel
from dearig.model.control import invert
from dearig.model.control.bands import low_pass
from dearig.model.diagnosis import diagnose
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.effects import EFFECTS
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator
from dearig.recording import open_recording
from dearig.sim_backend.factory import plant_of
from dearig.sim_backend.plant import Plant
from dearig.sim_backend.truth.cases import UNKNOWN
from dearig.sim_backend.truth.plant import TruthPlant
from tests.benchmarks.track_floor import Truth
from tests.benchmarks.track_peers import Learning, Loop, Path, Rig, lowered, tuned
from tests.blind.seeds import drawn

FIRST = 7300  # seed
RATE = 200.0  # Hz
ITERATIONS = 5
EFFORT = 8e7  # integration steps of a diagnosis: less than a third of its own, for time
WORSE = 0.2  # um: a fifth of the noise of a reading
#: Families of which no voltage takes off what they do: they are added to the reading.
ADDED = ("drift", "interference")
#: Frequency in Hz of a sine of the target, its cycles, and its part of the largest displacement.
SINES = ((0.25, 2.0, 0.25), (1.3, 4.0, 0.15), (2.5, 5.0, 0.06), (5.0, 10.0, 0.02))


@dataclass(frozen=True)
class Row:
    """Errors in um of one rig; of ``learned`` and ``model_free`` those of each iteration.

    ``floor`` is the smallest error that any voltage was found to leave, with the noise. ``film``
    are errors of the film itself: under the voltage of the thesis's model, of the model with the
    effect, of the first run, and of the last iteration. ``chosen`` is False where the thesis's
    model was followed in place of the other. ``trials`` are the runs with which both PID loops were
    tuned.
    """

    seed: int
    hidden: tuple[str, ...]
    what: str
    found: str
    verdict: str
    chosen: bool
    noise: float
    floor: float
    linear: float
    thesis: float
    diagnosed: float
    learned: tuple[float, ...]
    pid: float
    pid_ahead: float
    trials: tuple[int, int]
    model_free: tuple[float, ...]
    film: tuple[float, float, float, float]
    notes: tuple[str, ...]

    @property
    def invertible(self) -> bool:
        """True if a model can have what is hidden, and a voltage can take it off."""
        return UNKNOWN not in self.hidden and any(f not in ADDED for f in self.hidden)

    @property
    def ratio(self) -> float:
        """Error beyond the noise with the effect, over that with the thesis's model."""
        return _beyond(self.diagnosed, self.noise) / max(_beyond(self.thesis, self.noise), 1e-9)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, default=40, help="how many rigs [40]")
    parser.add_argument("--first", type=int, default=FIRST, help=f"first seed [{FIRST}]")
    parser.add_argument("--seeds", help="rigs, such as 3,17, in place of those")
    parser.add_argument("--fit", choices=FITS, default="diagnosis", help="the models [diagnosis]")
    parser.add_argument("--out", type=FilePath, help="keep a line of JSON for each rig here")
    parser.add_argument("--pid", type=int, default=40, help="rigs with the PID loops [40]")
    parser.add_argument("--feedforward", action="store_true", help="play nothing, see above")
    parser.add_argument("--models", type=FilePath, help="keep the fitted models in this folder")
    given = parser.parse_args()
    seeds = list(islice(_hiding(given.first), given.rigs))
    if given.seeds:
        seeds = [int(seed) for seed in given.seeds.split(",")]
    if given.feedforward:
        _feedforward(seeds, FITS[given.fit], given.models)
        return
    kept = _kept(given.out)
    heads = (
        "hidden (seed)", "found", "noise", "floor", "linear map", "thesis's model",
        "with the effect", "ratio beyond the noise", f"learned {ITERATIONS}", "PID",
        "PID and linear map", f"model-free {ITERATIONS}",
    )  # fmt: skip
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    rows: list[Row] = []
    stopped: list[int] = []
    for number, seed in enumerate(seeds):
        row = kept.get(seed)
        if row is None:
            try:
                with tempfile.TemporaryDirectory() as folder:
                    row = _row(
                        seed, FITS[given.fit], FilePath(folder), given.models,
                        with_pid=number < given.pid,
                    )  # fmt: skip
            except SafetyStop as stop:
                print(f"{seed} ({drawn(seed).description}): {stop}", file=sys.stderr, flush=True)
                stopped.append(seed)
                continue
            if given.out:
                with given.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(row)) + "\n")
        rows.append(row)
        figures = (
            row.noise, row.floor, row.linear, row.thesis, row.diagnosed, row.ratio,
            row.learned[-1], row.pid, row.pid_ahead, row.model_free[-1],
        )  # fmt: skip
        found = row.found if row.chosen else f"{row.found} (not followed)"
        shown = ("" if math.isnan(f) else f"{f:.2f}" for f in figures)
        cells = [f"{' + '.join(row.hidden)} ({seed})", found, *shown]
        print("| " + " | ".join(cells) + " |", flush=True)
    print(f"\nRigs on which an interlock ended a run, left out: {stopped or 'none'}.")
    _summary(rows)


def _hiding(first: int) -> Iterator[int]:
    return (seed for seed in count(first) if drawn(seed).families)


def _kept(path: FilePath | None) -> dict[int, Row]:
    """Return the rows that are in a file already, by seed."""
    if path is None or not path.exists():
        return {}
    found = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        values = {k: tuple(v) if isinstance(v, list) else v for k, v in json.loads(line).items()}
        found[values["seed"]] = Row(**values)
    return found


def _summary(rows: list[Row]) -> None:
    """Print the figures that the benchmark is for."""
    chosen = [r for r in rows if r.invertible]
    # an error of N readings is known to a part: two runs of one voltage differ by less than this
    worse = [r for r in rows if r.diagnosed > 1.05 * r.thesis]
    unchosen = [r for r in rows if r.film[1] > r.film[0] + 0.2 * r.noise]
    film_worse = [r for r in rows if r.film[2] > r.film[0] + 0.2 * r.noise]
    grown = [r for r in rows if r.learned[-1] > 1.05 * r.diagnosed]
    film_grown = [r for r in rows if r.film[3] > r.film[2] + 0.2 * r.noise]
    above = [r for r in rows if r.floor > 1.5 * r.noise]
    print(f"\nIn um RMS; {len(rows)} rigs, {len(chosen)} with an effect that a model can invert.")
    if chosen:
        film = [r.film[2] / r.film[0] for r in chosen]
        print(
            f"Error beyond the noise with the effect over that of the thesis's model: median "
            f"{np.median([r.ratio for r in chosen]):.2f} of those {len(chosen)}; of the film "
            f"itself {np.median(film):.2f}."
        )
    print(
        f"More than 5 % worse than the thesis's model: {_seeds(worse)}; of the film itself, by "
        f"more than a fifth of the noise: {_seeds(film_worse)}, and without the choice of the "
        f"model: {_seeds(unchosen)}. The thesis's model was followed on: "
        f"{_seeds([r for r in rows if not r.chosen])}."
    )
    print(
        f"After {ITERATIONS} iterations at most 1.5 times the noise: "
        f"{sum(r.learned[-1] <= 1.5 * r.noise for r in rows)} of {len(rows)}, at most 1.5 times "
        f"the floor: {sum(r.learned[-1] <= 1.5 * r.floor for r in rows)}. The floor is above 1.5 "
        f"times the noise on {_seeds(above)}. The last run is worse than the first by more than "
        f"5 % on {_seeds(grown)}, that of the film itself by more than a fifth of the noise on "
        f"{_seeds(film_grown)}."
    )
    for name, of in (
        ("linear map", lambda r: r.linear),
        ("thesis's model", lambda r: r.thesis),
        ("with the effect", lambda r: r.diagnosed),
        (f"learned {ITERATIONS}", lambda r: r.learned[-1]),
        ("PID", lambda r: r.pid),
        ("PID and linear map", lambda r: r.pid_ahead),
        (f"model-free {ITERATIONS}", lambda r: r.model_free[-1]),
    ):
        parts = [of(r) / r.noise for r in rows if math.isfinite(of(r))]
        if not parts:
            continue
        print(
            f"{name} ({len(parts)} rigs): error over noise, median {np.median(parts):.2f}, "
            f"nine in ten below {np.quantile(parts, 0.9):.2f}, largest {max(parts):.2f}; "
            f"at most 1.5: {sum(part <= 1.5 for part in parts)}"
        )
    for r in rows:
        print(
            f"{r.seed} ({r.what}): learned {', '.join(f'{e:.2f}' for e in r.learned)}; model-free "
            f"{', '.join(f'{e:.2f}' for e in r.model_free)}; film "
            f"{', '.join(f'{e:.2f}' for e in r.film)}"
        )


def _seeds(rows: list[Row]) -> str:
    return f"({', '.join(str(r.seed) for r in rows)})" if rows else "(none)"


def _beyond(error: float, noise: float) -> float:
    return math.sqrt(max(error * error - noise * noise, 0.0))


def _feedforward(seeds: list[int], fit: Fit, models: FilePath | None) -> None:
    """Print the errors of the film itself under the voltages of both models."""
    heads = ("hidden (seed)", "found", "thesis's model", "with the effect", "ratio")
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    ratios, worse = [], []
    for seed in seeds:
        rig = RigFile(card=CardSettings(sample_rate_Hz=RATE))
        with tempfile.TemporaryDirectory() as folder:
            kept = models or FilePath(folder)
            both = _models(seed, rig, fit, kept, FilePath(folder) / "thesis.h5")[:2]
        plant, _ = plant_of(f"sim:{seed}", rig.as_film(), rig.as_load())
        thesis, model = (one.model for one in both)
        if not (
            isinstance(plant, TruthPlant)
            and isinstance(thesis, Actuator)
            and isinstance(model, Actuator)
        ):
            raise TypeError(f"the rig sim:{seed} hides nothing")
        task = task_of(_target(plant, rig), rig)
        ours = invert(model, task)
        theirs = invert(thesis, replace(task, target=ours.reference))
        truth, errors = Truth(plant, task), []
        for voltage in (theirs.voltage, ours.voltage):
            moved = truth.film(voltage)
            off = np.inf if moved is None else (ours.reference - moved)[ours.reachable]
            errors.append(float(np.sqrt(np.mean(np.square(off)))) * 1e6)
        case, ratio = drawn(seed), errors[1] / errors[0]
        found = ", ".join(name for name, _ in model.effects) or "nothing"
        if UNKNOWN not in case.families and any(f not in ADDED for f in case.families):
            ratios.append(ratio)
        if errors[1] > errors[0] + WORSE:
            worse.append(seed)
        print(
            f"| {' + '.join(case.families)} ({seed}) | {found} | {errors[0]:.2f} | "
            f"{errors[1]:.2f} | {ratio:.2f} |",
            flush=True,
        )
    print(
        f"\nThe film itself, in um RMS; {len(seeds)} rigs. Median of the ratios "
        f"{np.median(ratios):.2f} of {len(ratios)} with an effect that a model can invert; worse "
        f"by more than {WORSE} um: {worse or 'none'}."
    )


def _row(seed: int, fit: Fit, folder: FilePath, models: FilePath | None, *, with_pid: bool) -> Row:
    """Errors of everything on the rig ``sim:seed``; ``models`` is where fitted models are kept."""
    address, rig = f"sim:{seed}", RigFile(card=CardSettings(sample_rate_Hz=RATE))
    thesis, model, verdict = _models(seed, rig, fit, models or folder, folder / "thesis.h5")
    plant, _ = plant_of(address, rig.as_film(), rig.as_load())
    if not (isinstance(plant, TruthPlant) and isinstance(model.model, Actuator)):
        raise TypeError(f"the rig {address} hides nothing")
    ours = track(
        _target(plant, rig), model, address, rig, folder / "ours", RunOptions(seed=10),
        iterations=ITERATIONS, compare=thesis, nearest=True,
    )  # fmt: skip
    found = ours.inversion
    inside = found.voltage > 0.0
    path = Path(found.reference, found.reachable, inside, RATE, limits_of(rig))

    def error(measured: np.ndarray) -> float:
        known = found.reachable & np.isfinite(measured)
        return float(np.sqrt(np.mean((found.reference - measured)[known] ** 2))) * 1e6

    def read(run: TrackedRun) -> float:
        """Return the error of the reading as it was recorded."""
        reading = open_recording(run.recording).signal
        zeroed = reading - reading[: task.lead_in].mean()
        return error(np.where(np.isfinite(run.measured), zeroed, np.nan))

    linear, fitted, first, *learned = ours.runs
    task = task_of(_target(plant, rig), rig)
    truth = Truth(plant, task)
    noise = math.sqrt(np.mean([run.noise**2 for run in ours.runs]))
    errors = [read(run) for run in learned]
    left = 0.0
    if errors[-1] > 1.5e6 * noise:
        best = learned[int(np.argmin(errors))].voltage
        left = truth.floor(model.model, found.reference, found.reachable, [best])

    def of_film(voltage: np.ndarray) -> float:
        moved = truth.film(voltage)
        return math.inf if moved is None else error(moved)

    at = 0.5 * path.limits.voltage
    film = Rig(plant, noise, _static(plant, at) / at**2, np.random.default_rng(seed))
    pid = _with_pid(film, path) if with_pid else (math.nan, math.nan, (0, 0))
    case = drawn(seed)
    return Row(
        seed=seed, hidden=case.families, what=case.description,
        found=", ".join(name for name, _ in model.model.effects) or "nothing", verdict=verdict,
        chosen=not np.array_equal(first.voltage, fitted.voltage), noise=noise * 1e6,
        floor=math.hypot(left, noise) * 1e6, linear=read(linear),
        thesis=read(fitted), diagnosed=read(first),
        learned=tuple(errors),
        pid=pid[0], pid_ahead=pid[1], trials=pid[2],
        model_free=tuple(error(read) for read in Learning(film, path).runs(ITERATIONS)[1:]),
        film=(
            of_film(fitted.voltage), of_film(found.voltage), of_film(first.voltage),
            of_film(learned[-1].voltage),
        ),
        notes=tuple(dict.fromkeys(note for run in ours.runs for note in run.notes)),
    )  # fmt: skip


def _with_pid(film: Rig, path: Path) -> tuple[float, float, tuple[int, int]]:
    """Errors in um of the PID loops, alone and with the linear map, and their tuning runs."""
    loop = Loop(film, path.limits, RATE)
    # a user tunes on the sines, without the slow way back
    trial = path.part(slice(int(np.argmax(path.inside)), -round(13.0 * RATE)))
    gains, trials = tuned(loop, trial)
    helped, more = tuned(loop, trial, replace(gains, ahead=1.0 / film.gain))
    alone, ahead = (
        path.error(loop.follow(path, lowered(loop, path, chosen))) * 1e6
        for chosen in (gains, helped)
    )
    return alone, ahead, (trials, more)


def _models(
    seed: int, rig: RigFile, fit: Fit, kept: FilePath, train: FilePath
) -> tuple[ModelFile, ModelFile, str]:
    """Thesis's model, that with an effect, and its verdict, from the files in ``kept``.

    Those that are not there are fitted to the recording of the rig ``train``, and written.
    """
    kept.mkdir(exist_ok=True)
    paths = [kept / f"{seed}-{name}.toml" for name in ("thesis", "model")]
    if not all(path.exists() for path in paths):
        record(load_sequence("thesis"), f"sim:{seed}", rig, train, RunOptions())
        for path, one in zip(paths, fit(seed, train), strict=True):
            save_model(path, one.name, one.model, one.history, overwrite=True)
    thesis, model = (load_model(path) for path in paths)
    return thesis, model, str(model.history.get("verdict", ""))


def _by_diagnosis(_seed: int, train: FilePath) -> tuple[ModelFile, ModelFile]:
    """Thesis's model, and that of a diagnosis of the same recording."""
    capped = partial(diagnose, settings=DiagnosisSettings(effort=EFFORT))
    with patch("dearig.analysis.diagnose.diagnose", capped):
        found = diagnose_recordings([train])
    thesis = ModelFile("thesis's model", found.finding.baseline.model)
    return thesis, found.model


def _by_family(seed: int, train: FilePath) -> tuple[ModelFile, ModelFile]:
    """Thesis's model and that with the best law of the hidden families, both fitted."""
    case = drawn(seed)
    bare = Actuator(case.film, case.load, case.network)
    records = [Readings(open_recording(train)).record]
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
    layout = FitLayout(start)
    problem = Problem(records, layout, workers=1, fidelity=kernel.QUICK)
    held = np.zeros(layout.size, dtype=bool)
    held[layout.column("J")] = True
    fit = descend(problem, layout.coordinates(layout.initial()), held, iterations=40, quick=True)
    model = layout.model(layout.values(fit.x))
    if not isinstance(model, Actuator):
        raise TypeError("a fit of actuators gives one")
    return fit.cost, model


#: How the models of a rig are fitted: thesis's and that with an effect.
Fit = Callable[[int, FilePath], tuple[ModelFile, ModelFile]]
FITS: dict[str, Fit] = {"diagnosis": _by_diagnosis, "family": _by_family}


def _target(plant: Plant, rig: RigFile) -> LoadedTarget:
    """A path of the size that the film reaches at three quarters of its highest voltage."""
    largest = 0.6 * _static(plant, 0.75 * rig.limits.voltage_max_kV * 1e3)
    pieces = [np.linspace(0.0, 1.0, round(2.0 * RATE))]
    for frequency, cycles, part in SINES:
        t = np.arange(round(cycles / frequency * RATE)) / RATE
        fade = np.clip(np.minimum(t, t[-1] - t) * frequency, 0.0, 1.0)
        pieces.append(1.0 + part * fade * np.sin(2.0 * np.pi * frequency * t))
    pieces.append(0.1 + 0.9 * np.linspace(1.0, 0.0, round(5.0 * RATE)) ** 2)
    pieces.append(0.1 * np.linspace(1.0, 0.0, round(8.0 * RATE)) ** 2)
    path = largest * np.concatenate(pieces)
    path = low_pass(np.pad(path, 10), RATE, 20.0)
    path[0] = path[-1] = 0.0
    return target_of(np.arange(path.size) / RATE, path, "sines of 0.25 to 5 Hz")


def _static(plant: Plant, voltage: float) -> float:
    """Displacement in m of the film after 5 s at ``voltage`` V, reached in 1 s."""
    time = np.arange(round(6.0 * RATE)) / RATE
    volts = voltage * np.minimum(time, 1.0)
    motion, _ = plant.advance(time, volts, True)
    return float(motion.displacement[-1])


if __name__ == "__main__":
    main()
