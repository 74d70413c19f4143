"""Comparison of a recording with the prediction of a model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.outcomes import Comparison
from dearig.analysis.readings.faults import spikes_about
from dearig.analysis.readings.record import Readings
from dearig.analysis.thesis_runs import place_of
from dearig.errors import InputError
from dearig.model.effects import EFFECTS
from dearig.model.errors import ModelError
from dearig.model.readings.measures import errors
from dearig.model.readings.noise import LEAD_IN
from dearig.model.readings.records import counted, mean_about
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.strip import Strip
from dearig.recording.content.layout import SIGNALS
from dearig.recording.content.physical import resolution
from dearig.recording.content.rest_noise import MIN_QUIET
from dearig.recording.reading.early_end import early_end
from dearig.recording.reading.origin import origin_of
from dearig.recording.reading.recording import Recording

if TYPE_CHECKING:
    # imports SciPy, which a comparison of films does without
    from dearig.model.fitting.channels import ChannelCurve, ChannelResult

__all__ = ["compare"]


#: Samples from which the step of imported values is read.
_STEP_SAMPLES = 100_000
#: Step as a share of the largest value, below which it is rounding; deviation from whole steps.
_ROUNDING, _OFF_STEP = 1e-9, 0.02


@dataclass(frozen=True)
class _Predicted:
    """Prediction (N,) of a model under ``driven`` (N,), and which readings are spikes about it."""

    model: np.ndarray
    driven: np.ndarray
    spiky: np.ndarray
    warnings: tuple[str, ...]


def compare(
    readings: Readings, model: Actuator | Strip, role: str, *, hashed: bool = True
) -> Comparison:
    """Compare the readings with the prediction of ``model``.

    Not ``hashed`` leaves the hash of the file, which takes a second for each GB, out of the origin.
    Readings that must not be used are NaN and do not count in the errors. Raises ``InputError``
    where model and recording are not of one kind, or where the model cannot follow the drive.
    """
    recording, look = readings.recording, readings.quality
    table, row, published = "", "", None
    if recording.kind == "film":
        signal = recording.signal
        predicted = _film(readings, model)
    else:
        signal = readings.displacement
        predicted = _actuator(readings, model)
        table, row, published = place_of(recording)
    usable = ~predicted.spiky if look.valid is None else look.valid & ~predicted.spiky
    noise, ended = readings.noise, early_end(recording)
    warnings = [*look.findings, *predicted.warnings, *([ended.sentence] if ended else [])]
    channels, curves = _channels(readings, model)
    return Comparison(
        name=recording.name,
        kind=recording.kind,
        role=role,
        time=recording.time,
        drive=predicted.driven,
        measured=np.where(usable, signal, np.nan),
        model=predicted.model,
        errors=errors(signal[usable], predicted.model[usable]),
        noise=noise.value if noise else None,
        noise_source=noise.source if noise else LEAD_IN,
        table=table,
        row=row,
        published=published,
        warnings=tuple(warnings),
        ended=ended,
        quiet_count=noise.count if noise and noise.source == LEAD_IN else 0,
        origin=origin_of(recording, hashed),
        step=_converter_step(recording),
        average=recording.average,
        channels=channels,
        curves=curves,
    )


def _channels(
    readings: Readings, model: Actuator | Strip
) -> tuple[tuple[ChannelResult, ...], tuple[ChannelCurve, ...]]:
    """Return what ``model`` leaves of the voltage monitor and the current of ``readings``."""
    if not isinstance(model, Actuator) or readings.electric is None:
        return (), ()
    from dearig.model.fitting.channels import Channels, results_of

    channels = Channels([readings.electric], model)
    return results_of(channels, replace(model, effects=()), model), channels.curves(model)


def _film(readings: Readings, model: Actuator | Strip) -> _Predicted:
    """Return the stress that ``model`` predicts under the stretch of ``readings``."""
    recording, stretch = readings.recording, readings.moved_by
    if isinstance(model, Actuator):
        raise InputError(
            f"{recording.path} is of a film (stretch), and the model is of an actuator "
            f"(voltage): validate it on recordings of the actuator, or identify a film model"
        )
    if stretch is None:
        raise InputError(f"{recording.path} has no stretch")
    warnings = []
    if recording.kinematics != model.kinematics:
        warnings.append(f"the film was held {recording.kinematics}, the model's {model.kinematics}")
    answer = replace(model, kinematics=recording.kinematics).simulate(recording.time, stretch)
    if not answer.ok:
        raise _cannot_follow(readings, answer.status_text)
    try:
        readings.known_noise()
    except ModelError as error:
        raise InputError(f"{recording.path}: {error}") from error
    none = np.zeros(stretch.size, dtype=bool)
    return _Predicted(answer.stress, stretch, none, tuple(warnings))


def _actuator(readings: Readings, model: Actuator | Strip) -> _Predicted:
    """Return the displacement that ``model`` predicts under the voltage of ``readings``."""
    recording = readings.recording
    if not isinstance(model, Actuator):
        raise InputError(
            f"{recording.path} is of an actuator (voltage), and the model is of a bare film "
            f"(stretch), which knows no load and no electrodes: validate it on recordings of "
            f"films, or identify an actuator model"
        )
    drive, valid = readings.voltage, readings.quality.valid
    response = model.simulate(drive, readings.lag)
    if not response.ok:
        raise _cannot_follow(readings, response.status_text)
    means = mean_about(response.displacement, recording.average)
    predicted = counted(means, readings.lead_in)
    usable = np.ones(predicted.size, dtype=bool) if valid is None else valid
    spiky, said = spikes_about(
        recording, readings.displacement - predicted, usable, drive.voltage**2
    )
    warnings = (*_other_rig(recording, model), *_unknown_air(model, drive), *said)
    return _Predicted(predicted, drive.voltage, spiky, warnings)


def _cannot_follow(readings: Readings, why: str) -> InputError:
    """Return the error of a model that fails under the drive, with what is odd about the readings.

    A model that was fitted to readings with a fault may fail for that fault.
    """
    odd = "".join(f"{text}; " for text in readings.quality.findings)
    return InputError(f"{readings.recording.path}: {odd}the model cannot follow it: {why}")


def _converter_step(recording: Recording) -> float:
    """Return the step of the converter in the measured unit, 0.0 where none is known.

    Imported values have no counts: theirs is the step of which all their differences are multiples.
    """
    for channel in recording.channels:
        if channel.name == SIGNALS[recording.kind]:
            return resolution(channel, recording.average)
    measured = recording.measured[:_STEP_SAMPLES]
    levels = np.unique(measured[np.isfinite(measured)])
    rises = np.diff(levels)
    if rises.size < MIN_QUIET:
        return 0.0
    step = float(rises.min())
    # a step of rounding errors, or one of which the others are not multiples, is none
    off = np.abs(rises / step - np.round(rises / step))
    is_even = step > _ROUNDING * float(np.abs(levels).max()) and float(off.max()) < _OFF_STEP
    return step if is_even else 0.0


def _unknown_air(model: Actuator, drive: Drive) -> list[str]:
    """Return sentences on effects of the room whose air the recording does not have."""
    sentences = []
    for name, _ in model.effects:
        needs = EFFECTS[name].needs
        if needs == "humidity" and drive.humidity is None:
            sentences.append(f"{name}: the humidity was not recorded, and is taken as 50 %")
        elif needs == "temperatures" and drive.temperature is None:
            sentences.append(f"{name}: the temperature was not recorded, and is taken as 23 °C")
    return sentences


def _other_rig(recording: Recording, model: Actuator) -> list[str]:
    """Return sentences on a film or load of the recording that differs from the model's."""
    sentences = []
    if recording.film is not None and recording.film != model.film:
        sentences.append("the recording was made with another film than the model's")
    if recording.load is not None and recording.load.mass != model.load.mass:
        sentences.append(
            f"the recording was made under {recording.load.mass * 1e3:g} g, the model is of "
            f"{model.load.mass * 1e3:g} g"
        )
    return sentences
