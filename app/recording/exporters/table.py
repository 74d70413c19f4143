"""Content of every export: columns by name with unit, and metadata of the recording."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from dearig.recording.content.layout import FORMAT, LINEAR, ZERO_ORDER
from dearig.recording.reading.recording import Recording

__all__ = ["Exporter", "columns_of", "description_of", "units_of"]

#: Names of the exported columns; units are those of the recording, so that no bit is lost.
COLUMNS = MappingProxyType(
    {
        "time": "time_s",
        "displacement": "displacement_m",
        "voltage_command": "voltage_V",
        "voltage_monitor": "voltage_monitor_V",
        "current_monitor": "current_A",
        "temperature": "temperature_C",
        "displacement_model": "displacement_model_m",
        "stretch": "stretch",
        "nominal_stress": "nominal_stress_Pa",
    }
)

#: Values that an import finds by the quantities in the names of its columns.
IMPORTED = tuple(name for name in COLUMNS if name != "displacement_model")


@dataclass(frozen=True)
class Exporter:
    """A file format that recordings are written in; its name in the registry is the suffix.

    Attributes
    ----------
    title : str
        Name of the format for menus and messages.
    write : callable
        Writes a recording to a path, which does not exist yet. May raise ``InputError``.
    describes : bool
        True if the file has the description of the recording too. Otherwise it is written to a
        file next to it.
    """

    title: str
    write: Callable[[Recording, Path], None]
    describes: bool = True


def columns_of(recording: Recording) -> dict[str, np.ndarray]:
    """Return the values (N,) by the names of the exported columns, ``time_s`` first."""
    return {_columns(recording)[name]: values for name, values in recording.values.items()}


def units_of(recording: Recording) -> dict[str, str]:
    """Return the unit of each exported column by its name."""
    return {column: recording.unit(name) for name, column in _columns(recording).items()}


def _columns(recording: Recording) -> dict[str, str]:
    """Return the name of the exported column of each value; for a declared channel, with its unit.

    A channel may be called as a built-in column is, such as current in A: it is numbered.
    """
    found: dict[str, str] = {}
    for name in recording.arrays.names:
        unit = re.sub(r"[^A-Za-z0-9]+", "_", recording.unit(name))
        plain = column = COLUMNS.get(name) or f"{name}_{unit}"
        number = 1
        while column in found.values():
            number += 1
            column = f"{plain}_{number}"
        found[name] = column
    return found


def description_of(recording: Recording) -> dict[str, str]:
    """Return the metadata that an import reads back, as texts by name.

    ``channels`` has the columns that no quantity of an import is in: name, unit and label of a
    declared channel, and the name alone of what a model computed. ``missing`` has the number of
    missing readings of each column that has such.
    """
    columns = _columns(recording)
    gaps = {column: recording.gaps(name) for name, column in columns.items()}
    return {
        "format": FORMAT,
        "name": recording.name,
        "kind": recording.kind,
        "kinematics": recording.kinematics,
        "average": str(recording.average),
        "hold": ZERO_ORDER if recording.hold else LINEAR,
        "complete": str(recording.complete).lower(),
        "film": json.dumps(asdict(recording.film)) if recording.film else "",
        "load": json.dumps(asdict(recording.load)) if recording.load else "",
        "sequence": recording.sequence_toml,
        "provenance": json.dumps(recording.provenance),
        "rest_reading": repr(float(recording.rest_reading)),
        "displacement_timing": json.dumps(
            [
                recording.displacement_skew,
                recording.displacement_delay,
                recording.displacement_delay_error,
            ]
        ),
        "channels": json.dumps(
            {
                columns[name]: [name, *recording.declared_channels.get(name, ())]
                for name in columns
                if name not in IMPORTED
            }
        ),
        "missing": json.dumps({column: count for column, count in gaps.items() if count}),
        "events": json.dumps([[e.sample, e.level, e.message] for e in recording.events]),
    }
