"""Extremes of each cycle of a recording: what is kept of it in a long lifetime test."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dearig.errors import InputError
from dearig.recording.files import write_whole
from dearig.recording.reader import open_recording
from dearig.recording.recording import Recording

__all__ = ["cycles_of", "write_extremes"]

#: Channels in the table where the recording has them, with the factor and the unit of a column.
_COLUMNS = (
    ("voltage_monitor", 1e-3, "kV"),
    ("current_monitor", 1e3, "mA"),
    ("displacement", 1e3, "mm"),
    ("temperature", 1.0, "celsius"),
)
_LEVEL = 0.5  # of the largest commanded voltage: a cycle begins where the command rises through it


def cycles_of(command: np.ndarray) -> np.ndarray:
    """Return the first sample of each cycle of the commanded voltage (N,) in V.

    A cycle begins where the magnitude of the command rises through half of its largest value. The
    command has no noise, so that one rise is one crossing.
    """
    size = np.abs(command)
    above = size >= _LEVEL * size.max() if size.size and size.max() > 0.0 else size > 0.0
    return np.flatnonzero(above[1:] & ~above[:-1]) + 1


def write_extremes(recording: Path, out: Path) -> int:
    """Write the extremes of each cycle of ``recording`` to the table ``out`` (CSV).

    Returns the number of cycles. The file is on the disk when this returns. Raises ``InputError``.
    """
    opened = open_recording(recording)
    command = opened.voltage_command
    if command is None:
        raise InputError(f"{recording} has no commanded voltage, and so no cycles")
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    present = [column for column in _COLUMNS if column[0] in opened.arrays.names]
    head = ["cycle", "start_s"]
    for name, _, unit in present:
        head += [f"{name}_min_{unit}", f"{name}_max_{unit}"]
    table.writerow(head)
    rows = list(_rows(opened, command, present))
    table.writerows(rows)
    write_whole(out, text.getvalue().encode())
    return len(rows)


def _rows(
    recording: Recording, command: np.ndarray, present: list[tuple[str, float, str]]
) -> Iterator[list[str]]:
    starts = cycles_of(command)
    if not starts.size:
        return
    time = recording.time
    found = []
    for name, factor, _ in present:
        values = recording.arrays.read(name) * factor
        found.append((np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)))
    for i, start in enumerate(starts):
        row = [str(i + 1), f"{time[start]:.6g}"]
        for low, high in found:
            row += [f"{low[i]:.6g}", f"{high[i]:.6g}"]
        yield row
