"""Displacement against voltage: the cycles of a drive, and the areas of their loops."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from dearig.analysis.decimate import decimate_path
from dearig.errors import InputError
from dearig.progress import Progress, quiet
from dearig.recording.reading.reader import open_recording

__all__ = ["Cycle", "Loops", "cycle_edges", "cycles", "loop_area", "loops", "loops_of", "valleys"]

#: Depth of a valley of the drive that divides two cycles, as a part of the range of the drive:
#: ripple and noise of a voltage are below it, lobes of a sequence above it.
_VALLEY = 0.1
_PARTS = 10_000  # of a curve that can be zoomed into


@dataclass(frozen=True)
class Cycle:
    """One cycle of the drive, ``start`` to ``end`` s, up to ``peak`` V.

    ``area`` is that of its loop of displacement against voltage in V m, ``area_squared`` that
    against the square of the voltage in V² m. They are positive where displacement lags: it is
    larger on the way down.
    """

    start: float
    end: float
    peak: float
    area: float
    area_squared: float


@dataclass(frozen=True)
class Loops:
    """Displacement (m,) in m against voltage (m,) in V in the order of time, and the cycles."""

    name: str
    voltage: np.ndarray
    displacement: np.ndarray
    cycles: tuple[Cycle, ...]

    def mean_area(self, squared: bool = False) -> float:
        """Return the mean hysteresis area of a cycle in V m, or in V² m; NaN without cycles."""
        areas = [c.area_squared if squared else c.area for c in self.cycles]
        return float(np.mean(areas)) if areas else float("nan")


def loop_area(x: np.ndarray, y: np.ndarray) -> float:
    """Return the area of the closed polygon (``x``, ``y``) (n,) in the product of their units.

    It is positive anticlockwise (Gauss's formula). The last point is joined to the first.
    """
    if x.size < 3:  # a line has no area
        return 0.0
    # from the first point: products of large offsets would cost digits
    x, y = x - x[0], y - y[0]
    return 0.5 * float(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1]))


def cycles(drive: np.ndarray) -> list[tuple[int, int]]:
    """Return first and last row of each cycle of ``drive`` (n,): from one valley to the next.

    A rest between two cycles is divided in its middle. A part that does not come back, such as the
    end of a run that was stopped, is not a cycle, and a drive that does not vary has none.
    """
    known = _known(drive)
    span = float(np.ptp(known)) if known.size else 0.0
    return [
        (first, last)
        for first, last in pairwise(valleys(drive))
        if abs(known[last] - known[first]) < _VALLEY * span
    ]


def cycle_edges(drive: np.ndarray) -> list[int]:
    """Return the rows at which the cycles of ``drive`` (n,) begin, and the last one's end.

    They are its ``valleys``, so that every part of the drive belongs to a cycle; a drive that only
    rises is one cycle. Empty for a drive that does not vary.
    """
    edges = valleys(drive)
    return [*edges, drive.size - 1] if len(edges) == 1 else edges


def valleys(drive: np.ndarray) -> list[int]:
    """Return the row of each valley of ``drive`` (n,), in the middle of one that is flat.

    On both sides the drive rises by a tenth of its range before it falls below the valley. A rest
    at an end is a valley too. The time is proportional to n, also for 10^5 equal cycles.
    """
    known = _known(drive)
    depth = _VALLEY * float(np.ptp(known)) if known.size else 0.0
    if depth == 0.0:
        return []
    # rows at which the drive turns, or begins or ends to be flat
    step = np.sign(np.diff(known))
    turns = np.flatnonzero(np.concatenate(([True], step[1:] != step[:-1], [True])))
    found: list[int] = []
    low = high = float(known[turns[0]])
    first = last = int(turns[0])
    falling = True  # there is a wall before the first row
    for row, value in zip(turns.tolist(), known[turns].tolist(), strict=True):
        if falling:
            if value < low:
                low, first, last = value, row, row
            elif value == low and row > last and np.all(known[last : row + 1] == low):
                last = row
            elif value - low >= depth:
                found.append((first + last) // 2)
                falling, high = False, value
        elif value > high:
            high = value
        elif high - value >= depth:
            falling, low, first, last = True, value, row, row
    return [*found, (first + last) // 2] if falling else found


def _known(drive: np.ndarray) -> np.ndarray:
    """Return ``drive`` with its lowest value where it is not known."""
    lowest = float(np.nanmin(drive)) if np.isfinite(drive).any() else 0.0
    known: np.ndarray = np.nan_to_num(drive, nan=lowest)
    return known


def loops_of(
    time: np.ndarray, voltage: np.ndarray, displacement: np.ndarray, name: str = ""
) -> Loops:
    """Return the loops of ``displacement`` (n,) in m against ``voltage`` (n,) in V.

    ``time`` (n,) is in s. Samples without displacement or voltage are left out.
    """
    good = np.isfinite(voltage) & np.isfinite(displacement)
    time, voltage, displacement = time[good], voltage[good], displacement[good]
    found = []
    for first, last in cycles(voltage):
        part = slice(first, last + 1)
        volts, moved = voltage[part], displacement[part]
        found.append(
            Cycle(
                float(time[first]), float(time[last]), float(volts.max()),
                loop_area(volts, moved), loop_area(volts**2, moved),
            )
        )  # fmt: skip
    return Loops(name, *decimate_path(voltage, displacement, _PARTS), tuple(found))


def loops(path: Path, progress: Progress = quiet) -> Loops:
    """Return the loops of the recording at ``path``, against its commanded voltage.

    The monitored voltage is not used: its noise would add area. Raises ``InputError`` where the
    recording cannot be read, or is of a film driven by stretch.
    """
    recording = open_recording(path)
    voltage, displacement = recording.voltage_command, recording.displacement
    if voltage is None or displacement is None:
        raise InputError(f"{recording.name} has no voltage and displacement to plot against it")
    progress(recording.name, 0.5)
    return loops_of(recording.time, voltage, displacement, recording.name)
