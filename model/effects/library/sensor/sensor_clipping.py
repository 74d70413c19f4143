"""Clipping of the sensor: beyond a knee the reading has 1 - s of its slope."""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sensor clipping",
    family="sensor_nonlinearity",
    acts_on="sensor",
    summary="the reading flattens beyond one displacement, at any speed",
    law=Law(
        equations=(r"r = x - s \max(x - x_k, 0)",),
        symbols=("s", "x_k"),
        source="a characteristic of two straight lines",
    ),
    parameters=(
        Parameter("flattening", "", (0.0, 1.0), "relative loss of slope beyond the knee", 0.1, 0.0),
        Parameter(
            "knee",
            "m",
            (1e-5, 2e-2),
            "displacement at which the reading begins to flatten",
            1e-3,
            starts=(0.5, 0.3, 0.7, 0.85),
            relative_to="displacement",
            logarithmic=True,
        ),
    ),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    return x - c[k] * max(x - c[k + 1], 0.0)
