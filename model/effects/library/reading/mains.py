"""Mains interference on the reading: the mains frequency and its third harmonic, at any phase."""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="mains interference",
    family="interference",
    acts_on="sensor",
    summary="a line at the mains frequency in the spectrum of the reading",
    law=Law(
        equations=(
            (
                r"r = x + a_1 \cos \omega t + b_1 \sin \omega t + a_3 \cos 3\omega t + b_3 \sin "
                r"3\omega t"
            ),
            r"\omega = 2 \pi f",
        ),
        symbols=("a_1", "b_1", "a_3", "b_3", "f"),
        source="a Fourier series",
        where=((r"\omega", "angular frequency"),),
    ),
    parameters=(
        Parameter("cosine", "m", (-1e-3, 1e-3), "of the fundamental", 2e-6, 0.0),
        Parameter("sine", "m", (-1e-3, 1e-3), "of the fundamental", 2e-6, 0.0),
        Parameter("third_cosine", "m", (-1e-3, 1e-3), "of the third harmonic", 1e-6, 0.0),
        Parameter("third_sine", "m", (-1e-3, 1e-3), "of the third harmonic", 1e-6, 0.0),
        Parameter(
            "frequency",
            "Hz",
            (45.0, 65.0),
            "of the mains",
            0.02,
            starts=(50.0, 60.0),
            relative_to="spectrum",
        ),
    ),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    phase = 2.0 * math.pi * c[k + 4] * t
    first = c[k] * math.cos(phase) + c[k + 1] * math.sin(phase)
    return x + first + c[k + 2] * math.cos(3.0 * phase) + c[k + 3] * math.sin(3.0 * phase)
