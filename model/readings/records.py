"""Measured records for fits: arrays, and their noise."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.errors import ModelError
from dearig.model.readings.channels import ElectricRecord
from dearig.model.simulation.actuator import Drive

__all__ = ["ActuatorRecord", "FilmRecord", "Record", "counted", "interpolated", "mean_about"]

_MATCHING = 10  # iterations; each leaves a third of the error of the one before


def counted(displacement: np.ndarray, lead_in: int) -> np.ndarray:
    """``displacement`` (..., N) counted from its mean over the first ``lead_in`` samples, if any.

    As a record's is: what drifts or warms up does so before the film is driven, too.
    """
    if lead_in == 0:
        return displacement
    return np.asarray(displacement - displacement[..., :lead_in].mean(axis=-1, keepdims=True))


@dataclass(frozen=True)
class ActuatorRecord:
    """Displacement (N,) in m from the loaded rest state, under ``drive``.

    ``noise`` is the standard deviation of one reading in m. ``lag`` is the known time in s by which
    a reading is older than its time stamp (an averaging sensor), less the converter's skew: the
    model is evaluated at ``time - lag``; it is known within ``lag_error``. ``valid`` (N,) bool is
    False where a reading must not be used (a dropout, a clipped sensor), None where all are good.
    Over the first ``lead_in`` samples, at 0 V, the displacement is 0 on average, because it is
    counted from there. Each reading is the mean of ``means_of`` conversions that were taken evenly
    about its time; the rig recorded means of ``average``. ``coarse_drive``, where there is one, is
    the drive in fewer and longer steps (``dearig.model.fitting.coarse_drive``); the effect of a
    parameter is estimated with it. ``rounding`` m is the part of ``noise`` that is the step of
    coarse readings: neighbours are rounded alike, so that their mean keeps it. ``electric`` are the
    readings of the voltage monitor and the current of every sample; they stay as they are where the
    record is thinned. None where a recording has none.
    """

    name: str
    drive: Drive
    displacement: np.ndarray
    noise: float
    lag: float = 0.0
    valid: np.ndarray | None = None
    lead_in: int = 0
    means_of: int = 1
    average: int = 1
    lag_error: float = 0.0
    coarse_drive: Drive | None = None
    rounding: float = 0.0
    electric: ElectricRecord | None = None

    def __post_init__(self) -> None:
        _check(self.name, self.measured, self.drive.time, self.noise)

    @property
    def time(self) -> np.ndarray:
        """(N,) s."""
        return self.drive.time

    @property
    def measured(self) -> np.ndarray:
        """(N,) m."""
        return self.displacement

    def seen(self, displacement: np.ndarray) -> np.ndarray:
        """Return a ``displacement`` (..., N) as it is read: averaged, from the lead-in's mean."""
        return counted(mean_about(displacement, self.means_of), self.lead_in)

    def coarse(self, rate: float) -> ActuatorRecord:
        """Return the record at about ``rate`` Hz or less, in means of neighbours."""
        step = float(np.median(np.diff(self.time)))
        # steps of a clock are equal only within rounding: 4.9999999 samples are 5
        return self.in_means(int(1.0 / (rate * step) + 1e-6))

    def _noise_of_means(self, every: int) -> float:
        kept = min(self.rounding, self.noise)
        return math.sqrt((self.noise**2 - kept**2) / every + kept**2)

    def in_means(self, every: int) -> ActuatorRecord:
        """Return the record in means of ``every`` readings, with less noise.

        The voltage between two means is linear, and pulls as much over the time of each as the
        voltage that was applied: the mean of its square is the same.
        """
        if every < 2:
            return self
        steps = np.diff(self.time)
        count = self.time.size // every
        rows = np.arange(count * every).reshape(count, every)
        t = self.time[rows].mean(axis=1)
        starts, last = self.time[rows[:, 0]], self.time[rows[-1, -1]]
        before = np.append(steps[:1], steps)[rows[:, 0]]
        edges = np.append(starts - 0.5 * before, last + 0.5 * steps[-1])
        drive = Drive(
            t, _pulling_alike(self.drive, edges), hold=False,
            temperature=self.drive.temperature, humidity=self.drive.humidity,
        )  # fmt: skip
        for name in ("warmth", "moisture"):
            values = getattr(self.drive, name)
            if values is not None:
                drive = replace(drive, **{name: values[rows].mean(axis=1)})
        valid = None if self.valid is None else np.all(self.valid[rows], axis=1)
        return replace(
            self,
            drive=drive,
            displacement=self.displacement[rows].mean(axis=1),
            noise=self._noise_of_means(every),
            valid=valid,
            lead_in=self.lead_in // every,
            means_of=every * self.means_of,
        )


