"""Work of the page Follow on a hold, which its worker's process does."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dearig.acquisition.run import RunResult
from dearig.analysis.hold import (
    HoldOptions,
    HoldOutcome,
    HoldPlan,
    actuator_of,
    loop_of,
    measured,
    numbers_of,
    plan_hold,
    settling_time,
)
from dearig.analysis.tracking import misfits_of
from dearig.api.holding import HoldResult
from dearig.config.modelfile import ModelFile, load_model
from dearig.config.rigfile import RigFile
from dearig.drivers.gate import Margin
from dearig.errors import InputError
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator
from dearig.output_state import Known, OutputState
from dearig.progress import Progress, quiet
from dearig.recording.reading.reader import open_recording

__all__ = [
    "HoldForecast",
    "HoldRequest",
    "forecast_hold",
    "measure_hold",
    "write_hold_report",
]


@dataclass(frozen=True)
class HoldRequest:
    """What is to be held: ``displacement`` in m for ``duration`` in s with ``options``.

    ``model`` is a model file, None for the thesis model. The rig is at ``address``; ``film`` is the
    name of the film on it.
    """

    displacement: float
    duration: float
    options: HoldOptions
    model: Path | None
    address: str
    rig_file: RigFile
    film: str


@dataclass(frozen=True, eq=False)
class HoldForecast:
    """A hold that passes the gate, with the whole authority of its feedback.

    ``numbers`` are those of ``dearig hold --check``. ``time`` in s and ``voltage`` in V, (n,) each,
    are the corners of the feedforward. ``warnings`` say where the model is not that of the rig.
    """

    request: HoldRequest
    plan: HoldPlan
    model: ModelFile
    numbers: dict[str, float]
    margins: tuple[Margin, ...]
    warnings: tuple[str, ...]
    time: np.ndarray
    voltage: np.ndarray


def forecast_hold(request: HoldRequest, progress: Progress = quiet) -> HoldForecast:
    """Plan a hold, and check it with the gate. Raises ``InputError`` where it cannot be held."""
    progress("computing the voltage", 0.0)
    rig_file = request.rig_file
    if request.model is None:
        actuator = Actuator(rig_file.as_film(), rig_file.as_load(), TABLE_3)
        model = ModelFile("thesis (Table 3)", actuator)
    else:
        model = load_model(request.model)
        actuator = actuator_of(model)
    planned = plan_hold(request.displacement, request.duration, actuator, rig_file, request.options)
    progress("checking with the gate", 0.0)
    loop = loop_of(planned, rig_file, request.film, progress)
    time, voltage = _corners(planned)
    return HoldForecast(
        request, planned, model, numbers_of(planned, loop), loop.gate.waveform.margins,
        tuple(misfits_of(actuator, rig_file)), time, voltage,
    )  # fmt: skip


def measure_hold(
    forecast: HoldForecast,
    recording: Path,
    result: RunResult | None,
    until: float,
    progress: Progress = quiet,
) -> HoldOutcome:
    """Return the errors of a hold; ``result`` is None for a run that ended early.

    Of such a run the error is counted ``until`` this time in s, that of the last answer. Raises
    ``InputError`` where the loop had not settled by then.
    """
    progress("reading the recording", 0.0)
    planned, request = forecast.plan, forecast.request
    if result is None:
        feedback = planned.feedback
        planned = replace(planned, feedback=replace(feedback, stop=min(feedback.stop, until)))
        if planned.feedback.stop - feedback.start <= settling_time(feedback):
            raise InputError("the run ended before the loop had settled; no error is counted")
        found = open_recording(recording)
        rate = (found.samples - 1) / found.duration
        result = RunResult(
            recording, found.samples, rate, "ended early", (), (), OutputState(Known.UNKNOWN, 0.0)
        )
    return measured(planned, forecast.model, request.address, request.rig_file, result)


def write_hold_report(outcome: HoldOutcome, progress: Progress = quiet) -> Path:
    """Write the report of a hold next to its recording, and return its path."""
    progress("writing the report", 0.0)
    return HoldResult(outcome).to_html(outcome.recording.with_suffix(".html"))


def _corners(planned: HoldPlan) -> tuple[np.ndarray, np.ndarray]:
    """Return times in s and voltages in V, (n,) each, between which the feedforward is straight."""
    data = tomllib.loads(planned.sequence.toml)
    times, volts = [0.0, float(data["lead_in_s"])], [0.0, 0.0]
    for segment in data["segment"]:
        times.append(times[-1] + float(segment["duration_s"]))
        volts.append(float(segment["to_kV"]) * 1e3 if "to_kV" in segment else volts[-1])
    times.append(times[-1] + float(data["tail_s"]))
    volts.append(volts[-1])
    return np.array(times), np.array(volts)
