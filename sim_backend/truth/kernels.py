"""Compiled loops of the stages with a state; arguments are numbers and arrays."""

from __future__ import annotations

import math

import numpy as np

from dearig.model.compiled.jit import allocating, jit

__all__ = [
    "delayed",
    "follow_pair",
    "lag_voltage",
    "limit_slew",
    "low_pass",
    "moving_average",
    "polarise",
    "second_order",
    "sway",
]


_AT_ONCE = 0.1  # of an interval; what relaxes faster has done so at its start


@jit
def polarise(
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    shares: np.ndarray,
    times: np.ndarray,
    slow: np.ndarray,
    effective: np.ndarray,
    bound: np.ndarray,
    creep: np.ndarray,
) -> None:
    """Return the voltage (N,) V, held between nodes, whose square is voltage times polarisation.

    ``slow`` (m,) V are the relaxing parts, updated in place up to the last node. They have
    ``shares`` (m,) of the polarisation and relaxation ``times`` (m,) s. Each is averaged over its
    interval. Fills ``bound`` (2, N) V, the polarisation at both ends of each interval, at which the
    voltage is ``ends`` (2, N) V, and ``creep`` (2, N) V/s, its rate there.
    """
    nodes = time.shape[0]
    share = 0.0
    for i in range(shares.shape[0]):
        share += shares[i]
    for k in range(nodes):
        v = voltage[k]
        polarisation = (1.0 - share) * v
        last = k == nodes - 1
        interval = 0.0 if last else time[k + 1] - time[k]
        rise = 0.0 if last else (1.0 - share) * (ends[1, k] - ends[0, k]) / interval
        for end in range(2):
            bound[end, k] = (1.0 - share) * ends[end, k]
            creep[end, k] = rise
        for i in range(shares.shape[0]):
            gap = slow[i] - v
            before = slow[i]
            if last:
                polarisation += shares[i] * slow[i]
            else:
                left = -math.expm1(-interval / times[i])
                polarisation += shares[i] * (v + gap * left * times[i] / interval)
                slow[i] = v + gap * (1.0 - left)
            if times[i] < _AT_ONCE * interval:
                bound[0, k] += shares[i] * slow[i]
            else:
                bound[0, k] += shares[i] * before
                creep[0, k] += shares[i] * (v - before) / times[i]
                creep[1, k] += shares[i] * (v - slow[i]) / times[i]
            bound[1, k] += shares[i] * slow[i]
        effective[k] = math.copysign(math.sqrt(max(v * polarisation, 0.0)), v)


@jit
def limit_slew(
    time: np.ndarray,
    voltage: np.ndarray,
    slew: float,
    output: float,
    effective: np.ndarray,
    starts: np.ndarray,
) -> float:
    """Follow ``voltage`` (N,) V at ``slew`` V/s at most from ``output``; returns the new output.

    Fills ``starts`` (N,) V with the output at each node, and ``effective`` (N,) V with the root
    mean square of the straight line in each interval.
    """
    nodes = time.shape[0]
    for k in range(nodes - 1):
        starts[k] = output
        reach = slew * (time[k + 1] - time[k])
        end = min(max(voltage[k], output - reach), output + reach)
        square = (output * output + output * end + end * end) / 3.0
        effective[k] = math.copysign(math.sqrt(square), output + end)
        output = end
    effective[nodes - 1] = starts[nodes - 1] = output
    return output


@jit
def lag_voltage(
    time: np.ndarray,
    voltage: np.ndarray,
    frequency: float,
    damping: float,
    state: np.ndarray,
    effective: np.ndarray,
    starts: np.ndarray,
) -> None:
    """Follow ``voltage`` (N,) V, held, by y'' + 2 d w y' + w^2 (y - v) = 0 with d below 1.

    ``state`` (2,) is y V and y' V/s, updated in place. Fills ``starts`` (N,) V with y at each node,
    and ``effective`` (N,) V with the mean of y at both ends of each interval.
    """
    nodes = time.shape[0]
    sigma = damping * frequency
    omega = frequency * math.sqrt(1.0 - damping * damping)
    for k in range(nodes - 1):
        h = time[k + 1] - time[k]
        gap, slope = state[0] - voltage[k], state[1]
        decay, c, s = math.exp(-sigma * h), math.cos(omega * h), math.sin(omega * h)
        b = (slope + sigma * gap) / omega
        end = voltage[k] + decay * (gap * c + b * s)
        starts[k] = state[0]
        effective[k] = 0.5 * (state[0] + end)
        state[1] = decay * ((b * omega - sigma * gap) * c - (gap * omega + sigma * b) * s)
        state[0] = end
    effective[nodes - 1] = starts[nodes - 1] = state[0]


