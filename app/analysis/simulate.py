"""Prediction of a model under a recorded or planned drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dearig.analysis.readings.band import PredictionBand, band_of
from dearig.analysis.readings.record import Readings
from dearig.config.modelfile import ModelFile, load_model, model_toml
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence, load_sequence
from dearig.drivers.channels import BAND_ENDINGS
from dearig.errors import InputError
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.stability import pull_in_voltage
from dearig.model.simulation.strip import Strip
from dearig.recording.content.layout import SIGNALS
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.files import check_output, replaced_when_done
from dearig.recording.reading.origin import MODEL
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording
from dearig.recording.writing.save import save_recording

__all__ = ["SimulatedRecord", "save_prediction", "simulate_model"]


@dataclass(frozen=True)
class SimulatedRecord:
    """What ``model`` predicts under a drive.

    ``values`` are arrays (N,) in SI units by the names that a recording has, ``time`` first;
    ``kind`` is actuator or film, ``hold`` and ``kinematics`` as of a recording, ``sequence_toml``
    that of the drive. ``field_max`` is the largest true field phi/z in V/m. ``pull_in`` is the
    voltage in V beyond which the film has no stable stretch; None where it stiffens first. Both are
    None for a film. ``band`` is that of the response; None where it was not asked for, or where the
    model's file has no covariance.
    """

    title: str
    kind: str
    model: ModelFile
    values: Mapping[str, np.ndarray]
    hold: bool = False
    kinematics: str = "uniaxial"
    sequence_toml: str = ""
    field_max: float | None = None
    pull_in: float | None = None
    band: PredictionBand | None = None

    @property
    def response(self) -> np.ndarray:
        """The displacement (N,) in m, or the nominal stress in Pa."""
        return self.values[SIGNALS[self.kind]]

    @property
    def open_limits(self) -> tuple[str, ...]:
        """Locking limits that the fit of the model did not determine, by their names.

        All of them where no intervals were computed.
        """
        estimates = self.model.history.get("estimate")
        tables = estimates if isinstance(estimates, list) else []
        if self.is_without_intervals:
            springs = enumerate(self.model.model.network.springs)
            return tuple(f"J_{i}" for i, s in springs if s.kind == "gent")
        return tuple(
            str(e["name"])
            for e in tables
            if isinstance(e, dict) and e.get("determined") is False
            and str(e.get("name", "")).startswith("J_")
        )  # fmt: skip

    @property
    def is_without_intervals(self) -> bool:
        """Whether the model was fitted, and no interval of its parameters was computed."""
        return self.model.history.get("estimate") == [] and "method" in self.model.history

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """The values and, where there is one, the band: its ends and its parts, (N,) each."""
        found = dict(self.values)
        if self.band is not None:
            half, name = self.band.half_width, SIGNALS[self.kind]
            ones = np.ones_like(half)
            parts = (
                self.response - half, self.response + half,
                self.band.parameters, self.band.noise * ones, self.band.law * ones,
            )  # fmt: skip
            found |= {f"{name}_{end}": p for end, p in zip(BAND_ENDINGS, parts, strict=True)}
        return found


def simulate_model(
    model: str | Path | ModelFile,
    drive: str | Path | Recording | LoadedSequence,
    *,
    rig_file: RigFile | None = None,
    voltage: str = "command",
    band: bool = False,
) -> SimulatedRecord:
    """Drive ``model`` with a recording or a sequence; a path is opened, and so is a preset's name.

    A recorded voltage is followed as the recording says (held by the converter, or linear between
    samples); a planned one as the sequence itself, sampled at the rate of ``rig_file``. ``voltage``
    is command or monitor. With ``band`` the result has the 95 % band of the response, if the model
    file has a covariance: two simulations for each parameter. Nothing is written;
    ``save_prediction`` does. Raises ``InputError``.
    """
    given = model if isinstance(model, ModelFile) else load_model(model)
    if not isinstance(drive, Recording | LoadedSequence):
        recorded = Path(drive).suffix in (".h5", ".hdf5", ".nxs")
        drive = open_recording(drive) if recorded else load_sequence(drive)
    if isinstance(drive, LoadedSequence):
        rate = float((rig_file or RigFile()).card.sample_rate_Hz)
        planned = Drive(*drive.sample(rate))
        values, field_max, pull_in = _actuator(given.model, planned)
        return SimulatedRecord(
            title=f"{given.name} under {drive.sequence.name}",
            kind="actuator",
            model=given,
            values=values,
            sequence_toml=drive.toml,
            field_max=field_max,
            pull_in=pull_in,
            band=band_of(given, planned, values["displacement"]) if band else None,
        )
    title = f"{given.name} under {drive.title or drive.name}"
    if drive.kind == "film":
        values = _film(given.model, drive.kinematics, drive.time, drive.stretch)
        stretched = values["time"], values["stretch"]
        return SimulatedRecord(
            title=title,
            kind="film",
            model=given,
            values=values,
            band=band_of(given, stretched, values["nominal_stress"], kinematics=drive.kinematics)
            if band
            else None,
            kinematics=drive.kinematics,
            sequence_toml=drive.sequence_toml,
        )
    driven = Readings(drive, voltage, given.assumes_held_voltage).voltage
    values, field_max, pull_in = _actuator(given.model, driven)
    return SimulatedRecord(
        title=title,
        kind="actuator",
        model=given,
        values=values,
        hold=driven.hold,
        sequence_toml=drive.sequence_toml,
        field_max=field_max,
        pull_in=pull_in,
        band=band_of(given, driven, values["displacement"]) if band else None,
    )


def save_prediction(prediction: SimulatedRecord, out: str | Path, overwrite: bool = False) -> Path:
    """Write ``prediction`` as a recording (``.h5``) or a table (``.csv``) and return the path.

    Raises ``InputError`` for another ending, or where the file may not be written.
    """
    target = check_output(out, overwrite)
    if target.suffix not in (".h5", ".csv"):
        raise InputError(f"{out}: the output is a recording (.h5) or a table (.csv)")
    if target.suffix == ".csv":
        with replaced_when_done(target, overwrite) as partial:
            _write_csv(partial, prediction.columns)
        return target
    given = prediction.model
    film = load = None
    if isinstance(given.model, Actuator) and prediction.kind == "actuator":
        film, load = given.model.film, given.model.load
    return save_recording(
        target,
        prediction.kind,
        prediction.columns,
        RunMetadata(
            title=prediction.title,
            film=film,
            load=load,
            sequence_toml=prediction.sequence_toml,
            model_toml=model_toml(given.name, given.model, {}),
            notes="a prediction of a model, not a measurement",
            provenance={"simulated": True, MODEL: given.name},
        ),
        hold=prediction.hold,
        kinematics=prediction.kinematics,
        overwrite=overwrite,
    )


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
        raise InputError(f"the model cannot follow this voltage: {response.status_text}")
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
        raise InputError(f"the model cannot follow this stretch: {answer.status_text}")
    return {"time": time, "stretch": stretch, "nominal_stress": answer.stress}


def _write_csv(path: Path, values: Mapping[str, np.ndarray]) -> None:
    columns = {
        "time": ("time_s", 1.0),
        "voltage_command": ("voltage_V", 1.0),
        "displacement": ("displacement_mm", 1e3),
        "stretch": ("stretch", 1.0),
        "nominal_stress": ("nominal_stress_kPa", 1e-3),
    }
    for name in SIGNALS.values():
        whole, factor = columns[name]
        unit = whole.removeprefix(name)
        columns |= {f"{name}_{end}": (f"{name}_{end}{unit}", factor) for end in BAND_ENDINGS}
    table = np.column_stack([values[name] * columns[name][1] for name in values])
    header = ",".join(columns[name][0] for name in values)
    np.savetxt(path, table, fmt="%.12g", delimiter=",", header=header, comments="")
