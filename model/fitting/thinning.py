"""Records in means of neighbours, as few as tell a fit what all of their samples do."""

from __future__ import annotations

import numpy as np

from dearig.model import kernel
from dearig.model.actuator import Actuator, reading_of
from dearig.model.records import ActuatorRecord

__all__ = ["thinned"]

_TOLD = 0.02  # of a mean's noise, squared: what thinning may add to the misfit of the truth
_STEP = 1.5  # times the rate, where it is too low
_LEFT = 17.0 / 5760.0  # of the fourth difference of means: what the second leaves of a curve


def thinned(record: ActuatorRecord, rate: float, model: Actuator) -> ActuatorRecord:
    """``record`` at about ``rate`` Hz, or as much above as it takes to say the same.

    What ``model`` foresees of the means must be the mean of what it foresees of the readings, but
    for a part of the noise; and the readings themselves must not move so fast that means of them
    hide it. A model that cannot follow the record is not asked.
    """
    foreseen: np.ndarray | None = None
    while True:
        thin = record.coarse(rate)
        if thin is record:
            return record
        rate *= _STEP
        if not _is_smooth(thin):
            continue
        if foreseen is None:
            foreseen = _foreseen(record, model)
            if foreseen is None:
                return thin
        every = thin.means_of // record.means_of
        there = _foreseen(thin, model)
        if there is None:
            continue
        means = foreseen[: thin.time.size * every].reshape(-1, every).mean(axis=1)
        if _mean_square(there - means, thin) < _TOLD:
            return thin


def _is_smooth(thin: ActuatorRecord) -> bool:
    """Whether neighbours tell how the readings went between them."""
    return _mean_square(_LEFT * np.diff(thin.displacement, 4), thin, 2) < _TOLD


def _foreseen(record: ActuatorRecord, model: Actuator) -> np.ndarray | None:
    """What ``model`` says of the readings (N,), in m; None where it cannot follow."""
    found, status = reading_of(model.coefficients(), model.film.length, record.drive, record.lag)
    return record.seen(found) if status == kernel.OK else None


def _mean_square(differences: np.ndarray, thin: ActuatorRecord, inside: int = 0) -> float:
    """Of ``differences`` at all but the ``inside`` readings at each end, over the noise's."""
    if thin.valid is not None:
        good = thin.valid.copy()
        for _ in range(inside):
            # beside what must not be used nothing is known either
            good[1:-1] &= good[:-2] & good[2:]
        differences = differences[good[inside : good.size - inside]]
    return float(np.mean((differences / thin.noise) ** 2)) if differences.size else 0.0
