"""Records as the search uses them: thinned, and with the tolerance of a film's model as noise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dearig.model.fitting.intervals import correlation_time
from dearig.model.fitting.thinning import RATE, thinned
from dearig.model.readings.noise import (
    REST_MIN,
    about_rest,
    noise_at_rest,
    rounding,
    tails_of,
)
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record, counted, interpolated
from dearig.model.readings.spikes import spikes
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = [
    "FILM_MODEL_ERROR",
    "at_rest",
    "has_line_at_rest",
    "prepared",
    "with_model_error",
    "without_spikes",
    "without_tails",
]

#: Of the largest stress: the error to which a model of a rubber is taken to be true.
FILM_MODEL_ERROR = 5e-3

_FILM_SAMPLES = 1500
_LEVEL = 8  # neighbours on either side, whose mean is the level of a reading: 80 ms at 200 Hz
_FAR = 0.05  # share of the noise at rest that is called far off
_CROWD = 2  # of the next two on either side far off: by chance at one reading in seventy


def prepared(record: Record, model: Actuator | Strip) -> Record:
    """Return the record at a rate that is enough, with its noise read again from its lead-in.

    Masked readings are interpolated: the regression imposes the measured motion on the springs.
    """
    thin = _thinned(record, model)
    if isinstance(thin, FilmRecord):
        return thin
    return replace(thin, displacement=interpolated(thin.time, thin.displacement, thin.valid))


def _thinned(record: Record, model: Actuator | Strip) -> Record:
    if isinstance(record, FilmRecord) or isinstance(model, Strip):
        return record.coarse(_FILM_SAMPLES)
    thin = thinned(record, RATE, model)
    if thin is record:
        return record
    moving = np.flatnonzero(thin.drive.voltage)
    if not (moving.size and moving[0] > REST_MIN):
        return thin
    quiet = np.zeros(thin.displacement.size, dtype=bool)
    quiet[: moving[0] - 1] = True
    if thin.valid is not None:
        quiet &= thin.valid
    if np.count_nonzero(quiet) < REST_MIN:
        return thin
    # a sensor that averages makes noise that thinning does not average away
    noise = noise_at_rest(thin.time[quiet], thin.displacement[quiet])
    return replace(thin, noise=max(thin.noise, noise))


def has_line_at_rest(record: Record) -> bool:
    """Whether something periodic is in the readings before the voltage."""
    rest = at_rest(record)
    if not isinstance(record, ActuatorRecord) or rest.size < REST_MIN:
        return False
    _, numbers = about_rest(record.time[rest], record.displacement[rest])
    return numbers > 2  # of a straight line


def at_rest(record: Record) -> np.ndarray:
    """Return the places (n,) of the usable readings before the voltage."""
    lead_in = record.lead_in if isinstance(record, ActuatorRecord) else 0
    usable = np.arange(lead_in)
    return usable if record.valid is None else usable[record.valid[:lead_in]]


def with_model_error(record: Record) -> Record:
    """Return ``record`` with the error of a film's model in its noise; actuators as they are."""
    if isinstance(record, ActuatorRecord):
        return record
    stress = record.stress if record.valid is None else record.stress[record.valid]
    error = FILM_MODEL_ERROR * float(np.max(np.abs(stress)))
    return replace(record, noise=math.hypot(record.noise, error))


def without_spikes(record: Record, residual: np.ndarray) -> Record:
    """Return ``record`` without single readings that are far off a model, masked and interpolated.

    ``residual`` (N,) is measured less model in m. Where the film rings, no smooth curve through the
    readings shows a spike, but the model knows how it rings.
    """
    if not isinstance(record, ActuatorRecord) or at_rest(record).size < REST_MIN:
        return record
    left = interpolated(record.time, residual, record.valid)
    found = spikes(record.time, left, record.drive.voltage**2, record.lead_in)
    if not found.any():
        return record
    valid = ~found if record.valid is None else record.valid & ~found
    spiky = replace(record, valid=valid)
    change = np.where(found, interpolated(record.time, left, valid) - left, 0.0)
    return replace(spiky, displacement=record.displacement + change)


def without_tails(record: Record, residual: np.ndarray) -> Record:
    """Return ``record`` with pseudo-values in place of readings whose noise has heavy tails.

    A fit to them by least squares is, to first order, that of the greatest likelihood under the
    distribution of the noise at rest (``Tails.pseudo``). The noise of each reading is its
    ``residual`` (N,), measured less model in m, about the mean of its neighbours': what a model may
    still explain lasts longer than one reading. Readings stay as they are where several that follow
    each other are far off, and all of them where twice as many are so as at rest.
    """
    if not isinstance(record, ActuatorRecord):
        return record
    usable = np.ones(residual.size, dtype=bool) if record.valid is None else record.valid
    rest = at_rest(record)
    if rest.size < REST_MIN:
        return record
    still, _ = about_rest(record.time[rest], record.displacement[rest])
    step = rounding(record.displacement[rest])
    tails = tails_of(still, step, 1.0 / correlation_time(still))
    if tails.is_normal:
        return record
    about = np.ones(2 * _LEVEL + 1)
    about[_LEVEL] = 0.0
    count = np.convolve(usable, about, "same")
    level = np.convolve(usable * residual, about, "same") / np.maximum(count, 1.0)
    noise = residual - level
    far = (np.abs(noise) > tails.limit(_FAR)) & usable
    if np.mean(far) > 2.0 * _FAR:
        return record
    alone = np.convolve(far, [1, 1, 0, 1, 1], "same") < _CROWD
    change = np.where(alone & usable, tails.pseudo(noise) - noise, 0.0)
    changed = counted(record.displacement + change, record.lead_in)
    # the tails are known from few readings: what they leave of the noise is read again
    left = noise_at_rest(record.time[rest], changed[rest])
    return replace(record, displacement=changed, noise=min(record.noise, left))
