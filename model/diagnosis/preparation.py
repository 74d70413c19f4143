"""Records as the search uses them: thinned, and with the tolerance of a film's model as noise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dearig.model.actuator import Actuator
from dearig.model.film import Strip
from dearig.model.fitting.thinning import thinned
from dearig.model.noise import noise_at_rest
from dearig.model.records import ActuatorRecord, FilmRecord, Record

__all__ = ["FILM_MODEL_ERROR", "bridged", "prepared", "with_model_error"]

#: Of the largest stress: the error to which a model of a rubber is taken to be true.
FILM_MODEL_ERROR = 5e-3

_RATE = 200.0  # Hz, to which records may be thinned: mains and a load's ringing still show
_QUIET_MIN = 100  # samples of a lead-in from which a thinned record's noise is read again
_FILM_SAMPLES = 1500


def prepared(record: Record, model: Actuator | Strip) -> Record:
    """Return the record at a rate that is enough, with its noise read again from its lead-in.

    Masked readings are bridged: the regression imposes the measured motion on the springs.
    """
    thin = _thinned(record, model)
    if isinstance(thin, FilmRecord):
        return thin
    return replace(thin, displacement=bridged(thin, thin.displacement))


def bridged(record: Record, values: np.ndarray) -> np.ndarray:
    """Return ``values`` (N,) at the samples of ``record``, interpolated across masked readings."""
    if record.valid is None or not record.valid.any():
        return values
    return np.interp(record.time, record.time[record.valid], values[record.valid])


def _thinned(record: Record, model: Actuator | Strip) -> Record:
    if isinstance(record, FilmRecord) or isinstance(model, Strip):
        return record.coarse(_FILM_SAMPLES)
    thin = thinned(record, _RATE, model)
    if thin is record:
        return record
    moving = np.flatnonzero(thin.drive.voltage)
    if not (moving.size and moving[0] > _QUIET_MIN):
        return thin
    quiet = np.zeros(thin.displacement.size, dtype=bool)
    quiet[: moving[0] - 1] = True
    if thin.valid is not None:
        quiet &= thin.valid
    if np.count_nonzero(quiet) < _QUIET_MIN:
        return thin
    # a sensor that averages makes noise that thinning does not average away
    noise = noise_at_rest(thin.time[quiet], thin.displacement[quiet])
    return replace(thin, noise=max(thin.noise, noise))


def with_model_error(record: Record) -> Record:
    """Return ``record`` with the error of a film's model in its noise; actuators as they are."""
    if isinstance(record, ActuatorRecord):
        return record
    stress = record.stress if record.valid is None else record.stress[record.valid]
    error = FILM_MODEL_ERROR * float(np.max(np.abs(stress)))
    return replace(record, noise=math.hypot(record.noise, error))
