"""High-voltage amplifier: a first-order lag with limits of slew rate and current.

The input is constant between two samples, so the output has a closed form: a straight line while
the slew rate or the current into the film's capacitance limits it, then an exponential towards the
target. No time stepping is needed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.drivers.settings import AmplifierSettings
from dearig.model.compiled.jit import jit

__all__ = ["Amplifier", "AmplifierRows", "AmplifierState"]

_SETTLED = 1e-3  # of the range; an output nearer than this to its target counts as settled


@jit
def _approach(
    start: float, target: float, tau: float, slew: float, elapsed: float
) -> tuple[float, float]:
    """Return the output and the integral of its square, ``elapsed`` s after ``target`` was set."""
    gap = target - start
    line = max(0.0, abs(gap) / slew - tau)  # the limit binds while |gap| > slew tau
    sign = 1.0 if gap > 0.0 else -1.0
    if elapsed < line:
        end = start + sign * slew * elapsed
        return end, elapsed * (start * start + start * end + end * end) / 3.0
    corner = start + sign * slew * line
    square = line * (start * start + start * corner + corner * corner) / 3.0
    rest = elapsed - line
    gap = target - corner
    left = math.exp(-rest / tau)
    square += target * target * rest
    square -= 2.0 * target * gap * tau * (1.0 - left)
    square += 0.5 * gap * gap * tau * (1.0 - left * left)
    return target - gap * left, square


@jit
def _follow(
    target: np.ndarray,
    output: float,
    tau: float,
    slew: float,
    interval: float,
    start: np.ndarray,
    effective: np.ndarray,
) -> float:
    """Follow ``target`` (N,); fill the output's start value and signed RMS in each interval."""
    for k in range(target.shape[0]):
        start[k] = output
        output, square = _approach(output, target[k], tau, slew, interval)
        effective[k] = math.copysign(math.sqrt(max(square, 0.0) / interval), output)
    return output


@jit
def _outputs_at(
    start: np.ndarray,
    target: np.ndarray,
    tau: float,
    slew: float,
    elapsed: float,
    output: np.ndarray,
) -> None:
    for k in range(start.shape[0]):
        output[k], _ = _approach(start[k], target[k], tau, slew, elapsed)


@dataclass(frozen=True)
class AmplifierState:
    """State of the amplifier: its present ``output`` in V at the film."""

    output: float = 0.0


@dataclass(frozen=True)
class AmplifierRows:
    """Output of the amplifier in each of N equal intervals.

    ``start`` (N,) V is the output at the start of an interval, ``target`` (N,) V its target there.
    ``effective`` (N,) V is the constant voltage with the same mean Maxwell stress: the root mean
    square, since the stress is proportional to the square. ``settled`` (N,) is False where the
    output did not reach its target within the interval. ``slew`` V/s is the limit that held.
    """

    start: np.ndarray
    target: np.ndarray
    effective: np.ndarray
    settled: np.ndarray
    slew: float


class Amplifier:
    """Amplifier with the given settings; the state is passed in and out."""

    def __init__(self, settings: AmplifierSettings) -> None:
        self._gain = settings.gain_V_per_V
        self._offset = settings.offset_V
        self._range = settings.range_kV * 1e3
        self._slew = settings.slew_V_per_us * 1e6
        self._current = settings.current_limit_mA * 1e-3
        self._tau = 1.0 / (2.0 * math.pi * settings.bandwidth_kHz * 1e3)

    def advance(
        self, volts: np.ndarray, interval: float, capacitance: float, state: AmplifierState
    ) -> tuple[AmplifierRows, AmplifierState]:
        """Follow inputs ``volts`` (N,) V, each held for ``interval`` s, into ``capacitance`` F."""
        target = np.clip(self._offset + self._gain * volts, -self._range, self._range)
        slew = min(self._slew, self._current / capacitance)
        start, effective = np.empty_like(target), np.empty_like(target)
        output = _follow(target, state.output, self._tau, slew, interval, start, effective)
        ends = np.append(start[1:], output)
        settled = np.abs(target - ends) <= _SETTLED * self._range
        return AmplifierRows(start, target, effective, settled, slew), AmplifierState(output)

    def outputs(self, rows: AmplifierRows, intervals: slice, elapsed: float) -> np.ndarray:
        """Return the output in V, ``elapsed`` s into each of some ``intervals``."""
        start, target = rows.start[intervals], rows.target[intervals]
        output = np.empty_like(start)
        _outputs_at(start, target, self._tau, rows.slew, elapsed, output)
        return output
