"""Thin a record to means of neighbouring samples without loss for a fit."""

from __future__ import annotations

import numpy as np

from dearig.model import kernel
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, reading_of

__all__ = ["RATE", "thinned"]

#: Hz, to which a search may thin records: mains and a load's ringing still show.
RATE = 200.0

_MISFIT_MAX = 0.02  # of a mean's variance: what thinning may add to the misfit of a true model
_MISFIT_CORRECTED = 1.0  # the same, where the difference is corrected afterwards
_RATE_FACTOR = 1.5  # by which a rate that is too low is raised
# of the fourth difference of means: error of a curve corrected by the second difference
_CURVATURE_ERROR = 17.0 / 5760.0


def thinned(
    record: ActuatorRecord, rate: float, model: Actuator, corrected: bool = False
) -> ActuatorRecord:
    """Return ``record`` in means at about ``rate`` Hz, or as much above as accuracy asks for.

    The simulation of the means by ``model`` must equal the means of its simulation of the readings
    within a part of the noise, and the readings must not curve more between means than that. The
    first test is left out where the simulation fails. With ``corrected`` the difference may be as
    large as the noise: the caller takes it off (``dearig.model.fitting.estimates.recentre``).
    """
    allowed = _MISFIT_CORRECTED if corrected else _MISFIT_MAX
    simulated: np.ndarray | None = None
    while True:
        thin = record.coarse(rate)
        if thin is record:
            return record
        rate *= _RATE_FACTOR
        if not _is_smooth(thin):
            continue
        if simulated is None:
            simulated = _simulated(record, model)
            if simulated is None:
                return thin
        every = thin.means_of // record.means_of
        of_means = _simulated(thin, model)
        if of_means is None:
            continue
        means = simulated[: thin.time.size * every].reshape(-1, every).mean(axis=1)
        if _mean_square(of_means - means, thin) < allowed:
            return thin


def _is_smooth(thin: ActuatorRecord) -> bool:
    """Whether interpolation between means reproduces the readings."""
    return _mean_square(_CURVATURE_ERROR * np.diff(thin.displacement, 4), thin, 2) < _MISFIT_MAX


def _simulated(record: ActuatorRecord, model: Actuator) -> np.ndarray | None:
    """Return the readings (N,) in m by ``model``; None where the simulation fails."""
    found, status = reading_of(model.coefficients(), model.film.length, record.drive, record.lag)
    return record.seen(found) if status == kernel.OK else None


def _mean_square(differences: np.ndarray, thin: ActuatorRecord, inside: int = 0) -> float:
    """Mean square of ``differences`` over the noise, without ``inside`` readings at each end."""
    if thin.valid is not None:
        good = thin.valid.copy()
        for _ in range(inside):
            # next to a masked reading the difference is unknown too
            good[1:-1] &= good[:-2] & good[2:]
        differences = differences[good[inside : good.size - inside]]
    return float(np.mean((differences / thin.noise) ** 2)) if differences.size else 0.0
