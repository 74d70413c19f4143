"""Values that stand for no reading: -99999.9999 among readings of a millimetre."""

from __future__ import annotations

import re

import numpy as np

__all__ = ["markers_in"]

#: How many times farther from 0 than all readings a marker is. An instrument's range is some times
#: the readings, and the marker is made to lie outside of it. The second is for numbers that
#: programs write for no reading, and hardly an instrument: nines, ends of integers, and 7999.
FAR, FAR_CODE = 100.0, 2.0
#: Markers of one column, at most: too near and too far; readings, and different ones, at least.
_KINDS, _REPEATED, _DIFFERENT = 2, 2, 10
#: Values that are compared with each other first: mostly they are enough.
_SOME = 1000
#: SCPI says 9.9E37 of what is too large, and 9.91E37 of what is not a number.
OVERFLOW = 9.9e36
_CODES = frozenset({7999.0, 32767.0, 32768.0, 65535.0, 2147483647.0, 2147483648.0})
_NINES = re.compile(r"9{3,}(?:\.9+|\.0)?")


def markers_in(values: np.ndarray, codes_only: bool = False) -> tuple[np.ndarray, list[float]]:
    """Return where ``values`` (n,) hold a marker, (n,) bool, and the markers.

    Markers are far off all readings, and not most of the values. They are repeated exactly, or one
    of the numbers that programs write for no reading; ``codes_only``, of values that a step may
    bring far off, both.
    """
    none = np.zeros(values.size, dtype=bool)
    if not values.size:
        return none, []
    extreme = _extreme(values)
    if abs(extreme) >= OVERFLOW:
        overflow = (np.abs(values) >= OVERFLOW) & np.isfinite(values)
        if 0 < 2 * int(overflow.sum()) < values.size:
            others, more = markers_in(np.where(overflow, np.nan, values), codes_only)
            return others | overflow, [*np.unique(values[overflow]).tolist()[:_KINDS], *more]
    if not (_is_code(extreme) or (_is_repeated(values, extreme) and not codes_only)):
        return none, []
    size = np.abs(values)
    size[~np.isfinite(size)] = -1.0
    marked = none.copy()
    found: list[float] = []
    while len(found) < _KINDS:
        extreme = float(size.max())
        same = size == extreme
        kinds = np.unique(values[same]).tolist()
        code = _is_code(extreme)
        if extreme <= 0.0 or len(kinds) + len(found) > _KINDS or (codes_only and not code):
            break
        if int(same.sum()) < _REPEATED and (codes_only or not code):
            break
        marked |= same
        found += kinds
        size[same] = -1.0
        largest = float(size.max())
        if 2 * int(marked.sum()) > values.size or largest <= 0.0:
            break
        far = FAR_CODE if all(map(_is_code, found)) else FAR
        if far * largest <= extreme and _are_different(size):
            return marked, found
    return none, []


def _are_different(size: np.ndarray) -> bool:
    """Return True if enough of the sizes (n,) that are left, from 0 on, differ."""
    some = size[:: max(size.size // _SOME, 1)]
    return any(np.unique(part[part >= 0.0]).size >= _DIFFERENT for part in (some, size))


def _is_code(value: float) -> bool:
    """Return True for a number that programs write where there is no reading."""
    if abs(value) >= OVERFLOW:
        return True
    return abs(value) in _CODES or _NINES.fullmatch(f"{abs(value):.12g}") is not None


def _extreme(values: np.ndarray) -> float:
    """Return the value farthest from 0."""
    low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
    return high if high >= -low else low


def _is_repeated(values: np.ndarray, extreme: float) -> bool:
    """Return True if the value farthest from 0 is there twice; most readings end here."""
    return int(np.count_nonzero(values == extreme)) >= _REPEATED or bool((values == -extreme).any())
