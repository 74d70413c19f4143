"""A record's drive in fewer and longer steps, for derivatives with respect to parameters.

A search needs derivatives of the readings far more often than the readings. In a difference the
error of a long step cancels to some hundredths. So derivatives are computed under a drive with
steps only where the voltage or the film changes quickly. Every reading and every reported error
comes from the full drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dearig.model import kernel
from dearig.model.film.sensor import at_sensor
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, Drive, reading_of

__all__ = ["CoarseDrive", "coarse_drive_of"]

_STEP_MAX = 0.02  # s
# The following are in units of a reading's noise
_INTERPOLATION_ERROR_MAX = 0.25  # of readings inside a step, interpolated from its ends
_PULL_ERROR_MAX = 1.0  # of the electrostatic pull, which the film follows only slowly
_CONSTANT = (
    1.0  # change of the static reading from sample to sample: below, the voltage is constant
)
_JUMP = 3.0  # change of that change: above, the converter's staircase excites ringing
_READING_ERROR_MAX = 0.5  # RMS of all readings
_SHARE_MAX = 0.7  # of the samples: a drive with more steps saves too little


@dataclass(frozen=True, kw_only=True)
class CoarseDrive(Drive):
    """A drive that is linear from each sample to ``to`` (N,) in V at the end of its step."""

    to: np.ndarray

    @cached_property
    def ends(self) -> np.ndarray:
        """``to``."""
        return self.to


def coarse_drive_of(record: ActuatorRecord, model: Actuator) -> CoarseDrive | None:
    """Return the drive of ``record`` in the longest steps under which ``model`` reads the same.

    None where that saves too little, or where the simulation of the record fails.
    """
    c, length = model.coefficients(), model.film.length
    if not kernel.is_swift(c):
        return None
    predicted, status = reading_of(c, length, record.drive, record.lag, kernel.QUICK)
    if status != kernel.OK:
        return None
    predicted /= record.noise
    strongest = float(np.max(record.drive.voltage**2))
    pulled = float(np.max(np.abs(predicted))) / max(
        strongest, 1e-300
    )  # in units of the noise per V^2
    begins, ends, jumping = _smoothed(record.drive, pulled)
    edges = _step_edges(record.time, predicted, begins, ends, jumping, pulled)
    if edges.size > _SHARE_MAX * record.time.size:
        return None
    drive = _coarsened(record.drive, begins, ends, edges)
    readings, status = reading_of(c, length, drive, record.lag, kernel.COARSE, record.time)
    near = float(np.mean((readings / record.noise - predicted) ** 2)) < _READING_ERROR_MAX**2
    return drive if status == kernel.OK and near else None


def _smoothed(drive: Drive, pulled: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return voltages (N - 1,) at the start and end of intervals, and where jumps matter (bool).

    Except where its jumps excite ringing, a held voltage is replaced by straight lines from the
    middle of each jump to the middle of the next, which move the film alike at the samples.
    """
    begins, ends = drive.voltage[:-1], drive.ends[:-1]
    if not drive.hold:
        return begins, ends, np.zeros(begins.size, dtype=bool)
    squares = begins * np.abs(begins)
    up = np.diff(squares, prepend=squares[0], append=squares[-1]) * pulled
    standing = np.maximum(np.abs(up[:-1]), np.abs(up[1:])) < _CONSTANT
    # a moving stretch of the drive is replaced as a whole: half a jump at its edge would ring
    course = np.cumsum(standing)
    rings = np.zeros(course[-1] + 1, dtype=bool)
    rings[course[np.abs(np.diff(up)) > _JUMP]] = True
    jumping = rings[course]
    jumping |= np.append(jumping[1:], False)
    half = np.append(0.5 * (squares[:-1] + squares[1:]), squares[-1])
    half = np.sign(half) * np.sqrt(np.abs(half))
    since_half = np.append(begins[:1], half[:-1])
    return np.where(jumping, begins, since_half), np.where(jumping, ends, half), jumping


