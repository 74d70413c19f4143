"""Stress that a model lacks, sample by sample from the measurement, without deconvolution.

The stretch is measured. With it imposed on the branches, every term of the equation of motion is
known except one: p = network stress - F/(L2 Z) - eps (phi/Z)^2 lam + M lam''. The same is computed
for the stretch that the model predicts. The difference is the missing stress: smoothing affects
both alike, and effects in the model cancel. It only shows where to look: effects on the voltage or
the sensor appear as a stress, so every reported error comes from simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.coefficients import EFFECTS_AT, ELECTRIC, INERTIA, MODULUS, WIDTH
from dearig.model.effects import MEMORY, NEUTRAL, PARAMETER_COUNT, assembly
from dearig.model.film.network import HEAD
from dearig.model.fitting.search import SMOOTHING
from dearig.model.kinematics import thinning
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record, interpolated
from dearig.model.simulation.actuator import Actuator, at_rest
from dearig.model.simulation.strip import Strip, unit_stresses

__all__ = ["MissingStress", "missing_stress"]

_BAND = 10.0  # Hz


@dataclass(frozen=True)
class MissingStress:
    """Stress in Pa that the model lacks, sample by sample (N,), and what it may depend on.

    ``band`` is the upper frequency in Hz to which it was kept; ``scale`` the RMS of the Maxwell
    stress (or of the measured stress of a film) to compare it with. ``voltage`` is zero for films.
    """

    record: str
    time: np.ndarray
    stress: np.ndarray
    stretch: np.ndarray
    rate: np.ndarray
    voltage: np.ndarray
    band: float
    scale: float


def missing_stress(records: Sequence[Record], model: Actuator | Strip) -> tuple[MissingStress, ...]:
    """Return the stress that ``model`` lacks in each record that it can simulate."""
    found = []
    for record in records:
        if isinstance(record, ActuatorRecord) and isinstance(model, Actuator):
            one = _of_actuator(record, model)
        elif isinstance(record, FilmRecord) and isinstance(model, Strip):
            one = _of_film(record, model)
        else:
            one = None
        if one is not None:
            found.append(one)
    return tuple(found)


def _of_film(record: FilmRecord, model: Strip) -> MissingStress | None:
    answer = model.simulate(record.time, record.stretch)
    if not answer.ok:
        return None
    step = float(np.median(np.diff(record.time)))
    return MissingStress(
        record=record.name,
        time=record.time,
        stress=interpolated(record.time, record.stress - answer.stress, record.valid),
        stretch=record.stretch,
        rate=np.gradient(record.stretch, record.time),
        voltage=np.zeros_like(record.time),
        band=0.5 / step,
        scale=float(np.sqrt(np.mean(record.stress**2))),
    )


def _of_actuator(record: ActuatorRecord, model: Actuator) -> MissingStress | None:
    response = model.simulate(record.drive, record.lag)
    if not response.ok:
        return None
    # filters need even sampling, which the sample clock provides
    time = record.time
    step = float(np.median(np.diff(time)))
    c = model.coefficients()
    c[INERTIA] += assembly.inertia(assembly.active(c), c, np.zeros(MEMORY))
    c[EFFECTS_AT : EFFECTS_AT + PARAMETER_COUNT] = NEUTRAL
    _, rest = at_rest(c, record.drive)
    length = model.film.length
    width = SMOOTHING / step

    def lacking(displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        stretch = (
            rest + scipy.ndimage.gaussian_filter1d(displacement, width, mode="nearest") / length
        )
        rate = scipy.ndimage.gaussian_filter1d(displacement, width, order=1, mode="nearest") / (
            length * step
        )
        bend = (
            scipy.ndimage.gaussian_filter1d(displacement, width, order=2, mode="nearest")
            / length
            / step**2
        )
        stretch[0] = rest
        parts, _, _ = unit_stresses(c, time, stretch)
        network = c[HEAD + MODULUS :: WIDTH] @ parts
        return network + c[INERTIA] * bend, stretch, rate

    residual = interpolated(
        time, record.displacement - record.seen(response.displacement), record.valid
    )
    measured, stretch, rate = lacking(response.displacement + residual)
    predicted, there, _ = lacking(response.displacement)
    late = np.interp(time - record.lag, time, record.drive.voltage)
    maxwell = c[ELECTRIC] * scipy.ndimage.gaussian_filter1d(late**2, width, mode="nearest")
    thrust = thinning(model.film.held, stretch) - thinning(model.film.held, there)
    return MissingStress(
        record=record.name,
        time=time,
        stress=measured - predicted - maxwell * thrust,
        stretch=stretch,
        rate=rate,
        voltage=late,
        band=_BAND,
        scale=float(np.sqrt(np.mean((maxwell * stretch) ** 2))),
    )
