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
#: SCPI says 9.9E37 of what is too large, and 9.91E37 of what is no number.
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
    with np.errstate(invalid="ignore"):
        overflow = np.abs(values) >= OVERFLOW
    if overflow.any() and 2 * int(overflow.sum()) < values.size:
        others, more = markers_in(np.where(overflow, np.nan, values), codes_only)
        return others | overflow, [*np.unique(values[overflow]).tolist()[:_KINDS], *more]
    if not values.size or not (_is_repeated(values) or _is_code(_extreme(values))):
        return none, []
    size = np.abs(values)
    marked = np.zeros(values.size, dtype=bool)
    found: list[float] = []
    while len(found) < _KINDS and not marked.all():
        left = np.where(marked | ~np.isfinite(size), -1.0, size)
        extreme = float(left.max())
        same = left == extreme
        kinds = np.unique(values[same]).tolist()
        code = _is_code(extreme)
        if extreme <= 0.0 or len(kinds) + len(found) > _KINDS or (codes_only and not code):
            break
        if int(same.sum()) < _REPEATED and (codes_only or not code):
            break
        marked |= same
        found += kinds
        rest = size[~marked & np.isfinite(size)]
        if 2 * int(marked.sum()) > values.size or not rest.size:
            break
        far = FAR_CODE if all(map(_is_code, found)) else FAR
        if 0.0 < far * float(rest.max()) <= extreme and np.unique(rest).size >= _DIFFERENT:
            return marked, found
    return none, []


def _is_code(value: float) -> bool:
    """Return True for a number that programs write where there is no reading."""
    if abs(value) >= OVERFLOW:
        return True
    return abs(value) in _CODES or _NINES.fullmatch(f"{abs(value):.12g}") is not None


def _extreme(values: np.ndarray) -> float:
    """Return the value farthest from 0."""
    low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
    return high if high >= -low else low


def _is_repeated(values: np.ndarray) -> bool:
    """Return True if the value farthest from 0 is there twice; most readings end here."""
    extreme = _extreme(values)
    return int(np.count_nonzero(values == extreme)) >= _REPEATED or bool((values == -extreme).any())
