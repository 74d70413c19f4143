"""The residuals of a set of records, for one parameter vector or a population of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Self

import numpy as np

from dearig.model import kernel
from dearig.model.compiled.packs import WIDTH
from dearig.model.effects import EFFECTS, SENSOR_COLUMNS
from dearig.model.errors import ModelError
from dearig.model.fitting.drift import DriftFit, record_drift
from dearig.model.fitting.neighbours import readings_of_neighbours
from dearig.model.fitting.offsets import Offsets
from dearig.model.fitting.parallel import parallel_map
from dearig.model.fitting.parameters import FitLayout
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record
from dearig.model.simulation.actuator import Actuator, Drive, readings_of
from dearig.model.simulation.strip import Strip, stress_of

__all__ = ["Problem", "agrees"]

# RMS, in units of the noise, by which readings by the coarse drive may differ from the full ones
_COARSE_MISFIT_MAX = 1.0
_COARSE_SHARE_MIN = 0.6  # of the parameters: below, no coarse derivative is trusted
_COARSE_ERROR_MAX = 0.15  # relative error of a derivative by the coarse drive
# Cost of a simulation, in integration steps of an actuator without effects
_STRIP_SAMPLE_COST = 6.0
_EFFECT_STEP_COST = 0.8
_POPULATION_COST = 1.5e4  # of one call: handing over, and the linear algebra of the fit


def agrees(full: np.ndarray, coarse: np.ndarray) -> bool:
    """Whether a derivative (N,) by the ``coarse`` drive is close enough to the ``full`` one."""
    return float(np.linalg.norm(coarse - full)) <= _COARSE_ERROR_MAX * float(np.linalg.norm(full))


def _places(groups: Sequence[Sequence[int]]) -> list[range]:
    """Return where the members of each group stand, with the groups one after the other."""
    ends = np.cumsum([len(group) for group in groups])
    return [range(end - len(group), end) for end, group in zip(ends, groups, strict=True)]


class Problem:
    """Least squares of model minus measurement, in units of the noise.

    ``records`` are all of actuators or all of films, and ``layout`` names the free parameters. A
    member of a population whose simulation ends early keeps the last value that it reached: its
    residual is large but finite, so a search moves away from it. ``fidelity`` is the kernel's.
    ``simulations`` counts the records simulated; ``on_simulations(count, cost)`` is called after
    each population. ``coarse_columns`` (d,) bool are the parameters whose derivatives the records'
    coarse drives give; None where none are.

    The offset of each record is eliminated in every prediction (``dearig.model.fitting.offsets``)
    unless ``exact_zero``, and so is drift that each of several records has on its own
    (``dearig.model.fitting.drift``); the layout's amplitudes of it then have no influence.

    A prior of the layout is one more reading: its row, the distance from its mean in standard
    deviations, follows those of the N readings.
    """

    def __init__(
        self,
        records: Sequence[Record],
        layout: FitLayout,
        workers: int = 2,
        fidelity: int = kernel.CAREFUL,
        on_simulations: Callable[[int, float], None] | None = None,
        exact_zero: bool = False,
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
        self.on_simulations = on_simulations
        self.coarse_columns: np.ndarray | None = None
        # difference of full and coarse readings (N,) in m, while the coarse drives are used
        self._correction: np.ndarray | None = None
        self._with_priors = True
        self.simulations = 0
        #: (N,) as they were taken; ``measured`` are those that are compared
        self.readings = np.concatenate([r.measured for r in records])
        self.measured = self.readings
        # a masked reading has no weight
        self.sigma = np.concatenate(
            [
                np.full(r.measured.size, r.noise)
                if r.valid is None
                else np.where(r.valid, r.noise, np.inf)
                for r in records
            ]
        )
        self._edges = np.cumsum([0, *(r.measured.size for r in records)])
        self._offsets = Offsets(() if exact_zero else records)
        self.drift = record_drift(self.records, layout.base.effects)
        own = () if self.drift is None else self.drift.names
        #: (d,) bool: parameters of the layout that each record has for itself
        self.own = np.array([name in own for name in layout.names], dtype=bool)

    def set_readings(self, readings: np.ndarray) -> None:
        """Fit other ``readings`` (N,) in place of those of the records."""
        self.readings = self.measured = readings

    @property
    def edges(self) -> np.ndarray:
        """Where each record's readings begin, and where the last ends: (K + 1,)."""
        return self._edges

    @property
    def samples(self) -> int:
        """Number of readings and priors that are fitted."""
        return self.readings_fitted + self._priors

    @property
    def readings_fitted(self) -> int:
        """Number of readings that are fitted."""
        return int(np.count_nonzero(np.isfinite(self.sigma)))

    @property
    def _priors(self) -> int:
        return self.layout.priors.size if self._with_priors else 0

    def _with_prior_rows(self, left: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return residuals ``left`` (P, N), then the priors' (P, k) for ``values`` (P, d)."""
        return np.hstack([left, self.layout.prior_rows(values)]) if self._priors else left

    def without_priors(self) -> Self:
        """Return the same problem of the readings alone."""
        other = copy(self)
        other._with_priors = False
        return other

    def predict(
        self, values: np.ndarray, coarse: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return readings (P, N) and statuses (P,) of a population ``values`` (P, d), natural.

        Members ``coarse`` (P,) bool are simulated under the coarse drives of the records that have
        one.
        """
        c = self.layout.coefficients(values)
        if coarse is None:
            coarse = np.full(c.shape[0], self._correction is not None)
        out = np.zeros((c.shape[0], self.measured.size))
        status = np.zeros((c.shape[0], len(self.records)), dtype=np.int64)

        films = self._films(c, coarse)
        which = coarse[[members[0] for members in films]]
        steps = np.zeros((which.size, len(self.records)))
        shares = self._shared_out(which, packed=self._in_packs(c[0]))

        def run(jobs: list[tuple[list[int], int]]) -> None:
            # several jobs a call: handing them over one by one costs a part of the time
            for some, i in jobs:
                members = [member for film in some for member in films[film]]
                part = slice(self._edges[i], self._edges[i + 1])
                out[members, part], status[members, i], steps[some[0], i] = self._readings(
                    c[members],
                    self.records[i],
                    bool(which[some[0]]),
                    _places([films[film] for film in some]),
                )

        parallel_map(run, shares, self.workers)
        self.simulations += steps.size
        if self.on_simulations is not None:
            self.on_simulations(steps.size, self._effort(float(steps.sum())))
        # the status is that of the first record that fails
        failed = np.argmax(status != kernel.OK, axis=1)
        found = np.take_along_axis(status, failed[:, None], axis=1)[:, 0]
        return self._compared(out), found

    def _compared(self, out: np.ndarray) -> np.ndarray:
        """Return readings ``out`` (P, N), changed in place, as they are compared with measured."""
        self._offsets.align(out, self.readings)
        if self._correction is not None:
            # the difference of two predictions with their offsets
            out += self._correction
        if self.drift is not None:
            out += self.drift.nearest(self.measured - out)
        return out

    def differences(
        self, values: np.ndarray, central: bool = False, coarse: bool = False
    ) -> np.ndarray | None:
        """Return differences (f, N) of the readings of a population ``values``, natural.

        The first of ``values`` (1 + f, d) are near the others, from which it is taken off. With
        ``central`` (1 + 2 f, d) the last f are taken off those before. All are simulated in steps
        that they share, so that differences are smooth; with ``coarse`` under the coarse drives.
        None where the films cannot share steps.
        """
        if not isinstance(self.layout.base, Actuator):
            return None
        c = self.layout.coefficients(values)
        coarse = coarse or self._correction is not None
        films = self._films(c, np.full(len(c), coarse))
        found: list[np.ndarray | None] = [None] * len(self.records)
        steps = np.zeros(len(self.records))

        def run(which: list[int]) -> None:
            for i in which:
                record = self.records[i]
                if not isinstance(record, ActuatorRecord):
                    return
                moved, steps[i] = readings_of_neighbours(
                    c, films, self._length, *self._drive(record, coarse), record.lag, record.time
                )
                if moved is not None:
                    half = len(c) // 2
                    above, below = (moved[1 : 1 + half], moved[1 + half :])
                    if not central:
                        above, below = moved[1:], moved[0]
                    above -= below
                    # linear, so that what is compared holds for differences as for readings
                    found[i] = record.seen(above)

        parallel_map(run, [[i] for i in range(len(self.records))], self.workers)
        self.simulations += len(films) * len(self.records)
        if self.on_simulations is not None:
            self.on_simulations(
                len(films) * len(self.records), self._effort(float(steps.sum()), len(films))
            )
        parts = [part for part in found if part is not None]
        if len(parts) < len(found):
            return None
        return self._differences_compared(
            parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)
        )

    def _differences_compared(self, rows: np.ndarray) -> np.ndarray:
        """Return differences ``rows`` (f, N), changed in place, as readings are compared."""
        self._offsets.align(rows)
        if self.drift is not None:
            rows -= self.drift.nearest(rows)
        return rows

    def _films(self, c: np.ndarray, coarse: np.ndarray) -> list[list[int]]:
        """Group members of a population ``c`` (P, C) whose films move alike, for one simulation."""
        sensors = any(EFFECTS[name].acts_on == "sensor" for name, _ in self.layout.base.effects)
        if len(c) < 2 or not sensors:
            return [[member] for member in range(len(c))]
        films: dict[tuple[bytes, bool], list[int]] = {}
        moving = np.delete(c, SENSOR_COLUMNS, axis=1)
        for member, (row, is_coarse) in enumerate(zip(moving, coarse, strict=True)):
            films.setdefault((row.tobytes(), bool(is_coarse)), []).append(member)
        return list(films.values())

    def _in_packs(self, c: np.ndarray) -> bool:
        """Whether films like ``c`` (C,) are simulated several at a time."""
        moving = any(EFFECTS[name].acts_on != "sensor" for name, _ in self.layout.base.effects)
        return isinstance(self.layout.base, Actuator) and not moving and kernel.is_swift(c)

    def _shared_out(self, coarse: np.ndarray, packed: bool) -> list[list[tuple[list[int], int]]]:
        """Share out (films, record) jobs among the workers; ``coarse`` (P,) films are cheaper.

        Films of one job go through the record together, where they are ``packed``. The longest jobs
        go first, each to the worker with the least load, since records differ.
        """
        together = WIDTH if packed else 1
        jobs = []
        for i, record in enumerate(self.records):
            for is_coarse, steps in enumerate(self._steps(record)):
                films = np.flatnonzero(coarse == bool(is_coarse)).tolist()
                jobs += [
                    (steps, films[begin : begin + together], i)
                    for begin in range(0, len(films), together)
                ]
        jobs.sort(key=lambda job: -job[0])
        workers = min(self.workers, len(jobs))
        shares: list[list[tuple[list[int], int]]] = [[] for _ in range(workers)]
        loads = [0.0] * len(shares)
        for steps, films, i in jobs:
            least = loads.index(min(loads))
            shares[least].append((films, i))
            loads[least] += steps
        return shares

    @staticmethod
    def _steps(record: Record) -> tuple[float, float]:
        """Samples that a simulation steps through: full record, and coarse drive."""
        if isinstance(record, FilmRecord) or record.coarse_drive is None:
            return float(record.time.size), float(record.time.size)
        return float(record.time.size), float(record.coarse_drive.time.size)

    def _effort(self, steps: float, side_by_side: int = 0) -> float:
        """Cost of simulating a population in so many ``steps``, in steps of a bare film.

        Counted in steps, not seconds: the same on any machine under any load. ``side_by_side`` is
        the number of films that share steps: one of them alone, then packs of them.
        """
        base = self.layout.base
        if isinstance(base, Strip):
            return _POPULATION_COST + _STRIP_SAMPLE_COST * steps
        moving = sum(EFFECTS[name].acts_on != "sensor" for name, _ in base.effects)
        # a step of a pack costs as much as one of a film, but effects take its films in turn
        packs = -(-side_by_side // WIDTH)
        turns = (1.0 + packs * WIDTH) / (1.0 + packs)
        return _POPULATION_COST + (1.0 + _EFFECT_STEP_COST * moving * turns) * steps

    def _readings(
        self, c: np.ndarray, record: Record, coarse: bool, films: Sequence[Sequence[int]]
    ) -> tuple[np.ndarray, np.ndarray | int, int]:
        """Return readings (M, N) of members ``c`` (M, C), statuses (M,) and steps.

        ``films`` are the places of members whose films move alike.
        """
        if isinstance(record, FilmRecord):
            stress, status, _ = stress_of(c[0], record.time, record.stretch)
            return stress[None], status, record.time.size
        drive, fidelity = self._drive(record, coarse)
        moved, statuses, steps = readings_of(
            c, self._length, drive, record.lag, fidelity, record.time, films
        )
        return record.seen(moved), statuses, steps

    @property
    def _length(self) -> float:
        """Length in m of an actuator's film."""
        base = self.layout.base
        return base.film.length if isinstance(base, Actuator) else 1.0

    def _drive(self, record: ActuatorRecord, coarse: bool) -> tuple[Drive, int]:
        """Return the drive and the fidelity at which ``record`` is simulated."""
        if coarse and record.coarse_drive is not None:
            return record.coarse_drive, kernel.COARSE
        return record.drive, self.fidelity

    def scaled(self, values: np.ndarray) -> np.ndarray:
        """Return predictions (P, N + k) over the noise of natural ``values`` (P, d).

        Those of priors are but for a constant.
        """
        return self._with_prior_rows(self.predict(values)[0] / self.sigma, values)

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return (model - measured)/noise, (N + k,), at coordinates ``x`` (d,)."""
        values = np.atleast_2d(self.layout.values(x))
        predicted, _ = self.predict(values)
        return self._with_prior_rows((predicted - self.measured) / self.sigma, values)[0]

    def of_readings(self, residuals: np.ndarray) -> np.ndarray:
        """Return the part (N,) of ``residuals`` that belongs to the readings."""
        return residuals[: self.measured.size]

    def fit_drift(self, x: np.ndarray) -> DriftFit | None:
        """Return the drift of the records at ``x`` (d,); None where no record has its own."""
        if self.drift is None:
            return None
        still = self.layout.values(x)
        still[self.own] = 0.0
        missing = self.measured - self.without_drift().predict(still)[0][0]
        return self.drift.fit(missing, self.sigma)

    def without_drift(self) -> Problem:
        """Return the same problem without the elimination of each record's drift."""
        other = copy(self)
        other.drift, other.own = None, np.zeros_like(self.own)
        return other

    def project_off_drift(self, jacobian: np.ndarray) -> np.ndarray:
        """Return the columns of ``jacobian`` (N, f) less what the drift of each record absorbs."""
        if self.drift is None:
            return jacobian
        sigma = np.where(np.isfinite(self.sigma), self.sigma, 0.0)
        return jacobian - (self.drift.nearest(jacobian.T * sigma) / self.sigma).T

    def costs(self, x: np.ndarray) -> np.ndarray:
        """Return the mean squares (P,) of the residuals of a population of coordinates (P, d).

        A member whose simulation fails costs more than a model that does not move.
        """
        return self.evaluate(x)[0]

    def evaluate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return costs (P,) as in ``costs``, and residuals (P, N + k), of coordinates (P, d)."""
        values = self.layout.values(x)
        predicted, status = self.predict(values)
        still = float(np.sum((self.measured / self.sigma) ** 2)) / self.samples
        residuals = self._with_prior_rows((predicted - self.measured) / self.sigma, values)
        costs = np.sum(residuals**2, axis=1) / self.samples
        return np.where(status == kernel.OK, costs, 10.0 * still + costs), residuals

    def jacobian(
        self,
        x: np.ndarray,
        free: np.ndarray,
        residuals: np.ndarray | None = None,
        coarse: bool = False,
    ) -> np.ndarray:
        """Return d(residuals)/dx (N + k, f) over the ``free`` (d,) coordinates.

        The derivatives of the readings are one population; priors need no simulation.
        """
        own = None if residuals is None else self.of_readings(residuals)
        above = self._readings_jacobian(x, free, own, coarse)
        if not self._priors:
            return above
        up, down = self._sides(x, free, self.layout.differences(x))
        width = (up - down).sum(axis=1)
        high, low = (self.layout.prior_rows(self.layout.values(side)) for side in (up, down))
        return np.vstack([above, (high - low).T / width])

    def _readings_jacobian(
        self, x: np.ndarray, free: np.ndarray, residuals: np.ndarray | None, coarse: bool
    ) -> np.ndarray:
        """Return the derivatives (N, f) of the readings' residuals.

        Differences are central: two branches of nearly equal relaxation times have nearly parallel
        columns (to 1e-5), and a one-sided difference blurs the direction in which they differ. With
        the ``residuals`` at ``x`` given, differences are one-sided, for half the cost; with
        ``coarse``, the ``coarse_columns`` come from the coarse drives, for a quarter of that.

        The films of the differences share their steps (``dearig.model.kernel.lanes``). Those that
        cannot, stiff films and films driven by stretch, are simulated one by one, with wider
        increments for the noise of their own steps.
        """
        moving = ~self.own[free]
        if not moving.all():
            # eliminated parameters have columns of exact zeros
            jac = np.zeros((self.measured.size, moving.size))
            jac[:, moving] = self._readings_jacobian(x, free & ~self.own, residuals, coarse)
            return jac
        columns = np.zeros(moving.size, dtype=bool)
        if residuals is not None and coarse and self.coarse_columns is not None:
            columns = self.coarse_columns[free]
        if residuals is not None:
            return self._one_sided(x, free, residuals, columns)
        steps = self.layout.differences(x, in_common=True, central=True)
        up, down = self._sides(x, free, steps)
        rows = self.differences(self.layout.values(np.vstack([x, up, down])), central=True)
        if rows is None:
            up, down = self._sides(x, free, self.layout.differences(x))
            sides, _ = self.predict(self.layout.values(np.concatenate([up, down])))
            rows = sides[: len(up)] - sides[len(up) :]
        return self._over_noise(rows, (up - down).sum(axis=1))

    def _over_noise(self, rows: np.ndarray, width: np.ndarray) -> np.ndarray:
        """Return the Jacobian (N, f) by differences ``rows`` (f, N), changed, over ``width`` (f,).

        A masked reading counts nothing.
        """
        rows /= self.sigma
        rows /= width[:, None]
        return rows.T

    def _sides(
        self, x: np.ndarray, free: np.ndarray, steps: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates (f, d) above and below ``x`` (d,) by ``steps`` (d,), in bounds."""
        away = np.diag(steps)[free]
        return np.minimum(x + away, self.layout.upper), np.maximum(x - away, self.layout.lower)

    def find_coarse_columns(
        self, x: np.ndarray, free: np.ndarray, known: np.ndarray | None = None
    ) -> np.ndarray:
        """Return which ``free`` parameters (d,) bool have a derivative by coarse drives at ``x``.

        ``known`` gives the answer for the first parameters, which are not computed again.
        """
        seen = np.zeros(x.size, dtype=bool)
        if not self._has_coarse_drives:
            return seen
        residuals = self.of_readings(self.residuals(x))
        if self.coarse_residuals(x, residuals) is None:
            return seen  # a large error of the reading is an error of the differences too
        asked = free.copy()
        if known is not None:
            seen[: known.size] = known
            asked[: known.size] = False
        count = int(np.count_nonzero(asked))
        full = self._one_sided(x, asked, residuals, np.zeros(count, dtype=bool))
        by_coarse = self._one_sided(x, asked, residuals, np.ones(count, dtype=bool))
        seen[asked] = [agrees(w, t) for w, t in zip(full.T, by_coarse.T, strict=True)]
        # where few derivatives agree, the others agree by chance
        return seen if np.mean(seen[free]) > _COARSE_SHARE_MIN else np.zeros_like(seen)

    def space_mapped(
        self, x: np.ndarray, residuals: np.ndarray, free: np.ndarray
    ) -> Problem | None:
        """Return the problem under coarse drives, corrected to ``residuals`` (N,) at ``x`` (d,).

        None where a ``free`` (d,) parameter has no derivative by the coarse drives.
        """
        if self.coarse_columns is None or not self.coarse_columns[free].all():
            return None
        coarse = self.coarse_residuals(x, residuals)
        if coarse is None:
            return None
        other = copy(self)
        other.coarse_columns = None
        # a masked reading needs no correction
        sigma = np.where(np.isfinite(self.sigma), self.sigma, 0.0)
        other._correction = (self.of_readings(residuals) - coarse) * sigma
        return other

    def coarse_residuals(self, x: np.ndarray, residuals: np.ndarray) -> np.ndarray | None:
        """Return residuals (N,) at ``x`` (d,) by coarse drives; None where they are not close."""
        if not self._has_coarse_drives:
            return None
        predicted, _ = self.predict(self.layout.values(x), np.ones(1, dtype=bool))
        coarse = np.asarray((predicted[0] - self.measured) / self.sigma)
        return (
            coarse
            if np.sum((coarse - self.of_readings(residuals)) ** 2)
            < _COARSE_MISFIT_MAX**2 * self.samples
            else None
        )

    @property
    def _has_coarse_drives(self) -> bool:
        return any(
            isinstance(r, ActuatorRecord) and r.coarse_drive is not None for r in self.records
        )

    def _one_sided(
        self, x: np.ndarray, free: np.ndarray, residuals: np.ndarray, coarse: np.ndarray
    ) -> np.ndarray:
        """Return one-sided differences (N, f), of columns ``coarse`` (f,) bool by coarse drives.

        ``residuals`` (N,) are those at ``x`` (d,).
        """
        there, steps = self._one_side(x, free, self.layout.differences(x, in_common=True))
        found = np.empty((residuals.size, steps.size))
        for by_coarse in (False, True):
            which = coarse == by_coarse
            if not which.any():
                continue
            rows = self.differences(
                self.layout.values(np.vstack([x, there[which]])), coarse=by_coarse
            )
            if rows is None:
                return self._one_by_one(x, free, residuals, coarse)
            part = self._over_noise(rows, steps[which])
            if which.all():
                return part
            found[:, which] = part
        return found

    def _one_side(
        self, x: np.ndarray, free: np.ndarray, steps: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates (f, d) next to ``x`` (d,) by ``steps`` (d,), and those steps (f,)."""
        # away from a bound that is near
        steps = np.where(x + steps > self.layout.upper, -steps, steps)
        return x + np.diag(steps)[free], steps[free]

    def _one_by_one(
        self, x: np.ndarray, free: np.ndarray, residuals: np.ndarray, coarse: np.ndarray
    ) -> np.ndarray:
        """Return what ``_one_sided`` does, of films that cannot share steps."""
        there, steps = self._one_side(x, free, self.layout.differences(x))
        if not coarse.any():
            predicted, _ = self.predict(self.layout.values(there))
            return np.asarray(((predicted - self.measured) / self.sigma - residuals).T / steps)
        rows = np.vstack([there, x])
        predicted, _ = self.predict(self.layout.values(rows), np.append(coarse, True))
        moved = (predicted - self.measured) / self.sigma
        here = np.where(coarse[:, None], moved[-1], residuals)
        return np.asarray((moved[:-1] - here).T / steps)
