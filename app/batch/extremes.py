"""Extremes of each cycle of a recording: what is kept of it in a long lifetime test."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from dearig.analysis.loops import cycle_edges
from dearig.errors import InputError
from dearig.recording.files import write_whole
from dearig.recording.reading.reader import open_recording

__all__ = ["write_extremes"]

#: Channels in the table where the recording has them, with the factor and the unit of a column.
_COLUMNS = (
    ("voltage_monitor", 1e-3, "kV"),
    ("current_monitor", 1e3, "mA"),
    ("displacement", 1e3, "mm"),
    ("temperature", 1.0, "celsius"),
)


def write_extremes(recording: Path, out: Path, every: int = 0) -> int:
    """Write the extremes of each cycle of ``recording`` to the table ``out`` (CSV).

    A cycle goes from one valley of the commanded voltage to the next. What comes before the first
    valley belongs to the first cycle, and what comes after the last one to the last, so that no
    extreme is lost. With ``every`` the samples of cycles 1, 1 + every, 1 + 2 every, ... are written
    to a table next to it, whose name ends in -cycles.

    Returns the number of cycles. The files are on the disk when this returns. Raises
    ``InputError``.
    """
    opened = open_recording(recording)
    command = opened.voltage_command
    if command is None:
        raise InputError(f"{recording} has no commanded voltage, and so no cycles")
    present = [column for column in _COLUMNS if column[0] in opened.arrays.names]
    values = [opened.arrays.read(name) * factor for name, factor, _ in present]
    names = [(name, unit) for name, _, unit in present]
    edges = cycle_edges(command)
    starts = np.array(edges[:-1], dtype=np.int64)
    if every:
        head = ["cycle", "time_s", *(f"{name}_{unit}" for name, unit in names)]
        rows = _samples(opened.time, values, edges, every)
        _write(out.with_name(f"{out.stem}-cycles{out.suffix}"), head, rows)
    head = ["cycle", "start_s"]
    for name, unit in names:
        head += [f"{name}_min_{unit}", f"{name}_max_{unit}"]
    _write(out, head, _extremes(opened.time, values, starts))
    return int(starts.size)


def _write(path: Path, head: list[str], rows: Iterable[list[str]]) -> None:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(head)
    table.writerows(rows)
    write_whole(path, text.getvalue().encode())


def _extremes(
    time: np.ndarray, values: list[np.ndarray], starts: np.ndarray
) -> Iterator[list[str]]:
    if not starts.size:
        return
    parts = np.concatenate(([0], starts[1:]))
    found = [(np.fmin.reduceat(row, parts), np.fmax.reduceat(row, parts)) for row in values]
    for i, start in enumerate(starts):
        row = [str(i + 1), f"{time[start]:.6g}"]
        for low, high in found:
            row += [f"{low[i]:.6g}", f"{high[i]:.6g}"]
        yield row


def _samples(
    time: np.ndarray, values: list[np.ndarray], edges: list[int], every: int
) -> Iterator[list[str]]:
    for i, (first, last) in enumerate(pairwise(edges)):
        if i % every == 0:
            for at in range(first, last + 1):
                yield [str(i + 1), f"{time[at]:.9g}", *(f"{row[at]:.6g}" for row in values)]
