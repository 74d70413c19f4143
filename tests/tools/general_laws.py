"""Approximate a law by the general law of its family, along a motion that is given.

Each law's hooks are evaluated along the thesis's excitation, with a motion that follows the square
of the voltage within a tenth of a second, up to 1.5 mm. The general law is linear in its weights,
so the best ones are a least-squares solution. No kernel is needed.
"""

import functools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear
from scipy.signal import lfilter

from dearig.model.coefficients import EFFECTS_AT, REST
from dearig.model.effects import EFFECTS, PLACES
from dearig.model.simulation.excitation import Sequence
from tests.tools.effect_cases import THESIS, numbers
from tests.tools.effect_oracle import Film

__all__ = ["Approximation", "approximate", "response"]

RATE = 100.0  # Hz
TRAVEL = 1.5e-3  # m, at the largest voltage
LATE = 0.1  # s


@dataclass(frozen=True)
class Motion:
    time: np.ndarray
    voltage: np.ndarray
    stretch: np.ndarray
    rate: np.ndarray
    film: np.ndarray  # coefficients before those of effects
    length: float


@functools.cache
def motion():
    time, voltage = Sequence.thesis(periods=2).sample(RATE)
    c, length = THESIS.coefficients()[:EFFECTS_AT], THESIS.film.length
    c[REST] = Film(THESIS).rest
    pull = (voltage / np.abs(voltage).max()) ** 2
    left = np.exp(-1.0 / RATE / LATE)
    stretch = c[REST] + TRAVEL / length * lfilter([1.0 - left], [1.0, -left], pull)
    return Motion(time, voltage, stretch, np.gradient(stretch, time), c, length)


def response(name, values):
    """What the effect ``name`` adds along the motion (N,), in the unit of its hook."""
    path, module = motion(), PLACES[name].module
    c = np.concatenate([path.film, list(values.values())])
    m = np.zeros(EFFECTS[name].memory)
    k, out = EFFECTS_AT, np.zeros(path.time.size)
    rest = path.stretch[0]
    for n in range(1, path.time.size):
        t, h = path.time[n - 1], path.time[n] - path.time[n - 1]
        lam0, lam, rate = path.stretch[n - 1], path.stretch[n], path.rate[n]
        start, end = path.voltage[n - 1], path.voltage[n]
        if hasattr(module, "stress"):
            # the mean rate of the step, as a state that follows the path has it
            out[n] = module.stress(c, k, m, 0, lam, rate, lam0, h, t)
        elif hasattr(module, "soften"):
            out[n] = module.soften(c, k, m, 0, lam, h, t, 0.0) - 1.0
        elif hasattr(module, "permittivity"):
            out[n] = module.permittivity(c, k, m, 0, lam, end * end) - 1.0
        elif hasattr(module, "supply"):
            out[n] = module.supply(c, k, m, 0, t, start, end, h, lam, rate)[1] - end
        elif hasattr(module, "polarise"):
            out[n] = module.polarise(c, k, m, 0, start, end, h)[1]
        else:
            x = (lam - rest) * path.length
            out[n] = module.sense(c, k, m, 0, t + h, h, x, rate * path.length) - x
        if hasattr(module, "commit"):
            module.commit(c, k, m, 0, lam, rate, lam0, h, t)
    return out


@functools.cache
def columns(name, shape):
    """What each weight of a general law adds when it is one typical value: (N, weights)."""
    effect = EFFECTS[name]
    made = []
    for p in effect.amplitudes:
        values = {q.name: q.neutral for q in effect.amplitudes} | {p.name: p.typical} | dict(shape)
        made.append(response(name, values))
    return np.stack(made, axis=1)


@dataclass(frozen=True)
class Approximation:
    """The weights by name, and the RMS of what is left over that of the law."""

    values: dict
    error: float
    weights: int


def approximate(general, target, **shape):
    """Approximate ``target`` (N,) by the general law, on the grid of its first starts."""
    effect = EFFECTS[general]
    grid = {p.name: v for p, v in zip(effect.parameters, numbers(general).values(), strict=True)}
    shape = {p.name: grid[p.name] for p in effect.shape_parameters} | shape
    a = columns(general, tuple(shape.items()))
    scale = float(np.abs(target).max())
    low, high = np.array([p.fit_bounds for p in effect.amplitudes]).T
    typical = np.array([p.typical for p in effect.amplitudes])
    # a small weight on all keeps those apart that the motion does not tell from each other
    size = 1e-4 * np.linalg.norm(a, axis=0).max()
    rows = np.concatenate([a, size * np.eye(a.shape[1])])
    right = np.concatenate([target, np.zeros(a.shape[1])])
    found = lsq_linear(rows / scale, right / scale, (low / typical, high / typical)).x
    left = target - a @ found
    values = dict(zip((p.name for p in effect.amplitudes), found * typical, strict=True)) | shape
    error = float(np.sqrt(np.mean(left**2) / np.mean(target**2)))
    return Approximation(values, error, int(np.sum(np.abs(found) > 1e-3 * np.abs(found).max())))
