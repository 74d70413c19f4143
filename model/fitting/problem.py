"""The residuals of a set of records, for one parameter vector or a population of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from model import kernel
from model.actuator import Actuator, reading_of
from model.errors import ModelError
from model.film import stress_of
from model.fitting.parameters import Layout
from model.fitting.threads import together
from model.records import ActuatorRecord, FilmRecord, Record

__all__ = ["Problem"]


class Problem:
    """Least squares of model minus measurement, in units of the noise.

    ``records`` are all of actuators or all of films, and ``layout`` says what is free. Members of a
    population whose simulation ends early keep the last value they reached: a large but finite
    residual, which a search walks away from. ``haste`` is as the kernel has it. ``simulations``
    counts records simulated, and ``told`` is called with each such number.
    """

    def __init__(
        self,
        records: Sequence[Record],
        layout: Layout,
        workers: int = 2,
        haste: int = kernel.CAREFUL,
        told: Callable[[int], None] | None = None,
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
        self.haste = haste
        self.told = told
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

    @property
    def samples(self) -> int:
        """How many readings are fitted."""
        return int(np.count_nonzero(np.isfinite(self.sigma)))

    def predict(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Model readings (P, N) and statuses (P,) of a population ``values`` (P, d), natural."""
        c = self.layout.coefficients(values)
        out = np.zeros((c.shape[0], self.measured.size))
        status = np.zeros((c.shape[0], len(self.records)), dtype=np.int64)

        def run(job: tuple[int, int]) -> None:
            member, i = job
            part = slice(self._edges[i], self._edges[i + 1])
            out[member, part], status[member, i] = self._reading(c[member], self.records[i])

        together(run, list(np.ndindex(status.shape)), self.workers)
        self.simulations += status.size
        if self.told is not None:
            self.told(status.size)
        # of several records the first that fails speaks
        failed = np.argmax(status != kernel.OK, axis=1)
        return out, np.take_along_axis(status, failed[:, None], axis=1)[:, 0]

    def _reading(self, c: np.ndarray, record: Record) -> tuple[np.ndarray, int]:
        if isinstance(record, FilmRecord):
            stress, status, _ = stress_of(c, record.time, record.stretch)
            return stress, status
        base = self.layout.base
        length = base.film.length if isinstance(base, Actuator) else 1.0
        moved, status = reading_of(c, length, record.drive, record.lag, self.haste)
        return record.seen(moved), status

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """(model - measured)/noise, (N,), at coordinates ``x`` (d,)."""
        predicted, _ = self.predict(self.layout.values(x))
        return (predicted[0] - self.measured) / self.sigma

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
        self, x: np.ndarray, free: np.ndarray, residuals: np.ndarray | None = None
    ) -> np.ndarray:
        """d(residuals)/dx (N, f) over the ``free`` (d,) coordinates, as one population.

        Central differences: two branches of nearly one relaxation time have nearly parallel columns
        (to 1e-5), and a one-sided difference would blur just the direction that is hard to see.
        With the ``residuals`` at ``x`` given, one-sided ones, for half of the cost.
        """
        if residuals is not None:
            return self._one_sided(x, free, residuals)
        steps = np.diag(self.layout.differences(x))[free]
        up = np.minimum(x + steps, self.layout.upper)
        down = np.maximum(x - steps, self.layout.lower)
        predicted, _ = self.predict(self.layout.values(np.concatenate([up, down])))
        width = (up - down).sum(axis=1)
        half = width.size
        return ((predicted[:half] - predicted[half:]) / self.sigma).T / width

    def _one_sided(self, x: np.ndarray, free: np.ndarray, residuals: np.ndarray) -> np.ndarray:
        steps = self.layout.differences(x)
        # away from a bound that is near
        steps = np.where(x + steps > self.layout.upper, -steps, steps)
        there = x + np.diag(steps)[free]
        predicted, _ = self.predict(self.layout.values(there))
        return ((predicted - self.measured) / self.sigma - residuals).T / steps[free]
