"""Noise of readings with slow parts, marginalised: r ~ N(0, I + B L B') in units of the noise.

Every record has its own. The columns of B are cosines over the record. The variances on the
diagonal of L are those of two noises. Drift: they fall as ``amplitude`` j^-4 with the number j of
half waves, an integrated random walk, as of a bench that warms. 1/f noise of the sensor: they fall
as 1/j, and the readings at rest say how large they are. A fit that whitens with
(I + B L B')^(-1/2) finds the most probable parameters whatever the slow parts have been; no
polynomial competes with an effect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dearig.model.fitting.offsets import centred
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.noise import about_rest
from dearig.model.readings.records import ActuatorRecord, Record

__all__ = [
    "Drift",
    "DriftSpace",
    "WhitenedProblem",
    "drift_basis",
    "drift_modes",
    "late_basis",
    "pink_density",
]

_POWER = 2.0  # of 1/j in a mode's standard deviation: an integrated random walk
#: Variances of the slowest mode, in units of the noise, among which the evidence chooses.
_AMPLITUDES = 10.0 ** np.arange(0.0, 9.0, 0.5)
_PINK_MAX = 15.0  # Hz: faster, a sensor that averages is not white, and mains may stand out
_PINK_LINES = 16  # of a spectrum: fewer do not show its slope
#: Frequencies in Hz below which 1/f noise is larger than white noise, among which is chosen.
_CORNERS = 10.0 ** np.arange(-1.0, 3.01, 0.05)


def drift_modes(record: ActuatorRecord, modes: int, every: int = 1) -> np.ndarray:
    """Return the modes (N, K) of a drift of unit amplitude, as the ``record`` counts displacement.

    Each is 0 where a reading is masked, and on average over the lead-in. With ``every`` > 1 they
    are means of so many neighbours.
    """
    basis = _cosines(record, modes)
    basis -= basis[: max(record.lead_in, 1)].mean(axis=0)
    if record.valid is not None:
        basis[~record.valid] = 0.0
    if every > 1:
        whole = basis.shape[0] // every
        basis = basis[: whole * every].reshape(whole, every, modes).mean(axis=1)
    return basis


def drift_basis(record: ActuatorRecord, modes: int) -> np.ndarray:
    """Return the modes (N, K) of ``drift_modes`` less what the offset of ``record`` absorbs."""
    return _without_offset(record, drift_modes(record, modes))


def late_basis(record: ActuatorRecord, modes: int) -> np.ndarray:
    """Return the modes (N, K) of ``drift_basis``, of what is slow and begins with the voltage."""
    late = _cosines(record, modes)
    late -= late[max(record.lead_in - 1, 0)]
    late[: record.lead_in] = 0.0
    return _without_offset(record, late)


def _cosines(record: ActuatorRecord, modes: int) -> np.ndarray:
    """Return the modes (N, K) of a drift of unit amplitude at every reading."""
    time = record.time - record.time[0]
    number = np.arange(1, modes + 1)
    return np.asarray(np.cos(math.pi * number * (time / time[-1])[:, None]) * number**-_POWER)


def _without_offset(record: ActuatorRecord, modes: np.ndarray) -> np.ndarray:
    """Return ``modes`` (N, K) less what the offset absorbs, and 0 where a reading is masked."""
    if record.valid is None:
        return centred(record, modes)
    return np.where(record.valid[:, None], centred(record, modes), 0.0)


def pink_density(records: Sequence[Record], odds: float, alike: float) -> float:
    """Return p in m^2 of a density p/f of the readings at rest, 0 where they are white.

    Whittle's likelihood of the lead-ins' periodograms below 15 Hz, less their straight line and
    what is periodic, of a density w + p/f over one of w. p is believed where twice the logarithm of
    their ratio is above ``odds``, and where that of a walk or a drift, of density w + p/f^2, over
    it is below ``alike``. Where the rest does not tell them apart, the search tries a drift next to
    the 1/f noise.
    """
    frequency: list[np.ndarray] = [np.zeros(0)]
    power: list[np.ndarray] = [np.zeros(0)]
    for record in records:
        if not isinstance(record, ActuatorRecord) or record.lead_in < 2 * _PINK_LINES:
            continue
        time = record.time[: record.lead_in]
        # the slope of a drift would look like 1/f noise
        rest, _ = about_rest(time, record.displacement[: record.lead_in])
        step = float(np.median(np.diff(time)))
        f = np.fft.rfftfreq(rest.size, step)[1:]
        density = 2.0 * step / rest.size * np.abs(np.fft.rfft(rest)[1:]) ** 2
        frequency.append(f[f < _PINK_MAX])
        power.append(density[f < _PINK_MAX])
    f, density = np.concatenate(frequency), np.concatenate(power)
    if f.size < _PINK_LINES or not density.any():
        return 0.0

    def fitted(power: float) -> tuple[float, float]:
        """Return minus the logarithm of the largest likelihood, and p there."""
        shapes = 1.0 + (_CORNERS[:, None] / f) ** power
        white = np.mean(density / shapes, axis=1)
        scores = f.size * np.log(white) + np.sum(np.log(shapes), axis=1)
        best = int(np.argmin(scores))
        return float(scores[best]), float(white[best] * _CORNERS[best])

    score, found = fitted(1.0)
    gain = 2.0 * (f.size * math.log(float(np.mean(density))) - score)
    return found if gain > odds and 2.0 * (score - fitted(2.0)[0]) < alike else 0.0


class DriftSpace:
    """Directions in which the records' noise is larger: the modes of each record, orthogonalised.

    ``bases`` are the modes (N_i, K) of each record, in units of one reading's noise. ``pink`` are
    the variances (K,) of each record's 1/f noise in these modes; none where it is not given.
    """

    def __init__(
        self, bases: Sequence[np.ndarray], pink: Sequence[np.ndarray] | None = None
    ) -> None:
        self.edges = np.cumsum([0, *(len(b) for b in bases)])
        self._bases, self._pink = bases, pink
        # without 1/f noise the directions are those of any drift
        self._units = [self._parts(b, np.ones(b.shape[1])) for b in bases if pink is None]

    @staticmethod
    def _parts(basis: np.ndarray, variances: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return directions (N, K), and the variance (K,) along each."""
        u, s, _ = np.linalg.svd(basis * np.sqrt(variances), full_matrices=False)
        return u, s * s

    def parts(self, amplitude: float) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return each record's directions (N, K) and variances (K,) under a drift."""
        if self._pink is None:
            return [(u, amplitude * unit) for u, unit in self._units]
        return [
            self._parts(basis, amplitude + pink)
            for basis, pink in zip(self._bases, self._pink, strict=True)
        ]

    def drift(self, amplitude: float) -> Drift | None:
        """Return the noise under a drift; None where it is white."""
        return Drift(self, amplitude) if amplitude or self._pink is not None else None

    def misfit(self, amplitude: float, residuals: np.ndarray) -> float:
        """Return r'(I + B L B')^-1 r + log det(I + B L B') less r'r, of ``residuals`` (N,) r.

        They are in noises; the smaller, the more probable is a drift of variance ``amplitude``.
        """
        total = 0.0
        for (u, variance), (a, b) in zip(self.parts(amplitude), pairwise(self.edges), strict=True):
            power = (residuals[a:b] @ u) ** 2
            total += float(np.sum(np.log1p(variance) - power * variance / (1.0 + variance)))
        return total

    def most_probable(self, residuals: np.ndarray) -> float:
        """Return the variance of the drift under which ``residuals`` (N,) are most probable.

        From a grid of half decades; 0 where the noise without drift is as probable as any.
        """
        best = min(map(float, _AMPLITUDES), key=lambda a: self.misfit(a, residuals))
        return best if self.misfit(best, residuals) < self.misfit(0.0, residuals) else 0.0


