"""The offset of each recording, eliminated: its zero is known as well as it is read.

Displacement is counted from the mean of a lead-in, which has the error of a mean: 2000 readings of
1 um give 24 nm. That error is the same in all readings of a recording. So each recording has an
offset, which follows from linear least squares for any values of the parameters (variable
projection, as in ``dearig.model.fitting.drift``). The readings of the lead-in are among those that
are fitted, at a displacement of 0: they are the offset's prior, with the variance of their mean.
Without a lead-in the zero counts as known to one reading.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dearig.model.readings.records import ActuatorRecord, Record

__all__ = ["Offsets", "centred"]


class Offsets:
    """Offsets of the readings of ``records``; those of films have none."""

    def __init__(self, records: Sequence[Record]) -> None:
        self._weights: list[tuple[slice, np.ndarray]] = []
        start = 0
        for record in records:
            part = slice(start, start + record.measured.size)
            start = part.stop
            if isinstance(record, ActuatorRecord):
                self._weights.append((part, _weights(record)))

    def align(self, rows: np.ndarray, readings: np.ndarray | None = None) -> None:
        """Move ``rows`` (..., N) in m by the offset nearest to ``readings`` (N,), 0 for None."""
        for part, weights in self._weights:
            own = rows[..., part]
            missing = -own if readings is None else readings[part] - own
            missing *= weights
            # not a matrix product, whose rounding depends on how many rows there are
            own += missing.sum(axis=-1, keepdims=True)

    def nearest(self, missing: np.ndarray) -> np.ndarray:
        """Return the offset (..., N) of each reading for residuals ``missing`` (..., N) in m."""
        found = np.zeros_like(missing)
        for part, weights in self._weights:
            found[..., part] = np.sum(missing[..., part] * weights, axis=-1, keepdims=True)
        return found


def centred(record: ActuatorRecord, columns: np.ndarray) -> np.ndarray:
    """Return ``columns`` (N, n) less what the offset of ``record`` absorbs of each."""
    return np.asarray(columns - _weights(record) @ columns)


def _weights(record: ActuatorRecord) -> np.ndarray:
    """Return the weights (N,) by which residuals give the offset.

    With n readings and m at zero before them, the marginal likelihood of the residuals r is that of
    r'(I - 11'/(n + m)) r. Its root subtracts the share 1 - sqrt(m/(n + m)) of the mean.
    """
    valid = np.ones(record.measured.size) if record.valid is None else record.valid.astype(float)
    count = max(float(valid.sum()), 1.0)
    before = 0.0 if record.lead_in else record.average / record.means_of
    share = 1.0 - (before / (count + before)) ** 0.5
    return np.asarray(share * valid / count)
