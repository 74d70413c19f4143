"""All starts by one regression: effects and springs that, to first order, explain the records.

With the stretch imposed, the misfit of a model with effects e is linear in the moduli mu of springs
on a grid of relaxation times and in the coefficients a of effects' responses:

    minimise |P mu - Y - D a|   over  mu >= 0, a within its bounds.     (4)

P, Y and D are of ``dearig.model.diagnosis.imposed``, in units of the noise. The column of mu_0 is
the whole derivative of the misfit, the rest stretch lam0(mu_0) included. One QR decomposition of P
serves all effects; each point of an effect's shape parameters is then a small non-negative least
squares problem. Numbers of equations are those of ``app/docs/explanation/diagnosis.md``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.diagnosis.imposed import (
    ImposedActuator,
    ImposedStrip,
    springs_of_grid,
    without_sensor,
)
from dearig.model.diagnosis.least_squares import bounded, lagrange, well_determined
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.diagnosis.shapes import Extent, amplitudes, moved, shape_points, typical_values
from dearig.model.effects import PLACES, Effect
from dearig.model.fitting.slow_noise import Drift, DriftSpace, drift_modes
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip, unit_stresses

__all__ = ["Regression", "Start", "electric", "is_unseen"]

_REST_STEP = 0.02  # of mu_0: the difference quotient of the misfit through the rest stretch
_NEAR = 0.2  # relative: starts that differ by less are one
_SECANT = (0.3, 3.3)  # coefficients of a secant: beyond, the next amplitude's is closer
_PATTERN = (0.1, 0.05, 0.02)  # steps of the pattern search, in parts of a parameter's range
_LINEAR = 0.02  # relative difference of two secants up to which a response is linear
_BRANCH_POOL = 8  # nodes of the grid, the most used ones, of which sets of branches are made
_FLAT = 1e-6  # relative singular value: flatter directions are left alone
_POLISHING = 5  # Gauss-Newton steps of relaxation times between the nodes of the grid
_WEAK = 1e-3  # of the largest modulus: a branch without weight still needs influence to move


@dataclass(frozen=True)
class Start:
    """Where a fit begins: the numbers of an effect, and springs, in two ways.

    With new springs, of ``moduli`` (1 + n,) in Pa and ``times`` (n,) in s, they are ``values``.
    With the parent's, moved by ``shift`` (f,) in the parent's free coordinates, they are
    ``shifted``. ``misfit`` is the RMS, in noises of a mean, that the regression leaves.
    """

    values: tuple[float, ...]
    moduli: np.ndarray
    times: np.ndarray
    misfit: float
    shifted: tuple[float, ...]
    shift: np.ndarray


@dataclass(frozen=True)
class _Columns:
    """Responses of one effect in one shape: ``rows`` (k, M), of coefficients within ``limits``.

    An amplitude is ``neutral + coefficient * unit``. ``inside`` (G, k) and ``outside`` (M, k) are
    the parts within the span of the springs and beyond it.
    """

    effect: Effect
    shape: tuple[float, ...]
    rows: np.ndarray
    limits: np.ndarray
    neutral: np.ndarray
    unit: np.ndarray
    inside: np.ndarray
    outside: np.ndarray

    def values(self, coefficients: np.ndarray) -> tuple[float, ...]:
        return (*map(float, self.neutral + coefficients * self.unit), *self.shape)


_Row = tuple[float, np.ndarray, _Columns]  # misfit, coefficients, columns


def electric(name: str) -> bool:
    """Whether the effect changes the pull of the field."""
    module = PLACES[name].module
    hooks = ("supply", "polarise", "permittivity")
    return any(getattr(module, h, None) is not None for h in hooks) and not hasattr(
        module, "soften"
    )


def is_unseen(effect: Effect) -> bool:
    """Whether an effect has no inverse along a measured motion: it hides a part of the stress."""
    return hasattr(PLACES[effect.name].module, "measured_stress")


class Regression:
    """The regression of ``records`` about a fitted ``model``, whose effects stay as they are.

    ``times`` is the range of relaxation times in s, ``drift`` the variance of the records' drift in
    units of a reading's noise; the most probable drift ``mean_drift_m`` (N,) in m is subtracted.
    ``local`` are the derivative (N, f) of the model's readings with respect to its free
    coordinates, and its residuals (N,), model less measured, both over the noise: by them the
    parent's springs follow an effect that is small (a Gauss-Newton step).
    """

    def __init__(
        self,
        records: Sequence[Record],
        model: Actuator | Strip,
        times: tuple[float, float],
        settings: DiagnosisSettings,
        drift: float = 0.0,
        mean_drift_m: np.ndarray | None = None,
        local: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        self.model, self.settings = model, settings
        count = int(math.log(times[1] / times[0]) / math.log(settings.grid_ratio)) + 2
        self.grid = np.geomspace(*times, count)
        self._springs = springs_of_grid(model, self.grid)
        self._displacements = _clean(records, model, settings, mean_drift_m)
        self._records = tuple(records)
        self._linear: dict[str, bool] = {}
        self._imposed = self._impose(model)
        self._whiten = self._drift(drift) if drift else None
        self.columns = self._joined([i.columns for i in self._imposed])
        self.target = self._joined([i.target() for i in self._imposed])
        self._free_equilibrium()
        # P = Q R: the parts of Y and D within the span of the springs, and beyond it
        self._q, self._triangle = np.linalg.qr(self.columns.T)
        self._inside = self._q.T @ self._wanted
        self._outside = self._wanted - self._q @ self._inside
        self.misfit = self._rms(self._solve(None)[1])
        self._residuals = np.zeros(0)
        if local is not None:
            self._residuals = self._means(local[1])
            self._directions = well_determined(self._means(local[0].T).T)

    # -- set-up: P and Y of (4) by (1) to (3), as means, whitened by (6)

    def _impose(self, model: Actuator | Strip) -> list[ImposedActuator | ImposedStrip]:
        c = model.coefficients()
        found: list[ImposedActuator | ImposedStrip] = []
        for record, displacement in zip(self._records, self._displacements, strict=True):
            if isinstance(record, ActuatorRecord):
                step = float(np.median(np.diff(record.time)))
                every = max(1, round(1.0 / (self.settings.bandwidth_hz * step)))
                found.append(
                    ImposedActuator(
                        record, displacement, c, self._springs, every, self.settings.smoothing_s
                    )
                )
            else:
                found.append(ImposedStrip(record, c, self._springs))
        return found

    def _drift(self, amplitude: float) -> Drift:
        """Return the drift of the means, in units of a mean's noise."""
        bases = [
            drift_modes(one.record, self.settings.drift_modes, one.every) * math.sqrt(one.every)
            for one in self._imposed
            if isinstance(one, ImposedActuator)
        ]
        return Drift(DriftSpace(bases), amplitude)

    def _means(self, rows: np.ndarray) -> np.ndarray:
        """Return readings (..., N) over the noise as means (..., M) over the noise of a mean."""
        edges = np.cumsum([0, *(r.measured.size for r in self._records)])
        parts = []
        for one, (a, b) in zip(self._imposed, pairwise(edges), strict=True):
            every = one.every if isinstance(one, ImposedActuator) else 1
            whole = (b - a) // every
            part = rows[..., a : a + whole * every].reshape(*rows.shape[:-1], whole, every)
            parts.append(part.mean(axis=-1) * math.sqrt(every))
        return self._joined(parts)

    def _joined(self, rows: Sequence[np.ndarray]) -> np.ndarray:
        joined = np.concatenate(rows, axis=-1)
        return joined if self._whiten is None else self._whiten.whitened(joined)

    def _free_equilibrium(self) -> None:
        """Replace mu_0's column by the whole derivative, and set what the springs must explain."""
        network = self.model.network
        modulus = network.equilibrium.modulus
        free = not (isinstance(self.model, Actuator) and self.model.load.rest_length is not None)
        self._least = 0.0
        self._wanted = self.target
        if isinstance(self.model, Strip):
            return
        if not free:
            # mu_0 follows from the rest length: its stress is known
            self._least = modulus
            self._wanted = self.target - modulus * self.columns[0]
            self.columns[0] = 0.0
            return
        stiffer = replace(network.equilibrium, modulus=(1.0 + _REST_STEP) * modulus)
        moved = replace(self.model, network=replace(network, equilibrium=stiffer))
        there = self._misfit_of(moved, self._impose(moved))
        here = self._misfit_of(self.model, self._imposed)
        self.columns[0] = (there - here) / (_REST_STEP * modulus)
        # Y about the parent's mu_0, at which T was computed: the column of mu_0 is now a derivative
        network_part = modulus * self._joined([i.columns[0] for i in self._imposed])
        self._wanted = self.target - network_part + modulus * self.columns[0]

    def _misfit_of(
        self, model: Actuator | Strip, imposed: Sequence[ImposedActuator | ImposedStrip]
    ) -> np.ndarray:
        """Return what the springs of ``model`` hold back less what they must, (M,) in noises."""
        springs = model.network.springs
        mu = np.array([s.modulus for s in springs])
        unit = replace(
            model.network,
            equilibrium=replace(springs[0], modulus=1.0),
            branches=tuple(
                replace(b, spring=replace(b.spring, modulus=1.0)) for b in model.network.branches
            ),
        )
        rows = []
        for one in imposed:
            if not isinstance(one, ImposedActuator):
                continue
            stretch = one.motion[0]
            held = int(one.c[0])
            parts, _, _ = unit_stresses(unit.coefficients(held), one.record.time, stretch)
            rows.append(one.through(mu @ (parts - parts[:, :1])) - one.target())
        return self._joined(rows)

    # -- least squares: (4) for one effect in one shape

    def _rms(self, norm: float) -> float:
        return norm / math.sqrt(self.target.size)

    def _solve(self, columns: _Columns | None) -> tuple[np.ndarray, float]:
        """Return coefficients within their limits, and the norm of the misfit."""
        if columns is None:
            _, left = scipy.optimize.nnls(self._triangle, self._inside)
            return np.zeros(0), math.hypot(left, float(np.linalg.norm(self._outside)))
        c = columns
        return bounded(self._triangle, self._inside, self._outside, c.inside, c.outside, *c.limits)

    def _columns_of(
        self, effect: Effect, shape: tuple[float, ...], probes: tuple[float, ...]
    ) -> _Columns | None:
        """Return the responses of ``effect`` in one shape to ``probes`` of its amplitudes.

        None where one of them has none.
        """
        neutral = np.array([p.neutral or 0.0 for p in effect.amplitudes])
        rows = []
        for i, probe in enumerate(probes):
            values = neutral.copy()
            values[i] = probe
            rows.append(self._response(effect, (*map(float, values), *shape)))
        joined = np.array(rows)
        if not (np.isfinite(joined).all() and np.any(joined, axis=1).all()):
            return None
        unit = np.array(probes) - neutral
        bounds = np.array([p.fit_bounds for p in effect.amplitudes])
        limits = np.sort((bounds - neutral[:, None]).T / unit, axis=0)
        if len(probes) == 1 and not self._linear.get(effect.name, True):
            limits = np.clip(limits, *_SECANT)
        inside = self._q.T @ joined.T
        outside = joined.T - self._q @ inside
        return _Columns(effect, shape, joined, limits, neutral, unit, inside, outside)

    def _tried(
        self, effect: Effect, shape: tuple[float, ...], probes: tuple[float, ...]
    ) -> _Row | None:
        """Return the misfit with ``effect`` in one shape, its coefficients and columns."""
        columns = self._columns_of(effect, shape, probes)
        if columns is None:
            return None
        a, left = self._solve(columns)
        return self._weighed(left, a, columns), a, columns

    # -- shapes and amplitudes: nonlinear parameters of a column of D

    def _sharpened(self, row: _Row, extent: Extent) -> _Row:
        """Return ``row`` after a pattern search of the effect's shape parameters.

        Secants are taken at the amplitude that was found last.
        """
        effect = row[2].effect
        for part in _PATTERN:
            for i, parameter in enumerate(effect.shape_parameters):
                for sign in (1.0, -1.0):
                    shape = list(row[2].shape)
                    shape[i] = moved(parameter, extent, shape[i], sign * part)
                    row = self._better(row, tuple(shape))
            row = self._better(row, row[2].shape)
        return row

    def _better(self, row: _Row, shape: tuple[float, ...]) -> _Row:
        """Return the better of ``row`` and its effect in another ``shape``."""
        _, a, columns = row
        effect, probes = columns.effect, tuple(columns.neutral + columns.unit)
        if not self._linear.get(effect.name, True):
            found = float(columns.neutral[0] + a[0] * columns.unit[0])
            probes = (found,) if found != columns.neutral[0] else probes
        other = self._tried(effect, shape, probes)
        return other if other is not None and other[0] < row[0] else row

    def _probes(self, effect: Effect, shape: tuple[float, ...]) -> list[tuple[float, ...]]:
        """Return the amplitudes to probe together: typical ones, and several of a single one.

        Of a single amplitude in which the response is linear the typical one is enough.
        """
        typical = tuple(amplitudes(p, (1.0,))[0] for p in effect.amplitudes)
        if len(effect.amplitudes) > 1 or self._is_linear(effect, typical[0], shape):
            return [typical]
        return [(a,) for a in amplitudes(effect.amplitudes[0], self.settings.amplitudes)]

    def _is_linear(self, effect: Effect, typical: float, shape: tuple[float, ...]) -> bool:
        """Whether the response is linear in the amplitude: asked in the first shape only."""
        if effect.name not in self._linear:
            neutral = effect.amplitudes[0].neutral or 0.0
            tried = amplitudes(effect.amplitudes[0], self.settings.amplitudes)
            last = [a for a in tried if (a - neutral) * (typical - neutral) > 0.0][-1]
            first = self._response(effect, (typical, *shape))
            far = self._response(effect, (last, *shape)) * ((typical - neutral) / (last - neutral))
            near = float(np.linalg.norm(far - first)) <= _LINEAR * float(np.linalg.norm(first))
            self._linear[effect.name] = near
        return self._linear[effect.name]

    def _response(self, effect: Effect, values: tuple[float, ...]) -> np.ndarray:
        return self._joined([i.response(effect.name, values) for i in self._imposed])

    def _weighed(self, misfit: float, coefficients: np.ndarray, columns: _Columns) -> float:
        """Return the RMS of the misfit; where the effect acts on the pull, over what is left of it.

        Else "no pull at all" would fit best.
        """
        if not electric(columns.effect.name):
            return self._rms(misfit)
        # equation 5
        whole = float(np.linalg.norm(self.target))
        pull = float(np.linalg.norm(self.target + coefficients @ columns.rows))
        return self._rms(misfit) * whole / max(pull, 1e-9 * whole)

    # -- starts: effects by (4), with the parent's springs moved, and with springs of the grid

    def starts(self, effects: Sequence[Effect], extent: Extent) -> dict[str, list[Start]]:
        """Return the best starts of each of ``effects``, best first; none of one without response.

        The last of each has the parent's springs.
        """
        rows: dict[str, list[_Row]] = {}
        for effect in effects:
            tried = (
                self._tried(effect, shape, probes)
                for shape in shape_points(effect, extent, self.settings)
                for probes in self._probes(effect, shape)
            )
            some = sorted((row for row in tried if row is not None), key=lambda row: row[0])
            if some:
                rows[effect.name] = _distinct(some, self.settings.starts)
        # what may come through the first rung is sharpened
        for name in sorted(rows, key=lambda n: rows[n][0][0])[: self.settings.rungs[1].effects]:
            sharpened = (self._sharpened(row, extent) for row in rows[name])
            rows[name] = sorted(sharpened, key=lambda row: row[0])
        found = {
            name: [self._start(c, a, left) for left, a, c in some] for name, some in rows.items()
        }
        return found | {e.name: [self._unseen(e)] for e in effects if is_unseen(e)}

    def _unseen(self, effect: Effect) -> Start:
        """Return a start next to the parent's springs of an effect that has no column."""
        network = self.model.network
        values = typical_values(effect)
        moduli = np.array([spring.modulus for spring in network.springs])
        times = np.array([branch.relaxation_time for branch in network.branches])
        return Start(values, moduli, times, self.misfit, values, np.zeros(0))

    def _start(self, columns: _Columns, coefficients: np.ndarray, misfit: float) -> Start:
        moduli, times = self._branches(self._wanted + coefficients @ columns.rows)
        shifted, shift = self._shifted(columns)
        return Start(columns.values(coefficients), moduli, times, misfit, shifted, shift)

    def _shifted(self, columns: _Columns) -> tuple[tuple[float, ...], np.ndarray]:
        """Return an effect, and the step (f,) of the parent's free coordinates that goes with it.

        A Gauss-Newton step along the directions that the records determine well: the others are
        not straight so far. Without a derivative the effect is neutral, and nothing moves.
        """
        rows, (low, high) = columns.rows, columns.limits
        if not self._residuals.size:
            a, step = np.zeros(low.size), np.zeros(0)
        else:
            u, inverse = self._directions
            beyond = rows - (rows @ u) @ u.T
            left = self._residuals - u @ (u.T @ self._residuals)
            a = scipy.optimize.lsq_linear(beyond.T, -left, (low, high)).x
            step = -inverse @ (u.T @ (self._residuals + a @ rows))
        return columns.values(a), step

    # -- springs of a start: the best nodes of the grid, then between the nodes

    def _branches(self, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return moduli (1 + n,) and times (n,) of the best set of branches that explain (M,)."""
        count = len(self.model.network.branches)
        inside = self._q.T @ wanted
        weights, _ = scipy.optimize.nnls(self._triangle, inside)
        used = weights[1:] + 0.5 * (np.roll(weights[1:], 1) + np.roll(weights[1:], -1))
        pool = sorted(np.argsort(-used)[: max(_BRANCH_POOL, count)])
        best, chosen, moduli = math.inf, tuple(pool[:count]), np.zeros(1 + count)
        for some in combinations(pool, count):
            mu, left = scipy.optimize.nnls(self._triangle[:, [0, *(1 + i for i in some)]], inside)
            if left < best:
                best, chosen, moduli = left, some, mu
        moduli, times = self._polished(moduli, np.log(self.grid[list(chosen)]), inside)
        moduli[0] += self._least
        return np.maximum(moduli, _WEAK * moduli.max()), np.exp(times)

    def _polished(
        self, moduli: np.ndarray, log_times: np.ndarray, inside: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return moduli (1 + n,) and log times (n,) between the nodes that fit ``inside`` best.

        Gauss-Newton on the stress of a branch, interpolated between four nodes of the grid.
        """
        count = log_times.size
        best = np.inf
        kept = (moduli, log_times)
        for _ in range(_POLISHING):
            parts, slopes = self._between_nodes(log_times)
            moduli, left = scipy.optimize.nnls(parts, inside)
            if left < best:
                best, kept = left, (moduli, log_times)
            jacobian = np.hstack([parts, slopes * moduli[1:]])
            change, *_ = np.linalg.lstsq(jacobian, inside - parts @ moduli, rcond=_FLAT)
            log_times = np.clip(
                log_times + np.clip(change[-count:], -0.5, 0.5),
                math.log(self.grid[0]), math.log(self.grid[-1]),
            )  # fmt: skip
        return kept[0].copy(), kept[1]

    def _between_nodes(self, log_times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return columns (G, 1 + n) at log times (n,), and their derivatives (G, n) by these."""
        step = math.log(self.grid[1] / self.grid[0])
        place = (log_times - math.log(self.grid[0])) / step
        first = np.clip(place.astype(int) - 1, 0, self.grid.size - 4)
        at = place - first
        parts, slopes = [self._triangle[:, 0]], []
        for i, t in zip(first, at, strict=True):
            nodes = self._triangle[:, 1 + i : 5 + i]
            parts.append(nodes @ lagrange(t))
            slopes.append(nodes @ (lagrange(t + 1e-3) - lagrange(t - 1e-3)) / (2e-3 * step))
        return np.column_stack(parts), np.column_stack(slopes)


def _distinct(rows: Sequence[_Row], many: int) -> list[_Row]:
    """Return the first ``many`` of ``rows`` that differ in a parameter of the effect."""
    kept: list[_Row] = []
    for row in rows:
        values = row[2].values(row[1])
        if any(np.allclose(values, c.values(a), rtol=_NEAR, atol=0.0) for _, a, c in kept):
            continue
        kept.append(row)
        if len(kept) == many:
            break
    return kept


def _clean(
    records: Sequence[Record],
    model: Actuator | Strip,
    settings: DiagnosisSettings,
    mean_drift_m: np.ndarray | None,
) -> list[np.ndarray]:
    """Return the displacement (N,) in m of each record, less drift and sensor effects."""
    found = []
    edges = np.cumsum([0, *(r.measured.size for r in records)])
    for record, (a, b) in zip(records, pairwise(edges), strict=True):
        if isinstance(record, FilmRecord) or isinstance(model, Strip):
            found.append(np.zeros(0))
            continue
        if mean_drift_m is not None:
            record = replace(record, displacement=record.displacement - mean_drift_m[a:b])
        found.append(without_sensor(record, model, settings.smoothing_s))
    return found