class Drift:
    """The covariance of several records' noise with a drift of variance ``amplitude``, or 0."""

    def __init__(self, space: DriftSpace, amplitude: float) -> None:
        self.amplitude = amplitude
        self.space = space
        parts = space.parts(amplitude)
        self._directions = [u for u, _ in parts]
        variances = [v for _, v in parts]
        self.log_det = float(sum(np.sum(np.log1p(v)) for v in variances))
        self._taken = [1.0 - 1.0 / np.sqrt(1.0 + v) for v in variances]
        self._kept = [v / (1.0 + v) for v in variances]

    def whitened(self, rows: np.ndarray) -> np.ndarray:
        """Return ``rows`` (..., N) times (I + B L B')^(-1/2)."""
        out = np.array(rows, dtype=float)
        self._subtract(out, self._taken)
        return out

    def mean(self, residuals: np.ndarray) -> np.ndarray:
        """Return the most probable drift (N,) given measured less model, ``residuals`` (N,)."""
        left = np.array(residuals, dtype=float)
        self._subtract(left, self._kept)
        return np.asarray(residuals - left)

    def _subtract(self, rows: np.ndarray, parts: Sequence[np.ndarray]) -> None:
        edges = pairwise(self.space.edges)
        for u, part, (a, b) in zip(self._directions, parts, edges, strict=True):
            rows[..., a:b] -= ((rows[..., a:b] @ u) * part) @ u.T


class WhitenedProblem(Problem):
    """Least squares as of ``Problem``, under white noise and a ``drift`` of each record.

    Without a drift (None) it is that of ``Problem``.
    """

    def __init__(
        self,
        records: Sequence[Record],
        layout: FitLayout,
        drift: Drift | None = None,
        **options: object,
    ) -> None:
        super().__init__(records, layout, **options)  # type: ignore[arg-type]
        self.noise_drift = drift
        self.set_readings(self.readings)

    def set_readings(self, readings: np.ndarray) -> None:
        """Fit other ``readings`` (N,) in place of those of the records."""
        super().set_readings(readings)
        if self.noise_drift is not None:
            self.measured = self.noise_drift.whitened(readings)

    def predict(
        self, values: np.ndarray, coarse: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return whitened readings (P, N) and statuses (P,), as of ``Problem``.

        The noise of one record is the same for all its readings, so whitening readings in m is
        whitening them in units of the noise.
        """
        predicted, status = super().predict(values, coarse)
        return self._whitened(predicted), status

    def _differences_compared(self, rows: np.ndarray) -> np.ndarray:
        rows = super()._differences_compared(rows)
        return rows if self.noise_drift is None else self.noise_drift.whitened(rows)

    def _whitened(self, predicted: np.ndarray) -> np.ndarray:
        if self.noise_drift is None:
            return predicted
        if self._correction is None:
            return self.noise_drift.whitened(predicted)
        # the correction by full simulations is of whitened readings
        return self.noise_drift.whitened(predicted - self._correction) + self._correction

    def white(self) -> WhitenedProblem:
        """Return the same problem of the readings alone, under white noise alone."""
        other = self.without_priors()
        other.noise_drift, other.measured = None, other.readings
        return other

    def of_channels(self, residuals: np.ndarray) -> np.ndarray:
        """Return the part of ``residuals`` that belongs to electrical channels: none here."""
        return residuals[residuals.size :]