def mean_about(values: np.ndarray, many: int) -> np.ndarray:
    """Return means over intervals of ``many`` readings, centred on ``values`` (..., N).

    Of as many samples of each interval, evenly spaced. From neighbours, to the fourth order in the
    interval's length; the ends are copied.
    """
    if many == 1:
        return values
    # the mean of a sine, as a series in its phase per interval
    bend = (1.0 - many**-2.0) / 24.0
    curl = 1.0 / 1920.0 - many**-2.0 / 576.0 + 7.0 * many**-4.0 / 5760.0 - bend / 12.0
    means = values.copy()
    second = np.diff(values, 2)
    means[..., 1:-1] += bend * second
    means[..., 2:-2] += curl * np.diff(second, 2)
    return means


def _pulling_alike(drive: Drive, edges: np.ndarray) -> np.ndarray:
    """Return voltages (N,) between ``edges`` (N + 1,), linear, with the mean square of ``drive``.

    Between each two of the edges the mean of the square is that of the drive, as far as a square
    can be made so.
    """
    at = np.union1d(drive.time, edges)
    if drive.hold:
        place = np.searchsorted(drive.time, at, side="right") - 1
        v = drive.voltage[np.maximum(place, 0)]
        squares = v[:-1] ** 2
        means = v[:-1]
    else:
        v = np.interp(at, drive.time, drive.voltage)
        squares = (v[:-1] ** 2 + v[:-1] * v[1:] + v[1:] ** 2) / 3.0
        means = 0.5 * (v[:-1] + v[1:])
    widths = np.diff(at)
    inside = np.searchsorted(at, edges)

    def mean(values: np.ndarray) -> np.ndarray:
        total = np.append(0.0, np.cumsum(values * widths))[inside]
        return np.asarray(np.diff(total) / np.diff(edges))

    wanted, sign = mean(squares), np.where(mean(means) < 0.0, -1.0, 1.0)
    found = wanted.copy()
    for _ in range(_MATCHING):
        found = np.maximum(found + wanted - _mean_square(sign * np.sqrt(found)), 0.0)
    return np.asarray(sign * np.sqrt(found))


def _mean_square(voltage: np.ndarray) -> np.ndarray:
    """Return means (N,) of the square of linear ``voltage`` (N,), half-way to each neighbour."""
    to_next = np.diff(voltage, append=voltage[-1])
    to_last = np.diff(voltage[::-1], append=voltage[0])[::-1]
    halves = [voltage**2 + 0.5 * voltage * to + to**2 / 12.0 for to in (to_next, to_last)]
    return 0.5 * (halves[0] + halves[1])


@dataclass(frozen=True)
class FilmRecord:
    """Nominal stress (N,) in Pa under an imposed ``stretch`` (N,) at ``time`` (N,) s.

    ``valid`` as in an ``ActuatorRecord``.
    """

    name: str
    time: np.ndarray
    stretch: np.ndarray
    stress: np.ndarray
    noise: float
    valid: np.ndarray | None = None

    def __post_init__(self) -> None:
        for name in ("time", "stretch", "stress"):
            object.__setattr__(
                self, name, np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            )
        _check(self.name, self.stress, self.time, self.noise)
        _check(self.name, self.stretch, self.time, self.noise)

    @property
    def measured(self) -> np.ndarray:
        """(N,) Pa."""
        return self.stress

    def coarse(self, samples: int) -> FilmRecord:
        """Return the record in at most about ``samples`` means of neighbours; the ends are kept."""
        every = self.time.size // samples
        if every < 2:
            return self
        count = (self.time.size - 1) // every
        rows = 1 + np.arange(count * every).reshape(count, every)

        def thin(values: np.ndarray) -> np.ndarray:
            return np.concatenate([values[:1], values[rows].mean(axis=1)])

        return replace(
            self,
            time=thin(self.time),
            stretch=thin(self.stretch),
            stress=thin(self.stress),
            noise=self.noise / math.sqrt(every),
            valid=None
            if self.valid is None
            else np.concatenate([self.valid[:1], self.valid[rows].all(axis=1)]),
        )


Record = ActuatorRecord | FilmRecord


def interpolated(time: np.ndarray, values: np.ndarray, valid: np.ndarray | None) -> np.ndarray:
    """Return ``values`` (N,) with straight lines across what is not ``valid`` (N,)."""
    if valid is None or not valid.any():
        return values
    return np.where(valid, values, np.interp(time, time[valid], values[valid]))


def _check(name: str, values: np.ndarray, time: np.ndarray, noise: float) -> None:
    if values.shape != time.shape:
        raise ModelError(f"{name}: {values.size} readings at {time.size} times")
    bad = np.flatnonzero(~(np.isfinite(values) & np.isfinite(time)))
    if bad.size:
        raise ModelError(f"{name}: sample {bad[0]} is not a finite number")
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        raise ModelError(
            f"{name}: time does not increase from sample {back[0]} ({time[back[0]]:.6g} s) to the "
            f"next ({time[back[0] + 1]:.6g} s)"
        )
    if not (math.isfinite(noise) and noise > 0.0):
        raise ModelError(f"{name}: noise = {noise!r} must be a finite number above 0")
