"""Tracking: the film is made to follow a displacement, run after run.

A ``Tracking`` proposes the next voltage and learns from the recording. It plays nothing: the
command and the window play the proposed sequence as any other, through the gate, the interlocks and
the guardian.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import tomli_w

from dearig.analysis.readings.band import PredictionBand, band_of, covariance_of
from dearig.analysis.readings.record import Readings
from dearig.analysis.track_target import WITHIN, missed_parts, task_of
from dearig.config.modelfile import ModelFile
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, load_sequence
from dearig.config.targetfile import LoadedTarget
from dearig.drivers.gate import Margin
from dearig.errors import InputError
from dearig.model.control import (
    Inversion,
    Learner,
    LearningSettings,
    TrackingTask,
    invert,
    lines_at_rest,
    mean_without_outliers,
    readings_under,
)
from dearig.model.errors import ModelError
from dearig.model.fitting.parameters import NORMAL_95, FitLayout
from dearig.model.readings.noise import noise_of
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Sampled, Sequence
from dearig.model.simulation.stability import static_stretch
from dearig.recording.reading.recording import Recording

__all__ = [
    "KINDS",
    "Proposal",
    "TrackOutcome",
    "TrackedRun",
    "Tracking",
    "alternatives_of",
    "misfits_of",
]

log = logging.getLogger(__name__)

#: Kinds of runs, in their order.
KINDS = ("linear", "thesis", "model", "learned")

_FALLBACK = 1e-7  # m: the noise of a sensor whose reading never changes
_FINISHED = "finished"  # outcome of a recording whose run came to its end


@dataclass(frozen=True, eq=False)
class _Named:
    """A run of a target: ``kind`` is one of ``KINDS``, ``iteration`` counts from 0."""

    kind: str
    iteration: int

    @property
    def label(self) -> str:
        """The run in words."""
        return {
            "linear": "linear map",
            "thesis": "compared model",
            "model": "model",
            "learned": f"learned, iteration {self.iteration}",
        }[self.kind]

    @property
    def stem(self) -> str:
        """Name of its sequence's files, without an ending."""
        return f"{self.kind}-{self.iteration}" if self.kind == "learned" else self.kind


@dataclass(frozen=True, eq=False)
class Proposal(_Named):
    """The next run of a target, before it is played.

    ``kind`` is one of ``KINDS``, ``iteration`` counts from 0. ``voltage`` (N,) in V is held between
    samples at ``rate`` Hz. ``expected`` (N,) in m is the displacement that is expected under it,
    None without a model. ``model`` is the one that computed the voltage, None for a linear map.
    ``target`` is the name of the target.
    """

    voltage: np.ndarray
    expected: np.ndarray | None
    rate: float
    target: str
    model: ModelFile | None

    @property
    def name(self) -> str:
        """Name of its sequence."""
        return f"{self.target}, {self.stem}"

    @property
    def time(self) -> np.ndarray:
        """Time (N,) in s."""
        return np.arange(self.voltage.size) / self.rate

    def sequence(self) -> LoadedSequence:
        """Return its sequence, in no file: the gate can check it before anything is written."""
        path = Sampled(self.time, self.voltage)
        return LoadedSequence(Sequence(self.name, (path,), 0.0, 0.0, ("csv",)), "", (0.0,), (0,))

    def write(self, folder: Path) -> LoadedSequence:
        """Write its sequence to ``folder``, TOML and table, and return it as it is read.

        Raises ``InputError``.
        """
        table = np.column_stack([self.time, self.voltage])
        text = tomli_w.dumps(
            {
                "name": self.name,
                "lead_in_s": 0.0,  # the table has both
                "tail_s": 0.0,
                "segment": [{"kind": "csv", "file": f"{self.stem}.csv"}],
            }
        )
        path = folder / f"{self.stem}.toml"
        try:
            np.savetxt(
                folder / f"{self.stem}.csv", table, fmt="%.12g", delimiter=",",
                header="time_s,voltage_V", comments="",
            )  # fmt: skip
            path.write_text(text, encoding="utf-8", newline="\n")
        except OSError as error:
            raise InputError(
                f"the sequence {path} cannot be written: {error.strerror or error}"
            ) from error
        return load_sequence(path)


