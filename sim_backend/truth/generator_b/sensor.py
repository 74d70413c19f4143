"""The sensor and its surroundings, by generator B.

Lag. ``delay``: the reading is the position some time ago, as of a digital controller with a
pipeline. ``butterworth``: y'' + sqrt(2) w y' + w^2 (y - x) = 0 (Butterworth, Wireless Engineer 7,
1930).

Nonlinearity. ``triangulation``: x/(1 - x/D), the spot's image on a tilted detector (Dorsch,
Hausler and Herrmann, Appl. Opt. 33, 1994). ``legendre``: a residual of third to fifth order over
the working range, as in a maker's linearity plot.

Drift. ``logarithm``: A ln(1 + t/t_0), as glue relaxes. ``brownian``: a random walk whose spread
grows with the root of time (its Karhunen-Loeve series), another one in each run.

Interference. ``fan``: a machine's vibration at its own frequency and at twice that.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth import kernels as loops
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.plumbing import looking_back, tones
from dearig.sim_backend.truth.sampling import either_sign, log_uniform

__all__ = [
    "brownian",
    "butterworth",
    "delay",
    "fan",
    "legendre",
    "logarithm",
    "triangulation",
]

_AGE = (3.5e-3, 100e-3)  # s, mean age of a reading
_ERROR = (5e-6, 70e-6)  # m, of the reading at 1.5 mm
_RANGE = 1.5e-3  # m
_DRIFT = (6e-6, 200e-6)  # m after 25 s
_WALK = 60.0  # s: longest run for which the walk's series is meant
_WALK_TERMS = 12
_HUM = (3.5e-6, 50e-6)  # m


def delay(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a pure delay."""
    age = log_uniform(generator, *_AGE)

    return TruthEffect(
        family="sensor_lag",
        acts_on="sensor",
        description=f"the reading is the position {age * 1e3:.3g} ms ago",
        on_motion=looking_back(age, loops.delayed),
    )


def butterworth(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a low-pass filter of second order."""
    omega = math.sqrt(2.0) / log_uniform(generator, *_AGE)

    def on_motion(time: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        state = np.array((rows[0, 0], 0.0)) if carry is None else np.array(carry)
        out = np.empty_like(rows)
        loops.second_order(time, rows, omega, 0.5 * math.sqrt(2.0), state, out)
        return out, state

    return TruthEffect(
        family="sensor_lag",
        acts_on="sensor",
        description=f"the reading passes a Butterworth filter of {omega / 2.0 / math.pi:.3g} Hz",
        on_motion=on_motion,
    )


def triangulation(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a hyperbolic characteristic."""
    error = either_sign(generator) * log_uniform(generator, *_ERROR)
    distance = _RANGE * (_RANGE + error) / error

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:  # noqa: ARG001
        whole = 1.0 - rows[0] / distance
        return np.stack((rows[0] / whole, rows[1] / whole**2)), carry

    return TruthEffect(
        family="sensor_nonlinearity",
        acts_on="sensor",
        description=(
            f"the reading is x/(1 - x/D) with D = {distance * 1e3:.3g} mm, {error * 1e6:.3g} um "
            f"too large at 1.5 mm"
        ),
        on_motion=on_motion,
    )


def legendre(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a residual of third, fourth and fifth order."""
    sizes = log_uniform(generator, *_ERROR) * generator.uniform(-1.0, 1.0, 3)
    error = np.polynomial.Legendre(
        np.concatenate((np.zeros(3), sizes)), domain=(-0.2 * _RANGE, 1.2 * _RANGE)
    )
    slope, at_rest = error.deriv(), error(0.0)

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:  # noqa: ARG001
        x = np.clip(rows[0], *error.domain)
        inside = x == rows[0]
        seen = rows[0] + error(x) - at_rest
        return np.stack((seen, rows[1] * (1.0 + np.where(inside, slope(x), 0.0)))), carry

    text = ", ".join(f"{size * 1e6:.2g}" for size in sizes)
    return TruthEffect(
        family="sensor_nonlinearity",
        acts_on="sensor",
        description=f"the reading has errors of third to fifth order of {text} um",
        on_motion=on_motion,
    )


def logarithm(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a drift that goes with the logarithm of time."""
    size = either_sign(generator) * log_uniform(generator, *_DRIFT)
    time = log_uniform(generator, 0.3, 6.0)
    scale = size / math.log1p(25.0 / time)

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        rows[0] += scale * np.log1p(t / time)
        rows[1] += scale / (time + t)
        return rows, carry

    return TruthEffect(
        family="drift",
        acts_on="sensor",
        description=(
            f"the reading drifts by {size * 1e6:.3g} um in 25 s, by the logarithm of time after "
            f"{time:.2g} s"
        ),
        on_motion=on_motion,
    )


def brownian(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a random walk, another one in each run."""
    return _walk(log_uniform(generator, *_DRIFT), generator)


def _walk(size: float, generator: np.random.Generator) -> TruthEffect:
    omegas = (np.arange(_WALK_TERMS) + 0.5) * math.pi / _WALK
    per_root = size / math.sqrt(25.0)
    amplitudes = per_root * math.sqrt(2.0 / _WALK) / omegas * generator.standard_normal(_WALK_TERMS)

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        for omega, amplitude in zip(omegas, amplitudes, strict=True):
            rows[0] += amplitude * np.sin(omega * t)
            rows[1] += amplitude * omega * np.cos(omega * t)
        return rows, carry

    return TruthEffect(
        family="drift",
        acts_on="sensor",
        description=f"the reading walks by {size * 1e6:.3g} um RMS in 25 s",
        on_motion=on_motion,
        redrawn=lambda generator: _walk(size, generator),
    )


def fan(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw the vibration of a machine."""
    size = log_uniform(generator, *_HUM)
    hertz = generator.uniform(17.0, 49.0)
    second = generator.uniform(0.0, 0.3)
    phases = generator.uniform(0.0, 2.0 * math.pi, 2)

    parts = ((size, 1.0, phases[0]), (second * size, 2.0, phases[1]))
    return TruthEffect(
        family="interference",
        acts_on="sensor",
        description=(
            f"vibration of {size * 1e6:.3g} um at {hertz:.2f} Hz, {second:.2f} of that at twice"
        ),
        on_motion=tones(parts, hertz),
    )
