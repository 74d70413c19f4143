"""Recordings handed on: as CSV, MAT (MATLAB) or Parquet, with the columns that import takes."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType

import numpy as np

from dearig.errors import InputError
from dearig.recording.files import check_output, replaced_when_done
from dearig.recording.layout import FORMAT, LINEAR, UNITS, ZERO_ORDER
from dearig.recording.reader import open_recording
from dearig.recording.recording import Recording

__all__ = ["EXPORTS", "export_recording"]

#: Names of the exported columns, in the recording's own units so that not a bit is lost.
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
#: Rows that are put into words at a time.
BATCH = 20_000
#: Bytes of one variable that a MAT file of version 5 can hold.
MAT_LIMIT = 2**31 - 1


def export_recording(
    path: str | Path, to: str, out: str | Path | None = None, overwrite: bool = False
) -> Path:
    """Write the recording at ``path`` as ``to`` (csv, mat or parquet); returns where it went.

    ``out`` is the recording's own name with another ending, if not given. Columns are named with
    their units, and hold every number to the last bit. Raises ``InputError``.
    """
    path = Path(path)
    if to not in EXPORTS:
        raise InputError(f"a recording is exported to {', '.join(EXPORTS)}, not to {to!r}")
    out = check_output(path.with_suffix(f".{to}") if out is None else out, overwrite, path)
    recording = open_recording(path)
    with replaced_when_done(out) as partial:
        EXPORTS[to](recording, partial)
    return out


def _columns(recording: Recording) -> dict[str, np.ndarray]:
    return {COLUMNS[name]: values for name, values in recording.values.items()}


def _about(recording: Recording) -> dict[str, str]:
    return {
        "format": FORMAT,
        "name": recording.name,
        "kind": recording.kind,
        "kinematics": recording.kinematics,
        "hold": ZERO_ORDER if recording.hold else LINEAR,
        "complete": str(recording.complete).lower(),
        "film": json.dumps(asdict(recording.film)) if recording.film else "",
        "load": json.dumps(asdict(recording.load)) if recording.load else "",
        "sequence": recording.sequence_toml,
        "provenance": json.dumps(recording.provenance),
    }


def _to_csv(recording: Recording, path: Path) -> None:
    columns = _columns(recording)
    with path.open("w", encoding="utf-8", newline="") as stream:
        stream.write(",".join(columns) + "\n")
        for first in range(0, recording.samples, BATCH):
            rows = zip(*(c[first : first + BATCH].tolist() for c in columns.values()), strict=True)
            # repr is the shortest text that reads back as the same number
            stream.writelines(",".join(map(repr, row)) + "\n" for row in rows)


def _to_mat(recording: Recording, path: Path) -> None:
    from scipy.io import savemat

    columns = _columns(recording)
    if recording.time.nbytes > MAT_LIMIT:
        raise InputError(
            f"{recording.path} has {recording.samples} samples, more than a MAT file of version 5 "
            f"can hold; export it to parquet"
        )
    units = {COLUMNS[name]: UNITS[name] for name in recording.values}
    about = {name: text for name, text in _about(recording).items() if text}
    with path.open("wb") as stream:
        # compressed variables carry a checksum
        savemat(
            stream,
            columns | {"units": units, "about": about},
            oned_as="column",
            do_compression=True,
        )


def _to_parquet(recording: Recording, path: Path) -> None:
    import pyarrow
    from pyarrow import parquet

    fields = [
        pyarrow.field(COLUMNS[name], pyarrow.float64(), False, {"units": UNITS[name]})
        for name in recording.values
    ]
    schema = pyarrow.schema(fields, _about(recording))
    arrays = [pyarrow.array(values) for values in recording.values.values()]
    table = pyarrow.Table.from_arrays(arrays, schema=schema)
    parquet.write_table(table, path, write_page_checksum=True)


#: The formats, each with what writes it.
EXPORTS: MappingProxyType[str, Callable[[Recording, Path], None]] = MappingProxyType(
    {"csv": _to_csv, "mat": _to_mat, "parquet": _to_parquet}
)
