"""Import of measured data from other programs as a recording."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from dearig.drivers.rig import Event
from dearig.errors import InputError
from dearig.model.specimen import KINEMATICS
from dearig.recording.files import check_output, file_sha256
from dearig.recording.importers.chosen import Chosen
from dearig.recording.importers.exported import exported
from dearig.recording.importers.plausible import doubts
from dearig.recording.importers.registry import source_at
from dearig.recording.metadata import RunMetadata
from dearig.recording.rest_noise import lead_in, mean_beyond_noise
from dearig.recording.save import save_recording

__all__ = ["import_file"]


def import_file(
    source: str | Path,
    out: str | Path,
    columns: Mapping[str, str] | None = None,
    *,
    gauge_length_mm: float | None = None,
    area_mm2: float | None = None,
    kinematics: str | None = None,
    metadata: RunMetadata | None = None,
    overwrite: bool = False,
    now: Callable[[], float] = time.time,
) -> list[str]:
    """Import the CSV, MAT, Parquet or TDMS file ``source`` as the recording ``out``.

    ``columns`` maps names such as ``voltage_kV`` to what the file calls them: a CSV column, a MAT
    path (``data.xdata[0]``), a TDMS ``group/channel``; columns that already have such a name
    may be left out. Film data with a displacement take ``gauge_length_mm``, those with a force
    ``area_mm2``; they are uniaxial unless ``kinematics`` says otherwise. Time is kept as it is,
    even or not.
    Displacement of an actuator is counted from the mean of its lead-in at 0 V, if it has one. A
    recording that was exported to MAT or Parquet keeps the metadata of that file: film, load,
    kinematics, sequence, and how its voltage was held. ``metadata`` has precedence; its title is
    the file's name by default.

    Returns warnings about values that are possible but look wrong. Raises ``InputError``, with
    nothing written, for data that cannot be a recording.
    """
    path = Path(source)
    out = check_output(out, overwrite, path)
    _check_film_settings(gauge_length_mm, area_mm2, kinematics)
    opened = source_at(path)
    was = exported(opened.about)
    chosen = Chosen(opened, columns or {})
    warnings: list[str] = []
    kind = chosen.kind(warnings)
    kinematics = kinematics or was.kinematics
    metadata = metadata or RunMetadata()
    film = metadata.film or was.film
    if kind == "actuator":
        values = chosen.actuator()
        if gauge_length_mm is not None or area_mm2 is not None:
            warnings.append("gauge length and area are for film data, and were not used")
        rest, events = _from_rest(values)
        if film is not None and kinematics is not None:
            film = replace(film, kinematics=kinematics)
    else:
        values = chosen.film(gauge_length_mm, area_mm2, warnings)
        rest, events = 0.0, ()
        kinematics = kinematics or "uniaxial"
    warnings += chosen.left_out()
    warnings += doubts(values, film)
    save_recording(
        out,
        kind,
        values,
        replace(
            metadata,
            title=metadata.title or path.stem,
            film=film,
            load=metadata.load or was.load,
            sequence_toml=metadata.sequence_toml or was.sequence,
            provenance={
                **_provenance(path, chosen, gauge_length_mm, area_mm2),
                **metadata.provenance,
            },
        ),
        hold=was.hold and kind == "actuator",
        kinematics=kinematics,
        rest_reading=rest,
        events=(*events, *(Event(0, "warning", sentence) for sentence in warnings)),
        overwrite=overwrite,
        now=now,
    )
    return warnings


def _check_film_settings(
    gauge_length_mm: float | None, area_mm2: float | None, kinematics: str | None
) -> None:
    """Raise ``InputError`` for settings that no film can have."""
    if kinematics is not None and kinematics not in KINEMATICS:
        raise InputError(f"kinematics {kinematics!r} is not one of {', '.join(KINEMATICS)}")
    for name, given in (("gauge length", gauge_length_mm), ("area", area_mm2)):
        if given is not None and not 0.0 < given < float("inf"):
            raise InputError(f"the {name} is {given!r}; it must be a finite number above 0")


def _provenance(
    path: Path, chosen: Chosen, gauge_length_mm: float | None, area_mm2: float | None
) -> dict[str, object]:
    """Return the file, the columns and the settings that the values come from."""
    found: dict[str, object] = {
        "source": path.name,
        "source_sha256": file_sha256(path),
        "columns": ", ".join(f"{n}={where}" for n, where, _ in chosen.picked.values()),
    }
    if gauge_length_mm is not None:
        found["gauge_length_mm"] = float(gauge_length_mm)
    if area_mm2 is not None:
        found["area_mm2"] = float(area_mm2)
    return found


def _from_rest(values: dict[str, np.ndarray]) -> tuple[float, tuple[Event, ...]]:
    """Count the displacement from its mean over the lead-in, changing ``values``."""
    quiet = lead_in(values["voltage_command"])
    rest = mean_beyond_noise(values["displacement"][:quiet])
    if rest == 0.0:
        return 0.0, ()
    values["displacement"] = values["displacement"] - rest
    message = (
        f"displacement is counted from its mean over the {quiet} samples at 0 V at the start, "
        f"which was {rest * 1e6:.6g} um"
    )
    return rest, (Event(0, "info", message),)
