"""A weakly damped mass on a spring at the edge of the film: a ringing frame, a swinging load.

The position w of the mass, as a strain, obeys w'' = -2 z om w' - om^2 (w - e), e = lam - lam_rest;
the spring adds the stress s (e - w). It belongs to no named family.
"""

from __future__ import annotations

import math

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.shared.filters import swung

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

EFFECT = Effect(
    name="attached mode",
    family="unknown",
    acts_on="load",
    summary="a second mass rings at its own frequency after every edge",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + k (\delta - w)",
            r"\ddot{w} = -2 \zeta \omega \dot{w} - \omega^2 (w - \delta)",
            r"\omega = 2 \pi f",
            r"\delta = \lambda - \lambda_0",
        ),
        symbols=("k", "f", r"\zeta"),
        source="a mass on a spring with a damper",
        where=(
            ("w", "position of the mass, as a stretch from rest"),
            (r"\omega", "angular frequency of the mass"),
        ),
    ),
    parameters=(
        Parameter(
            "stiffness",
            "Pa",
            (0.0, 1e6),
            "of the spring that holds the mass, as stress per stretch",
            5e3,
            0.0,
        ),
        Parameter(
            "frequency",
            "Hz",
            (0.3, 40.0),
            "of the mass on its spring",
            5.0,
            starts=(4.0, 2.0, 8.0, 15.0),
            relative_to="spectrum",
            logarithmic=True,
        ),
        Parameter("damping", "", (1e-3, 1.0), "ratio", 0.05, starts=(0.05,), logarithmic=True),
    ),
    memory=2,
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    # within a step it moves on with its own rate: exact to the second order in the step
    return c[k] * (lam - c[REST] - m[j] - since * m[j + 1])


@jit
def stiffness(c, k, m, j, lam, rate):
    return c[k], 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    e0, e1 = lam0 - c[REST], lam - c[REST]
    omega = 2.0 * math.pi * c[k + 1]
    m[j], m[j + 1] = swung(m[j], m[j + 1], e0, e1, h, omega, c[k + 2])
    return 0
