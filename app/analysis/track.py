"""Tracking: the film is made to follow a displacement, run after run.

Every run is a run of ``dearig.acquisition.run.record``: a sequence with the computed voltage passes
the gate, the interlocks and the guardian as any other, and is recorded as any other.
"""

from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypedDict

import numpy as np
import tomli_w

from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.rigs import kind_of
from dearig.acquisition.run import RunObserver, RunOptions, RunResult, record
from dearig.analysis.quality import inspect
from dearig.config.modelfile import ModelFile, model_toml
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, load_sequence
from dearig.config.targetfile import LoadedTarget
from dearig.drivers.gate import Margin
from dearig.errors import DearigError, InputError, Interrupted
from dearig.model.actuator import Actuator
from dearig.model.control import Inversion, Learner, Lesson, Unreachable, VoltageLimits, invert
from dearig.model.effects import EFFECTS
from dearig.model.errors import ModelError
from dearig.model.noise import noise_of
from dearig.model.stability import static_stretch
from dearig.progress import Progress, quiet
from dearig.recording.reader import open_recording
from dearig.recording.recording import Recording
from dearig.recording.result_folder import result_folder

__all__ = [
    "KINDS",
    "SAMPLES_MAX",
    "WITHIN",
    "TrackOutcome",
    "TrackedRun",
    "alternatives_of",
    "check_feasible",
    "limits_of",
    "plan_target",
    "track",
]

log = logging.getLogger(__name__)

#: Kinds of runs, in their order.
KINDS = ("linear", "thesis", "model", "learned")
#: Samples of a target at most: 17 min at 1 kHz. The inversion holds them, several times over.
SAMPLES_MAX = 1_000_000
#: Distance in m from a target that is accepted: a film rounds every corner by some micrometres.
WITHIN = 5e-6

_PARTS_SHOWN = 3  # of what is unreachable, in a sentence
_FALLBACK = 1e-7  # m: the noise of a sensor whose reading never changes


@dataclass(frozen=True, eq=False)
class TrackedRun:
    """A run of a target.

    ``kind`` is one of ``KINDS``, ``iteration`` counts from 0. ``rms`` and ``largest`` in m are of
    reference minus measured, over the ``samples`` that the film can reach and that were usable;
    NaN where there are none. ``recording`` is the file, ``margins`` those of the gate. ``time``,
    ``measured`` (NaN where unusable), ``predicted`` and ``voltage`` are (N,) in SI units.
    ``noise`` in m is the standard deviation of a reading at rest.
    ``edge`` in Hz is up to where the next run learned from this one, 0 where it did not.
    """

    kind: str
    iteration: int
    rms: float
    largest: float
    samples: int
    recording: Path
    margins: tuple[Margin, ...]
    time: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray | None
    voltage: np.ndarray
    noise: float
    edge: float = 0.0
    contraction: float = math.nan
    notes: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """The run in words."""
        return {
            "linear": "linear map",
            "thesis": "compared model",
            "model": "model",
            "learned": f"learned, iteration {self.iteration}",
        }[self.kind]


@dataclass(frozen=True, eq=False)
class TrackOutcome:
    """A target that was followed: what can be reached, and every run.

    ``status`` is ``complete``, ``interrupted`` by the operator, or ``stopped`` by a limit, an
    instrument or the gate, with the ``reason``. ``noise`` in m is that of a reading, ``within`` in
    m the distance from the target that is accepted.
    """

    target: LoadedTarget
    model: ModelFile
    rig: str
    inversion: Inversion
    within: float
    runs: tuple[TrackedRun, ...] = ()
    noise: float = math.nan
    status: str = "complete"
    reason: str = ""
    warnings: tuple[str, ...] = ()
    report: Path | None = None

    @property
    def feasible(self) -> bool:
        """True if the film can follow the whole target, within the accepted distance."""
        return all(part.worst <= self.within for part in self.inversion.unreachable)

    @property
    def best(self) -> TrackedRun | None:
        """The run of the model, or learned from it, with the smallest error."""
        ours = [r for r in self.runs if r.kind in ("model", "learned") and math.isfinite(r.rms)]
        return min(ours, key=lambda r: r.rms, default=None)


