"""Saturation of the sensor: beyond a knee the gain decreases, as a spot leaves the detector.

A travel y beyond the knee reads y/(1 + y/s), half of it at y = s.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="sensor saturation",
    family="sensor_nonlinearity",
    acts_on="sensor",
    summary="beyond one displacement the reading falls behind, more and more, at any speed",
    law=Law(
        equations=(r"r = x - y + \frac{y}{1 + \kappa y}", r"y = \max(x - x_k, 0)"),
        symbols=(r"\kappa", "x_k"),
        source="a hyperbola beyond a knee",
        where=(("y", "travel beyond the knee"),),
    ),
    parameters=(
        Parameter(
            "inverse_range",
            "1/m",
            (0.0, 1e4),
            "inverse of the travel beyond the knee that reads half",
            20.0,
            0.0,
        ),
        Parameter(
            "knee",
            "m",
            (1e-5, 2e-2),
            "displacement at which the reading begins to fall behind",
            5e-4,
            starts=(0.3, 0.05, 0.5, 0.7),
            relative_to="displacement",
            logarithmic=True,
        ),
    ),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    beyond = max(x - c[k + 1], 0.0)
    return x - beyond * beyond * c[k] / (1.0 + beyond * c[k])