@dataclass(frozen=True, eq=False)
class TrackedRun(_Named):
    """A run of a target.

    ``kind`` is one of ``KINDS``, ``iteration`` counts from 0. ``rms`` and ``largest`` in m are of
    reference minus measured, over the ``samples`` that the film can reach and that were usable;
    NaN where there are none. ``recording`` is the file, ``margins`` those of the gate. ``time``,
    ``measured`` (NaN where unusable, without the interference that is there at rest too),
    ``predicted`` and ``voltage`` are (N,) in SI units.
    ``noise`` in m is the standard deviation of a reading at rest.
    ``edge`` in Hz is up to where the next run learned from this one, 0 where it did not.
    """

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


@dataclass(frozen=True, eq=False)
class TrackOutcome:
    """A target that was followed: what can be reached, and every run.

    ``status`` is ``complete``, ``interrupted`` by the operator, or ``stopped`` by a limit, an
    instrument or the gate, with the ``reason``; a complete one has a reason where nothing more was
    to be learned before all runs were made. ``noise`` in m is that of a reading, ``within`` in
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
        return not missed_parts(self.inversion.unreachable, self.within)

    @cached_property
    def band(self) -> PredictionBand | None:
        """The band of what the model predicts of its own first run, about the target.

        None where its file has no covariance, and before that run.
        """
        first = next((r for r in self.runs if r.kind == "model"), None)
        if first is None or not isinstance(self.model.model, Actuator):
            return None
        driven = Drive(first.time, first.voltage, hold=True)
        response = self.model.model.simulate(driven)
        band = band_of(self.model, driven, response.displacement) if response.ok else None
        return None if band is None else replace(band, noise=first.noise)

    @property
    def best(self) -> TrackedRun | None:
        """The run of the model, or learned from it, with the smallest error."""
        ours = [r for r in self.runs if r.kind in ("model", "learned") and math.isfinite(r.rms)]
        return min(ours, key=lambda r: r.rms, default=None)


class Tracking:
    """A target that is followed run after run: which voltage comes next, and what the runs showed.

    Parameters
    ----------
    target, model, rig_file
        What is followed, with the voltage of which model, within which limits.
    iterations : int or None
        Runs that learn from the one before; None proposes one after another.
    compare : ModelFile, optional
        The voltages of a linear map and of this model are proposed before. Where it predicts its
        own run significantly better than ``model`` does, it is followed in place of ``model``: a
        model is falsified by data that were recorded under another voltage, before it is used (M.
        G. Safonov and T.-C. Tsao, IEEE Trans. Automatic Control 42, 843 (1997)). Where learning by
        ``model`` ends above the noise, it goes on from the run of this model.
    within : float
        Distance in m from the target that is accepted.

    Attributes
    ----------
    inversion : Inversion
        What the model says can be reached.
    proposed : Proposal or None
        The next run, None after the last.
    runs : tuple of TrackedRun
        The finished runs.

    Raises
    ------
    InputError
        For a target that is too long, and for a model that cannot be inverted.
    """

    def __init__(
        self,
        target: LoadedTarget,
        model: ModelFile,
        rig_file: RigFile,
        *,
        iterations: int | None = 5,
        compare: ModelFile | None = None,
        within: float = WITHIN,
    ) -> None:
        self.target, self.model, self.within = target, model, within
        self._followed = model
        self._compare = compare
        self._given_up: tuple[Learner, ModelFile] | None = None
        ours = _actuator(model, "model")
        self.task = task_of(target, rig_file)
        self._iterations = iterations
        self._others: list[Proposal] = []
        try:
            self._learner = Learner(ours, self.task, alternatives=alternatives_of(model))
            self.inversion: Inversion = self._learner.first
            if compare is not None:
                self._others = self._compared(compare)
        except ModelError as error:
            raise InputError(f"target {target.name!r}: {error}") from error
        self.warnings = tuple(misfits_of(ours, rig_file))
        self.runs: tuple[TrackedRun, ...] = ()
        self.proposed: Proposal | None = self._next()

    def add(self, recording: Recording, margins: tuple[Margin, ...] = ()) -> TrackedRun:
        """Take the ``recording`` of the proposed run, learn from it, and propose the next.

        ``margins`` are those of the gate. Raises ``InputError`` for a run that ended early: nothing
        is learned from it, and it stays proposed.
        """
        played = self.proposed
        if played is None:
            raise InputError(f"target {self.target.name!r}: all runs are made")
        if recording.outcome != _FINISHED:
            raise InputError(
                f"the run {played.label!r} ended early ({recording.outcome}): nothing is learned "
                f"from it; play its voltage again"
            )
        if recording.rate != self.task.rate:
            raise InputError(
                f"{recording.path} was not recorded at {self.task.rate:g} Hz, for which its "
                f"voltage was computed: nothing is learned from it; compute the voltage again"
            )
        run = self._measured(played, recording, margins)
        if played.kind == "thesis":
            run = replace(run, notes=(*run.notes, *self._chosen_by(run, played)))
        if played.kind in ("model", "learned"):
            last = played.iteration == self._iterations
            try:
                lesson = self._learner.learn(run.measured, run.noise)
            except ModelError as error:
                raise InputError(f"target {self.target.name!r}: {error}") from error
            run = replace(
                run,
                rms=lesson.rms,
                largest=lesson.largest,
                samples=lesson.samples,
                edge=0.0 if last else lesson.edge,
                contraction=math.nan if last else lesson.contraction,
                notes=(*run.notes, *lesson.notes, *self._other_tried()),
            )
        self.runs = (*self.runs, run)
        self.proposed = self._next()
        return run

    @property
    def settled(self) -> str:
        """Why nothing more is learned: further runs play the same voltage; "" while it goes on."""
        return self._learner.settled

    def outcome(self, rig: str, status: str = "complete", reason: str = "") -> TrackOutcome:
        """Return what was done on the rig at the address ``rig``."""
        return TrackOutcome(
            self.target, self.model, rig, self.inversion, self.within, self.runs,
            noise=self.runs[-1].noise if self.runs else math.nan,
            status=status, reason=reason, warnings=self.warnings,
        )  # fmt: skip

    def _next(self) -> Proposal | None:
        done = len(self.runs)
        if done < len(self._others):
            return self._others[done]
        iteration = done - len(self._others)
        if self._iterations is not None and iteration > self._iterations:
            return None
        kind = "learned" if iteration else "model"
        learner = self._learner
        return self._proposal(kind, learner.voltage, learner.expected, self._followed, iteration)

    def _proposal(
        self,
        kind: str,
        voltage: np.ndarray,
        expected: np.ndarray | None,
        model: ModelFile | None,
        iteration: int = 0,
    ) -> Proposal:
        rate, name = self.task.rate, self.target.name
        return Proposal(kind, iteration, voltage, expected, rate, name, model)

    def _compared(self, compare: ModelFile) -> list[Proposal]:
        """Return the runs of a linear map and of another model, for the same reference."""
        theirs = _actuator(compare, "compare")
        linear = _linear_map(self.task, self.inversion, theirs)
        found = invert(theirs, replace(self.task, target=self.inversion.reference))
        return [
            self._proposal("linear", linear, None, None),
            self._proposal("thesis", found.voltage, found.reading, compare),
        ]

    def _chosen_by(self, run: TrackedRun, played: Proposal) -> tuple[str, ...]:
        """Follow the compared model if its run speaks against the model; return what is said.

        The difference of the mean squares of both predictions' errors counts from so many standard
        errors on as learning asks for: with noise n it is that of 2 (difference of both) n. Where
        the model has a drift or an event of its recordings, it is judged with and without.
        """
        theirs, expected = self._compare, played.expected
        if theirs is None or expected is None:
            return ()
        known = self.inversion.reachable & np.isfinite(run.measured)
        measured, other = run.measured[known], (run.measured - expected)[known]
        found = readings_under(_actuator(self.model, "model"), self.task, played.voltage)
        off = math.inf
        for mine in (reading[known] for reading in found):
            scatter = 2.0 * run.noise * float(np.sqrt(np.sum((mine - expected[known]) ** 2)))
            worse = float(np.sum((measured - mine) ** 2) - np.sum(other**2))
            if np.isfinite(mine).all() and worse <= LearningSettings().significant * scatter:
                return ()
            off = min(off, float(np.sqrt(np.mean((measured - mine) ** 2))) * 1e6)
        self._learner, self._followed = self._learner_of(theirs), theirs
        less = float(np.sqrt(np.mean(other**2))) * 1e6
        return (
            f"the model {self.model.name!r} predicts this run with an error of {off:.3g} um, the "
            f"compared one with {less:.3g} um: the compared model is followed",
        )

    def _learner_of(self, compare: ModelFile) -> Learner:
        """Return a learner by the compared model, for the same reference."""
        task = replace(self.task, target=self.inversion.reference)
        model = _actuator(compare, "compare")
        return Learner(model, task, alternatives=alternatives_of(compare))

    def _other_tried(self) -> tuple[str, ...]:
        """Go on from the compared model's run where learning has ended above the noise.

        A model with a sharp resonance that the film does not have gives voltages that ring, and
        learning does not correct that. If both end above the noise, the better voltage is kept.
        Returns the notes for the report.
        """
        now, theirs = (self._learner, self._followed), self._compare
        if not self._learner.settled or self._learner.is_at_noise or theirs is None:
            return ()
        if self._given_up is not None:
            if self._given_up[0].best_rms < self._learner.best_rms:
                (self._learner, self._followed), self._given_up = self._given_up, now
            return ()
        run = next((run for run in self.runs if run.kind == "thesis"), None)
        if self._followed is theirs or run is None:
            return ()
        other = self._learner_of(theirs)
        if not other.learn(run.measured, run.noise).learned:
            return ()
        self._given_up, self._learner, self._followed = now, other, theirs
        return (
            f"learning by the model {now[1].name!r} has ended above the noise: it goes on from the "
            f"run of the compared model",
        )

    def _measured(
        self, played: Proposal, recording: Recording, margins: tuple[Margin, ...]
    ) -> TrackedRun:
        """Return a run with its errors from the reference."""
        inversion = self.inversion
        reading, valid = _reading(recording)
        n = min(reading.size, inversion.time.size)
        usable = np.isfinite(reading[:n]) if valid is None else valid[:n] & np.isfinite(reading[:n])
        rest = usable & (np.arange(n) < self.task.lead_in)
        measured = np.full(inversion.time.size, np.nan)
        noise = _noise(recording)
        zero = mean_without_outliers(reading[:n][rest], noise) if rest.any() else 0.0
        measured[:n] = np.where(usable, reading[:n] - zero, np.nan)
        expected = inversion.reference if played.expected is None else played.expected
        notes = []
        for frequency, row in lines_at_rest(
            measured - expected, self.task.lead_in, noise, self.task.rate
        ):
            measured -= row
            notes.append(
                f"interference of {float(np.std(row)) * 1e6:.3g} um RMS about {frequency:.4g} Hz, "
                f"which is in the reading at rest, is taken off"
            )
        error = (inversion.reference - measured)[inversion.reachable & np.isfinite(measured)]
        commanded = recording.voltage_command
        voltage = np.zeros(inversion.time.size)
        if commanded is not None:
            voltage[:n] = commanded[:n]
        predicted = recording.displacement_model
        return TrackedRun(
            kind=played.kind,
            iteration=played.iteration,
            rms=float(np.sqrt(np.mean(error**2))) if error.size else math.nan,
            largest=float(np.abs(error).max()) if error.size else math.nan,
            samples=int(error.size),
            recording=recording.path,
            margins=margins,
            time=inversion.time,
            measured=measured,
            predicted=None if predicted is None or predicted.size != n else predicted,
            voltage=voltage,
            noise=noise,
            notes=tuple(notes),
        )


def alternatives_of(model: ModelFile) -> tuple[Actuator, ...]:
    """Return models that are 1.96 standard deviations away, one in each independent direction.

    The directions are the principal axes of the covariance of the fitted parameters, which
    ``dearig identify`` and ``dearig diagnose`` write; a model without one has none. No parameter is
    moved farther than a fit's linearisation holds, nor out of its range.
    """
    actuator, fitted = model.model, covariance_of(model)
    if not isinstance(actuator, Actuator) or fitted is None:
        return ()
    layout = FitLayout(actuator)
    names, covariance = fitted
    columns = [layout.names.index(name) for name in names]
    values = layout.initial()
    x = layout.coordinates(values)
    natural = np.array([q.logarithmic for q in layout.quantities])
    by = np.where(natural, values, 1.0)[columns]
    # standard deviations apart, the axes do not depend on units
    spread = np.sqrt(np.diag(covariance)) / by
    spread = np.where(spread > 0.0, spread, 1.0)
    sizes, axes = np.linalg.eigh(covariance / np.outer(by * spread, by * spread))
    found = []
    for size, axis in zip(sizes, axes.T, strict=True):
        step = np.zeros(x.size)
        step[columns] = NORMAL_95 * math.sqrt(max(float(size), 0.0)) * spread * axis
        step /= max(1.0, float(np.max(np.abs(step) / layout.reach(x))))
        moved = layout.model(layout.values(np.clip(x + step, layout.lower, layout.upper)))
        if isinstance(moved, Actuator) and np.any(step):
            found.append(moved)
    return tuple(found)


def _actuator(model: ModelFile, option: str) -> Actuator:
    if isinstance(model.model, Actuator):
        return model.model
    raise InputError(
        f"the model {model.name!r} is of a bare film, which a voltage does not move: give one of "
        f"an actuator",
        option=option,
    )


def misfits_of(model: Actuator, rig_file: RigFile) -> Iterator[str]:
    """Yield a sentence for film and load of ``model`` that are not those of the rig file."""
    if model.film != rig_file.as_film():
        yield "the model is of another film than the rig file's"
    if model.load.mass != rig_file.load.mass_g / 1e3:
        yield (
            f"the model is of a load of {model.load.mass * 1e3:g} g, the rig file of "
            f"{rig_file.load.mass_g:g} g"
        )


def _linear_map(task: TrackingTask, inversion: Inversion, model: Actuator) -> np.ndarray:
    """Return the voltage (N,) in V of a film whose displacement is a straight line over V^2.

    The line is that of ``model`` at rest, through 0 and the largest displacement of the reference:
    what a person has who measured one displacement at one voltage.
    """
    largest = float(inversion.reference.max())
    volts = np.zeros(inversion.time.size)
    if largest > 0.0:
        low, high = 0.0, task.limits.voltage
        for _ in range(50):  # halvings of the voltage's range: to the last digit
            middle = 0.5 * (low + high)
            try:
                moved = (static_stretch(model, middle) - model.rest()) * model.film.length
            except ModelError:  # beyond pull-in
                moved = math.inf
            low, high = (middle, high) if moved < largest else (low, middle)
        volts = high * np.sqrt(np.maximum(inversion.reference, 0.0) / largest)
    ceiling = np.where(task.inside, task.limits.voltage, 0.0)
    return task.limits.nearest(volts, ceiling, inversion.rate)


def _noise(recording: Recording) -> float:
    """Return the standard deviation in m of a reading at rest."""
    floor = recording.noise_floor or noise_of(recording.signal)
    return floor if floor > 0.0 else _FALLBACK


def _reading(recording: Recording) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the displacement (N,) m of a recording, and which readings may be used."""
    try:
        return recording.signal, Readings(recording).quality.valid
    except InputError as error:
        log.info("%s: nothing is learned from it: %s", recording.path, error)
        return recording.signal, np.zeros(recording.samples, dtype=bool)
