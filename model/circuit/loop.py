"""Voltage, charge and current along a given stretch, by the hooks of the effects.

Signal path: the command goes through the effects of the amplifier to its output U, then through
those of the electrodes to the voltage V at the film. The charge follows from the energy that the
Maxwell stress D E comes from,

    Q = C_0 (Z/z)^2 eps (V_E^2/V),   i = dQ/dt + conducted current,

with the factor eps of ``permittivity``, V_E^2 = V^2 + what ``polarise`` adds, and what ``charge``
adds to it. No mechanics is solved: a pass takes a tenth of a simulation's time.
"""

from __future__ import annotations

import numpy as np

from dearig.model.coefficients import CAPACITANCE, HELD
from dearig.model.compiled.jit import allocating, inlined, jit, read_only
from dearig.model.effects import MEMORY, assembly
from dearig.model.kinematics import thinning_squared

__all__ = [
    "ABOUT",
    "AFTER",
    "AT",
    "DROP",
    "ELECTRIC_BITS",
    "FILM",
    "INTO",
    "OUTPUT",
    "SLOPE",
    "circuit_state",
    "follow",
]

#: When a row is read: at an instant soon after the sample; as the mean over the interval that the
#: sample begins, the jump of the voltage at its start included; as the mean about the sample, from
#: half-way to the one before to half-way to the next.
AT, AFTER, ABOUT = 0, 1, 2
#: Rows of ``follow``: output of the amplifier in V, voltage at the film in V, current in A, voltage
#: in V that drops by a conducted current of unknown size, slope of the output in V/s.
OUTPUT, FILM, INTO, DROP, SLOPE = 0, 1, 2, 3, 4

_BITS = assembly.HOOK_BITS
#: Bits of the effects that take part in the circuit.
ELECTRIC_BITS = (
    _BITS["supply"]
    | _BITS["polarise"]
    | _BITS["permittivity"]
    | _BITS["charge"]
    | _BITS["conduct"]
    | _BITS["drop"]
)
_AMPLIFIER = assembly.AMPLIFIER
_BREATHES = _BITS["breathe"]
_COMMITS = _BITS["permittivity"] & _BITS["commit"]
_SUPPLY, _POLARISE = _BITS["supply"], _BITS["polarise"]
_supply, _polarise, _permittivity = assembly.supply, assembly.polarise, assembly.permittivity
_charge, _conduct, _drop = assembly.charge, assembly.conduct, assembly.drop
_commit, _breathe, _active = assembly.commit, assembly.breathe, assembly.active

_GOING, _FIRST = 4, 5  # in a state, after U, V, charge and command: whether it began; memories

_LEAST = 1.0  # V: at which the polarisation of a film without a voltage is asked for
_WIDTH = 0.01  # of an interval, over which an instant at its start is a mean, at least


@jit
def _charged(acting: int, c: np.ndarray, m: np.ndarray, lam: float, v: float) -> float:
    """Charge in C of the film at ``v`` V, stretched by ``lam``."""
    q = c[CAPACITANCE] * thinning_squared(int(c[HELD]), lam)
    if acting == 0:
        return float(q * v)
    bound = v
    if acting & _POLARISE:
        u = v if abs(v) > _LEAST else _LEAST
        added, _ = _polarise(acting, c, m, u, u, 0.0)
        bound += added / u
    bound += _charge(acting, c, m, v)
    return float(q * bound * _permittivity(acting, c, m, lam, v * v))


@jit
def _now(
    acting: int, c: np.ndarray, m: np.ndarray, t: float, u: float, lam: float, rate: float
) -> tuple[float, float]:
    """Output of the amplifier and voltage at the film, in V, under a command ``u`` V now."""
    output, _ = _supply(acting & _AMPLIFIER, c, m, t, u, u, 0.0, lam, rate)
    film, _ = _supply(acting & ~_AMPLIFIER, c, m, t, output, output, 0.0, lam, rate)
    return output, film


@inlined
def _pieces(way: int, into: float, h: float) -> tuple[float, float]:
    """Ends of the first two of up to three pieces in which an interval of ``h`` s is crossed."""
    if way == AT:
        return 0.0, min(max(2.0 * into, _WIDTH * h), h)
    if way == ABOUT:
        return 0.5 * h, 0.5 * h
    return 0.0, h