class _Ends(TypedDict):
    lead_in: int
    tail: int
    lag: float


@dataclass(frozen=True)
class _Job:
    """What does not change from run to run."""

    target: LoadedTarget
    address: str
    rig_file: RigFile
    folder: Path
    options: RunOptions
    observer: RunObserver | None
    progress: Progress
    inversion: Inversion
    lead_in: int
    tail: int
    runs: list[TrackedRun] = field(default_factory=list)

    @property
    def limits(self) -> VoltageLimits:
        """Limits of the voltage."""
        return limits_of(self.rig_file)

    @property
    def ends(self) -> _Ends:
        """Samples at rest and age of a reading, for an inversion."""
        return {"lead_in": self.lead_in, "tail": self.tail, "lag": _lag(self.rig_file)}


# ---------------------------------------------------------------- before a run


def limits_of(rig_file: RigFile) -> VoltageLimits:
    """Return the limits within which a voltage is computed: those of the gate."""
    limits = rig_file.gate_limits()
    return VoltageLimits(limits.voltage_max, limits.slew, limits.field)


def plan_target(
    target: LoadedTarget, model: Actuator, rig_file: RigFile
) -> tuple[Inversion, int, int]:
    """Return the voltage of ``target`` for ``model``, and its samples of lead-in and tail.

    Raises ``InputError`` for a target that is too long, and for a model that cannot be inverted.
    """
    wanted, lead_in, tail = _sampled(target, rig_file)
    try:
        found = invert(
            model, wanted, float(rig_file.card.sample_rate_Hz), limits_of(rig_file),
            lead_in=lead_in, tail=tail, lag=_lag(rig_file),
        )  # fmt: skip
    except ModelError as error:
        raise InputError(f"target {target.name!r}: {error}") from error
    return found, lead_in, tail


def check_feasible(
    target: LoadedTarget, unreachable: Sequence[Unreachable], within: float = WITHIN
) -> None:
    """Raise ``InputError`` where the film misses ``target`` by more than ``within`` m.

    The sentence says when, why and by how much.
    """
    parts = [part for part in unreachable if part.worst > within]
    if parts:
        said = "; ".join(part.sentence for part in parts[:_PARTS_SHOWN])
        more = len(parts) - _PARTS_SHOWN
        raise InputError(
            f"target {target.name!r} cannot be reached: {said}"
            + (f" (and {more} more)" if more > 0 else "")
            + "; give another target, or use --nearest to follow the nearest feasible one"
        )


def _sampled(target: LoadedTarget, rig_file: RigFile) -> tuple[np.ndarray, int, int]:
    rate = float(rig_file.card.sample_rate_Hz)
    if target.sequence.sequence.duration * rate > SAMPLES_MAX:
        raise InputError(
            f"target {target.name!r} lasts {target.sequence.sequence.duration:.4g} s, which is "
            f"more than {SAMPLES_MAX:,} samples at {rate:g} Hz: shorten it, or lower "
            f"card.sample_rate_Hz in the rig file"
        )
    _, wanted, lead_in, tail = target.sample(rate)
    if wanted.size - lead_in - tail < 4:
        raise InputError(f"target {target.name!r} has fewer than 4 samples at {rate:g} Hz")
    return wanted, lead_in, tail


def _lag(rig_file: RigFile) -> float:
    """Return by how much a reading is older than the sample at which it is recorded, in s."""
    inputs = [name for name in rig_file.terminals() if name != "voltage_command"]
    return rig_file.laser.delay - rig_file.skew(inputs.index("displacement"))