@jit
def low_pass(time: np.ndarray, rows: np.ndarray, tau: float, state: np.ndarray) -> None:
    """Pass ``rows`` (2, N), position and velocity, through two equal lags of ``tau`` s, in place.

    The input is linear between nodes. ``state`` (2,) m holds both lags, updated in place.
    """
    first, second = state[0], state[1]
    before = rows[0, 0]
    for k in range(time.shape[0]):
        if k > 0:
            h = time[k] - time[k - 1]
            left = math.exp(-h / tau)
            x = rows[0, k]
            slope = (x - before) / h
            start = first
            first = x - tau * slope + (first - before + tau * slope) * left
            slope_2 = (first - start) / h
            second = first - tau * slope_2 + (second - start + tau * slope_2) * left
            before = x
        rows[0, k] = second
        rows[1, k] = (first - second) / tau
    state[0], state[1] = first, second


@jit
def moving_average(
    time: np.ndarray, rows: np.ndarray, first: int, window: float, out: np.ndarray
) -> None:
    """Average the cubic through ``rows`` (2, N) over the last ``window`` s, from node ``first`` on.

    Before node 0 the film rests at its position there. Fills ``out`` (2, N - first).
    """
    j = 0
    for k in range(first, time.shape[0]):
        begin = time[k] - window
        while j < k and time[j + 1] <= begin:
            j += 1
        total = 0.0
        if begin <= time[0]:
            oldest = rows[0, 0]
            total += (time[0] - begin) * oldest
            low = 0
        else:
            h = time[j + 1] - time[j]
            u = (begin - time[j]) / h
            x0, v0 = rows[0, j], rows[1, j] * h
            rise, v1 = rows[0, j + 1] - x0, rows[1, j + 1] * h
            c2, c3 = 3.0 * rise - 2.0 * v0 - v1, v0 + v1 - 2.0 * rise
            oldest = x0 + u * (v0 + u * (c2 + u * c3))
            all_of_it = x0 + v0 / 2.0 + c2 / 3.0 + c3 / 4.0
            part = u * (x0 + u * (v0 / 2.0 + u * (c2 / 3.0 + u * c3 / 4.0)))
            total += h * (all_of_it - part)
            low = j + 1
        for i in range(low, k):
            h = time[i + 1] - time[i]
            total += 0.5 * h * (rows[0, i] + rows[0, i + 1])
            total += h * h / 12.0 * (rows[1, i] - rows[1, i + 1])
        out[0, k - first] = total / window
        out[1, k - first] = (rows[0, k] - oldest) / window


@allocating
def sway(
    time: np.ndarray,
    rows: np.ndarray,
    frequency: float,
    damping: float,
    coupling: float,
    state: np.ndarray,
    out: np.ndarray,
) -> None:
    """Solve w'' + 2 d f w' + f^2 w = -g x'' for the motion ``rows`` (2, N) of x.

    With W = w + g x no acceleration is needed. ``state`` (2,) is W and W', updated in place. Fills
    ``out`` (2, N) with w and w'. Takes one fourth-order Runge-Kutta step an interval.
    """
    slopes = np.empty((4, 2))
    for k in range(time.shape[0]):
        if k > 0:
            h = time[k] - time[k - 1]
            x0, x1 = rows[0, k - 1], rows[0, k]
            v0, v1 = rows[1, k - 1], rows[1, k]
            for stage in range(4):
                x, v, ahead = x0, v0, 0.0
                if stage == 3:
                    x, v, ahead = x1, v1, h
                elif stage > 0:
                    x = 0.5 * (x0 + x1) + h / 8.0 * (v0 - v1)
                    v = 1.5 * (x1 - x0) / h - 0.25 * (v0 + v1)
                    ahead = 0.5 * h
                p, q = state[0], state[1]
                if stage > 0:
                    p += ahead * slopes[stage - 1, 0]
                    q += ahead * slopes[stage - 1, 1]
                slopes[stage, 0] = q
                slopes[stage, 1] = -2.0 * damping * frequency * (q - coupling * v)
                slopes[stage, 1] -= frequency * frequency * (p - coupling * x)
            for i in range(2):
                state[i] += (
                    h
                    / 6.0
                    * (slopes[0, i] + 2.0 * slopes[1, i] + 2.0 * slopes[2, i] + slopes[3, i])
                )
        out[0, k] = state[0] - coupling * rows[0, k]
        out[1, k] = state[1] - coupling * rows[1, k]