@allocating
def _follow(
    c: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    stretch: np.ndarray,
    way: int,
    into: float,
    state: np.ndarray,
    rows: np.ndarray,
) -> None:
    # One piece: the state of the circuit is carried from piece to piece of each interval
    n = time.shape[0]
    acting = _active(c) & ELECTRIC_BITS
    of_film = acting & ~_AMPLIFIER
    goes_on = state[_GOING] > 0.0
    m = state[_FIRST:].copy()
    breathes = air.shape[1] == n and acting & _BREATHES != 0
    whole = np.zeros(n)  # s that each row is the mean over
    u, v, q, last = state[0], state[1], state[2], state[3]
    if not goes_on:
        u, v = voltage[0], voltage[0]
        if acting:
            u, v = _now(acting, c, m, time[0], voltage[0], stretch[0], 0.0)
        q, last = _charged(of_film, c, m, stretch[0], v), voltage[0]
    for k in range(n):
        if k == n - 1:
            # what comes next begins with this sample again
            state[0], state[1], state[2], state[3], state[_GOING] = u, v, q, last, 1.0
            state[_FIRST:] = m
        # after the last sample the film goes on as before
        h = time[k + 1] - time[k] if k + 1 < n else time[k] - time[k - 1]
        lam = stretch[k]
        rate = ((stretch[k + 1] - lam) if k + 1 < n else (lam - stretch[k - 1])) / h
        if breathes:
            _breathe(acting, c, m, air[0, k], air[1, k], h)
        before_u, before_q, command = u, q, voltage[k]
        if command != last or (k == 0 and not goes_on):
            u = v = command
            if acting:
                u, v = _now(acting, c, m, time[k], command, lam, rate)
            q = _charged(of_film, c, m, lam, v)
        if way != AT and k:
            rows[INTO, k] += q - before_q
            rows[SLOPE, k] += u - before_u
        elif k:
            rows[SLOPE, k] = (u - before_u) / h
        slope = (ends[k] - command) / h
        t, first, second = 0.0, 0.0, 0.0
        first, second = _pieces(way, into, h)
        for piece in range(3):
            end = first if piece == 0 else second if piece == 1 else h
            step = end - t
            if step <= 0.0:
                continue
            start_u, start_v, start_q = u, v, q
            start, stop = command + slope * t, command + slope * end
            middle = lam + rate * 0.5 * (t + end)
            u = v = stop
            if acting & _SUPPLY:
                _, u = _supply(
                    acting & _AMPLIFIER, c, m, time[k] + t, start, stop, step, middle, rate
                )
                v = u
                if of_film & _SUPPLY:
                    _, v = _supply(of_film, c, m, time[k] + t, start_u, u, step, middle, rate)
            if of_film & _POLARISE:
                _polarise(acting, c, m, start_v, v, step)
            now = lam + rate * end
            if acting & _COMMITS:
                _commit(acting & _COMMITS, c, m, now, rate, lam + rate * t, step, time[k] + t)
            q = _charged(of_film, c, m, now, v)
            t = end
            row = k
            if way == AT and piece != 1:
                continue
            if way == ABOUT and piece == 2:
                row = k + 1
            if row == n:
                continue
            whole[row] += step
            current, dropped = 0.0, 0.0
            if of_film:
                current = _conduct(of_film, c, m, time[k] + t, v, now)
                dropped = _drop(of_film, c, m, v)
            rows[OUTPUT, row] += 0.5 * (start_u + u) * step
            rows[FILM, row] += 0.5 * (start_v + v) * step
            rows[INTO, row] += q - start_q + current * step
            rows[DROP, row] += dropped * step
            rows[SLOPE, row] += (u - start_u) / (step if way == AT else 1.0)
        last = ends[k]
    for k in range(n):
        for row in range(SLOPE if way == AT else SLOPE + 1):
            rows[row, k] /= whole[k]


def follow(
    c: np.ndarray,
    time: np.ndarray,
    voltage: np.ndarray,
    ends: np.ndarray,
    air: np.ndarray,
    stretch: np.ndarray,
    way: int = AFTER,
    into: float = 0.0,
    state: np.ndarray | None = None,
) -> np.ndarray:
    """Return the circuit's rows (5, N) along ``stretch`` (N,): ``OUTPUT``, ``FILM``, ...

    ``time``, ``voltage``, ``ends`` and ``air`` as in ``kernel.drive_by_voltage``. ``c`` must know
    the stretch at rest. ``way`` is ``AT`` ``into`` s after each sample (as the mean from the sample
    to twice that), ``AFTER`` or ``ABOUT``.
    A current at an instant is free of the jump of the voltage at the sample, whose charge flows
    within microseconds where nothing is in series with the film.

    A ``state`` of ``circuit_state`` is that of the last sample afterwards: the samples that follow,
    with this one before them, go on from there. Their first row is then no whole one.
    """
    rows = np.zeros((5, time.size))
    given = (read_only(time), read_only(voltage), read_only(ends), read_only(air))
    kept = circuit_state() if state is None else state
    _follow(c, *given, read_only(np.ascontiguousarray(stretch)), way, into, kept, rows)
    return rows


def circuit_state() -> np.ndarray:
    """Return the state of a circuit that has not begun."""
    return np.zeros(_FIRST + MEMORY)