def alternatives_of(model: ModelFile) -> tuple[Actuator, ...]:
    """Return models with one parameter each at an end of its 95 % interval.

    They are taken from the history that ``dearig identify`` writes; without one there are none.
    """
    estimates = model.history.get("estimate")
    actuator = model.model
    if not isinstance(actuator, Actuator) or not isinstance(estimates, list):
        return ()
    found = []
    for estimate in estimates:
        if not isinstance(estimate, dict) or not estimate.get("determined"):
            continue
        for end in ("low95", "high95"):
            value = estimate.get(end)
            if isinstance(value, int | float):
                found += _with(actuator, str(estimate.get("name", "")), float(value))
    return tuple(found)


def _with(actuator: Actuator, name: str, value: float) -> list[Actuator]:
    """Return ``actuator`` with the parameter ``name`` at ``value``; nothing where it has none."""
    network = actuator.network
    try:
        effect, colon, parameter = name.partition(": ")
        if colon and effect in EFFECTS:
            effects = tuple(
                (n, tuple((p, value if n == effect and p == parameter else v) for p, v in values))
                for n, values in actuator.effects
            )
            return [replace(actuator, effects=effects)]
        symbol, _, number = name.partition("_")
        if symbol not in ("mu", "T") or not number.isdigit():
            return []  # a limit J hardly changes a film that is stretched so little
        i = int(number)
        if i == 0 and symbol == "mu":
            spring = replace(network.equilibrium, modulus=value)
            return [replace(actuator, network=replace(network, equilibrium=spring))]
        branches = list(network.branches)
        branch = branches[i - 1]
        branches[i - 1] = (
            replace(branch, relaxation_time=value)
            if symbol == "T"
            else replace(branch, spring=replace(branch.spring, modulus=value))
        )
        return [replace(actuator, network=replace(network, branches=tuple(branches)))]
    except (ModelError, IndexError):
        return []


# ---------------------------------------------------------------- runs


def track(
    target: LoadedTarget,
    model: ModelFile,
    address: str,
    rig_file: RigFile,
    folder: Path,
    options: RunOptions,
    *,
    iterations: int = 5,
    compare: ModelFile | None = None,
    nearest: bool = False,
    within: float = WITHIN,
    observer: RunObserver | None = None,
    ended: Callable[[TrackOutcome], None] | None = None,
    progress: Progress = quiet,
) -> TrackOutcome:
    """Make the film on the rig at ``address`` follow ``target``, learning from run to run.

    The first run plays the voltage that ``model`` asks for, and ``iterations`` more what was
    learned. With ``compare``, a linear map and that model are played before. Recordings and the
    sequences that were played are written to ``folder``. A target that the film misses by more than
    ``within`` m is refused; with ``nearest`` the nearest feasible one is followed. ``ended`` is
    called with what was done where a run ends early, before its error is raised.

    Raises ``InputError`` before anything is played for a target that cannot be reached, and what
    ``record`` raises.
    """
    ours = _actuator(model, "--model")
    inversion, lead_in, tail = plan_target(target, ours, rig_file)
    if not nearest:
        check_feasible(target, inversion.unreachable, within)
    kind_of(address)  # refuses what is no rig
    result_folder(folder, options.overwrite)
    job = _Job(
        target, address, rig_file, folder, options, observer, progress, inversion, lead_in, tail
    )
    outcome = TrackOutcome(
        target, model, address, inversion, within, warnings=tuple(_warnings(ours, rig_file))
    )

    def now(status: str = "complete", reason: str = "") -> TrackOutcome:
        noise = job.runs[-1].noise if job.runs else math.nan
        return replace(outcome, runs=tuple(job.runs), noise=noise, status=status, reason=reason)

    try:
        if compare is not None:
            _play_others(job, compare)
        _play_and_learn(job, model, ours, iterations)
    except (DearigError, ModelError, KeyboardInterrupt) as error:
        stopped: DearigError
        if isinstance(error, DearigError):
            stopped = error
        elif isinstance(error, ModelError):
            stopped = InputError(f"target {target.name!r}: {error}")
        else:
            stopped = Interrupted(
                f"interrupted between two runs, at 0 V; {len(job.runs)} runs are in {folder}"
            )
        status = "interrupted" if isinstance(stopped, Interrupted) else "stopped"
        if isinstance(stopped, InputError) and not job.runs:
            with contextlib.suppress(OSError):  # it may hold files of others
                folder.rmdir()
        elif ended is not None:
            ended(now(status, str(stopped)))
        if stopped is error:
            raise
        raise stopped from error
    return now()


