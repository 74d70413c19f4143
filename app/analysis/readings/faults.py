"""Faulty readings of one recording: where the sensor was clipped or stuck, or time jumps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from dearig.errors import InputError
from dearig.model.readings.records import interpolated
from dearig.model.readings.spikes import RINGING, spikes
from dearig.recording.reading.recording import Recording
from dearig.units import counted

__all__ = ["clipped", "gap_text", "gaps", "outliers", "place", "spikes_about", "stuck", "where"]

_LONG = 25  # readings of one value: more than noise of a fraction of a step leaves
#: Steps by which a parabola may fall over half of its flat top beyond either end: 3 where the top
#: is one step high, and one for the rounding and half a one for the noise.
_FALL = 4.5


def gaps(recording: Recording, moved: np.ndarray) -> Iterator[str]:
    """Yield a sentence for each harmless jump of time; refuse one where the film may have moved."""
    steps = np.diff(recording.time)
    typical = float(np.median(steps))
    span = float(np.ptp(moved)) or 1.0
    for i in map(int, np.flatnonzero(steps > 5.0 * typical)):
        before, after = steps[max(i - 10, 0) : i], steps[i + 1 : i + 11]
        # a logger that changes its rate has short steps on one side only
        around = [float(np.median(s)) for s in (before, after) if s.size]
        if len(around) < 2 or steps[i] < 5.0 * max(around):
            continue
        jump = f"time jumps by {steps[i]:.4g} s after {place(recording, i)}"
        around_it = moved[max(i - 3, 0) : i + 5]
        if float(np.ptp(around_it)) > 0.02 * span:
            raise InputError(
                f"{recording.path}: {jump}, and what drove the film meanwhile is not known; cut "
                f"the recording in two there, at rest"
            )
        yield f"{jump}; the drive is assumed constant meanwhile"


def _runs(values: np.ndarray, shortest: int) -> list[tuple[int, int]]:
    """Return ``(start, end)`` of runs of at least ``shortest`` equal samples."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    starts = np.concatenate(([0], edges))
    ends = np.concatenate((edges, [values.size]))
    keep = ends - starts >= shortest
    return [(int(a), int(b)) for a, b in zip(starts[keep], ends[keep], strict=True)]


