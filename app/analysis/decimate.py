"""Decimation of long curves that keeps their peaks."""

from __future__ import annotations

import numpy as np

__all__ = ["decimate", "decimate_on_grid", "decimate_path"]


def decimate(x: np.ndarray, y: np.ndarray, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of ``y`` (N,) over increasing ``x`` (N,) that ``columns`` pixels can show.

    Of every column the lowest and the highest sample are kept at their places, and of the curve the
    first and the last: at most 2 columns + 2 points. Where a column has no finite sample, one NaN
    is kept, so that the line breaks there. A curve that is short enough is returned unchanged.
    """
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if x.shape != y.shape or x.ndim != 1:
        raise ValueError(f"x {x.shape} and y {y.shape} must be rows of one length")
    if columns < 1:
        raise ValueError(f"columns = {columns} must be 1 or more")
    y = np.where(np.isfinite(y), y, np.nan)
    if x.size <= 2 * columns + 2:
        return x, y
    span = x[-1] - x[0]
    if not span > 0.0:
        raise ValueError("x must increase")
    column = np.minimum(((x - x[0]) / span * columns).astype(np.int64), columns - 1)
    starts = np.flatnonzero(np.diff(column, prepend=-1))
    return _pick(x, y, _extremes(y, starts))


def decimate_on_grid(x: np.ndarray, y: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of ``y`` (N,) over ``x`` (N,), not decreasing, in columns of ``step``.

    As ``decimate``, but the columns begin at multiples of ``step``: a curve keeps its points while
    the range that is shown moves.
    """
    if not step > 0.0:
        raise ValueError(f"step = {step} must be above 0")
    if not x.size:
        return x, y
    starts = np.flatnonzero(np.diff(np.floor(x / step), prepend=-np.inf))
    return _pick(x, y, _extremes(y, starts))


def decimate_path(x: np.ndarray, y: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return at most 4 parts + 2 points of a curve (``x``, ``y``) (N,) that may turn back.

    The curve is cut into ``parts`` of equal length, and of each the extremes of both coordinates
    are kept. Use it for loops.
    """
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if x.shape != y.shape or x.ndim != 1:
        raise ValueError(f"x {x.shape} and y {y.shape} must be rows of one length")
    if x.size <= 4 * parts + 2:
        return x, y
    starts = np.unique(np.linspace(0, x.size, parts, endpoint=False).astype(np.int64))
    return _pick(x, y, np.concatenate((_extremes(x, starts), _extremes(y, starts))))


def _pick(x: np.ndarray, y: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    kept = np.unique(np.concatenate((rows, [0, x.size - 1])))
    return x[kept], y[kept]


def _extremes(y: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Return rows of the lowest and highest ``y`` in each run that begins at ``starts`` (K,)."""
    lengths = np.diff(starts, append=y.size)
    rows = [starts[np.isnan(np.fmin.reduceat(y, starts))]]
    for ends in (np.fmin.reduceat(y, starts), np.fmax.reduceat(y, starts)):
        there = np.flatnonzero(y == np.repeat(ends, lengths))
        run = np.searchsorted(starts, there, side="right")
        rows.append(there[np.unique(run, return_index=True)[1]])
    return np.concatenate(rows)