def _step_edges(
    time: np.ndarray,
    predicted: np.ndarray,
    begins: np.ndarray,
    ends: np.ndarray,
    jumping: np.ndarray,
    pulled: float,
) -> np.ndarray:
    """Return the samples (B + 1,) at which steps end: steps are doubled while errors stay small."""
    edges = np.arange(time.size)
    step = float(np.median(np.diff(time)))
    rate = np.gradient(predicted, time)
    between, slope = np.empty_like(time), np.empty_like(time)
    size = 2
    while size * step <= _STEP_MAX * (1.0 + 1e-6):
        first = np.arange(0, time.size - size, size)
        inner = first[:, None] + np.arange(1, size)
        good = ~np.any(jumping[first[:, None] + np.arange(size)], axis=1)
        at_sensor(time[::size], predicted[::size], rate[::size], time, between, slope)
        good &= np.max(np.abs(between - predicted)[inner], axis=1) < _INTERPOLATION_ERROR_MAX
        left, right, possible = _line(time, begins, ends, first, size)
        there = left[:, None] + (right - left)[:, None] * (np.arange(1, size) / size)
        pulls = pulled * (there**2 - begins[inner] ** 2)
        good &= np.max(np.abs(pulls), axis=1) < _PULL_ERROR_MAX
        good &= possible
        good[1:-1] &= (
            good[:-2] & good[2:]
        )  # while the film rings, a single step may agree by chance
        edges = np.setdiff1d(edges, inner[good])
        size *= 2
    return edges


def _line(
    time: np.ndarray, begins: np.ndarray, ends: np.ndarray, first: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return voltages (B,) at the ends of a line that replaces ``size`` intervals, and validity.

    The square of the voltage, which is the pull, has the same mean and first moment over the line
    as over the intervals.
    """
    inside = first[:, None] + np.arange(size)
    a, b = begins[inside], ends[inside]
    t0, whole = time[first][:, None], (time[first + size] - time[first])[:, None]
    width = (time[inside + 1] - time[inside]) / whole
    middle = 0.5 * (time[inside + 1] + time[inside] - 2.0 * t0 - whole) / whole
    square, slope = (a * a + a * b + b * b) / 3.0, (b * b - a * a) / 12.0
    mean = np.sum(width * square, axis=1)
    moment = np.sum(width * (square * middle + width * slope), axis=1)
    # linear from m - d/2 to m + d/2 the square has the mean m^2 + d^2/12 and the moment m d/6
    under = mean**2 - 12.0 * moment**2
    m = np.sqrt(0.5 * (mean + np.sqrt(np.maximum(under, 0.0))))
    half = np.where(m > 0.0, 3.0 * moment / np.maximum(m, 1e-300), 0.0)
    sign = np.where(np.sum(width * (a + b), axis=1) < 0.0, -1.0, 1.0)
    one_way = (np.min(np.minimum(a, b), axis=1) >= 0.0) | (np.max(np.maximum(a, b), axis=1) <= 0.0)
    possible = (np.abs(half) <= (1.0 + 1e-6) * m) & one_way
    half = np.clip(half, -m, m)
    return sign * (m - half), sign * (m + half), possible


def _coarsened(
    drive: Drive, begins: np.ndarray, ends: np.ndarray, edges: np.ndarray
) -> CoarseDrive:
    """Return ``drive`` in steps between samples ``edges`` (B + 1,)."""
    time = drive.time
    starts, to = begins[edges[:-1]].copy(), ends[edges[1:] - 1].copy()
    air = drive.air[:, edges].copy() if drive.air.size else None
    sizes = np.diff(edges)
    for size in np.unique(sizes[sizes > 1]):
        which = np.flatnonzero(sizes == size)
        first = edges[which]
        starts[which], to[which], _ = _line(time, begins, ends, first, int(size))
        if air is not None:
            air[:, which] = drive.air[:, first[:, None] + np.arange(size)].mean(axis=2)
    last = drive.voltage[-1]
    return CoarseDrive(
        time[edges],
        np.append(starts, last),
        warmth=None if air is None or drive.warmth is None else air[0],
        moisture=None if air is None or drive.moisture is None else air[1],
        temperature=drive.temperature,
        humidity=drive.humidity,
        to=np.append(to, last),
    )