def clipped(signal: np.ndarray, moved: np.ndarray) -> list[tuple[int, int]]:
    """Return runs at the largest or smallest value that are longer than noise or a peak explains.

    The top of a peak in coarse steps is flat too, but hides no more than one step.
    """
    steps = np.abs(np.diff(signal))
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    rough = np.abs(np.diff(signal, 2))
    still = (np.diff(moved[1:]) == 0.0) & (np.diff(moved[:-1]) == 0.0)
    # in motion rounding is rough too: the noise shows where nothing moves
    noise = rough[still] if np.count_nonzero(still) > _LONG else rough
    noisy = float(np.median(noise)) > 0.25 * step
    found: list[tuple[int, int]] = []
    for extreme in (float(signal.max()), float(signal.min())):
        runs = []
        for a, b in _runs(signal, 8):
            if signal[a] != extreme:
                continue
            moving = int(np.count_nonzero(np.diff(moved[a:b])))
            reach = max(10, moving // 4)
            left, right = min(reach, a), min(reach, signal.size - b)
            slopes = [0.0]
            if left > 1:
                slopes.append(abs(signal[a] - signal[a - left]) / left)
            if right > 1:
                slopes.append(abs(signal[b - 1] - signal[b - 1 + right]) / right)
            hidden = 0.25 * max(slopes) * moving
            steep = noisy and b - a >= _LONG and _falls(signal, a, b) > _FALL * step
            if steep or hidden > 4.0 * step:
                runs.append((a, b))
        if sum(b - a for a, b in runs) >= 20:
            found += runs
    return sorted(found)


def _falls(signal: np.ndarray, a: int, b: int) -> float:
    """Return how far the signal goes over half of the run from ``a`` to ``b``, beyond an end."""
    half = (b - a) // 2
    sides = (signal[max(a - half, 0)], signal[min(b - 1 + half, signal.size - 1)])
    return max(abs(float(signal[a] - side)) for side in sides)


def stuck(time: np.ndarray, signal: np.ndarray, moved: np.ndarray) -> list[tuple[int, int]]:
    """Return runs of one value for at least 0.1 s and 15 samples while the drive changes."""
    span = float(np.ptp(moved)) or 1.0
    return [
        (a, b)
        for a, b in _runs(signal, 15)
        if time[b - 1] - time[a] >= 0.1 and float(np.ptp(moved[a:b])) > 0.1 * span
    ]


def outliers(signal: np.ndarray, moved: np.ndarray) -> list[tuple[int, int]]:
    """Return runs of up to 5 outliers between neighbours that agree, while the drive is steady.

    Where most of the steps before or after are as large, the film rings.
    """
    steps = np.diff(signal)
    noise = 1.4826 * float(np.median(np.abs(np.diff(signal, 2)))) / 6.0**0.5
    span = float(np.subtract(*np.percentile(signal, (99.0, 1.0))))
    far = max(15.0 * noise, 0.05 * span)
    drive_span = float(np.ptp(moved)) or 1.0
    found = []
    last = 0
    for i in np.flatnonzero(np.abs(steps) > far):
        a = int(i) + 1
        if a < last or a < 2:
            continue
        for b in range(a + 1, min(a + 6, signal.size - 1)):
            back = signal[b] - signal[b - 1]
            if abs(back) > far and back * steps[i] < 0.0:
                calm = max(
                    abs(signal[b] - signal[a - 1]),
                    abs(steps[i - 1]),
                    abs(steps[b]),
                    float(np.median(np.abs(steps[max(i - RINGING, 0) : i]))),
                    float(np.median(np.abs(steps[b : b + RINGING]))),
                )
                still = float(np.ptp(moved[a - 1 : b + 1])) < 0.05 * drive_span
                if calm < 0.3 * min(abs(steps[i]), abs(back)) and still:
                    found.append((a, b))
                    last = b + 1
                break
    return found


def spikes_about(
    recording: Recording, residual: np.ndarray, usable: np.ndarray, pull: np.ndarray
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return which readings (N,) are spikes about a model, and a sentence on them.

    ``residual`` (N,) is measured less model, ``pull`` (N,) what moves the film. Where the film
    rings, only a model tells a spike from its motion.
    """
    if recording.noise is None or recording.noise.step:
        return np.zeros_like(usable), ()
    left = interpolated(recording.time, residual, usable)
    found = spikes(recording.time, left, pull, recording.quiet_samples) & usable
    if not found.any():
        return found, ()
    places = [(int(i), int(i) + 1) for i in np.flatnonzero(found)]
    return found, (where(recording, "a single reading is far off the model", places),)


def where(recording: Recording, what: str, runs: Sequence[tuple[int, int]]) -> str:
    """Return a sentence on the samples of ``runs``, of which ``what`` is said."""
    samples = sum(b - a for a, b in runs)
    value = recording.signal[runs[0][0]]
    scale, unit = (1e3, "mm") if recording.kind == "actuator" else (1e-3, "kPa")
    places = "" if len(runs) == 1 else f", in {len(runs)} places"
    return (
        f"{what} at {value * scale:.4g} {unit} from {place(recording, runs[0][0])} on"
        f"{places}; {samples} sample{'s' if samples > 1 else ''} taken out"
    )


def gap_text(recording: Recording, missing: np.ndarray) -> str:
    """Return a sentence on the readings that ``missing`` (N,) says an imported file has not."""
    count = int(np.count_nonzero(missing))
    places = int(np.count_nonzero(np.diff(missing.astype(np.int8), prepend=0) > 0))
    return (
        f"{counted(count, 'reading')} {'is' if count == 1 else 'are'} missing, from "
        f"{place(recording, int(np.argmax(missing)))} on"
        f"{'' if places == 1 else f', in {places} places'}; no fit uses "
        f"{'it' if count == 1 else 'them'}"
    )


def place(recording: Recording, sample: int) -> str:
    """Return the place of ``sample``, with its time."""
    return f"sample {sample} ({recording.time[sample]:.4g} s)"
