"""Times that are written as one number and are not a number of seconds: 40.59 for 40 min 59 s."""

from __future__ import annotations

import numpy as np

__all__ = ["by_sixties", "counts_days", "epoch_unit"]

#: Spread of the steps counted by sixties, over that of the numbers: chance gives no such part.
_EVENER = 0.25
_SOME = 1000  # numbers that are looked at first
_ROWS_MIN = 10  # with fewer rows, what looks like minutes and seconds may be chance
#: Seconds since 1970 of the years 2001 to 2100, and the units in which programs count them.
_EPOCH = (1e9, 4.1e9)
_UNITS = (("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9))


def by_sixties(values: np.ndarray) -> np.ndarray | None:
    """Return ``values`` (n,) such as 40.59 as 40 times 60 and 59; None if they are plain numbers.

    They are counted by sixties where no number has more than .59 behind the point, 41.00 follows
    40.59, and the steps are far more even so.
    """
    if values.size < _ROWS_MIN:
        return None
    # most times are plain by their first numbers already
    if _by_sixties(values[:_SOME]) is None or (found := _by_sixties(values)) is None:
        return None
    hundredths, whole, rest = found
    if not (np.diff(rest) < 0.0).any():
        return None
    counted = 60.0 * whole + rest
    plain = float(np.std(np.diff(hundredths)))
    return counted if float(np.std(np.diff(counted))) < _EVENER * plain else None


def _by_sixties(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return hundredths, whole numbers and rests up to 59 of ``values`` (n,); None for others."""
    hundredths = np.round(100.0 * values)
    if not np.isfinite(values).all() or (values < 0.0).any():
        return None
    if np.max(np.abs(100.0 * values - hundredths)) > 1e-6 * max(float(hundredths.max()), 1.0):
        return None
    whole, rest = np.divmod(hundredths, 100.0)
    return None if rest.max() > 59.0 else (hundredths, whole, rest)


def epoch_unit(values: np.ndarray) -> str:
    """Return the unit in which ``values`` (n,) count the time since 1970, or ""."""
    if not values.size or not np.isfinite(values[0]):
        return ""
    low, high = _EPOCH
    return next((unit for unit, times in _UNITS if low * times < values[0] < high * times), "")


#: Days since 1900 of the years 2000 to 2100, as spreadsheets count them.
_DAYS = (36_526.0, 73_050.0)
#: Longest step in days between samples of which it is sure: 10 s. A clock of seconds that has run
#: for ten hours and more, and is read every 0.1 ms, is none of a laboratory.
_DAYS_STEP = 10.0 / 86_400.0


def counts_days(values: np.ndarray) -> bool:
    """Return True if ``values`` (n,) count days since 1900, by their size and their steps."""
    if values.size < _ROWS_MIN or not np.isfinite(values).all():
        return False
    if not _DAYS[0] < float(values.min()) <= float(values.max()) < _DAYS[1]:
        return False
    return 0.0 < float(np.median(np.diff(values))) <= _DAYS_STEP
