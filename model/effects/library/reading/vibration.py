"""Vibration of the bench in the reading: a pump, a fan or the floor, with its second harmonic."""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="vibration",
    family="interference",
    acts_on="sensor",
    summary="a line in the spectrum of the reading, whatever the voltage does",
    law=Law(
        equations=(
            (
                r"r = x + a_1 \cos \omega t + b_1 \sin \omega t + a_2 \cos 2\omega t + b_2 \sin "
                r"2\omega t"
            ),
            r"\omega = 2 \pi f",
        ),
        symbols=("a_1", "b_1", "a_2", "b_2", "f"),
        source="a Fourier series",
        where=((r"\omega", "angular frequency"),),
    ),
    parameters=(
        Parameter("cosine", "m", (-1e-3, 1e-3), "of the fundamental", 2e-6, 0.0),
        Parameter("sine", "m", (-1e-3, 1e-3), "of the fundamental", 2e-6, 0.0),
        Parameter("second_cosine", "m", (-1e-3, 1e-3), "of the second harmonic", 1e-6, 0.0),
        Parameter("second_sine", "m", (-1e-3, 1e-3), "of the second harmonic", 1e-6, 0.0),
        # slower, a swinging load is told from it by its decay only
        Parameter(
            "frequency",
            "Hz",
            (8.0, 500.0),
            "of the fundamental",
            0.02,
            starts=(25.0,),  # a motor of 1500/min
            relative_to="spectrum",
        ),
    ),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    phase = 2.0 * math.pi * c[k + 4] * t
    first = c[k] * math.cos(phase) + c[k + 1] * math.sin(phase)
    return x + first + c[k + 2] * math.cos(2.0 * phase) + c[k + 3] * math.sin(2.0 * phase)