def _play_others(job: _Job, compare: ModelFile) -> None:
    """Play the voltages of a linear map and of another model, for the same reference."""
    theirs = _actuator(compare, "--compare")
    job.runs.append(_play(job, "linear", 0, _linear_map(job, theirs), None))
    found = invert(theirs, job.inversion.reference, job.inversion.rate, job.limits, **job.ends)
    job.runs.append(_play(job, "thesis", 0, found.voltage, compare))


def _play_and_learn(job: _Job, model: ModelFile, ours: Actuator, iterations: int) -> None:
    """Play the voltage of the model, and then what was learned."""
    job.progress("learning", 0.0)
    learner = Learner(
        ours, job.inversion.target, job.inversion.rate, job.limits, **job.ends,
        alternatives=alternatives_of(model),
    )  # fmt: skip
    for i in range(iterations + 1):
        run = _play(job, "learned" if i else "model", i, learner.voltage, model)
        job.progress("learning", i / (iterations + 1))
        lesson = learner.learn(run.measured, run.noise)
        job.runs.append(_taught(run, lesson, last=i == iterations))


def _actuator(model: ModelFile, option: str) -> Actuator:
    if isinstance(model.model, Actuator):
        return model.model
    raise InputError(
        f"{option}: the model {model.name!r} is of a bare film, which a voltage does not move: "
        f"give one of an actuator"
    )


def _warnings(model: Actuator, rig_file: RigFile) -> Iterator[str]:
    if model.film != rig_file.as_film():
        yield "the model is of another film than the rig file's"
    if model.load.mass != rig_file.load.mass_g / 1e3:
        yield (
            f"the model is of a load of {model.load.mass * 1e3:g} g, the rig file of "
            f"{rig_file.load.mass_g:g} g"
        )


def _linear_map(job: _Job, model: Actuator) -> np.ndarray:
    """Return the voltage (N,) in V of a film whose displacement is a straight line over V^2.

    The line is that of ``model`` at rest, through 0 and the largest displacement of the reference:
    what a person has who measured one displacement at one voltage.
    """
    inversion, limits = job.inversion, job.limits
    largest = float(inversion.reference.max())
    volts = np.zeros(inversion.time.size)
    if largest > 0.0:
        low, high = 0.0, limits.voltage
        for _ in range(50):  # halvings of the voltage's range: to the last digit
            middle = 0.5 * (low + high)
            try:
                moved = (static_stretch(model, middle) - model.rest()) * model.film.length
            except ModelError:  # beyond pull-in
                moved = math.inf
            low, high = (middle, high) if moved < largest else (low, middle)
        volts = high * np.sqrt(np.maximum(inversion.reference, 0.0) / largest)
    ceiling = np.full(volts.size, limits.voltage)
    ceiling[: job.lead_in] = 0.0
    ceiling[volts.size - job.tail :] = 0.0
    return limits.nearest(volts, ceiling, inversion.rate)


