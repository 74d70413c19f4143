"""A record's drive in fewer and longer steps, by which a fit is told what a number of a model does.

A search asks far more often how readings change with a number than what they are. In the change,
what a long step gets wrong is gone but for some hundredths; so such questions are answered by a
drive that is cut only where something happens. Every reading and every error comes from the whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dearig.model import kernel
from dearig.model.actuator import Actuator, Drive, reading_of
from dearig.model.records import ActuatorRecord
from dearig.model.sensor import at_sensor

__all__ = ["Sketch", "sketched"]

_LONGEST = 0.02  # s, of a step
_NEAR = 0.25  # of a reading's noise: as near must neighbours tell what is between
_NEAR_PULL = 1.0  # of the same: as near the pull, which the film does not follow at once
_FLAT = 1.0  # of the same: less from sample to sample is standing
_JUMPS = 3.0  # of the same: more change of what is less, or more, and a converter's steps show
_SAME = 0.5  # of the same: as near in the mean must all readings be
_WORTH = 0.7  # of the samples: a drive of more steps is not worth it


@dataclass(frozen=True, kw_only=True)
class Sketch(Drive):
    """A drive that goes from each sample linearly to ``to`` (N,) V, from where it jumps."""

    to: np.ndarray

    @property
    def ends(self) -> np.ndarray:
        """``to``."""
        return self.to


def sketched(record: ActuatorRecord, model: Actuator) -> Sketch | None:
    """The drive of ``record`` in steps as long as ``model`` foresees the same readings.

    None where that spares too little, or where the model cannot follow the record.
    """
    c, length = model.coefficients(), model.film.length
    if not kernel.is_swift(c):
        return None
    foreseen, status = reading_of(c, length, record.drive, record.lag, kernel.QUICK)
    if status != kernel.OK:
        return None
    foreseen /= record.noise
    strongest = float(np.max(record.drive.voltage**2))
    pulled = float(np.max(np.abs(foreseen))) / max(strongest, 1e-300)  # of the noise, by 1 V^2
    begins, ends, shown = _smoothed(record.drive, pulled)
    edges = _joined(record.time, foreseen, begins, ends, shown, pulled)
    if edges.size > _WORTH * record.time.size:
        return None
    drive = _drawn(record.drive, begins, ends, edges)
    there, status = reading_of(c, length, drive, record.lag, kernel.COARSE, record.time)
    near = float(np.mean((there / record.noise - foreseen) ** 2)) < _SAME**2
    return drive if status == kernel.OK and near else None


def _smoothed(drive: Drive, pulled: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voltages (N - 1,) at which intervals begin and end, and where a converter's steps show.

    A held voltage is, but for where they do, as one that goes straight from half of each step to
    half of the next: at the samples, the film is where it would be.
    """
    begins, ends = drive.voltage[:-1], drive.ends[:-1]
    if not drive.hold:
        return begins, ends, np.zeros(begins.size, dtype=bool)
    squares = begins * np.abs(begins)
    up = np.diff(squares, prepend=squares[0], append=squares[-1]) * pulled
    standing = np.maximum(np.abs(up[:-1]), np.abs(up[1:])) < _FLAT
    # all from one stand to the next, or none: half a step of a moving voltage would make it ring
    course = np.cumsum(standing)
    shows = np.zeros(course[-1] + 1, dtype=bool)
    shows[course[np.abs(np.diff(up)) > _JUMPS]] = True
    shown = shows[course]
    shown |= np.append(shown[1:], False)
    half = np.append(0.5 * (squares[:-1] + squares[1:]), squares[-1])
    half = np.sign(half) * np.sqrt(np.abs(half))
    since_half = np.append(begins[:1], half[:-1])
    return np.where(shown, begins, since_half), np.where(shown, ends, half), shown


def _joined(
    time: np.ndarray,
    foreseen: np.ndarray,
    begins: np.ndarray,
    ends: np.ndarray,
    shown: np.ndarray,
    pulled: float,
) -> np.ndarray:
    """Samples (B + 1,) between which a step may go: twice as far, as long as nothing is missed."""
    edges = np.arange(time.size)
    step = float(np.median(np.diff(time)))
    rate = np.gradient(foreseen, time)
    between, slope = np.empty_like(time), np.empty_like(time)
    size = 2
    while size * step <= _LONGEST * (1.0 + 1e-6):
        first = np.arange(0, time.size - size, size)
        inner = first[:, None] + np.arange(1, size)
        good = ~np.any(shown[first[:, None] + np.arange(size)], axis=1)
        at_sensor(time[::size], foreseen[::size], rate[::size], time, between, slope)
        good &= np.max(np.abs(between - foreseen)[inner], axis=1) < _NEAR
        left, right, possible = _line(time, begins, ends, first, size)
        there = left[:, None] + (right - left)[:, None] * (np.arange(1, size) / size)
        pulls = pulled * (there**2 - begins[inner] ** 2)
        good &= np.max(np.abs(pulls), axis=1) < _NEAR_PULL
        good &= possible
        good[1:-1] &= good[:-2] & good[2:]  # of a film that rings a single one may fit by chance
        edges = np.setdiff1d(edges, inner[good])
        size *= 2
    return edges


def _line(
    time: np.ndarray, begins: np.ndarray, ends: np.ndarray, first: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voltages (B,) between which ``size`` intervals go straight, and whether they can.

    Over all of them the square of the voltage, which is what pulls, has the same mean and the same
    first moment.
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


def _drawn(drive: Drive, begins: np.ndarray, ends: np.ndarray, edges: np.ndarray) -> Sketch:
    """``drive`` in steps between samples ``edges`` (B + 1,)."""
    time = drive.time
    starts, to = begins[edges[:-1]].copy(), ends[edges[1:] - 1].copy()
    warmth = None if drive.warmth is None else drive.warmth[edges].copy()
    sizes = np.diff(edges)
    for size in np.unique(sizes[sizes > 1]):
        which = np.flatnonzero(sizes == size)
        first = edges[which]
        starts[which], to[which], _ = _line(time, begins, ends, first, int(size))
        if warmth is not None and drive.warmth is not None:
            warmth[which] = drive.warmth[first[:, None] + np.arange(size)].mean(axis=1)
    last = drive.voltage[-1]
    return Sketch(time[edges], np.append(starts, last), warmth=warmth, to=np.append(to, last))
