"""What a recording asks of a model, compared with what the training recordings have shown.

A film is nearly linear about its path, so that what recordings show of its response is told by
bands of frequency. In a band in which the training recordings move the film by x, in units of the
noise, least squares knows the response (a gain in phase and one in quadrature) to a relative error
of

    e^2 = min(1, 2 / sum x^2)                                                        (10)

whatever law the model has. A recording that moves the film by y in that band may therefore be
mispredicted by e y. Slow bands are rests and holds, fast ones are edges.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.verdict import TOLERANCE

__all__ = [
    "BANDS",
    "LEVELS",
    "Beyond",
    "Excitation",
    "FrequencyBand",
    "PredictedRun",
    "Tested",
    "TrainingRange",
    "excitation",
    "range_of",
    "shown_by",
]

#: Where training shows too little.
LEVELS, BANDS = "levels", "bands"

_COMPONENTS = 2.0  # of a gain in one band: in phase and in quadrature
_ALLOWED = TOLERANCE**2 - 1.0  # mean square over that of the noise that counts as noise too
_HALF = 0.5  # of the error above the noise: the better part
_LEVEL_RATIO = 1.05  # of the highest voltage to that of the training recordings


@dataclass(frozen=True)
class PredictedRun:
    """One recording: ``drive`` (N,) V and what a model makes of it, ``response`` (N,) m.

    Samples are ``step`` s apart; ``noise`` m is the standard deviation of one reading.
    """

    name: str
    step: float
    drive: np.ndarray
    response: np.ndarray
    noise: float

    def energies(self, edges: np.ndarray, values: np.ndarray | None = None) -> np.ndarray:
        """Return the sum of squares (B,) of the response, or of ``values``, in units of the noise.

        ``edges`` (B + 1,) Hz are those of bands.
        """
        x = (self.response if values is None else values) / self.noise
        # a recording does not end where it began: the jump between its ends would be in every band
        x = x - np.linspace(x[0], x[-1], x.size)
        spectrum = np.abs(np.fft.rfft(x)) ** 2 / x.size
        spectrum[1 : (x.size + 1) // 2] *= 2.0
        found, _ = np.histogram(np.fft.rfftfreq(x.size, self.step), edges, weights=spectrum)
        return found


@dataclass(frozen=True)
class FrequencyBand:
    """A band of frequency, in Hz: what a recording asks there, and what training has shown.

    ``asked`` is the RMS of the response over the whole recording, in noises; ``known`` is the
    relative error to which training has shown it, 1 where it has shown nothing. ``excess`` is the
    mean square of the recording's error above that of the noise, in squares of the noise.
    """

    low: float
    high: float
    asked: float
    known: float
    excess: float

    @property
    def open(self) -> float:
        """Mean square, in squares of the noise, of what training leaves open."""
        return (self.asked * self.known) ** 2


@dataclass(frozen=True)
class Excitation:
    """What the recording ``name`` asks, band by band.

    ``shown`` (B,) are the training recordings' energies in the bands. ``above`` is the part of the
    error above the noise at voltages or displacements that training does not reach.
    """

    name: str
    bands: tuple[FrequencyBand, ...]
    shown: tuple[float, ...]
    above: float = 0.0

    @property
    def edges(self) -> np.ndarray:
        """Edges of the bands (B + 1,) in Hz."""
        return np.array([self.bands[0].low, *(b.high for b in self.bands)])

    @property
    def open_rms(self) -> float:
        """RMS, in noises, of what the training recordings leave open of the response."""
        return math.sqrt(sum(b.open for b in self.bands))

    @property
    def undetermined(self) -> tuple[FrequencyBand, ...]:
        """Bands that training does not determine, of rising frequency.

        Without them, what is left open would be noise.
        """
        return _undetermined(self.bands)

    @property
    def share(self) -> float:
        """Part of the error above the noise that lies in the bands that are not determined."""
        total = sum(max(b.excess, 0.0) for b in self.bands)
        lies = sum(max(b.excess, 0.0) for b in self.undetermined)
        return lies / total if total > 0.0 else 0.0

    @property
    def cause(self) -> str:
        """Where most of the error above the noise is and training shows too little.

        ``levels`` are voltages and displacements that training does not reach, ``bands`` the bands
        that are not determined, and "" says that most of the error is elsewhere.
        """
        if self.above > _HALF:
            return LEVELS
        return BANDS if self.share > _HALF else ""

    def after(self, motion: PredictedRun) -> Excitation:
        """Return what is asked, if training had one more recording with this ``motion``."""
        shown = motion.energies(self.edges) + np.array(self.shown)
        bands = (replace(b, known=float(k)) for b, k in zip(self.bands, _known(shown), strict=True))
        return replace(self, bands=tuple(bands), shown=tuple(shown.tolist()))


@dataclass(frozen=True)
class Tested:
    """How far recordings test a model: highest voltage V, fastest edge V/s, lowest and highest Hz.

    The frequencies are those at which the response is more than noise.
    """

    voltage: float
    rate: float
    low: float
    high: float


@dataclass(frozen=True)
class Beyond:
    """Where a recording goes beyond what training has shown.

    ``levels``: to voltages or displacements that training does not reach. ``bands`` are those of
    frequency that training does not determine.
    """

    levels: bool
    bands: tuple[FrequencyBand, ...]


@dataclass(frozen=True, eq=False)
class TrainingRange:
    """What training recordings have shown, also without them.

    ``energies`` (B,) are their sums of squares in units of the noise in bands with ``edges``
    (B + 1,) Hz. They reach ``voltage`` V, and displacements from ``low`` to ``high`` m.
    """

    edges: np.ndarray
    energies: np.ndarray
    voltage: float
    low: float
    high: float

    def further(self, asked: PredictedRun) -> np.ndarray:
        """Return where ``asked`` goes to levels that training does not reach, (N,) bool."""
        further = np.abs(asked.drive) > _LEVEL_RATIO * self.voltage
        further |= asked.response < self.low - asked.noise
        return np.asarray(further | (asked.response > self.high + asked.noise))

    def beyond(self, asked: PredictedRun) -> Beyond | None:
        """Return where ``asked`` goes beyond training; None where it does not.

        As a voltage may be, a displacement may be higher by a part that is not counted.
        """
        edges, shown = self.edges, self.energies
        if 0.5 / asked.step > edges[-1]:
            # faster than any training recording was sampled
            edges, shown = np.append(edges, 0.5 / asked.step), np.append(shown, 0.0)
        asks = asked.energies(edges) / asked.response.size
        known = _known(shown)
        bands = tuple(
            FrequencyBand(float(low), float(high), math.sqrt(a), float(k), 0.0)
            for low, high, a, k in zip(edges[:-1], edges[1:], asks, known, strict=True)
        )
        more = (_LEVEL_RATIO - 1.0) * (self.high - self.low)
        nearly = replace(self, low=self.low - more, high=self.high + more)
        found = Beyond(bool(nearly.further(asked).any()), _undetermined(bands))
        return found if found.levels or found.bands else None


def shown_by(train: Sequence[PredictedRun], edges: np.ndarray | None = None) -> TrainingRange:
    """Return what the recordings ``train`` have shown, in bands with ``edges`` (B + 1,) Hz."""
    edges = _edges(train) if edges is None else edges
    return TrainingRange(
        edges,
        np.sum([motion.energies(edges) for motion in train], axis=0),
        max(float(np.max(np.abs(m.drive))) for m in train),
        min(float(np.min(m.response)) for m in train),
        max(float(np.max(m.response)) for m in train),
    )


def excitation(train: Sequence[PredictedRun], asked: PredictedRun, error: np.ndarray) -> Excitation:
    """Return what the recording ``asked`` asks beyond ``train``.

    ``error`` (N,) m is measured minus model there, NaN where a reading must not be used.
    """
    edges = _edges([*train, asked])
    shown = shown_by(train, edges)
    known = _known(shown.energies)
    size = asked.response.size
    good = np.isfinite(error)
    left = np.where(good, error, 0.0)
    asks, errs = asked.energies(edges) / size, asked.energies(edges, left) / size
    # noise that is white has its power in proportion to the frequencies of a band
    noise = np.diff(np.minimum(edges, 0.5 / asked.step)) * 2.0 * asked.step
    bands = tuple(
        FrequencyBand(float(low), float(high), math.sqrt(a), float(k), float(e - n))
        for low, high, a, k, e, n in zip(
            edges[:-1], edges[1:], asks, known, errs, noise * np.mean(good), strict=True
        )
    )
    power = np.where(good, (left / asked.noise) ** 2 - 1.0, 0.0)
    total = float(np.sum(power))
    above = float(np.sum(power[shown.further(asked)])) / total if total > 0.0 else 0.0
    return Excitation(asked.name, bands, tuple(shown.energies.tolist()), above)


def range_of(motions: Iterable[PredictedRun]) -> Tested:
    """Return how far recordings of these ``motions`` test a model together."""
    every = list(motions)
    edges = _edges(every)
    seen = np.sum([m.energies(edges) for m in every], axis=0) > _COMPONENTS
    visible = np.flatnonzero(seen)
    first, last = (int(visible[0]), int(visible[-1])) if visible.size else (0, -1)
    return Tested(
        max(float(np.max(np.abs(m.drive))) for m in every),
        max(float(np.max(np.abs(np.diff(m.drive)))) / m.step for m in every),
        # the slowest band begins at 0: what is slower than a recording lasts does not show
        max(float(edges[first]), 1.0 / max(m.step * m.response.size for m in every)),
        float(edges[last + 1]),
    )


def _undetermined(bands: Sequence[FrequencyBand]) -> tuple[FrequencyBand, ...]:
    """Return those of ``bands`` without which what training leaves open would be noise."""
    left, found = sum(b.open for b in bands), []
    for band in sorted(bands, key=lambda b: -b.open):
        if left <= _ALLOWED:
            break
        found.append(band)
        left -= band.open
    return tuple(sorted(found, key=lambda b: b.low))


def _known(shown: np.ndarray) -> np.ndarray:
    """Return (10) of the energies ``shown`` (B,) in units of the noise."""
    return np.sqrt(np.minimum(1.0, _COMPONENTS / np.maximum(shown, _COMPONENTS)))


def _edges(motions: Sequence[PredictedRun]) -> np.ndarray:
    """Return the edges of octaves, from one period of the longest recording to the fastest rate."""
    longest = max(m.step * m.response.size for m in motions)
    highest = 0.5 / min(m.step for m in motions)
    octaves = max(int(math.log2(highest * longest)), 1)
    return np.array([0.0, *(highest * 2.0 ** -np.arange(octaves - 1, -1, -1.0))])
