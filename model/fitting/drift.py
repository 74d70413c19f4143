"""Sensor drift of each recording on its own, eliminated by linear least squares.

Recordings of one rig share the parameters of the film, but each has its own slow drift of the
reading. Drift is linear in its amplitudes, so for any values of the other parameters the best
amplitudes of each record follow from linear least squares (variable projection; Golub and Pereyra,
SIAM J. Numer. Anal. 10, 413 (1973)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dearig.model.effects import EFFECTS, EffectValues
from dearig.model.fitting.offsets import centred
from dearig.model.readings.records import ActuatorRecord, Record

__all__ = ["DriftFit", "RecordDrift", "record_drift"]

# relative cut-off of singular values: a short record does not determine every amplitude
_SINGULAR = 1e-12


@dataclass(frozen=True)
class DriftFit:
    """Amplitudes (K, n) in m of the drift of each of K records, and of one drift (n,) for all.

    ``residuals_in_common`` (N,), in units of the noise, remain after the drift in common.
    """

    amplitudes: np.ndarray
    in_common: np.ndarray
    residuals_in_common: np.ndarray


class RecordDrift:
    """Drift that the drift effects ``effects`` allow each of K ``records``.

    ``names`` (n,) are the names of the amplitudes, as in a layout. ``basis`` (N, K n), in m, is the
    derivative of all readings with respect to each amplitude: the first n columns belong to the
    first record, and so on.
    """

    def __init__(self, records: Sequence[ActuatorRecord], effects: Sequence[str]) -> None:
        self.names = tuple(
            f"{name}: {p.name}" for name in effects for p in EFFECTS[name].parameters
        )
        self._edges = np.cumsum([0, *(r.measured.size for r in records)])
        self._bases = [_basis_of(r, effects) for r in records]
        self._solved: list[tuple[np.ndarray, np.ndarray]] = []
        for record, basis in zip(records, self._bases, strict=True):
            # a masked reading carries no information about the drift
            used = basis if record.valid is None else np.where(record.valid[:, None], basis, 0.0)
            scale = np.maximum(np.linalg.norm(used, axis=0), 1e-300)
            q, r = np.linalg.qr(used / scale)
            self._solved.append((q, (np.linalg.pinv(r, rcond=_SINGULAR) / scale[:, None]).T))

    @property
    def more(self) -> int:
        """Number of fitted amplitudes beyond one set for all records."""
        return (len(self._bases) - 1) * len(self.names)

    @property
    def basis(self) -> np.ndarray:
        """Derivative of all readings with respect to all amplitudes, (N, K n) in m."""
        n = len(self.names)
        found = np.zeros((self._edges[-1], len(self._bases) * n))
        for i, basis in enumerate(self._bases):
            found[self._edges[i] : self._edges[i + 1], i * n : (i + 1) * n] = basis
        return found

    def amplitudes(self, missing: np.ndarray) -> np.ndarray:
        """Return least-squares amplitudes (..., K, n) for residuals ``missing`` (..., N) in m."""
        found = []
        for i, (q, inverse) in enumerate(self._solved):
            part = missing[..., self._edges[i] : self._edges[i + 1]]
            found.append((part @ q) @ inverse)
        return np.stack(found, axis=-2)

    def readings(self, amplitudes: np.ndarray) -> np.ndarray:
        """Return what drift of ``amplitudes`` (..., K, n) adds to the readings, (..., N) in m."""
        parts = [amplitudes[..., i, :] @ basis.T for i, basis in enumerate(self._bases)]
        return np.concatenate(parts, axis=-1)

    def nearest(self, missing: np.ndarray) -> np.ndarray:
        """Return the drift (..., N) in m that is nearest to ``missing`` (..., N) in m."""
        return self.readings(self.amplitudes(missing))

    def fit(self, missing: np.ndarray, sigma: np.ndarray) -> DriftFit:
        """Fit the drift to the residuals ``missing`` (N,) in m.

        ``sigma`` (N,) in m is the noise of each reading, infinite for a masked reading.
        """
        rows = np.concatenate(self._bases) / sigma[:, None]
        scale = np.linalg.norm(rows, axis=0)
        common, *_ = np.linalg.lstsq(rows / scale, missing / sigma, rcond=None)
        left = (rows / scale) @ common - missing / sigma
        return DriftFit(self.amplitudes(missing), common / scale, left)


def record_drift(records: Sequence[Record], effects: EffectValues) -> RecordDrift | None:
    """Return the drift of several ``records`` under ``effects``; None for a single record.

    With a single record the amplitudes of drift are ordinary parameters of the model.
    """
    drifting = [name for name, _ in effects if EFFECTS[name].drift_basis is not None]
    rigs = [r for r in records if isinstance(r, ActuatorRecord)]
    return RecordDrift(rigs, drifting) if drifting and len(rigs) > 1 else None


def _basis_of(record: ActuatorRecord, effects: Sequence[str]) -> np.ndarray:
    """Derivative of the readings of ``record`` with respect to each amplitude: (N, n) in m.

    Less what the offset of the record absorbs.
    """
    basis = [EFFECTS[name].drift_basis for name in effects]
    columns = np.concatenate([way(record.time) for way in basis if way is not None], axis=1)
    return centred(record, record.seen(columns.T).T)
