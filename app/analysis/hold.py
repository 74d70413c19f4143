"""A displacement that is held for long: the feedforward of a model, and feedback during the run.

The feedforward is a sequence of straight lines: the voltage with which the model rises to the
displacement and stays there. The feedback of ``dearig.acquisition.feedback`` corrects it while it
is played, by the film's creep and by what else the model does not know.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import tomli_w

from dearig.acquisition.feedback import Feedback, FeedbackLoop, FeedbackReport
from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.plan import plan
from dearig.acquisition.run import RunObserver, RunOptions, RunResult, record
from dearig.analysis.track_target import WITHIN, lag_of, limits_of
from dearig.analysis.tracking import misfits_of
from dearig.config.modelfile import ModelFile, model_toml
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, parse_sequence
from dearig.errors import InputError
from dearig.model.control import TrackingTask, VoltageLimits, invert, sensitivity_of
from dearig.model.errors import ModelError
from dearig.model.readings.measures import root_mean_square
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording

__all__ = [
    "HoldOptions",
    "HoldOutcome",
    "HoldPlan",
    "actuator_of",
    "check_hold",
    "hold",
    "loop_of",
    "measured",
    "numbers_of",
    "plan_hold",
    "settling_time",
]

_RATE = 100.0  # Hz of the inversion: four times what is faster in a path than is followed
_INVERTED = 300.0  # s of the hold that the model's voltage follows; it is constant after that
_LEAD_IN, _TAIL = 2.0, 1.0  # s at 0 V
_RISE_STEP = 0.05  # s, of the lines of the rise
_HOLD_STEP = 0.1  # s, of the first line of the hold; the later ones are longer and longer
_HOLD_LINES = 60  # by which the voltage of the hold is drawn, each longer than the one before
_OFF = 0.01  # of the displacement: a feedforward that is nearer is near enough for the feedback
_SHORTEST = 10.0  # s; a shorter hold is over before the loop has settled
_LONGEST = 1e6  # s
_SETTLED = 5.0  # response times, delay included: 0.7 % of an error is left after so many

#: Lowest and highest value of each option, with the factor and the unit in which it is shown.
_RANGES = {
    "rise": (0.5, 600.0, 1.0, "s"),
    "authority": (0.001, 0.5, 100.0, "%"),
    "rate_limit": (1e-6, 1.0, 100.0, "%/s"),
    "response": (0.2, 3600.0, 1.0, "s"),
    "ahead": (0.2, 2.0, 1.0, "s"),
    "laser_loss": (0.2, 600.0, 1.0, "s"),
}


@dataclass(frozen=True)
class HoldOptions:
    """Options of a hold, in SI units: time of rise and fall, and those of ``Feedback``.

    With a delay of 0.6 s, which ``ahead`` and the blocks of 0.1 s give, the ``response`` of 1 s has
    a gain margin of 4 and a phase margin of 69 deg. The ``rate_limit`` of 1 % per s moves the film
    by 2 % of its displacement per s, which is slow next to its resonance.
    """

    rise: float = 2.0
    authority: float = 0.1
    rate_limit: float = 0.01
    response: float = 1.0
    ahead: float = 0.5
    laser_loss: float = 2.0


@dataclass(frozen=True)
class HoldPlan:
    """A hold before its run: the feedforward, its feedback, and the voltage in V at its end."""

    sequence: LoadedSequence
    feedback: Feedback
    voltage: float


@dataclass(frozen=True)
class HoldOutcome:
    """A displacement that was held, in SI units.

    ``rms`` and ``largest`` are those of setpoint minus reading over the hold, ``settled_rms`` from
    ``settled`` s after its begin on. ``noise`` is the standard deviation of a reading at rest.
    ``minutes`` (n, 3) has for each minute of the hold its end in s, its mean error, and its mean
    correction. ``feedback`` is None for a feedforward that was played without one.
    """

    setpoint: float
    duration: float
    model: ModelFile
    address: str
    recording: Path
    noise: float
    rms: float
    largest: float
    settled: float
    settled_rms: float
    minutes: np.ndarray
    feedback: FeedbackReport | None
    run: RunResult
    warnings: tuple[str, ...] = field(default=())


def plan_hold(
    displacement: float,
    duration: float,
    model: Actuator,
    rig_file: RigFile,
    options: HoldOptions = HoldOptions(),
) -> HoldPlan:
    """Plan a hold of ``displacement`` in m for ``duration`` in s with ``model``.

    Raises ``InputError`` for a displacement that the film cannot reach within the limits, with the
    authority of the feedback on top, and for values that make no hold.
    """
    _check(displacement, duration, options)
    rate = min(_RATE, float(rig_file.card.sample_rate_Hz))
    limits = limits_of(rig_file)
    most = 1.0 + options.authority
    room = VoltageLimits(limits.voltage / most, limits.slew, limits.field / most)
    lead_in, tail = round(_LEAD_IN * rate), round(_TAIL * rate)
    rise, stays = round(options.rise * rate), round(min(duration, _INVERTED) * rate)
    rising = 0.5 - 0.5 * np.cos(np.pi * np.arange(rise) / rise)
    shape = np.concatenate((np.zeros(lead_in), rising, np.ones(stays), np.zeros(tail)))
    try:
        task = TrackingTask(
            displacement * shape, rate, room, lead_in=lead_in, tail=tail, lag=lag_of(rig_file)
        )
        found = invert(model, task, tolerance=max(WITHIN, _OFF * displacement))
        # the last second is left out: the path ends there, at 0 V
        end = lead_in + rise + stays - round(rate)
        for part in found.unreachable:
            # what is missed in the rise alone does not matter, and the feedback removes the rest
            if part.start < end / rate <= part.stop:
                raise InputError(
                    f"{displacement * 1e3:.4g} mm cannot be held, with room for corrections of "
                    f"{options.authority:.3g} of the voltage: {part.sentence}"
                )
        voltage = found.voltage[lead_in:end]
        volts = float(voltage[-1])
        sensitivity = sensitivity_of(model, volts)
    except ModelError as error:
        raise InputError(f"{displacement * 1e3:.4g} mm cannot be held: {error}") from error
    sequence = _sequence(displacement, duration, options.rise, voltage, rate)
    start = _LEAD_IN + options.rise
    feedback = Feedback(
        setpoint=displacement,
        sensitivity=sensitivity,
        lead_in=_LEAD_IN,
        start=start,
        stop=start + duration,
        authority=options.authority,
        rate_limit=options.rate_limit,
        response=options.response,
        ahead=options.ahead,
        laser_loss=options.laser_loss,
    )
    return HoldPlan(sequence, feedback, volts)


def hold(
    displacement: float,
    duration: float,
    model: ModelFile,
    address: str,
    rig_file: RigFile,
    out: Path,
    run_options: RunOptions,
    options: HoldOptions = HoldOptions(),
    *,
    feedback: bool = True,
    observer: RunObserver | None = None,
    progress: Progress = quiet,
) -> HoldOutcome:
    """Hold ``displacement`` in m for ``duration`` in s on the rig at ``address``.

    The run is recorded to ``out``, with the prediction of ``model``. Without ``feedback`` only the
    feedforward is played. Raises as ``plan_hold`` and ``record``.
    """
    actuator = actuator_of(model)
    planned = plan_hold(displacement, duration, actuator, rig_file, options)
    overlay = OverlayModel(
        model.name, actuator, toml=model_toml(model.name, actuator, model.history)
    )
    result = record(
        planned.sequence, address, rig_file, out, run_options, overlay=overlay, observer=observer,
        progress=progress, feedback=planned.feedback if feedback else None,
    )  # fmt: skip
    return measured(planned, model, address, rig_file, result)


def check_hold(
    planned: HoldPlan, rig_file: RigFile, run_options: RunOptions, progress: Progress = quiet
) -> dict[str, float]:
    """Return the numbers of a hold that passes the gate, before any run.

    Raises ``InputError`` for one that does not, with the whole authority of its feedback.
    """
    return numbers_of(planned, loop_of(planned, rig_file, run_options.film_id, progress))


def loop_of(
    planned: HoldPlan, rig_file: RigFile, film: str = "", progress: Progress = quiet
) -> FeedbackLoop:
    """Return the feedback of a hold that passes the gate; ``film`` as of a run.

    Raises ``InputError`` for one that does not, with the whole authority of its feedback.
    """
    sequence = plan(planned.sequence, rig_file, None, film, progress)
    return FeedbackLoop(planned.feedback, sequence, rig_file, None, film, progress)


def numbers_of(planned: HoldPlan, loop: FeedbackLoop) -> dict[str, float]:
    """Return the numbers of a hold before any run."""
    return {
        "setpoint_mm": planned.feedback.setpoint * 1e3,
        "voltage_kV": planned.voltage * 1e-3,
        "highest_kV": loop.gate.waveform.margins[0].reached,
        "sensitivity_mm": loop.settings.sensitivity * 1e3,
        "delay_s": loop.settings.delay,
        "gain_margin": loop.settings.gain_margin,
        "phase_margin_deg": loop.settings.phase_margin,
    }


def actuator_of(model: ModelFile) -> Actuator:
    """Return the actuator of ``model``; raises ``InputError`` for a bare film."""
    if not isinstance(model.model, Actuator):
        raise InputError(
            f"the model {model.name!r} is of a bare film, which a voltage does not move: give one "
            f"of an actuator"
        )
    return model.model


def measured(
    planned: HoldPlan, model: ModelFile, address: str, rig_file: RigFile, result: RunResult
) -> HoldOutcome:
    """Return the errors of a hold that was recorded as ``result`` says."""
    recording = open_recording(result.path)
    feedback, rate = planned.feedback, result.rate_Hz
    first, last = round(feedback.start * rate), round(feedback.stop * rate)
    error = feedback.setpoint - recording.signal[first:last]
    seen = np.isfinite(error)
    settled = settling_time(feedback)
    later = seen.copy()
    later[: round(settled * rate)] = False
    return HoldOutcome(
        setpoint=feedback.setpoint,
        duration=feedback.stop - feedback.start,
        model=model,
        address=address,
        recording=result.path,
        noise=recording.noise_floor or math.nan,
        rms=root_mean_square(error[seen]),
        largest=float(np.abs(error[seen]).max(initial=0.0)),
        settled=settled,
        settled_rms=root_mean_square(error[later]),
        minutes=_minutes(recording, planned, error, first, rate),
        feedback=result.feedback,
        run=result,
        warnings=tuple(misfits_of(actuator_of(model), rig_file)),
    )


def settling_time(feedback: Feedback) -> float:
    """Return the time in s from the begin of the hold, after which the loop has settled."""
    return _SETTLED * (feedback.response + feedback.ahead + feedback.block)


def _check(displacement: float, duration: float, options: HoldOptions) -> None:
    """Raise ``InputError`` for values that make no hold."""
    if not (math.isfinite(displacement) and displacement > 0.0):
        raise InputError(
            f"a displacement of {displacement * 1e3:g} mm cannot be held: a voltage makes the film "
            f"longer, so it must be above 0"
        )
    if not _SHORTEST <= duration <= _LONGEST:
        raise InputError(
            f"a hold of {duration:g} s: it must last from {_SHORTEST:g} s to {_LONGEST:g} s"
        )
    for name, (low, high, factor, unit) in _RANGES.items():
        value = getattr(options, name)
        if not low <= value <= high:
            raise InputError(
                f"hold: {name.replace('_', ' ')} = {value * factor:g} {unit} must be from "
                f"{low * factor:g} to {high * factor:g} {unit}"
            )


def _sequence(
    displacement: float, duration: float, rise: float, voltage: np.ndarray, rate: float
) -> LoadedSequence:
    """Return the feedforward ``voltage`` (N,) V at ``rate`` Hz, from the begin of the rise on.

    After its end the last value is held until ``duration`` in s is over.
    """
    inverted = voltage.size / rate - rise
    later = np.geomspace(_HOLD_STEP, max(inverted - 1.0 / rate, 2.0 * _HOLD_STEP), _HOLD_LINES)
    times = np.concatenate((np.arange(0.0, rise, _RISE_STEP), [rise], rise + later))
    places = np.unique(np.minimum(np.rint(times * rate).astype(int), voltage.size - 1))
    segments = []
    before = 0
    for _, place in pairwise(places):
        if place - before < 2 and place != places[-1]:
            continue  # a line has two samples or more
        segments.append(
            {
                "kind": "ramp",
                "to_kV": float(voltage[place]) * 1e-3,
                "duration_s": float(place - before) / rate,
            }
        )
        before = int(place)
    left = rise + duration - before / rate
    segments.append({"kind": "hold", "duration_s": left})
    segments.append({"kind": "ramp", "to_kV": 0.0, "duration_s": rise})
    name = f"hold of {displacement * 1e3:.6g} mm"
    text = tomli_w.dumps(
        {"name": name, "lead_in_s": _LEAD_IN, "tail_s": _TAIL, "segment": segments}
    )
    return parse_sequence(text, name, Path())


def _minutes(
    recording: Recording, planned: HoldPlan, error: np.ndarray, first: int, rate: float
) -> np.ndarray:
    """Return for each minute of the hold its end in s, its mean error and its mean correction."""
    command = recording.voltage_command
    size = max(1, round(60.0 * rate))
    feedforward = planned.sequence.on_clock(rate)
    rows = []
    for begin in range(0, error.size, size):
        part = error[begin : begin + size]
        seen = part[np.isfinite(part)]
        at = first + begin
        asked = feedforward.window(at, at + part.size)
        played = asked if command is None else command[at : at + part.size]
        corrected = float(np.mean(played[: asked.size]) / np.mean(asked)) - 1.0
        mean = float(seen.mean()) if seen.size else math.nan
        rows.append(((begin + part.size) / rate, mean, corrected))
    return np.array(rows)
