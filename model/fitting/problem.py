"""The residuals of a set of records, for one parameter vector or a population of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy

import numpy as np

from dearig.model import kernel
from dearig.model.actuator import Actuator, readings_of
from dearig.model.effects import EFFECTS, SENSOR_COLUMNS
from dearig.model.errors import ModelError
from dearig.model.film import Strip, stress_of
from dearig.model.fitting.drift import Walking, walks_of
from dearig.model.fitting.parameters import Layout
from dearig.model.fitting.threads import together
from dearig.model.records import ActuatorRecord, FilmRecord, Record

__all__ = ["Problem", "is_told"]

_SAME = 1.0  # of the noise: a sketch that is further from the whole is none
_MOST = 0.6  # of the numbers
_ALIKE = 0.15  # of what a number does: as near must a sketch tell it
_OF_STRIP = 6.0  # steps of an actuator that a sample of a strip takes as long as
_OF_EFFECT = 0.8  # of a step, that each effect takes which moves the film
_OF_ANY = 1.5e4  # a population beside its steps: to hand it over, and what a fit makes of it


def is_told(whole: np.ndarray, sketch: np.ndarray) -> bool:
    """Whether a ``sketch`` (N,) of what a number does is near enough to the ``whole``."""
    return float(np.linalg.norm(sketch - whole)) <= _ALIKE * float(np.linalg.norm(whole))


class Problem:
    """Least squares of model minus measurement, in units of the noise.

    ``records`` are all of actuators or all of films, and ``layout`` says what is free. Members of a
    population whose simulation ends early keep the last value they reached: a large but finite
    residual, which a search walks away from. ``fidelity`` is as the kernel has it. ``simulations``
    counts records simulated, and ``told`` is called with each such number. What the numbers
    ``sketched`` (d,) bool do is told by the records' sketches, None where nothing is.

    Walks that each of several records has of its own are found on the way
    (``dearig.model.fitting.drift``) and are part of every prediction; the layout's numbers of them
    then do nothing.
    """

    def __init__(
        self,
        records: Sequence[Record],
        layout: Layout,
        workers: int = 2,
        fidelity: int = kernel.CAREFUL,
        told: Callable[[int, float], None] | None = None,
    ) -> None:
        if not records:
            raise ModelError("a fit needs at least one record")
        driven = {type(r) for r in records}
        if len(driven) > 1:
            raise ModelError("records driven by voltage and by stretch cannot be fitted together")
        if isinstance(layout.base, Actuator) != isinstance(records[0], ActuatorRecord):
            raise ModelError("the model and the records are not of one kind (voltage or stretch)")
        self.records = tuple(records)
        self.layout = layout
        self.workers = workers
        self.fidelity = fidelity
        self.told = told
        self.sketched: np.ndarray | None = None
        self._missed: np.ndarray | None = None  # by sketches, of all readings, where they are used
        self.simulations = 0
        self.measured = np.concatenate([r.measured for r in records])
        # a reading that must not be used has no weight
        self.sigma = np.concatenate(
            [
                np.full(r.measured.size, r.noise)
                if r.valid is None
                else np.where(r.valid, r.noise, np.inf)
                for r in records
            ]
        )
        self._edges = np.cumsum([0, *(r.measured.size for r in records)])
        self.walks = walks_of(self.records, layout.base.effects)
        own = () if self.walks is None else self.walks.names
        #: (d,) bool of the layout's numbers that each record has for itself
        self.own = np.array([name in own for name in layout.names], dtype=bool)

    @property
    def samples(self) -> int:
        """How many readings are fitted."""
        return int(np.count_nonzero(np.isfinite(self.sigma)))

    def predict(
        self, values: np.ndarray, sketched: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Model readings (P, N) and statuses (P,) of a population ``values`` (P, d), natural.

        Of members ``sketched`` (P,) bool, if any, by the sketches of the records that have one.
        """
        c = self.layout.coefficients(values)
        by_sketch = np.full(c.shape[0], self._missed is not None) if sketched is None else sketched
        out = np.zeros((c.shape[0], self.measured.size))
        status = np.zeros((c.shape[0], len(self.records)), dtype=np.int64)

        films = self._films(c, by_sketch)
        which = by_sketch[[members[0] for members in films]]
        steps = np.zeros((which.size, len(self.records)))

        def run(jobs: list[tuple[int, int]]) -> None:
            # some in one go: to hand them over one by one would take a part of the time
            for film, i in jobs:
                members = films[film]
                part = slice(self._edges[i], self._edges[i + 1])
                out[members, part], status[members, i], steps[film, i] = self._readings(
                    c[members], self.records[i], bool(which[film])
                )

        together(run, self._shared_out(which), self.workers)
        self.simulations += steps.size
        if self.told is not None:
            self.told(steps.size, self._effort(float(steps.sum())))
        if self._missed is not None:
            out += self._missed
        if self.walks is not None:
            out += self.walks.nearest(self.measured - out)
        # of several records the first that fails speaks
        failed = np.argmax(status != kernel.OK, axis=1)
        return out, np.take_along_axis(status, failed[:, None], axis=1)[:, 0]

    def _films(self, c: np.ndarray, by_sketch: np.ndarray) -> list[list[int]]:
        """Members of a population ``c`` (P, C) whose films move alike: one simulation does."""
        sensors = any(EFFECTS[name].acts_on == "sensor" for name, _ in self.layout.base.effects)
        if len(c) < 2 or not sensors:
            return [[member] for member in range(len(c))]
        films: dict[tuple[bytes, bool], list[int]] = {}
        moving = np.delete(c, SENSOR_COLUMNS, axis=1)
        for member, (row, sketched) in enumerate(zip(moving, by_sketch, strict=True)):
            films.setdefault((row.tobytes(), bool(sketched)), []).append(member)
        return list(films.values())

    def _shared_out(self, by_sketch: np.ndarray) -> list[list[tuple[int, int]]]:
        """Films, of which some are ``by_sketch`` (P,), and records for each of the workers.

        The long ones first, each to who has least to do yet: records may differ much.
        """
        steps = np.array([self._steps(r) for r in self.records])
        jobs = list(np.ndindex(by_sketch.size, len(self.records)))
        jobs.sort(key=lambda job: -steps[job[1], int(by_sketch[job[0]])])
        shares: list[list[tuple[int, int]]] = [[] for _ in range(min(self.workers, len(jobs)))]
        loads = [0.0] * len(shares)
        for film, i in jobs:
            least = loads.index(min(loads))
            shares[least].append((film, i))
            loads[least] += steps[i, int(by_sketch[film])]
        return shares

    @staticmethod
    def _steps(record: Record) -> tuple[float, float]:
        """Samples that a simulation steps through: of the whole record, and of its sketch."""
        if isinstance(record, FilmRecord) or record.sketch is None:
            return float(record.time.size), float(record.time.size)
        return float(record.time.size), float(record.sketch.time.size)

    def _effort(self, steps: float) -> float:
        """What it takes to simulate a population in so many ``steps``, in those of a bare film.

        As steps go, not seconds: the same on any machine, however busy.
        """
        base = self.layout.base
        if isinstance(base, Strip):
            return _OF_ANY + _OF_STRIP * steps
        moving = sum(EFFECTS[name].acts_on != "sensor" for name, _ in base.effects)
        return _OF_ANY + (1.0 + _OF_EFFECT * moving) * steps

    def _readings(
        self, c: np.ndarray, record: Record, sketched: bool
    ) -> tuple[np.ndarray, int, int]:
        """Readings (M, N) of members ``c`` (M, C) whose films move alike; status and steps."""
        if isinstance(record, FilmRecord):
            stress, status, _ = stress_of(c[0], record.time, record.stretch)
            return stress[None], status, record.time.size
        base = self.layout.base
        length = base.film.length if isinstance(base, Actuator) else 1.0
        drive, fidelity = record.drive, self.fidelity
        if sketched and record.sketch is not None:
            drive, fidelity = record.sketch, kernel.COARSE
        moved, status, steps = readings_of(c, length, drive, record.lag, fidelity, record.time)
        return record.seen(moved), status, steps

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """(model - measured)/noise, (N,), at coordinates ``x`` (d,)."""
        predicted, _ = self.predict(self.layout.values(x))
        return (predicted[0] - self.measured) / self.sigma

    def walking(self, x: np.ndarray) -> Walking | None:
        """The walks of the records at ``x`` (d,); None where none has one of its own."""
        if self.walks is None:
            return None
        still = self.layout.values(x)
        still[self.own] = 0.0
        missing = self.measured - self.without_walks().predict(still)[0][0]
        return self.walks.walking(missing, self.sigma)

    def without_walks(self) -> Problem:
        """The same, but that what each record has of its own is not found on the way."""
        other = copy(self)
        other.walks, other.own = None, np.zeros_like(self.own)
        return other

    def own_jacobian(self) -> np.ndarray:
        """d(residuals)/d(sizes of the records' own walks), (N, K n); (N, 0) where none has one."""
        if self.walks is None:
            return np.empty((self.measured.size, 0))
        return self.walks.ways / self.sigma[:, None]

    def off_walks(self, jacobian: np.ndarray) -> np.ndarray:
        """Columns of a ``jacobian`` (N, f) less what the walks of each record make up for."""
        if self.walks is None:
            return jacobian
        sigma = np.where(np.isfinite(self.sigma), self.sigma, 0.0)
        return jacobian - (self.walks.nearest(jacobian.T * sigma) / self.sigma).T

    def costs(self, x: np.ndarray) -> np.ndarray:
        """Mean square of the residuals (P,) of a population of coordinates (P, d).

        Members that the model cannot follow cost more than doing nothing at all.
        """
        return self.evaluate(x)[0]

    def evaluate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Costs (P,) as ``costs`` has them, and residuals (P, N), of coordinates (P, d)."""
        predicted, status = self.predict(self.layout.values(x))
        still = float(np.sum((self.measured / self.sigma) ** 2)) / self.samples
        residuals = (predicted - self.measured) / self.sigma
        costs = np.sum(residuals**2, axis=1) / self.samples
        return np.where(status == kernel.OK, costs, 10.0 * still + costs), residuals

    def jacobian(
        self,
        x: np.ndarray,
        free: np.ndarray,
        residuals: np.ndarray | None = None,
        sketched: bool = False,
    ) -> np.ndarray:
        """d(residuals)/dx (N, f) over the ``free`` (d,) coordinates, as one population.

        Central differences: two branches of nearly one relaxation time have nearly parallel columns
        (to 1e-5), and a one-sided difference would blur just the direction that is hard to see.
        With the ``residuals`` at ``x`` given, one-sided ones, for half of the cost; if they may be
        ``sketched``, those that sketches tell for a quarter of that.
        """
        moving = ~self.own[free]
        if not moving.all():
            # what each record has for itself does nothing, and not even by rounding
            jac = np.zeros((self.measured.size, moving.size))
            jac[:, moving] = self.jacobian(x, free & ~self.own, residuals, sketched)
            return jac
        if residuals is not None:
            by_sketch = None if self.sketched is None or not sketched else self.sketched[free]
            return self._one_sided(x, free, residuals, by_sketch)
        steps = np.diag(self.layout.differences(x))[free]
        up = np.minimum(x + steps, self.layout.upper)
        down = np.maximum(x - steps, self.layout.lower)
        predicted, _ = self.predict(self.layout.values(np.concatenate([up, down])))
        width = (up - down).sum(axis=1)
        half = width.size
        return ((predicted[:half] - predicted[half:]) / self.sigma).T / width

    def told_by_sketches(
        self, x: np.ndarray, free: np.ndarray, known: np.ndarray | None = None
    ) -> np.ndarray:
        """Which numbers (d,) bool sketches tell at ``x`` (d,) what they do, of those ``free``.

        The first of them may be ``known``, and are not asked again.
        """
        told = np.zeros(x.size, dtype=bool)
        if not self._has_sketches:
            return told
        residuals = self.residuals(x)
        if self.sketch(x, residuals) is None:
            return told  # much of what they miss would show in differences too
        asked = free.copy()
        if known is not None:
            told[: known.size] = known
            asked[: known.size] = False
        wholly = self._one_sided(x, asked, residuals, None)
        there = self._one_sided(x, asked, residuals, np.ones(wholly.shape[1], dtype=bool))
        told[asked] = [is_told(w, t) for w, t in zip(wholly.T, there.T, strict=True)]
        # where few are told, these are hardly to be trusted either
        return told if np.mean(told[free]) > _MOST else np.zeros_like(told)

    def anchored(self, x: np.ndarray, residuals: np.ndarray, free: np.ndarray) -> Problem | None:
        """The problem by sketches, which have the ``residuals`` (N,) at ``x`` (d,) as the whole.

        None where these do not tell what all ``free`` (d,) numbers do.
        """
        if self.sketched is None or not self.sketched[free].all():
            return None
        sketch = self.sketch(x, residuals)
        if sketch is None:
            return None
        other = copy(self)
        other.sketched = None
        # a reading that must not be used is missed by nothing
        sigma = np.where(np.isfinite(self.sigma), self.sigma, 0.0)
        other._missed = (residuals - sketch) * sigma
        return other

    def sketch(self, x: np.ndarray, residuals: np.ndarray) -> np.ndarray | None:
        """The ``residuals`` (N,) at ``x`` (d,) as sketches have them; None where these are none."""
        if not self._has_sketches:
            return None
        predicted, _ = self.predict(self.layout.values(x), np.ones(1, dtype=bool))
        sketch = np.asarray((predicted[0] - self.measured) / self.sigma)
        return sketch if np.sum((sketch - residuals) ** 2) < _SAME**2 * self.samples else None

    @property
    def _has_sketches(self) -> bool:
        return any(isinstance(r, ActuatorRecord) and r.sketch is not None for r in self.records)

    def _one_sided(
        self, x: np.ndarray, free: np.ndarray, residuals: np.ndarray, sketched: np.ndarray | None
    ) -> np.ndarray:
        steps = self.layout.differences(x)
        # away from a bound that is near
        steps = np.where(x + steps > self.layout.upper, -steps, steps)
        there = x + np.diag(steps)[free]
        if sketched is None or not sketched.any():
            predicted, _ = self.predict(self.layout.values(there))
            return ((predicted - self.measured) / self.sigma - residuals).T / steps[free]
        rows = np.vstack([there, x])
        predicted, _ = self.predict(self.layout.values(rows), np.append(sketched, True))
        moved = (predicted - self.measured) / self.sigma
        here = np.where(sketched[:, None], moved[-1], residuals)
        return (moved[:-1] - here).T / steps[free]
