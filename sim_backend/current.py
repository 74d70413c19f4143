"""Current that the amplifier delivers, as its current monitor shows it.

The current is dQ/dt of the film's charge, the conduction through the film, and C dV/dt of the
cable. The command is a staircase: after each step the amplifier delivers a charge within
microseconds, by the same lag and the same limits as its output follows, or through the resistance
of the film's law. The monitor is a first-order lag, so that its integral is the charge whatever the
shape of the pulse. The slow parts pass it with that delay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.drivers.settings import AmplifierSettings
from dearig.model.compiled.jit import jit
from dearig.sim_backend.plant import Electricity

__all__ = ["CurrentMonitor", "CurrentState"]


@jit
def _crossed(tau: float, blur: float, elapsed: float) -> float:
    """Return the part of a charge that waits at 0 s and is between both lags ``elapsed`` s later.

    It leaves the first lag with ``tau`` s and the second one with ``blur`` s.
    """
    apart = (1.0 / blur - 1.0 / tau) * elapsed
    between = 1.0 if abs(apart) < 1e-9 else -math.expm1(-apart) / apart
    return elapsed / tau * math.exp(-elapsed / tau) * between


@jit
def _after(
    gap: float, ahead: float, tau: float, limit: float, blur: float, elapsed: float
) -> tuple[float, float]:
    """Return ``gap`` and ``ahead`` in C ``elapsed`` s later; see ``_deliver``."""
    line = max(0.0, abs(gap) / limit - tau)  # the limit binds while |gap| > limit tau
    if line > 0.0:
        rate, held = math.copysign(limit, gap), min(line, elapsed)
        gap -= rate * held
        ahead = rate * blur + (ahead - rate * blur) * math.exp(-held / blur)
        elapsed -= held
    ahead = ahead * math.exp(-elapsed / blur) + gap * _crossed(tau, blur, elapsed)
    return gap * math.exp(-elapsed / tau), ahead


@jit
def _deliver(
    step: np.ndarray,
    tau: float,
    limit: float,
    blur: float,
    interval: float,
    into: float,
    state: np.ndarray,
    current: np.ndarray,
) -> None:
    """Deliver charges ``step`` (M,) C, one at the start of each interval.

    ``tau`` s is the lag and ``limit`` A the largest current of what delivers, ``blur`` s the lag of
    the monitor. ``state`` (2,) C is the charge that is still to come and the one that the monitor
    has not shown; it is updated in place. Fills ``current`` (M,) A, what the monitor shows ``into``
    s into each interval.
    """
    # away from the limit, which is nearly always, all intervals have the same factors
    kept, crossed = math.exp(-into / blur), _crossed(tau, blur, into)
    left_all, kept_all = math.exp(-interval / tau), math.exp(-interval / blur)
    crossed_all = _crossed(tau, blur, interval)
    gap, ahead = state[0], state[1]
    for k in range(step.shape[0]):
        gap += step[k]
        if abs(gap) <= limit * tau:
            current[k] = (ahead * kept + gap * crossed) / blur
            ahead = ahead * kept_all + gap * crossed_all
            gap *= left_all
        else:
            current[k] = _after(gap, ahead, tau, limit, blur, into)[1] / blur
            gap, ahead = _after(gap, ahead, tau, limit, blur, interval)
    state[0], state[1] = gap, ahead


@jit
def _fast(charge: np.ndarray, charging: np.ndarray, k: int, interval: float, tau: float) -> float:
    """Return the charge in C that flows at the start of interval ``k`` within ``tau`` s, or 0.

    Contacts that conduct better under a larger voltage pass a step in nanoseconds. ``charge`` and
    ``charging`` (2, M) are those at both ends of the intervals.
    """
    first, last = charging[0, k], charging[1, k]
    pulse: float = charge[1, k] - charge[0, k] - last * interval
    # an exponential of this charge that begins with the first current
    if pulse * (first - last) > 0.0 and abs(pulse) < tau * abs(first - last):
        return pulse
    return 0.0


@jit
def _add_fast(
    charge: np.ndarray, charging: np.ndarray, interval: float, tau: float, step: np.ndarray
) -> None:
    """Add to ``step`` (M,) C what flows faster than the amplifier delivers, in ``tau`` s."""
    for k in range(step.shape[0]):
        step[k] += _fast(charge, charging, k, interval, tau)


@jit
def _add_flow(
    charge: np.ndarray,
    charging: np.ndarray,
    conduction: np.ndarray,
    interval: float,
    into: float,
    tau: float,
    current: np.ndarray,
) -> None:
    """Add to ``current`` (M,) A what flows between the steps, ``into`` s into each interval.

    The charging current is the parabola with its values at both ends, whose integral is the change
    of the charge, without what flows at once (``_fast``) if the amplifier delivers in ``tau`` s.
    """
    x = into / interval
    for k in range(current.shape[0]):
        first, last = charging[0, k], charging[1, k]
        mean = (charge[1, k] - charge[0, k]) / interval
        if _fast(charge, charging, k, interval, tau) != 0.0:
            first = mean = last
        current[k] += first * (1.0 - x) + last * x
        current[k] += 6.0 * x * (1.0 - x) * (mean - 0.5 * (first + last))
        current[k] += conduction[0, k] * (1.0 - x) + conduction[1, k] * x


@dataclass(frozen=True)
class CurrentState:
    """State of the current monitor between two chunks.

    ``film`` and ``cable`` are the states in C of ``_deliver``, ``output`` V is the amplifier's.
    """

    film: tuple[float, float] = (0.0, 0.0)
    cable: tuple[float, float] = (0.0, 0.0)
    output: float = 0.0


class CurrentMonitor:
    """Current monitor of an amplifier, in intervals of ``spacing`` s; states are passed around."""

    def __init__(self, settings: AmplifierSettings, spacing: float) -> None:
        self._spacing = spacing
        self._cable = settings.cable_pF * 1e-12
        self._tau = 1.0 / (2.0 * math.pi * settings.bandwidth_kHz * 1e3)
        self._blur = 1.0 / (2.0 * math.pi * settings.current_monitor_bandwidth_kHz * 1e3)

    def read(
        self,
        electricity: Electricity,
        slew: float,
        capacitance: float,
        intervals: slice,
        into: float,
        state: CurrentState,
    ) -> tuple[np.ndarray, CurrentState]:
        """Return the current in A that is shown ``into`` s into some ``intervals``.

        ``slew`` V/s is the limit of the output, ``capacitance`` F that of the film.
        """
        tau = self._tau + electricity.lag
        step = electricity.step.copy()
        _add_fast(electricity.charge, electricity.charging, self._spacing, tau, step)
        current, film = self._pulses(step, tau, slew * capacitance, into, state.film)
        _add_flow(
            electricity.charge,
            electricity.charging,
            electricity.conduction,
            self._spacing,
            max(into - self._blur, 0.0),
            tau,
            current,
        )

        output, cable = electricity.output, state.cable
        if self._cable > 0.0:
            step = self._cable * (output[0] - np.append(state.output, output[1, :-1]))
            pulses, cable = self._pulses(step, self._tau, slew * self._cable, into, cable)
            current += pulses + self._cable * (output[1] - output[0]) / self._spacing
        return current[intervals], CurrentState(film, cable, float(output[1, -1]))

    def _pulses(
        self, step: np.ndarray, tau: float, limit: float, into: float, before: tuple[float, float]
    ) -> tuple[np.ndarray, tuple[float, float]]:
        current, state = np.empty(step.size), np.array(before)
        _deliver(step, tau, limit, self._blur, self._spacing, into, state, current)
        return current, (float(state[0]), float(state[1]))