@jit
def follow_pair(
    time: np.ndarray,
    voltage: np.ndarray,
    slew: float,
    delay: float,
    output: float,
    effective: np.ndarray,
    starts: np.ndarray,
) -> float:
    """Follow ``voltage`` (N,) V, held, by y' = S tanh((v - y)/(S tau)); returns the new output.

    In closed form sinh((v - y)/(S tau)) falls as exp(-t/tau). Fills ``starts`` (N,) V with the
    output at each node, and ``effective`` (N,) V with the root of the mean square by Simpson's
    rule.
    """
    nodes = time.shape[0]
    scale = slew * delay
    for k in range(nodes - 1):
        starts[k] = output
        h = time[k + 1] - time[k]
        v = voltage[k]
        start = math.sinh((v - output) / scale)
        middle = v - scale * math.asinh(start * math.exp(-0.5 * h / delay))
        end = v - scale * math.asinh(start * math.exp(-h / delay))
        square = (output * output + 4.0 * middle * middle + end * end) / 6.0
        effective[k] = math.copysign(math.sqrt(square), output + end)
        output = end
    effective[nodes - 1] = starts[nodes - 1] = output
    return output


@jit
def delayed(time: np.ndarray, rows: np.ndarray, first: int, age: float, out: np.ndarray) -> None:
    """Return the cubic through ``rows`` (2, N) ``age`` s before each node from ``first`` on.

    Before node 0 the film rests at its position there. Fills ``out`` (2, N - first).
    """
    j = 0
    for k in range(first, time.shape[0]):
        at = time[k] - age
        if at <= time[0]:
            out[0, k - first], out[1, k - first] = rows[0, 0], 0.0
            continue
        while j < k - 1 and time[j + 1] < at:
            j += 1
        h = time[j + 1] - time[j]
        u = (at - time[j]) / h
        x0, v0 = rows[0, j], rows[1, j] * h
        rise, v1 = rows[0, j + 1] - x0, rows[1, j + 1] * h
        c2, c3 = 3.0 * rise - 2.0 * v0 - v1, v0 + v1 - 2.0 * rise
        out[0, k - first] = x0 + u * (v0 + u * (c2 + u * c3))
        out[1, k - first] = (v0 + u * (2.0 * c2 + 3.0 * u * c3)) / h


@allocating
def second_order(
    time: np.ndarray,
    rows: np.ndarray,
    frequency: float,
    damping: float,
    state: np.ndarray,
    out: np.ndarray,
) -> None:
    """Follow the position of ``rows`` (2, N) by y'' + 2 d w y' + w^2 (y - x) = 0.

    ``state`` (2,) is y m and y' m/s, updated in place. Fills ``out`` (2, N). Takes one fourth-order
    Runge-Kutta step an interval.
    """
    slopes = np.empty((4, 2))
    for k in range(time.shape[0]):
        if k > 0:
            h = time[k] - time[k - 1]
            x0, x1 = rows[0, k - 1], rows[0, k]
            for stage in range(4):
                x, ahead = x0, 0.0
                if stage == 3:
                    x, ahead = x1, h
                elif stage > 0:
                    x = 0.5 * (x0 + x1) + h / 8.0 * (rows[1, k - 1] - rows[1, k])
                    ahead = 0.5 * h
                p, q = state[0], state[1]
                if stage > 0:
                    p += ahead * slopes[stage - 1, 0]
                    q += ahead * slopes[stage - 1, 1]
                slopes[stage, 0] = q
                slopes[stage, 1] = frequency * frequency * (x - p) - 2.0 * damping * frequency * q
            for i in range(2):
                both = slopes[1, i] + slopes[2, i]
                state[i] += h / 6.0 * (slopes[0, i] + 2.0 * both + slopes[3, i])
        out[0, k] = state[0]
        out[1, k] = state[1]
