"""Describe residuals: whether they are noise, and which quantities they depend on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from dearig.model.fitting.intervals import correlation_time, unevenness
from dearig.model.fitting.rejection import noise_test
from dearig.model.readings.noise import NOISE_MARGIN
from dearig.model.readings.records import ActuatorRecord, Record
from dearig.model.verdict import is_rejected

__all__ = ["Dependence", "Signature", "signatures"]

_BY_CHANCE = 1e-3  # significance level of the test for a white spectrum
_BINS = 24
_SHARE = 0.03  # of the residual's variance beyond chance: below, there is no dependence
_REPORTED_SHARE = 0.1  # the same, for a sentence


@dataclass(frozen=True)
class Dependence:
    """How the residual depends on one quantity: bin centres ``at`` (B,) and bin means.

    ``loading`` and ``unloading`` (B,) are the means of the residual where the quantity rises and
    where it falls (NaN where a bin is empty); ``error`` (B,) is the standard error of the bin mean
    if the residual were noise. ``explained`` is the share of the residual's variance that a
    function of this quantity alone explains, 0 to 1, beyond what noise would give.
    """

    quantity: str
    unit: str
    at: np.ndarray
    loading: np.ndarray
    unloading: np.ndarray
    error: np.ndarray
    explained: float


@dataclass(frozen=True)
class Signature:
    """Description of the residual of one record.

    ``time``, ``residual`` (N,): measured less model, in the measured unit. ``noise`` is the floor
    of one of these samples. ``ljung_box_p`` and ``runs_p`` are the probabilities that noise as
    that at rest is as correlated, and changes its sign as rarely. ``is_noise`` is by these, by its
    size and spectrum (``dearig.model.fitting.rejection``), and by its ``dependences``. ``noise_p``
    is the probability by all tests. ``frequency`` Hz and ``density`` (F,) are its power spectral
    density (unit^2/Hz), ``floor_density`` that of the noise. ``words`` are sentences on what is
    remarkable.
    """

    record: str
    time: np.ndarray
    residual: np.ndarray
    noise: float
    rms: float
    ljung_box_p: float
    runs_p: float
    correlation_time: float
    frequency: np.ndarray
    density: np.ndarray
    floor_density: float
    dependences: tuple[Dependence, ...]
    loading_less_unloading: float
    first_less_repeats: float
    is_noise: bool
    words: tuple[str, ...]
    noise_p: float | None = None


class _Scaled(Protocol):
    sigma: np.ndarray


class _Fitted(Protocol):
    """A fit: ``residuals`` (N,) are model less measured over the noise ``problem.sigma``."""

    @property
    def problem(self) -> _Scaled: ...

    @property
    def residuals(self) -> np.ndarray: ...


def signatures(records: Sequence[Record], trial: _Fitted) -> tuple[Signature, ...]:
    """Return the signature of the residual of each of ``records`` under the model of ``trial``."""
    found, start = [], 0
    for record in records:
        part = slice(start, start + record.measured.size)
        start = part.stop
        sigma = trial.problem.sigma[part]
        good = np.isfinite(sigma)
        # masked readings show as zero and do not count
        residual = np.where(good, -trial.residuals[part] * record.noise, 0.0)
        found.append(_signature(record, residual, good))
    return tuple(found)


def _signature(record: Record, residual: np.ndarray, good: np.ndarray) -> Signature:
    time, noise = record.time, record.noise
    step = float(np.median(np.diff(time)))
    quantities, up = _quantities(record, record.measured - residual, step)
    # at rest there is neither loading nor unloading
    moving = np.abs(up) > 0.02 * float(np.max(np.abs(up)) or 1.0)
    used = residual[good]
    rest, averaged = None, False
    if isinstance(record, ActuatorRecord):
        rest = record.displacement[: record.lead_in][good[: record.lead_in]]
        averaged = record.average > 1
    test = noise_test(used, rest, averaged=averaged)
    dependences = tuple(
        _dependence(n, u, q[good], used, up[good], moving[good], test.apart)
        for n, u, q in quantities
    )
    from scipy.signal import welch  # takes a second to import

    frequency, density = welch(
        residual, 1.0 / step, nperseg=min(max(time.size // 6, 64), 4096, time.size)
    )
    # masked stretches have no power
    density = density / float(np.mean(good))
    rms = float(np.sqrt(np.mean(used**2)))
    along = dependences[1] if isinstance(record, ActuatorRecord) else dependences[0]
    difference = along.loading - along.unloading
    loops = float(np.nanmean(difference)) if np.isfinite(difference).any() else 0.0
    repeats = _first_less_repeats(record, residual, good)
    # the noise of a film record is a tolerance, whose spectrum need not be flat
    sensed = isinstance(record, ActuatorRecord)
    uneven = unevenness(used, _BY_CHANCE) if sensed else 0.0
    is_small = rms < NOISE_MARGIN * noise if test.size is None else True
    is_independent = all(d.explained < _SHARE for d in dependences)
    is_noise = is_small and is_independent and not (sensed and is_rejected(test.p))
    return Signature(
        record=record.name,
        time=time,
        residual=residual,
        noise=noise,
        rms=rms,
        ljung_box_p=test.ljung_box,
        runs_p=test.runs,
        correlation_time=correlation_time(used) * step,
        frequency=frequency[1:],
        density=density[1:],
        floor_density=2.0 * noise**2 * step,
        dependences=dependences,
        loading_less_unloading=loops,
        first_less_repeats=repeats,
        is_noise=is_noise,
        words=_words(
            record, rms, is_noise, dependences, loops, repeats, frequency, density, step, uneven
        ),
        noise_p=test.p if sensed else None,
    )


def _quantities(
    record: Record, model: np.ndarray, step: float
) -> tuple[list[tuple[str, str, np.ndarray]], np.ndarray]:
    """Return name, unit and values (N,) of what a residual may depend on, and the rate (N,).

    ``model`` (N,) is the model's reading at samples ``step`` s apart.
    """
    time = record.time
    if not isinstance(record, ActuatorRecord):
        up = np.gradient(record.stretch, time)
        return [
            ("stretch", "", record.stretch),
            ("rate of stretch", "1/s", up),
            ("stress", "kPa", model * 1e-3),
            ("time", "s", time),
        ], up
    # wide enough for the sign of the rate in a noisy reading
    window = max(3, round(0.02 / step))
    smooth = np.convolve(np.pad(model, window // 2, mode="edge"), np.ones(window) / window, "valid")
    rate = np.gradient(smooth[: time.size], time)
    return [
        ("voltage squared", "kV^2", (record.drive.voltage * 1e-3) ** 2),
        ("displacement", "mm", model * 1e3),
        ("rate", "mm/s", rate * 1e3),
        ("time", "s", time),
    ], rate


def _dependence(
    name: str,
    unit: str,
    quantity: np.ndarray,
    residual: np.ndarray,
    up: np.ndarray,
    moving: np.ndarray,
    apart: float,
) -> Dependence:
    """Return how a residual depends on a ``quantity``; noise is correlated over ``apart``."""
    low, high = float(quantity.min()), float(quantity.max())
    edges = np.linspace(low, high if high > low else low + 1.0, _BINS + 1)
    index = np.clip(np.searchsorted(edges, quantity, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(index, minlength=_BINS)
    total = np.bincount(index, residual, _BINS)
    variance = float(np.var(residual)) or 1.0
    filled = count > 0
    centred = total[filled] / count[filled] - residual.mean()
    between = float(np.sum(count[filled] * centred**2)) / residual.size
    by_chance = apart * np.count_nonzero(filled) * variance / residual.size
    return Dependence(
        quantity=name,
        unit=unit,
        at=0.5 * (edges[1:] + edges[:-1]),
        loading=_means(index, residual, moving & (up > 0.0)),
        unloading=_means(index, residual, moving & (up < 0.0)),
        error=math.sqrt(variance) / np.sqrt(np.maximum(count, 1)),
        explained=min(max((between - by_chance) / variance, 0.0), 1.0),
    )


def _means(index: np.ndarray, residual: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Return the mean residual in each bin over the samples ``which`` (N,); NaN where empty."""
    count = np.bincount(index[which], minlength=_BINS)
    total = np.bincount(index[which], residual[which], _BINS)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _first_less_repeats(record: Record, residual: np.ndarray, good: np.ndarray) -> float:
    """Return the RMS change of the residual from the first period of the drive to the second.

    The part of noise is subtracted. NaN where the drive is not periodic.
    """
    drive = record.drive.voltage if isinstance(record, ActuatorRecord) else record.stretch - 1.0
    active = np.flatnonzero(np.abs(drive) > 1e-3 * float(np.max(np.abs(drive)) or 1.0))
    if active.size < 200 or np.ptp(np.diff(record.time)) > 0.01 * np.median(np.diff(record.time)):
        return math.nan
    first, last = int(active[0]), int(active[-1])
    x = drive[first : last + 1]
    n = x.size
    lags = np.arange(n // 5, n // 2 + 2)
    lags = lags[lags < n]
    # mean square of x(t + lag) - x(t): a correlation is biased by the ends
    energy = np.concatenate([[0.0], np.cumsum(x**2)])
    match = np.fft.irfft(np.abs(np.fft.rfft(x, 2 * n)) ** 2)[lags]
    apart = (energy[n] - energy[lags] + energy[n - lags] - 2.0 * match) / (n - lags)
    lag = int(lags[np.argmin(apart)])
    if np.max(np.abs(x[lag:] - x[:-lag])) < 0.02 * np.max(np.abs(x)):
        late, early = slice(first + lag, last + 1), slice(first, last + 1 - lag)
        change = (residual[late] - residual[early])[good[late] & good[early]]
        if change.size:
            return math.sqrt(max(float(np.mean(change**2)) - 2.0 * record.noise**2, 0.0))
    return math.nan


def _words(
    record: Record,
    rms: float,
    is_noise: bool,
    dependences: tuple[Dependence, ...],
    loops: float,
    repeats: float,
    frequency: np.ndarray,
    density: np.ndarray,
    step: float,
    uneven: float,
) -> tuple[str, ...]:
    unit, scale = ("um", 1e6) if isinstance(record, ActuatorRecord) else ("kPa", 1e-3)
    words = [
        f"{rms * scale:.3g} {unit} RMS, {rms / record.noise:.3g} times the noise floor of "
        f"{record.noise * scale:.3g} {unit}" + (": only noise is left" if is_noise else "")
    ]
    if is_noise:
        return tuple(words)
    reported = [d for d in dependences if d.explained > _REPORTED_SHARE]
    words += [
        f"{100 * d.explained:.0f} % of its variance depends on {d.quantity} alone"
        for d in sorted(reported, key=lambda d: -d.explained)
    ]
    if abs(loops) > 0.3 * rms:
        higher = "higher" if loops > 0.0 else "lower"
        words.append(f"{abs(loops) * scale:.3g} {unit} {higher} on loading than on unloading")
    if repeats > 0.5 * rms:
        words.append(
            f"the second period differs from the first by {repeats * scale:.3g} {unit} RMS: "
            f"the film has memory"
        )
    peak = int(np.argmax(density[1:])) + 1
    floor = 2.0 * record.noise**2 * step
    if frequency[peak] > 2.0 and density[peak] > 20.0 * floor:
        words.append(f"its spectrum has a line at {frequency[peak]:.3g} Hz")
    elif uneven:
        words.append(
            f"at least {100 * uneven:.0f} % of its power is not white noise; the spectrum peaks at "
            f"{frequency[peak]:.3g} Hz"
        )
    return tuple(words)
