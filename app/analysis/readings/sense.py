"""Displacement from voltage and current alone, compared with the laser."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dearig.analysis.readings.record import Readings
from dearig.analysis.readings.scales import ScaleErrors, scale_errors
from dearig.config.modelfile import ModelFile, load_model
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.readings.channels import CURRENT
from dearig.model.readings.measures import root_mean_square
from dearig.model.readings.sensing import SHARES, Sensed, sense_displacement
from dearig.model.simulation.actuator import Actuator
from dearig.recording.files import check_output, replaced_when_done
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording

__all__ = ["Agreement", "SenseOutcome", "save_sensed", "sense_recording"]

# Hz, of conversions: monitors of amplifiers have 1 to 20 kHz; slower ones catch the peak of each
# step of the output and not its mean
_RATE = 1e5


@dataclass(frozen=True)
class Agreement:
    """What the laser says of a sensed displacement, over the rows that have an estimate.

    ``rms`` m is that of the difference and ``error`` m that of its standard error; ``coverage`` the
    share of rows within two standard errors. ``gain`` is that by which charge and laser agree best,
    ``gain_error`` its relative standard error from the scatter of the lobes (None with fewer than
    three), ``rms_with_gain`` m what is left then.
    """

    rms: float
    error: float
    coverage: float
    gain: float
    gain_error: float | None
    rms_with_gain: float


@dataclass(frozen=True)
class SenseOutcome:
    """Displacement of a recording from voltage and current; arrays (N,) in SI units.

    ``laser`` is the measured displacement at the times of the rows. ``agreement`` is None where no
    row has an estimate. ``gain`` is charge over that of the model, ``gain_error`` its relative
    standard uncertainty; ``scales`` are what that is from, None where a calibration gave it.
    ``advised`` is the number of conversions a row at which rows are means of the current.
    """

    name: str
    model_name: str
    time: np.ndarray
    voltage: np.ndarray
    laser: np.ndarray
    sensed: Sensed
    average: int
    gain: float
    gain_error: float
    scales: ScaleErrors | None
    agreement: Agreement | None
    advised: int
    is_instantaneous: bool


def sense_recording(
    recording: str | Path | Recording,
    model: str | Path | ModelFile,
    *,
    drive: str = "command",
    gain: float = 1.0,
    gain_error: float | None = None,
) -> SenseOutcome:
    """Return the displacement that voltage and current of ``recording`` show by ``model``.

    ``drive`` is the voltage, command or monitor. ``gain`` is charge over that of the model's film,
    as the laser of an earlier recording gave it. Without its ``gain_error`` that is what the rig
    file states of the scales. Raises ``InputError``.
    """
    if not (math.isfinite(gain) and gain > 0.0):
        raise InputError(f"the gain is {gain:g}; it must be a number above 0", option="gain")
    if gain_error is not None and not (math.isfinite(gain_error) and gain_error >= 0.0):
        raise InputError(
            f"the error of the gain is {gain_error:g}; it must be 0 or more", option="gain_error"
        )
    given = model if isinstance(model, ModelFile) else load_model(model)
    opened = recording if isinstance(recording, Recording) else open_recording(recording)
    actuator = given.model
    if opened.kind == "film" or not isinstance(actuator, Actuator):
        what = (
            f"the recording {opened.path}" if opened.kind == "film" else f"the model {given.name}"
        )
        raise InputError(f"{what} is of a bare film: sensing takes a film that a voltage moves")
    readings = Readings(opened, drive, given.assumes_held_voltage)
    electric = readings.electric
    current = next((c for c in electric.channels if c.name == CURRENT), None) if electric else None
    if electric is None or current is None or not current.used:
        reason = current.reason if current else "not recorded"
        raise InputError(
            f"{opened.path}: its current cannot be used ({reason}); wire the amplifier's current "
            f"monitor to the card and record again"
        )
    voltage, scales = readings.voltage, None
    if gain_error is None:
        scales = scale_errors(opened)
        gain_error = scales.of_charge(drive)
    try:
        sensed = sense_displacement(actuator, voltage, current, gain, gain_error)
    except ModelError as error:
        raise InputError(f"{opened.path}: {error}") from error
    instantaneous = opened.average == 1 and opened.hold
    if not (SHARES[0] < sensed.share < SHARES[1]) and not instantaneous:
        raise InputError(
            f"{opened.path}: the charge is {sensed.share:.3g} of what the film of {given.name} "
            f"takes; check that the model is of this film (length, width, thickness, permittivity) "
            f"and the scale of the current, and that the card converts faster than the current "
            f"monitor follows ([card] average = {_advised(opened)} or more)"
        )
    # a reading at time t is of the displacement a lag before
    laser = np.interp(voltage.time + readings.lag, voltage.time, electric.displacement)
    agreement = _agreement(sensed, laser, gain)
    return SenseOutcome(
        name=readings.name,
        model_name=given.name,
        time=voltage.time,
        voltage=voltage.voltage,
        laser=laser,
        sensed=sensed,
        average=opened.average,
        gain=gain,
        gain_error=gain_error,
        scales=scales,
        agreement=agreement,
        advised=_advised(opened),
        is_instantaneous=instantaneous,
    )


def _agreement(sensed: Sensed, laser: np.ndarray, gain: float) -> Agreement | None:
    known = np.isfinite(sensed.displacement)
    if not known.any():
        return None
    difference = sensed.displacement[known] - laser[known]
    error, gradient = sensed.standard_error[known], sensed.gradient[known]
    # d(ln C) that each row asks for, weighted by the noise, as the gain is common to all
    asked = difference / gradient
    weight = (gradient / sensed.noise_error[known]) ** 2
    change = float(np.average(asked, weights=weight))
    lobes = sensed.lobe[known]
    means = [np.average(asked[lobes == n], weights=weight[lobes == n]) for n in np.unique(lobes)]
    scatter = float(np.std(means, ddof=1) / math.sqrt(len(means))) if len(means) > 2 else None
    return Agreement(
        rms=root_mean_square(difference),
        error=root_mean_square(error),
        coverage=float(np.mean(np.abs(difference) <= 2.0 * error)),
        gain=gain * math.exp(change),
        gain_error=scatter,
        rms_with_gain=root_mean_square(difference - change * gradient),
    )


def _advised(opened: Recording) -> int:
    """Return the conversions a row whose rate is ``_RATE``."""
    return max(1, math.ceil(_RATE * opened.duration / (opened.samples - 1) - 1e-6))


def save_sensed(outcome: SenseOutcome, out: str | Path, overwrite: bool = False) -> Path:
    """Write the rows of ``outcome`` as a table (``.csv``) and return the path.

    A row without an estimate has ``nan`` there. Raises ``InputError`` for another ending, or where
    the file may not be written.
    """
    target = check_output(out, overwrite)
    if target.suffix != ".csv":
        raise InputError(f"{target} must end in .csv")
    sensed = outcome.sensed
    columns = {
        "time_s": outcome.time,
        "voltage_V": outcome.voltage,
        "displacement_mm": sensed.displacement * 1e3,
        "standard_error_mm": sensed.standard_error * 1e3,
        "noise_error_mm": sensed.noise_error * 1e3,
        "laser_mm": outcome.laser * 1e3,
    }
    table = np.column_stack([*columns.values()])
    with replaced_when_done(target, overwrite) as partial:
        np.savetxt(
            partial, table, fmt="%.12g", delimiter=",", header=",".join(columns), comments=""
        )
    return target
