"""Drift of the sensor's zero that slows down but does not settle: heat that diffuses into a mount.

The reading is moved by d ((1 + t/T)^n - 1)/((1 + 30 s/T)^n - 1), t since the record began: n = 1
is a constant rate, n = 1/2 diffusion, n near 0 the logarithm of time.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="slowing drift",
    family="drift",
    acts_on="sensor",
    summary="the reading drifts, ever more slowly, whatever the film does",
    law=Law(
        equations=(r"r = x + d \frac{(1 + t/T)^n - 1}{(1 + 30\,\mathrm{s}/T)^n - 1}",),
        symbols=("d", "T", "n"),
        source="a power of time: 1/2 is diffusion",
    ),
    parameters=(
        Parameter("drift", "m", (-5e-3, 5e-3), "of the zero within 30 s", 3e-6, 0.0),
        Parameter(
            "onset",
            "s",
            (0.1, 100.0),
            "time after which the drift slows down",
            2.0,
            starts=(2.0,),
            logarithmic=True,
        ),
        Parameter("exponent", "", (0.02, 1.0), "power of time", 0.1, starts=(0.5,)),
    ),
)

_AT = 30.0  # s


@jit
def _gone(c, k, t):
    return (1.0 + t / c[k + 1]) ** c[k + 2] - 1.0


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x + c[k] * _gone(c, k, t) / _gone(c, k, _AT)