def _play(
    job: _Job, kind: str, iteration: int, voltage: np.ndarray, model: ModelFile | None
) -> TrackedRun:
    """Play ``voltage`` (N,) V, record it, and return the run."""
    stem = f"{kind}-{iteration}" if kind == "learned" else kind
    loaded = _as_sequence(job, stem, voltage)
    overlay = None
    if model is not None and isinstance(model.model, Actuator):
        overlay = OverlayModel(
            model.name, model.model, toml=model_toml(model.name, model.model, model.history)
        )
    notes = f"target {job.target.name!r}, {stem}"
    options = replace(
        job.options,
        seed=job.options.seed + len(job.runs),  # the noise of two runs is independent
        notes=f"{job.options.notes}; {notes}" if job.options.notes else notes,
    )
    try:
        result: RunResult = record(
            loaded, job.address, job.rig_file, job.folder / f"{stem}.h5", options, overlay=overlay,
            observer=job.observer, progress=job.progress,
        )  # fmt: skip
    except InputError:  # nothing was played
        for ending in ("csv", "toml"):
            (job.folder / f"{stem}.{ending}").unlink()
        raise
    recording = open_recording(result.path)
    return _measured(job, kind, iteration, recording, result.margins)


def _as_sequence(job: _Job, stem: str, voltage: np.ndarray) -> LoadedSequence:
    """Write ``voltage`` (N,) V as a sequence in the folder, and return it as it is read."""
    time = np.arange(voltage.size) / job.inversion.rate
    table = np.column_stack([time, voltage])
    np.savetxt(
        job.folder / f"{stem}.csv", table, fmt="%.12g", delimiter=",", header="time_s,voltage_V",
        comments="",
    )  # fmt: skip
    text = tomli_w.dumps(
        {
            "name": f"{job.target.name}, {stem}",
            "lead_in_s": 0.0,  # the file has both
            "tail_s": 0.0,
            "segment": [{"kind": "csv", "file": f"{stem}.csv"}],
        }
    )
    path = job.folder / f"{stem}.toml"
    path.write_text(text, encoding="utf-8", newline="\n")
    return load_sequence(path)


def _noise(recording: Recording) -> float:
    """Return the standard deviation in m of a reading at rest."""
    floor = recording.noise_floor or noise_of(recording.signal)
    return floor if floor > 0.0 else _FALLBACK


def _reading(recording: Recording) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the displacement (N,) m of a recording, and which readings may be used."""
    try:
        return recording.signal, inspect(recording, to_fit=False).valid
    except InputError as error:
        log.info("%s: nothing is learned from it: %s", recording.path, error)
        return recording.signal, np.zeros(recording.samples, dtype=bool)


def _measured(
    job: _Job,
    kind: str,
    iteration: int,
    recording: Recording,
    margins: tuple[Margin, ...],
) -> TrackedRun:
    """Return a run with its errors from the reference."""
    inversion = job.inversion
    reading, valid = _reading(recording)
    n = min(reading.size, inversion.time.size)
    usable = np.isfinite(reading[:n]) if valid is None else valid[:n] & np.isfinite(reading[:n])
    rest = usable & (np.arange(n) < job.lead_in)
    measured = np.full(inversion.time.size, np.nan)
    zero = float(np.median(reading[:n][rest])) if rest.any() else 0.0
    measured[:n] = np.where(usable, reading[:n] - zero, np.nan)
    error = (inversion.reference - measured)[inversion.reachable & np.isfinite(measured)]
    commanded = recording.voltage_command
    voltage = np.zeros(inversion.time.size)
    if commanded is not None:
        voltage[:n] = commanded[:n]
    predicted = recording.displacement_model
    return TrackedRun(
        kind=kind,
        iteration=iteration,
        rms=float(np.sqrt(np.mean(error**2))) if error.size else math.nan,
        largest=float(np.abs(error).max()) if error.size else math.nan,
        samples=int(error.size),
        recording=recording.path,
        margins=margins,
        time=inversion.time,
        measured=measured,
        predicted=None if predicted is None or predicted.size != n else predicted,
        voltage=voltage,
        noise=_noise(recording),
    )


def _taught(run: TrackedRun, lesson: Lesson, last: bool) -> TrackedRun:
    """Return ``run`` with what was learned from it, errors without what was left out."""
    return replace(
        run,
        rms=lesson.rms,
        largest=lesson.largest,
        samples=lesson.samples,
        edge=0.0 if last else lesson.edge,
        contraction=math.nan if last else lesson.contraction,
        notes=lesson.notes,
    )
