"""Sensor nonlinearity that is periodic along the travel, as of a grating, fringes or pixels.

The reading is x + a sin(2 pi x/p) + b (1 - cos(2 pi x/p)).
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sensor ripple",
    family="sensor_nonlinearity",
    acts_on="sensor",
    summary="the reading has an error that is periodic along the travel",
    law=Law(
        equations=(
            r"r = x + a \sin \frac{2 \pi x}{p} + b \left(1 - \cos \frac{2 \pi x}{p}\right)",
        ),
        symbols=("a", "b", "p"),
        source="a Fourier series along the travel",
    ),
    parameters=(
        Parameter("sine", "m", (-5e-4, 5e-4), "of the error", 5e-6, 0.0),
        Parameter("cosine", "m", (-5e-4, 5e-4), "of the error", 5e-6, 0.0),
        Parameter(
            "period",
            "m",
            # what is longer than a stroke is a bend
            (2e-5, 1.5e-3),
            "of travel",
            5e-4,
            # near enough to each other to be told apart over the travel
            starts=tuple(1.0 / (1.0 + 0.4 * n) for n in range(24)),
            relative_to="displacement",
            logarithmic=True,
        ),
    ),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    angle = 2.0 * math.pi * x / c[k + 2]
    return x + c[k] * math.sin(angle) + c[k + 1] * (1.0 - math.cos(angle))
