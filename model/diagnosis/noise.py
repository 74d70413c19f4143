"""Noise of readings with slow drift, marginalised: r ~ N(0, I + B L B') in units of the noise.

Every record drifts by itself. The columns of B are cosines over the record, the variances on the
diagonal of L fall as ``amplitude`` j^-4 with the number j of half waves: an integrated random walk,
as of a bench that warms. A fit that whitens with (I + B L B')^(-1/2) finds the most probable
parameters whatever the drift has been; no polynomial competes with an effect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dearig.model.fitting.parameters import Layout
from dearig.model.fitting.problem import Problem
from dearig.model.records import ActuatorRecord, Record

__all__ = ["Drift", "DriftSpace", "WhitenedProblem", "drift_modes"]

_POWER = 2.0  # of 1/j in a mode's standard deviation: an integrated random walk
#: Variances of the slowest mode, in units of the noise, among which the evidence chooses.
_AMPLITUDES = 10.0 ** np.arange(0.0, 9.0, 0.5)


def drift_modes(record: ActuatorRecord, modes: int, every: int = 1) -> np.ndarray:
    """Return the modes (N, K) of a drift of unit amplitude, as the ``record`` counts displacement.

    Each is 0 where a reading is masked, and on average over the lead-in. With ``every`` > 1 they
    are means of so many neighbours.
    """
    time = record.time - record.time[0]
    number = np.arange(1, modes + 1)
    basis = np.cos(math.pi * number * (time / time[-1])[:, None]) * number**-_POWER
    basis -= basis[: max(record.lead_in, 1)].mean(axis=0)
    if record.valid is not None:
        basis[~record.valid] = 0.0
    if every > 1:
        whole = basis.shape[0] // every
        basis = basis[: whole * every].reshape(whole, every, modes).mean(axis=1)
    return basis


class DriftSpace:
    """Directions in which the records' noise is larger: the modes of each record, orthogonalised.

    ``bases`` are the modes (N_i, K) of each record, in units of one reading's noise.
    """

    def __init__(self, bases: Sequence[np.ndarray]) -> None:
        self.edges = np.cumsum([0, *(len(b) for b in bases)])
        self.parts: list[tuple[np.ndarray, np.ndarray]] = []
        for basis in bases:
            u, s, _ = np.linalg.svd(basis, full_matrices=False)
            self.parts.append((u, s * s))

    def most_probable(self, residuals: np.ndarray) -> float:
        """Return the variance of the drift under which ``residuals`` (N,) are most probable.

        Maximum of the evidence -r'(I + B L B')^-1 r - log det(I + B L B') over a grid of half
        decades; 0 where white noise alone is as probable as any. ``residuals`` are in noises.
        """
        inside = [
            (residuals[a:b] @ u) ** 2
            for (u, _), a, b in zip(self.parts, self.edges[:-1], self.edges[1:], strict=True)
        ]

        def score(amplitude: float) -> float:
            total = 0.0
            for power, (_, unit) in zip(inside, self.parts, strict=True):
                variance = amplitude * unit
                total += float(np.sum(np.log1p(variance) - power * variance / (1.0 + variance)))
            return total

        best = min(map(float, _AMPLITUDES), key=score)
        return best if score(best) < 0.0 else 0.0


class Drift:
    """The covariance of several records' noise with a drift of variance ``amplitude``."""

    def __init__(self, space: DriftSpace, amplitude: float) -> None:
        self.amplitude = amplitude
        self.space = space
        variances = [amplitude * unit for _, unit in space.parts]
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
        edges = self.space.edges
        for (u, _), part, a, b in zip(self.space.parts, parts, edges[:-1], edges[1:], strict=True):
            rows[..., a:b] -= ((rows[..., a:b] @ u) * part) @ u.T


class WhitenedProblem(Problem):
    """Least squares as of ``Problem``, under white noise and a ``drift`` of each record.

    Without a drift (None) it is that of ``Problem``.
    """

    def __init__(
        self,
        records: Sequence[Record],
        layout: Layout,
        drift: Drift | None = None,
        **options: object,
    ) -> None:
        super().__init__(records, layout, **options)  # type: ignore[arg-type]
        self.noise_drift = drift
        self.readings = self.measured
        if drift is not None:
            self.measured = drift.whitened(self.measured)

    def predict(
        self, values: np.ndarray, coarse: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return whitened readings (P, N) and statuses (P,), as of ``Problem``.

        The noise of one record is the same for all its readings, so whitening readings in m is
        whitening them in units of the noise.
        """
        predicted, status = super().predict(values, coarse)
        if self.noise_drift is None:
            return predicted, status
        if self._correction is None:
            return self.noise_drift.whitened(predicted), status
        # the correction by full simulations is of whitened readings
        plain = predicted - self._correction
        return self.noise_drift.whitened(plain) + self._correction, status

    @property
    def edges(self) -> np.ndarray:
        """Where each record's readings begin, and where the last ends: (K + 1,)."""
        return self._edges
