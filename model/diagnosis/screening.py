"""The score test: what each effect promises to explain, before anything is fitted.

To first order an effect of size s moves the model's answer by s times its sensitivity. What the
baseline's own numbers could do as well is projected away; what is left of the sensitivity is
compared with what is left of the residual. Shapes (relaxation times, thresholds, moments) are tried
on a small grid, and each grid point comes with the size that the residual asks for.

First order is no guide to an effect that does nothing until it is large (a slew limit), or changes
everything as soon as it is there (a mass that turns 70 Hz into 7). So the leading promises are
simulated, and beside them sizes from small to large; what counts is what is then left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice, product

import numpy as np

from dearig.model import kernel
from dearig.model.actuator import Actuator
from dearig.model.diagnosis.bench import Bench, Trial
from dearig.model.diagnosis.results import MUCH_LEFT
from dearig.model.effects import EFFECTS, Effect, EffectValues, Parameter, any_hysteretic
from dearig.model.film import Strip
from dearig.model.fitting.problem import Problem, agrees
from dearig.model.records import ActuatorRecord, FilmRecord

__all__ = ["Promise", "Screen", "is_of", "sizes_of", "with_effect"]

_MOMENTS = 20  # sought along the longest record
_CLOSER = ((0.5, 9), (0.3, 9), (0.1, 9))  # parts of their distance, and how many there
_LINES = 400  # frequencies within an effect's bounds
_SIMULATED = 2  # leading promises that are held against a simulation
_DONE_WELL = (1e-2, 1e-3)  # of what a model's numbers do best: what is left to them
_LET_GO = 0.05  # of how far a film was stretched: less is no way back
_ON_THE_WAY_BACK = ("softening", "rate_independent_hysteresis", "slack")  # families that show there
_SPREAD = (16, 6, 4)  # values of one shape, of each of two, of each of more
_SIZES = (0.3, 1.0, 3.0, 10.0)  # times the typical one, tried of effects with a single size


@dataclass(frozen=True)
class Promise:
    """What one effect, in one shape, promises on top of a fitted model.

    ``model`` has the effect in it, ``start`` (d,) are the base model's coordinates with the effect
    at some size, ``columns`` (N, sizes) the sensitivities to its sizes, ``share`` is the part of
    the residual's mean square that goes when the base model's own numbers follow to first order.
    """

    model: Actuator | Strip
    start: np.ndarray
    columns: np.ndarray
    share: float


def with_effect(model: Actuator | Strip, name: str, values: tuple[float, ...]) -> Actuator | Strip:
    """``model`` with effect ``name`` at ``values`` in the order of its parameters."""
    pairs = zip((p.name for p in EFFECTS[name].parameters), values, strict=True)
    effects: EffectValues = (*model.effects, (name, tuple(pairs)))
    return replace(model, effects=effects)


def sizes_of(size: Parameter, parts: Sequence[float] = _SIZES) -> list[float]:
    """Sizes from small to large, ``parts`` of the typical one, of both signs where there are."""
    low, high = size.fit_bounds
    neutral = size.neutral or 0.0
    signs = (1.0, -1.0) if low < neutral else (1.0,)
    steps = [neutral + sign * part * size.typical for sign in signs for part in parts]
    return [s for s in steps if low <= s <= high]


class Screen:
    """Score tests on top of one fitted model."""

    def __init__(self, bench: Bench, trial: Trial) -> None:
        self.bench = bench
        self.trial = trial
        #: (N, f) of the base model
        self.jacobian = trial.jacobian()
        self._q, self._r = np.linalg.qr(self.jacobian)
        self._residual = trial.residuals - self._q @ (self._q.T @ trial.residuals)
        self._fidelity, self._as_it_was = kernel.ROUGH, trial.residuals
        if any_hysteretic(trial.model.effects):
            # what the base model does must be as it was: films turn elsewhere in a rough simulation
            if bench.is_dear and trial.cost >= MUCH_LEFT:
                rough = bench.problem(trial.problem.layout.base, self._fidelity)
                self._as_it_was = rough.residuals(trial.x)
            else:
                self._fidelity = trial.problem.fidelity
        self._sketch = trial.problem.coarse_residuals(trial.x, trial.residuals)

    def promises(self, effect: Effect) -> list[Promise]:
        """Promises of ``effect``, best first: one for each shape on its grid."""
        own = self._of_each_record(effect)
        if own is not None:
            return [own]
        shapes = list(product(*(self._starts(p) for p in effect.shape_parameters)))
        found = self._scored(effect, shapes)
        only = effect.shape_parameters[0] if len(effect.shape_parameters) == 1 else None
        step = self._step(only) if only else 0.0
        found.sort(key=lambda p: -p.share)
        if only and step:
            found = [self._closer(effect, only, p, step) for p in _apart(found, step)]
            found.sort(key=lambda p: -p.share)
        tried = self._simulated(effect, found, several=not step and len(effect.amplitudes) == 1)
        return sorted(tried, key=lambda p: -p.share)

    def scattered(self, effect: Effect) -> list[Promise]:
        """Promises of ``effect``, best first, of shapes all over their bounds."""
        several = len(effect.shape_parameters)
        spread = [_spread(p, several) or self._starts(p) for p in effect.shape_parameters]
        found = self._scored(effect, list(product(*spread)))
        return sorted(found, key=lambda p: -p.share)

    def _closer(self, effect: Effect, shape: Parameter, near: Promise, step: float) -> Promise:
        """The best promise within half a ``step`` or so of one that is ``near``."""
        low, high = shape.fit_bounds
        best = near
        for part, count in _CLOSER:
            finer = [(_place(best) + f * part * step,) for f in np.linspace(-1.0, 1.0, count)]
            found = self._scored(effect, [s for s in finer if low < s[0] < high])
            best = max([best, *found], key=lambda p: p.share)
        return best

    def _simulated(self, effect: Effect, found: list[Promise], several: bool) -> list[Promise]:
        """The leading promises as a simulation keeps them, and with ``several`` other sizes too.

        Of a shape the best size is kept: one promise for each shape.
        """
        if not found:
            return []
        problem = self.bench.problem(found[0].model, self._fidelity)
        layout = problem.layout
        first = self.trial.x.size
        rows: list[tuple[int, np.ndarray]] = []
        for place, promise in enumerate(found[:_SIMULATED]):
            values = layout.values(promise.start)
            rows.append((place, values))
            for size in self._sizes(effect.amplitudes[0]) if several else ():
                other = values.copy()
                other[first] = size
                rows.append((place, other))
        population = np.array([values for _, values in rows])
        # what they tell of a large size they tell of smaller ones
        largest = int(np.argmax(np.abs(population[:, first])))
        moved, status = self._moved(problem, population, [largest])
        there = moved + self.trial.residuals
        total = float(self._residual @ self._residual)
        kept = [replace(promise, share=0.0) for promise in found]
        off: dict[int, np.ndarray] = {}  # what the base model's own numbers could take off
        for (place, values), residual, failed in zip(rows, there, status, strict=True):
            if failed:
                continue
            own = self._q.T @ residual
            left = residual - self._q @ own
            share = 1.0 - float(left @ left) / max(total, 1e-300)
            if share <= kept[place].share:
                continue
            start = layout.coordinates(values)
            off[place] = own
            columns = found[place].columns
            moved = values[first] - (effect.amplitudes[0].neutral or 0.0)
            if len(effect.amplitudes) == 1 and moved != 0.0:
                columns = ((residual - self.trial.residuals) / moved)[:, None]
            kept[place] = replace(found[place], start=start, columns=columns, share=share)
        for place, own in off.items():
            kept[place] = replace(kept[place], start=self._met(problem, kept[place].start, own))
        return kept

    def _met(self, problem: Problem, start: np.ndarray, own: np.ndarray) -> np.ndarray:
        """``start`` (d,) with the base model's own numbers where they meet the effect best.

        ``own`` (f,) is what they could take off there, to first order. Where branches relax nearly
        alike that leads far away, along numbers that to first order do nothing: so only what they
        do well is asked of them, and what it comes to is simulated, as is where nothing moves.
        """
        free, layout = ~self.trial.fixed, problem.layout
        reach = self.trial.problem.layout.reach(self.trial.x)[free]
        u, much, v = np.linalg.svd(self._r * reach)
        starts = [start]
        for least in _DONE_WELL:
            told = much > least * much[0]
            step = -v[told].T @ ((u[:, told].T @ own) / much[told])
            there = start.copy()
            there[: free.size][free] += reach * step / max(1.0, float(np.max(np.abs(step))))
            starts.append(np.clip(there, layout.lower, layout.upper))
        return starts[int(np.argmin(problem.costs(np.array(starts))))]

    def _step(self, shape: Parameter) -> float:
        """How far apart places are between which a descent loses its way; 0 where it does not."""
        if shape.relative_to == "duration":
            return self._duration() / _MOMENTS
        return 1.0 / self._duration() if shape.relative_to == "spectrum" else 0.0

    def _duration(self) -> float:
        return max(float(r.time[-1]) for r in self.bench.records)

    def _sizes(self, size: Parameter) -> list[float]:
        """Sizes to try, for these records."""
        if size.relative_to != "slope":
            return list(size.starts) or sizes_of(size)
        slopes = np.concatenate(
            [
                np.abs(np.diff(r.drive.voltage)) / np.diff(r.drive.time)
                for r in self.bench.records
                if isinstance(r, ActuatorRecord)
            ]
        )
        moving = slopes[slopes > 0.0]
        if not moving.size:
            return []
        low, high = size.fit_bounds
        steepest = np.quantile(moving, 1.0 - np.array(size.starts))
        return [float(s) for s in 1.0 / steepest if low <= s <= high]

    def _starts(self, parameter: Parameter) -> list[float]:
        """Values of a shape to try, for these records."""
        records = self.bench.records
        starts = list(parameter.starts)
        if parameter.relative_to == "displacement":
            largest = max(
                float(np.max(r.measured if r.valid is None else r.measured[r.valid]))
                for r in records
            )
            starts = [s * largest for s in starts]
        elif parameter.relative_to == "voltage":
            largest = max(
                float(np.max(np.abs(r.drive.voltage)))
                for r in records
                if isinstance(r, ActuatorRecord)
            )
            starts = [s * largest for s in starts]
        elif parameter.relative_to == "duration":
            starts = list((np.arange(_MOMENTS) + 0.5) / _MOMENTS * self._duration())
        elif parameter.relative_to == "spectrum":
            starts = [self._strongest_line(*parameter.fit_bounds), *starts]
        low, high = parameter.fit_bounds
        return [min(max(s, low), high) for s in starts]

    def _strongest_line(self, low: float, high: float) -> float:
        """Frequency in Hz at which a sine explains most of the residual."""
        records = self.bench.records
        longest = max(records, key=lambda r: r.measured.size)
        start = 0
        for record in records:
            if record is longest:
                break
            start += record.measured.size
        residual = self._residual[start : start + longest.measured.size]
        step = float(np.median(np.diff(longest.time)))
        high = min(high, max(0.5 / step, low * 1.01)) if low < 0.5 / step else high
        duration = float(longest.time[-1] - longest.time[0])
        count = int(min(max((high - low) * duration * 2.0, 2), 8 * _LINES))
        frequencies = np.linspace(low, high, count)
        # from one frequency to the next every sample turns by so much
        turn = np.exp(-2j * np.pi * (frequencies[1] - frequencies[0]) * longest.time)
        wave = np.exp(-2j * np.pi * low * longest.time) * residual
        power = []
        for _ in frequencies:
            power.append(abs(wave.sum()))
            wave *= turn
        return float(frequencies[int(np.argmax(power))])

    def _scored(self, effect: Effect, shapes: list[tuple[float, ...]]) -> list[Promise]:
        sizes = effect.amplitudes
        rows, models = [], []
        for shape in shapes:
            for i in range(len(sizes)):
                values = tuple(
                    self._probe(p) if j == i else float(p.neutral or 0.0)
                    for j, p in enumerate(sizes)
                )
                model = with_effect(self.trial.model, effect.name, (*values, *shape))
                models.append(model)
                rows.append(np.array((*values, *shape)))
        if not models:
            return []
        problem = self.bench.problem(models[0], self._fidelity)
        layout = problem.layout
        base_values = self.trial.problem.layout.values(self.trial.x)
        population = np.array([np.concatenate([base_values, row]) for row in rows])
        moved, status = self._moved(problem, population, sorted({0, len(population) - 1}))
        total = float(self._residual @ self._residual)
        found = []
        per = len(sizes)
        for n, shape in enumerate(shapes):
            part = slice(n * per, (n + 1) * per)
            if status[part].any():
                continue
            probes = np.array([self._probe(p) for p in sizes])
            columns = moved[part].T / probes
            across = columns - self._q @ (self._q.T @ columns)
            size, share = self._solve(across, columns, total)
            size = np.clip(size, *np.transpose([p.fit_bounds for p in sizes]))
            there_too = np.concatenate([base_values, size, shape])
            start = np.clip(layout.coordinates(there_too), layout.lower, layout.upper)
            found.append(Promise(models[n * per], start, columns, share))
        return found

    def _of_each_record(self, effect: Effect) -> Promise | None:
        """The promise of a walk that each record has of its own; None of any other effect."""
        if effect.drift_basis is None:
            return None
        nothing = tuple(p.neutral or 0.0 for p in effect.amplitudes)
        model = with_effect(self.trial.model, effect.name, nothing)
        problem = self.bench.problem(model, self._fidelity)
        if problem.drift is None:
            return None
        columns = problem.drift_jacobian()
        columns /= np.linalg.norm(columns, axis=0)
        across = columns - self._q @ (self._q.T @ columns)
        _, share = self._solve(across, columns, float(self._residual @ self._residual))
        base_values = self.trial.problem.layout.values(self.trial.x)
        start = problem.layout.coordinates(np.concatenate([base_values, nothing]))
        # its sizes are found on the way: as numbers of the model they do nothing
        return Promise(model, start, np.zeros((problem.measured.size, len(nothing))), share)

    def _moved(
        self, problem: Problem, population: np.ndarray, asked: Sequence[int]
    ) -> tuple[np.ndarray, np.ndarray]:
        """By how much (P, N), over the noise, members move the readings; statuses (P,).

        By sketches, where these tell what the members ``asked`` do.
        """
        coarse = np.zeros(len(population), dtype=bool)
        moved, status = self._moved_by(problem, population[asked], coarse[asked])
        if self._sketch is not None and len(asked) < len(population):
            sketched, failed = self._moved_by(problem, population[asked], ~coarse[asked])
            told = all(agrees(w, s) for w, s in zip(moved, sketched, strict=True))
            coarse[:] = told and not (status.any() or failed.any())
        rest = np.setdiff1d(np.arange(len(population)), asked)
        others, failed = self._moved_by(problem, population[rest], coarse[rest])
        order = np.argsort(np.append(asked, rest))
        return np.vstack([moved, others])[order], np.append(status, failed)[order]

    def _moved_by(
        self, problem: Problem, population: np.ndarray, coarse: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        predicted, status = problem.predict(population, coarse)
        moved = (predicted - problem.measured) / problem.sigma
        for row, sketched in zip(moved, coarse, strict=True):
            row -= self._sketch if sketched else self._as_it_was
        return moved, status

    @staticmethod
    def _probe(parameter: Parameter) -> float:
        neutral = parameter.neutral or 0.0
        return neutral + parameter.typical

    def _solve(
        self, across: np.ndarray, columns: np.ndarray, total: float
    ) -> tuple[np.ndarray, float]:
        """Sizes that the residual asks for, and the share of its mean square that they explain."""
        own = np.linalg.norm(columns, axis=0)
        seen = np.linalg.norm(across, axis=0)
        # what the baseline can do as well is not seen: no size follows from it
        if not np.all(np.isfinite(across)) or np.any(seen <= 1e-6 * np.maximum(own, 1e-300)):
            return np.zeros(across.shape[1]), 0.0
        size, *_ = np.linalg.lstsq(across, -self._residual, rcond=1e-9)
        left = self._residual + across @ size
        share = 1.0 - float(left @ left) / max(total, 1e-300)
        return size, max(share, 0.0) if math.isfinite(share) else 0.0


def _spread(shape: Parameter, several: int) -> list[float]:
    """Values of a ``shape`` all over its bounds, fewer of ``several``; none where records say."""
    if shape.relative_to:
        return []
    low, high = shape.fit_bounds
    count = _SPREAD[min(several, len(_SPREAD)) - 1]
    parts = (np.arange(count) + 0.5) / count
    if shape.logarithmic:
        return [float(low * (high / low) ** part) for part in parts]
    return [float(low + (high - low) * part) for part in parts]


def _place(promise: Promise) -> float:
    """The last number of the promised effect: its shape, where it has one."""
    return float(promise.model.effects[-1][1][-1][1])


def _apart(promises: Sequence[Promise], step: float) -> list[Promise]:
    """The first of ``promises``, and the first that is not next to it, if any.

    A line has a mirror image, in which another of its harmonics plays it nearly as well.
    """
    if not promises:
        return []
    far = (p for p in promises if abs(_place(p) - _place(promises[0])) > 0.5 * step)
    return [promises[0], *islice(far, 1)]


def _returns(stretch: np.ndarray) -> bool:
    """Whether a film is let go again, by more than a little of how far it was stretched."""
    back = np.maximum.accumulate(stretch) - stretch
    return bool(np.max(back) > _LET_GO * (np.max(stretch) - stretch[0]))


def is_of(effect: Effect, bench: Bench) -> bool:
    """True where ``effect`` makes sense for the bench's records.

    What tells loading from unloading is nothing but another elasticity to a film that is only
    stretched and held: such an effect would be a guess about what was not done.
    """
    first = bench.records[0]
    if isinstance(first, FilmRecord):
        returns = any(_returns(r.stretch) for r in bench.records if isinstance(r, FilmRecord))
        return "stretch" in effect.drives and (returns or effect.family not in _ON_THE_WAY_BACK)
    if "voltage" not in effect.drives:
        return False
    if effect.name == "temperature":
        return any(
            isinstance(r, ActuatorRecord) and r.drive.warmth is not None for r in bench.records
        )
    return True
