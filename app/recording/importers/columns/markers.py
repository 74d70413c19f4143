"""Values that stand for no reading: -99999.9999 among readings of a millimetre."""

from __future__ import annotations

import numpy as np

__all__ = ["markers_in"]

#: How many times farther from 0 than all readings a marker is. An instrument's range is some times
#: the readings, and the marker is made to lie outside of it.
FAR = 100.0
#: Markers of one column, at most: too near and too far; readings, and different ones, at least.
_KINDS, _REPEATED, _DIFFERENT = 2, 2, 10


def markers_in(values: np.ndarray) -> tuple[np.ndarray, list[float]]:
    """Return where ``values`` (n,) hold a marker, (n,) bool, and the markers.

    Markers are repeated exactly, are not most of the values, and are far off all of them.
    """
    none = np.zeros(values.size, dtype=bool)
    if not values.size or not _is_repeated(values):
        return none, []
    size = np.abs(values)
    marked = np.zeros(values.size, dtype=bool)
    found: list[float] = []
    while len(found) < _KINDS and not marked.all():
        left = np.where(marked | ~np.isfinite(size), -1.0, size)
        extreme = float(left.max())
        same = left == extreme
        kinds = np.unique(values[same]).tolist()
        if extreme <= 0.0 or int(same.sum()) < _REPEATED or len(kinds) + len(found) > _KINDS:
            break
        marked |= same
        found += kinds
        rest = size[~marked & np.isfinite(size)]
        if 2 * int(marked.sum()) > values.size or not rest.size:
            break
        if 0.0 < FAR * float(rest.max()) <= extreme and np.unique(rest).size >= _DIFFERENT:
            return marked, found
    return none, []


def _is_repeated(values: np.ndarray) -> bool:
    """Return True if the value farthest from 0 is there twice; most readings end here."""
    low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
    extreme = high if high >= -low else low
    return int(np.count_nonzero(values == extreme)) >= _REPEATED or high == -low
