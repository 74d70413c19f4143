"""What a model predicts under a recorded or planned drive, as a recording or as CSV."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dearig.analysis.records import recording_drive
from dearig.config.modelfile import load_model, model_toml
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.errors import InputError
from dearig.model.actuator import Actuator, Drive
from dearig.model.film import Strip
from dearig.model.stability import pull_in_voltage
from dearig.recording.files import check_output, replaced_when_done
from dearig.recording.metadata import RunMetadata
from dearig.recording.reader import open_recording
from dearig.recording.save import save_recording

__all__ = ["Prediction", "simulate_model"]


@dataclass(frozen=True)
class Prediction:
    """What was written where, and for an actuator how near it came to breaking down.

    ``field_max`` is the largest true field phi/z in V/m. ``pull_in`` is the voltage in V beyond
    which the film has no stable stretch; None where it stiffens first. Both are None for a film.
    """

    path: Path
    field_max: float | None = None
    pull_in: float | None = None


def simulate_model(
    model_path: str | Path,
    drive: str | Path,
    out: str | Path,
    *,
    rig_file: RigFile,
    voltage: str = "command",
    overwrite: bool = False,
) -> Prediction:
    """Drive the model with a recording (``.h5``) or a sequence, and write ``.h5`` or ``.csv``.

    A recorded voltage is followed as the recording says (held by the converter, or linear between
    samples); a planned one as the sequence itself, sampled at the rig file's rate. ``voltage`` is
    command or monitor. Raises ``InputError``.
    """
    loaded = load_model(model_path)
    target = check_output(out, overwrite, model_path, drive)
    if target.suffix not in (".h5", ".csv"):
        raise InputError(f"{out}: the output is a recording (.h5) or a table (.csv)")
    sequence_toml, hold, kinematics = "", False, "uniaxial"
    field_max, pull_in = None, None
    if Path(drive).suffix in (".h5", ".hdf5", ".nxs"):
        recording = open_recording(drive)
        title = f"{loaded.name} under {recording.title or recording.name}"
        sequence_toml = recording.sequence_toml
        if recording.kind == "film":
            values = _film(loaded.model, recording.kinematics, recording.time, recording.stretch)
            kinematics = recording.kinematics
        else:
            given = recording_drive(recording, voltage)
            values, field_max, pull_in = _actuator(loaded.model, given)
            hold = given.hold
    else:
        plan = load_sequence(drive)
        title = f"{loaded.name} under {plan.sequence.name}"
        sequence_toml = plan.toml
        time, volts = plan.sample(float(rig_file.card.sample_rate_Hz))
        values, field_max, pull_in = _actuator(loaded.model, Drive(time, volts))
    if target.suffix == ".csv":
        with replaced_when_done(target) as partial:
            _write_csv(partial, values)
        return Prediction(target, field_max, pull_in)
    actuator = loaded.model if isinstance(loaded.model, Actuator) else None
    save_recording(
        target,
        "film" if "stretch" in values else "actuator",
        values,
        RunMetadata(
            title=title,
            film=actuator.film if actuator and "stretch" not in values else None,
            load=actuator.load if actuator and "stretch" not in values else None,
            sequence_toml=sequence_toml,
            model_toml=model_toml(loaded.name, loaded.model, {}),
            notes="a prediction of a model, not a measurement",
        ),
        hold=hold,
        kinematics=kinematics,
        overwrite=overwrite,
    )
    return Prediction(target, field_max, pull_in)


def _actuator(
    model: Actuator | Strip, drive: Drive
) -> tuple[dict[str, np.ndarray], float, float | None]:
    """Arrays of the prediction, its largest true field in V/m, and the pull-in voltage in V."""
    if not isinstance(model, Actuator):
        raise InputError(
            "the model is of a bare film, which a voltage does not move: drive it with a recording "
            "of a film"
        )
    response = model.simulate(drive)
    if not response.ok:
        raise InputError(f"the model cannot follow this voltage: {response.in_words}")
    values = {
        "time": drive.time,
        "voltage_command": drive.voltage,
        "displacement": response.displacement,
    }
    return values, float(np.max(np.abs(response.field))), pull_in_voltage(model)


def _film(
    model: Actuator | Strip, kinematics: str, time: np.ndarray, stretch: np.ndarray | None
) -> dict[str, np.ndarray]:
    if stretch is None:
        raise InputError("the recording holds no stretch")
    strip = Strip(model.network) if isinstance(model, Actuator) else model
    answer = replace(strip, kinematics=kinematics).simulate(time, stretch)
    if not answer.ok:
        raise InputError(f"the model cannot follow this stretch: {answer.in_words}")
    return {"time": time, "stretch": stretch, "nominal_stress": answer.stress}


def _write_csv(path: Path, values: dict[str, np.ndarray]) -> None:
    columns = {
        "time": ("time_s", 1.0),
        "voltage_command": ("voltage_V", 1.0),
        "displacement": ("displacement_mm", 1e3),
        "stretch": ("stretch", 1.0),
        "nominal_stress": ("nominal_stress_kPa", 1e-3),
    }
    table = np.column_stack([values[name] * columns[name][1] for name in values])
    header = ",".join(columns[name][0] for name in values)
    np.savetxt(path, table, fmt="%.12g", delimiter=",", header=header, comments="")
