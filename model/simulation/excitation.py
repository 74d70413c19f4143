"""Voltage over time: thesis eq. 49 and the general sequence, as functions of exact time.

A segment is an immutable value with a duration, a voltage at its start and at its end, and its
voltage in between. A sequence joins segments; where two do not meet, it refuses and says what to
do. Sampling evaluates the exact function at the ticks of the output clock: boundaries need not
fall on ticks (the thesis's lobes of 1/0.6 s never do).

One piece: each kind of segment is some forty lines that rest on the same few.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol, cast

import numpy as np

from dearig.model.errors import ModelError

__all__ = [
    "THESIS_AMPLITUDES",
    "THESIS_FREQUENCIES",
    "Chirp",
    "HalfSine",
    "Hold",
    "Lobes",
    "Multisine",
    "Ramp",
    "Sampled",
    "Segment",
    "Sequence",
    "Sine",
    "Steps",
    "Triangle",
]

THESIS_AMPLITUDES = (6.0e3, 6.5e3, 7.0e3, 7.5e3, 8.0e3)  #: V, a_i = 5.5 + 0.5 i kV
THESIS_FREQUENCIES = (0.2, 0.4, 0.6, 0.8, 1.0)  #: Hz, f_i = 0.2 i

_JOIN_TOLERANCE = 1e-3  # V: far below the converter's step, far above rounding
_SAMPLES_MAX = 400_000_000  # 3 GB of voltage: a typing error, not a plan


class Segment(Protocol):
    """A piece of a sequence."""

    @property
    def duration(self) -> float:
        """S."""
        ...

    @property
    def start(self) -> float:
        """Voltage at its first instant, V."""
        ...

    @property
    def end(self) -> float:
        """Voltage at its last instant, V."""
        ...

    def voltage(self, t: np.ndarray) -> np.ndarray:
        """Voltage in V at times ``t`` (N,) in s since its start, 0 <= t <= duration."""
        ...

    def after(self, end: float) -> Segment:
        """The segment following a voltage of ``end`` V: fills in a start that was left open."""
        ...


def _require(kind: str, **values: float) -> None:
    for name, value in values.items():
        if not math.isfinite(value):
            raise ModelError(f"{kind}: {name} = {value!r} must be a finite number")


def _require_positive(kind: str, **values: float) -> None:
    _require(kind, **values)
    for name, value in values.items():
        if value <= 0.0:
            raise ModelError(f"{kind}: {name} = {value!r} must be above 0")


def _between(start: float | np.ndarray, target: float | np.ndarray, part: np.ndarray) -> np.ndarray:
    """Voltage a ``part`` of the way: both ends are met exactly, and rounding passes neither.

    A limit that a ramp ends at must not be broken by the last bit of its last sample.
    """
    v = start * (1.0 - part) + target * part
    return np.clip(v, np.minimum(start, target), np.maximum(start, target))


class _Fixed:
    """A segment whose start does not depend on what came before."""

    def after(self, end: float) -> Segment:  # noqa: ARG002
        return self  # type: ignore[return-value]


class _FromZero(_Fixed):
    """A segment that starts and ends at 0 V."""

    @property
    def start(self) -> float:
        return 0.0

    @property
    def end(self) -> float:
        return 0.0


@dataclass(frozen=True)
class HalfSine(_FromZero):
    """One unipolar lobe, v = a sin(pi f t) for 0 <= t <= 1/f (one line of eq. 49)."""

    amplitude: float
    frequency: float

    def __post_init__(self) -> None:
        _require("half_sine", amplitude=self.amplitude)
        _require_positive("half_sine", frequency=self.frequency)

    @property
    def duration(self) -> float:
        return 1.0 / self.frequency

    def voltage(self, t: np.ndarray) -> np.ndarray:
        # sin(pi) is -1e-16 in floating point, and a unipolar rig refuses any negative voltage
        return self.amplitude * np.maximum(np.sin(np.pi * self.frequency * t), 0.0)


@dataclass(frozen=True)
class Lobes(_FromZero):
    """Eq. 49: ``periods`` times the half-sine lobes of ``amplitudes`` V and ``frequencies`` Hz."""

    amplitudes: tuple[float, ...] = THESIS_AMPLITUDES
    frequencies: tuple[float, ...] = THESIS_FREQUENCIES
    periods: int = 1

    def __post_init__(self) -> None:
        if not len(self.amplitudes) == len(self.frequencies) > 0:
            raise ModelError(
                f"thesis: {len(self.amplitudes)} amplitudes and {len(self.frequencies)} "
                f"frequencies; each lobe takes one of both"
            )
        if self.periods < 1:
            raise ModelError(f"thesis: periods = {self.periods} must be 1 or more")
        for lobe in self._lobes:
            lobe.__post_init__()

    @property
    def _lobes(self) -> tuple[HalfSine, ...]:
        return tuple(HalfSine(a, f) for a, f in zip(self.amplitudes, self.frequencies, strict=True))

    @property
    def period(self) -> float:
        """Length of the five lobes, the sum of 1/f_i, in s."""
        return math.fsum(1.0 / f for f in self.frequencies)

    @property
    def duration(self) -> float:
        return self.periods * self.period

    def voltage(self, t: np.ndarray) -> np.ndarray:
        within = np.mod(t, self.period)
        edges = np.concatenate(([0.0], np.cumsum([1.0 / f for f in self.frequencies])))
        v = np.empty_like(within)
        # times in order meet one lobe after another, and each lobe once in a period
        order = None if (np.diff(within) >= 0.0).all() else np.argsort(within, kind="stable")
        ticks = within if order is None else within[order]
        cuts = np.searchsorted(ticks, edges)
        cuts[0], cuts[-1] = 0, ticks.size
        for i, (a, f) in enumerate(zip(self.amplitudes, self.frequencies, strict=True)):
            inside = slice(cuts[i], cuts[i + 1])
            lobe = a * np.maximum(np.sin(np.pi * f * (ticks[inside] - edges[i])), 0.0)
            v[inside if order is None else order[inside]] = lobe
        v[t >= self.duration] = 0.0
        return v


@dataclass(frozen=True)
class Sine(_Fixed):
    """offset + a sin(2 pi f t + phase), for ``cycles`` periods; phase in rad."""

    amplitude: float
    frequency: float
    cycles: float = 1.0
    offset: float = 0.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        _require("sine", amplitude=self.amplitude, offset=self.offset, phase=self.phase)
        _require_positive("sine", frequency=self.frequency, cycles=self.cycles)

    @property
    def duration(self) -> float:
        return self.cycles / self.frequency

    @property
    def start(self) -> float:
        return self.offset + self.amplitude * math.sin(self.phase)

    @property
    def end(self) -> float:
        return self.offset + self.amplitude * math.sin(2.0 * math.pi * self.cycles + self.phase)

    def voltage(self, t: np.ndarray) -> np.ndarray:
        return self.offset + self.amplitude * np.sin(2.0 * np.pi * self.frequency * t + self.phase)


@dataclass(frozen=True)
class Triangle(_FromZero):
    """From 0 to ``amplitude`` and back in 1/f, both ways at one slope."""

    amplitude: float
    frequency: float

    def __post_init__(self) -> None:
        _require("triangle", amplitude=self.amplitude)
        _require_positive("triangle", frequency=self.frequency)

    @property
    def duration(self) -> float:
        return 1.0 / self.frequency

    def voltage(self, t: np.ndarray) -> np.ndarray:
        return self.amplitude * np.maximum(1.0 - np.abs(2.0 * self.frequency * t - 1.0), 0.0)


@dataclass(frozen=True)
class Ramp:
    """Straight from ``origin`` (None: where the segment before ended) to ``target`` V."""

    target: float
    length: float
    origin: float | None = None

    def __post_init__(self) -> None:
        _require("ramp", target=self.target, origin=self.origin or 0.0)
        _require_positive("ramp", duration=self.length)

    @property
    def duration(self) -> float:
        return self.length

    @property
    def start(self) -> float:
        return 0.0 if self.origin is None else self.origin

    @property
    def end(self) -> float:
        return self.target

    def voltage(self, t: np.ndarray) -> np.ndarray:
        return _between(self.start, self.target, np.clip(t / self.length, 0.0, 1.0))

    def after(self, end: float) -> Segment:
        return replace(self, origin=end) if self.origin is None else self


@dataclass(frozen=True)
class Hold:
    """One voltage (``level`` None: where the segment before ended) for ``length`` s."""

    length: float
    level: float | None = None

    def __post_init__(self) -> None:
        _require("hold", voltage=self.level or 0.0)
        _require_positive("hold", duration=self.length)

    @property
    def duration(self) -> float:
        return self.length

    @property
    def start(self) -> float:
        return 0.0 if self.level is None else self.level

    @property
    def end(self) -> float:
        return self.start

    def voltage(self, t: np.ndarray) -> np.ndarray:
        return np.full_like(t, self.start)

    def after(self, end: float) -> Segment:
        return replace(self, level=end) if self.level is None else self


@dataclass(frozen=True)
class Steps:
    """A staircase: each level is reached by a ramp of ``rise`` s and kept, ``dwell`` s in all."""

    levels: tuple[float, ...]
    dwell: float
    rise: float = 0.01
    origin: float | None = None

    def __post_init__(self) -> None:
        if not self.levels:
            raise ModelError("steps: levels is empty; give at least one voltage")
        _require("steps", origin=self.origin or 0.0)
        _require("steps", **{f"levels[{i}]": v for i, v in enumerate(self.levels)})
        _require_positive("steps", dwell=self.dwell, rise=self.rise)
        if self.rise > self.dwell:
            raise ModelError(f"steps: rise = {self.rise} s is longer than dwell = {self.dwell} s")

    @property
    def duration(self) -> float:
        return self.dwell * len(self.levels)

    @property
    def start(self) -> float:
        return 0.0 if self.origin is None else self.origin

    @property
    def end(self) -> float:
        return self.levels[-1]

    def voltage(self, t: np.ndarray) -> np.ndarray:
        i = np.clip((t / self.dwell).astype(np.int64), 0, len(self.levels) - 1)
        steps = np.array((self.start, *self.levels))
        part = np.clip((t - i * self.dwell) / self.rise, 0.0, 1.0)
        return _between(steps[i], steps[i + 1], part)

    def after(self, end: float) -> Segment:
        return replace(self, origin=end) if self.origin is None else self


def _taper(t: np.ndarray, duration: float, taper: float) -> np.ndarray:
    """Raised cosine from 0 to 1 within ``taper`` s of either end."""
    if taper == 0.0:
        return np.ones_like(t)
    nearest = np.clip(np.minimum(t, duration - t) / taper, 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * nearest))


class _AboutOffset:
    """A segment of ``length`` s from ``offset`` V (None: where the one before ended) and back."""

    length: float
    offset: float | None

    @property
    def duration(self) -> float:
        return self.length

    @property
    def start(self) -> float:
        return 0.0 if self.offset is None else self.offset

    @property
    def end(self) -> float:
        return self.start

    def after(self, end: float) -> Segment:
        return cast(Segment, replace(self, offset=end) if self.offset is None else self)  # type: ignore[type-var]


@dataclass(frozen=True)
class Chirp(_AboutOffset):
    """A sine about ``offset`` whose frequency goes from ``low`` to ``high`` Hz in ``length`` s.

    The frequency grows exponentially (equal time in each octave) or, with ``linear``, evenly. A
    raised-cosine ``taper`` (s) at both ends makes it start and end at the offset (None: where the
    segment before ended).
    """

    amplitude: float
    low: float
    high: float
    length: float
    offset: float | None = None
    taper: float = 0.25
    linear: bool = False

    def __post_init__(self) -> None:
        _require("chirp", amplitude=self.amplitude, offset=self.offset or 0.0)
        _require_positive("chirp", low=self.low, high=self.high, duration=self.length)
        if not 0.0 < self.taper <= self.length / 2.0:
            raise ModelError(f"chirp: taper = {self.taper} s must lie in (0, {self.length / 2}] s")

    def voltage(self, t: np.ndarray) -> np.ndarray:
        ratio = math.log(self.high / self.low)
        if self.linear or abs(ratio) < 1e-9:
            cycles = self.low * t + (self.high - self.low) * t * t / (2.0 * self.length)
        else:
            cycles = self.low * self.length / ratio * np.expm1(ratio * t / self.length)
        swing = np.sin(2.0 * np.pi * cycles) * _taper(t, self.length, self.taper)
        return np.asarray(self.start + self.amplitude * swing)


@dataclass(frozen=True)
class Multisine(_AboutOffset):
    """Sines of ``frequencies`` Hz about ``offset``, Schroeder's phases, scaled to ``amplitude``.

    ``amplitude`` is the largest excursion from the offset, so that a limit is easy to keep.
    """

    amplitude: float
    frequencies: tuple[float, ...]
    length: float
    offset: float | None = None
    taper: float = 0.25

    def __post_init__(self) -> None:
        if not self.frequencies:
            raise ModelError("multisine: frequencies is empty; give at least one")
        _require("multisine", amplitude=self.amplitude, offset=self.offset or 0.0)
        _require_positive("multisine", duration=self.length)
        _require_positive(
            "multisine", **{f"frequencies[{i}]": f for i, f in enumerate(self.frequencies)}
        )
        if not 0.0 < self.taper <= self.length / 2.0:
            raise ModelError(
                f"multisine: taper = {self.taper} s must lie in (0, {self.length / 2}] s"
            )

    def _sum(self, t: np.ndarray) -> np.ndarray:
        n = len(self.frequencies)
        total = np.zeros_like(t)
        for k, f in enumerate(self.frequencies):
            # Schroeder (1970): a low crest, so that little of the range is lost
            total += np.sin(2.0 * np.pi * f * t - np.pi * k * (k + 1) / n)
        return total

    @cached_property
    def _crest(self) -> float:
        """Largest excursion of the sum; on a grid of its own, whatever the sample clock."""
        points = math.ceil(32.0 * max(self.frequencies) * self.length)
        grid = np.linspace(0.0, self.length, min(max(points, 64), 200_000))
        return float(np.max(np.abs(self._sum(grid) * _taper(grid, self.length, self.taper))))

    def voltage(self, t: np.ndarray) -> np.ndarray:
        shape = self._sum(t) * _taper(t, self.length, self.taper) / self._crest
        return np.asarray(self.start + self.amplitude * np.clip(shape, -1.0, 1.0))


@dataclass(frozen=True, eq=False)
class Sampled(_Fixed):
    """A waveform given by points: ``times`` (N,) s from 0, increasing; ``voltages`` (N,) V."""

    times: np.ndarray
    voltages: np.ndarray

    def __post_init__(self) -> None:
        times = np.asarray(self.times, dtype=np.float64)
        voltages = np.asarray(self.voltages, dtype=np.float64)
        if times.ndim != 1 or times.shape != voltages.shape or times.size < 2:
            raise ModelError(
                f"csv: needs two columns of one length of at least 2, "
                f"not {times.shape} and {voltages.shape}"
            )
        for name, values in (("time", times), ("voltage", voltages)):
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                raise ModelError(f"csv: {name} in row {bad[0] + 1} is not a finite number")
        back = np.flatnonzero(np.diff(times) <= 0.0)
        if back.size:
            raise ModelError(f"csv: time does not increase from row {back[0] + 1} to the next")
        object.__setattr__(self, "times", times - times[0])
        object.__setattr__(self, "voltages", voltages)

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    @property
    def start(self) -> float:
        return float(self.voltages[0])

    @property
    def end(self) -> float:
        return float(self.voltages[-1])

    def voltage(self, t: np.ndarray) -> np.ndarray:
        return np.asarray(np.interp(t, self.times, self.voltages))


def join(
    segments: Iterable[Segment], labels: tuple[str, ...] = ()
) -> tuple[list[Segment], list[tuple[int, str]]]:
    """Return the segments, each begun where the one before ends, and what does not join.

    Of each fault: the segment, counted from 0, and a sentence. ``labels`` are the kinds.
    """

    def label(i: int) -> str:
        return f"segment {i + 1} ({labels[i]})" if i < len(labels) else f"segment {i + 1}"

    end, joined = 0.0, []
    faults: list[tuple[int, str]] = []
    for i, open_segment in enumerate(segments):
        segment = open_segment.after(end)
        if abs(segment.start - end) > _JOIN_TOLERANCE:
            before = f"{label(i - 1)} ends" if i else "the lead-in ends"
            text = (
                f"{label(i)} starts at {segment.start * 1e-3:.6g} kV but {before} at "
                f"{end * 1e-3:.6g} kV: put a ramp between them"
            )
            faults.append((i, text))
        end = segment.end
        joined.append(segment)
    if abs(end) > _JOIN_TOLERANCE:
        last = len(joined) - 1
        text = (
            f"{label(last)} ends at {end * 1e-3:.6g} kV but the run ends at 0 kV: put a ramp to 0 "
            f"at the end"
        )
        faults.append((last, text))
    return joined, faults


@dataclass(frozen=True)
class Sequence:
    """Segments one after another, framed by a quiet lead-in and tail at 0 V (s).

    Building one joins its segments: each must start where the one before ended. The noise floor of
    a recording is read in the lead-in.
    """

    name: str
    segments: tuple[Segment, ...]
    lead_in: float = 2.0
    tail: float = 1.0
    labels: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        if not self.segments:
            raise ModelError("the sequence has no segment; give at least one")
        for name, value in (("lead_in", self.lead_in), ("tail", self.tail)):
            if not (math.isfinite(value) and value >= 0.0):
                raise ModelError(f"{name} = {value!r} s must be a finite number, 0 or more")
        joined, faults = join(self.segments, self.labels)
        if faults:
            raise ModelError(faults[0][1])
        object.__setattr__(self, "segments", tuple(joined))

    @classmethod
    def thesis(
        cls,
        amplitudes: Iterable[float] = THESIS_AMPLITUDES,
        frequencies: Iterable[float] = THESIS_FREQUENCIES,
        periods: int = 2,
        name: str = "thesis identification",
    ) -> Sequence:
        """The thesis's excitation, eq. 49; the defaults are the identification set."""
        return cls(name, (Lobes(tuple(amplitudes), tuple(frequencies), periods),))

    @cached_property
    def boundaries(self) -> np.ndarray:
        """Times in s at which segments start, and the one at which the last ends; read-only."""
        edges = [self.lead_in]
        for segment in self.segments:
            edges.append(edges[-1] + segment.duration)
        found = np.array(edges)
        found.setflags(write=False)
        return found

    @property
    def duration(self) -> float:
        """s, with lead-in and tail."""
        return float(self.boundaries[-1]) + self.tail

    def voltage(self, t: np.ndarray) -> np.ndarray:
        """Voltage in V at times ``t`` (N,) in s since the start of the run; 0 V outside it."""
        t = np.asarray(t, dtype=np.float64)
        v = np.zeros_like(t)
        order = np.argsort(t, kind="stable")
        v[order] = self._voltage_at(t[order])
        return v

    def ticks(self, rate: float) -> int:
        """Return the number of samples on a clock of ``rate`` Hz. Raises ``ModelError``."""
        if not (math.isfinite(rate) and rate > 0.0):
            raise ModelError(f"sample rate {rate!r} Hz must be a finite number above 0")
        count = self.duration * rate
        if not math.isfinite(count):
            raise ModelError(f"the sequence lasts {self.duration:.4g} s, too long at {rate:g} Hz")
        return math.ceil(count - 1e-9) + 1

    def window(self, rate: float, start: int, stop: int) -> np.ndarray:
        """Return the samples ``start`` to ``stop`` of ``sample(rate)``, without the others."""
        v = self._voltage_at(np.arange(start, stop, dtype=np.float64) / rate)
        if stop >= self.ticks(rate) and v.size:
            v[-1] = 0.0
        return v

    def sample(self, rate: float) -> tuple[np.ndarray, np.ndarray]:
        """``(time, voltage)`` (N,) at the ticks k/rate of a clock of ``rate`` Hz, ending at 0 V."""
        count = self.ticks(rate)
        if count > _SAMPLES_MAX:
            raise ModelError(
                f"the sequence lasts {self.duration:.4g} s, {count:.3g} samples at {rate:g} Hz; "
                f"at most {_SAMPLES_MAX:.0g} can be played: shorten it or lower the rate"
            )
        return np.arange(count, dtype=np.float64) / rate, self.window(rate, 0, count)

    def _voltage_at(self, ticks: np.ndarray) -> np.ndarray:
        """Voltage in V at times ``ticks`` (N,) s that do not decrease."""
        v = np.zeros(ticks.size)
        if not ticks.size:
            return v
        # of thousands of short segments only those that the times meet
        first = max(int(np.searchsorted(self.boundaries, ticks[0], side="right")) - 1, 0)
        last = int(np.searchsorted(self.boundaries, ticks[-1], side="right"))
        edges = self.boundaries[first : last + 1]
        cuts = np.searchsorted(ticks, edges)
        for i, segment in enumerate(self.segments[first:last]):
            inside = slice(cuts[i], cuts[i + 1])
            if inside.start < inside.stop:
                local = ticks[inside] - edges[i]
                v[inside] = segment.voltage(np.minimum(local, segment.duration, out=local))
        return v
