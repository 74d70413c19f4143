"""Readings of a run: which can be used, and what happened in one run alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.control.learning_settings import LearningSettings
from dearig.model.readings.noise import READINGS_MIN, about_rest

__all__ = [
    "RunReadings",
    "bridged",
    "has_jump",
    "lines_at_rest",
    "mean_without_outliers",
    "noise_with_steps",
    "sorted_out",
]

_OUTLIER = 6.0  # times the median deviation: 4 standard deviations of a normal one
_FARTHEST = 1.0  # m: no film moves so far
_LINES = 3  # mains, third and fifth harmonic: aliased, a lead-in may not tell them apart
_STANDS_OUT = 30.0  # times the power of noise: by chance once in 10^13 lines
_MEDIAN_OF_NORMAL = 0.6745  # median of |x| for a normal x of unit variance


@dataclass(frozen=True, eq=False)
class RunReadings:
    """Readings ``values`` (N,) in m from rest, which are ``usable`` (N,), and why others are not.

    ``noise`` in m is the standard deviation of one, that of the reading's steps included.
    """

    values: np.ndarray
    usable: np.ndarray
    noise: float
    notes: list[str]


def mean_without_outliers(readings: np.ndarray, least: float) -> float:
    """Return the mean of ``readings`` (n,) without outliers; NaN for none.

    ``least`` is what the spread of the readings is at least, in their unit, such as a step of the
    converter: coarse readings may mostly be the same. Their median would be a whole step, and so
    off by up to half of one.
    """
    if readings.size == 0:
        return math.nan
    off = np.abs(readings - np.median(readings))
    return float(readings[off <= _OUTLIER * max(float(np.median(off)), least)].mean())


def noise_with_steps(readings: np.ndarray, noise: float) -> float:
    """Return the ``noise`` in m of ``readings`` (n,), at least that of their steps.

    A reading that is rounded to steps is off by step/sqrt(12), also where it stands still at rest.
    The step is the smallest difference of two readings.
    """
    steps = np.diff(np.unique(readings))
    # differences of rounded numbers are not quite the same
    steps = steps[steps > 1e-6 * max(float(np.ptp(readings)) if readings.size else 0.0, noise)]
    return max(noise, float(steps.min()) / math.sqrt(12.0)) if steps.size else noise


def sorted_out(
    given: np.ndarray,
    valid: np.ndarray | None,
    predicted: np.ndarray,
    noise: float,
    rate: float,
    lead_in: int,
    settings: LearningSettings,
) -> RunReadings:
    """Return which of the readings ``given`` (any number) in m may be used, from rest.

    ``predicted`` (N,) in m is what was expected at ``rate`` Hz, ``noise`` in m that of a reading,
    ``valid`` False for readings that must not be used. The first ``lead_in`` are at rest. Readings
    that are not finite, spikes, and stuck ones are not used.
    """
    notes: list[str] = []
    given, n = np.asarray(given, dtype=np.float64), predicted.size
    if given.ndim != 1 or given.size != n:
        # a run that was ended early has fewer
        notes.append(f"{given.size} readings were recorded of {n}")
        row = np.full(n, np.nan)
        row[: min(given.size, n)] = given.ravel()[:n]
        given = row
        valid = None if valid is None else np.resize(valid, n)
    with np.errstate(invalid="ignore", over="ignore"):
        usable = np.isfinite(given) & (np.abs(given) < _FARTHEST)
    if valid is not None:
        usable &= np.asarray(valid, dtype=bool)
    given = np.where(usable, given, 0.0)
    noise = noise_with_steps(given[usable], noise)
    lead = usable & (np.arange(n) < lead_in)
    if lead.any():
        given = given - mean_without_outliers(given[lead], noise)
    off = given - predicted
    away = np.abs(off - scipy.ndimage.median_filter(off, settings.spike_readings))
    spikes = usable & (away > settings.spike * noise)
    stuck = _stuck(given, predicted, noise, rate, settings) & usable
    for mask, words in ((spikes, "spikes"), (stuck, "stuck readings")):
        if mask.any():
            notes.append(f"{np.count_nonzero(mask)} {words} are left out")
    return RunReadings(given, usable & ~spikes & ~stuck, noise, notes)


def lines_at_rest(
    off: np.ndarray, lead_in: int, noise: float, rate: float
) -> list[tuple[float, np.ndarray]]:
    """Return what is periodic in a run and also at rest, such as mains interference.

    ``off`` (N,) in m are readings less what was expected, NaN where there is none, at ``rate`` Hz.
    The first ``lead_in``, in which nothing moves the film, tell about which frequencies there are
    lines; the whole run tells apart up to ``_LINES`` there that stand out from the ``noise`` in m.
    Each item is a frequency in Hz, and the sum (N,) in m of the lines there.
    """
    rest, known = off[:lead_in], np.isfinite(off)
    if rest.size < READINGS_MIN or not known[:lead_in].all():
        return []
    time, left = np.arange(off.size) / rate, np.where(known, off, 0.0)
    bare, numbers = about_rest(time[:lead_in], rest)
    periodic = rest - bare
    periodic -= np.polyval(np.polyfit(time[:lead_in], periodic, 1), time[:lead_in])
    found: dict[float, np.ndarray] = {}
    for _ in range((numbers - 2) // 3):  # a straight line, and three numbers of each
        frequency = float(np.argmax(np.abs(np.fft.rfft(periodic)))) * rate / rest.size
        whole = np.zeros(off.size)
        for _ in range(_LINES):
            row = _sine(time, left - whole * known, frequency, rate / rest.size)
            # the power of noise in one line of N samples is noise^2/N
            if 0.5 * float(np.mean(row**2)) < _STANDS_OUT * noise**2 / off.size:
                break
            whole += row
        left, periodic = left - whole * known, periodic - whole[:lead_in]
        found[frequency] = found.get(frequency, 0.0) + whole
    return [(frequency, whole) for frequency, whole in found.items() if whole.any()]


def _sine(time: np.ndarray, values: np.ndarray, frequency: float, within: float) -> np.ndarray:
    """Return the strongest sine (N,) in ``values`` (N,) ``within`` so many Hz of ``frequency``."""
    line = 1.0 / (time.size * time[1])
    near = np.fft.rfftfreq(time.size, time[1])
    power = np.where(np.abs(near - frequency) <= within, np.abs(np.fft.rfft(values)), 0.0)
    middle = float(near[np.argmax(power)])

    def waves(of: float) -> np.ndarray:
        turn = 2.0 * math.pi * of * time
        return np.array([np.cos(turn), np.sin(turn)])

    best = scipy.optimize.minimize_scalar(
        lambda of: -float(np.sum((waves(of) @ values) ** 2)),
        bounds=(middle - line, middle + line),
        method="bounded",
        options={"xatol": 1e-4 * line},
    )
    both = waves(float(best.x))
    return np.asarray(np.linalg.solve(both @ both.T, both @ values) @ both)


def _stuck(
    reading: np.ndarray,
    predicted: np.ndarray,
    noise: float,
    rate: float,
    settings: LearningSettings,
) -> np.ndarray:
    """Return where the ``reading`` stands still while the film is ``predicted`` to move."""
    width = max(round(settings.stuck_s * rate), 2)
    same = np.concatenate([[False], np.diff(reading) == 0.0]).astype(float)
    stands = scipy.ndimage.uniform_filter1d(same, width, mode="nearest") > 1.0 - 0.5 / width
    moves = sum(scipy.ndimage.maximum_filter1d(p, width) for p in (predicted, -predicted))
    found = stands & (moves > settings.moved * noise)
    return np.asarray(scipy.ndimage.binary_dilation(found, np.ones(width, dtype=bool)))


def bridged(lacking: np.ndarray, known: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return ``lacking`` (N,) m with what is ``known`` already where it is not ``usable``.

    The difference from what is known is joined across a gap, so that no step is learned.
    """
    if usable.all():
        return lacking
    if not usable.any():
        return known
    at = np.arange(lacking.size)
    more = np.interp(at, at[usable], (lacking - known)[usable])
    return np.where(usable, lacking, known + more)


def has_jump(
    change: np.ndarray, inside: np.ndarray, noise: float, rate: float, settings: LearningSettings
) -> bool:
    """Return whether ``change`` (N,) m has a jump where it is ``inside`` (N,).

    A jump is as large at once as over a longer time. ``noise`` in m is that of a reading.
    """
    width, apart = max(round(settings.jump_s * rate), 3), settings.jump_apart
    near, far = (_differences(change, width, k * width) for k in (1, apart))
    usual = float(np.median(np.abs(near[inside]))) / _MEDIAN_OF_NORMAL
    least = settings.spike * max(noise * math.sqrt(2.0 / width), usual)
    # half way between a jump and what moves steadily
    sudden = np.abs(near) > 0.5 * (1.0 + 1.0 / apart) * np.abs(far)
    return bool(np.any((sudden & (np.abs(near) > least))[inside]))


def _differences(values: np.ndarray, width: int, apart: int) -> np.ndarray:
    """Return the differences (N,) of means over ``width`` samples that are ``apart`` samples."""
    mean = scipy.ndimage.uniform_filter1d(values, width, mode="nearest")
    half = apart // 2
    padded = np.pad(mean, (half, apart - half), mode="edge")
    return np.asarray(padded[apart:] - padded[: values.size])
