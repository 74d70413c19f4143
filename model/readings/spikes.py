"""Spikes: single readings far outside of the noise at rest.

A sensor that loses its spot for one sample reads anything. No film moves so, and a model that is
fitted to such readings is worse. Masked is one reading at a time, between neighbours that lie on a
smooth curve within the noise at rest: a jump, a kink, ringing or a slow error shows in several
readings, and stays. Two spikes may be near each other, with good readings between.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.readings.noise import Tails, about_rest, rounding, tails_of

__all__ = ["RINGING", "spikes"]

#: Good readings of a recording that are masked by mistake, on average, where the noise is that at
#: rest.
_MASKED_WRONGLY = 0.01
_REST_MIN = 100  # readings: fewer give the noise to worse than 7 %
_FEW = 0.01  # of the readings: where more are far off, the noise is not that at rest
#: Samples: two periods of ringing at a third of the rate, which no cubic shows.
RINGING = 6
_CUT = 0.962  # standard deviation of a normal distribution without its largest hundredth
#: Displacement over that in proportion to the pull: a film that rings goes twice as far, and one
#: that is stretched is twice as soft as on average.
_DRIVEN = 4.0

#: Neighbours of a reading, and what projects off the cubics through these.
_REACH = 4
_PLACES = np.delete(np.arange(-_REACH, _REACH + 1.0), _REACH)
_CURVES = np.vander(_PLACES, 4, increasing=True)
_BESIDE = np.eye(_PLACES.size) - _CURVES @ np.linalg.pinv(_CURVES)
#: The reading less the curve there; its noise, over that of one reading.
_OFF = np.insert(-np.linalg.pinv(_CURVES)[0], _REACH, 1.0)
_OFF_NOISE = math.sqrt(float(_OFF @ _OFF))
#: 99 % of chi-square with four degrees of freedom: squared deviations of the eight neighbours from
#: their cubic of four coefficients, in sum over the variance of normal noise.
_BESIDE_MAX = 13.3
#: Of what one reading may be off, for two: where the noise grows with the motion, two are far off
#: among neighbours within the noise at rest more often than one is.
_CLEAR = 2.0
_SURE = 0.99  # of the same quantile, for two spikes with any number of neighbours


def spikes(time: np.ndarray, signal: np.ndarray, pull: np.ndarray, quiet: int) -> np.ndarray:
    """Return which readings (N,) bool of ``signal`` (N,) are spikes.

    It may be measured, or what a model leaves of it. ``pull`` (N,) is what moves the film. The
    first ``quiet`` readings are at rest: their distribution, normal or Student's t, says how far
    off a reading may be.
    """
    found = np.zeros(signal.size, dtype=bool)
    if quiet < _REST_MIN or signal.size < _OFF.size:
        return found
    tails = _at_rest(time[:quiet], signal[:quiet])
    # rounding alone moves a reading off its curve by a step
    limit = _OFF_NOISE * tails.limit(_MASKED_WRONGLY / signal.size) + tails.step
    # what the drive may have moved, just now or before, is not a spike
    driven = scipy.ndimage.maximum_filter1d(np.abs(_off(pull)), 2 * _REACH + 1)
    driven /= float(np.max(np.abs(pull))) or 1.0
    moved = _DRIVEN * float(np.ptp(signal)) * driven
    width = math.hypot(tails.scale, tails.step / math.sqrt(12.0))
    off = np.abs(_off(signal))
    far = np.flatnonzero(off - moved > limit)
    alone = [_beside(signal, i) < width and not _rings(off, i) for i in map(int, far)]
    found[far[alone]] = True
    farthest = _CLEAR * tails.limit(_MASKED_WRONGLY / signal.size)
    # a spike bends the curves of its neighbours: more than these are not spikes, but a misfit
    few = far.size <= _OFF.size * _FEW * signal.size
    for i, j in _near_each_other(far, found) if few else ():
        if _are_two(signal, i, j, farthest, tails.step, width):
            found[[i, j]] = True
    return found if np.mean(found) <= _FEW else np.zeros_like(found)


def _near_each_other(far: np.ndarray, found: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield pairs of readings with others between, not both ``found``.

    One is ``far`` off. The other one need not look so: the first bends its curve.
    """
    for i in map(int, far):
        for apart in range(2, 2 * _REACH + 1):
            for j in (i - apart, i + apart):
                if 0 <= j < found.size and not (found[i] and found[j]):
                    yield min(i, j), max(i, j)


def _are_two(
    signal: np.ndarray, i: int, j: int, farthest: float, step: float, width: float
) -> bool:
    """Whether readings ``i`` and ``j`` are two spikes: their neighbours are smooth without both."""
    first, last = i - _REACH, j + _REACH + 1
    if first < 0 or last > signal.size:
        return False
    good, off, error, most = _without_two(j - i)
    left = off @ signal[first:last]
    if float(np.sum(left[good] ** 2)) > most * width**2:
        return False
    return bool(np.all(np.abs(left[~good]) > farthest * error + step))


@cache
def _without_two(apart: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return what tells two spikes so many samples ``apart`` from a cubic through the others.

    These are which readings (M,) are others; the matrix (M, M) that subtracts the cubic; the noise
    (2,) of what it leaves at the spikes, of which the cubic has a part, over that of one reading;
    and the quantile of the sum of the others' squares.
    """
    at = np.arange(-_REACH, apart + _REACH + 1)
    good = (at != 0) & (at != apart)
    curves = np.vander((at - 0.5 * apart) / _REACH, 4, increasing=True)
    fit = np.linalg.pinv(curves[good])
    off = np.eye(at.size)
    off[:, good] -= curves @ fit
    error = np.sqrt(1.0 + np.sum((curves[~good] @ fit) ** 2, axis=1))
    most = scipy.special.chdtri(np.count_nonzero(good) - 4, 1.0 - _SURE)
    return good, off, error, float(most)


def _at_rest(time: np.ndarray, signal: np.ndarray) -> Tails:
    """Return the distribution of the noise at rest, without spikes where the rest is normal."""
    noise, _ = about_rest(time, signal)
    size, step = np.abs(noise), rounding(signal)
    middle = tails_of(noise[size <= np.quantile(size, 1.0 - _FEW)], step)
    if middle.is_normal:
        return replace(middle, scale=middle.scale / _CUT)
    return tails_of(noise, step)


def _off(values: np.ndarray) -> np.ndarray:
    """Return ``values`` (N,) less the curves through their neighbours, 0 at the ends."""
    return np.pad(np.correlate(values, _OFF, "valid"), _REACH)


def _beside(signal: np.ndarray, i: int) -> float:
    """Return the deviation of the neighbours of reading ``i`` from their curve.

    It is scaled so that normal noise exceeds its own standard deviation once in a hundred times.
    """
    neighbours = np.delete(signal[i - _REACH : i + _REACH + 1], _REACH)
    return math.sqrt(float(neighbours @ _BESIDE @ neighbours) / _BESIDE_MAX)


def _rings(off: np.ndarray, i: int) -> bool:
    """Whether readings near ``i`` are half as far ``off`` (N,): ringing of some three samples.

    Not its next two neighbours on either side, whose curves pass through it.
    """
    others = np.concatenate([off[max(i - RINGING, 0) : i - 2], off[i + 3 : i + 1 + RINGING]])
    return bool(np.max(others) > 0.5 * off[i])
