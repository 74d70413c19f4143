"""A load that swings from the start of the record, until its swing has died away.

A pendulum rises at both ends of its way, and the sensor below it sees that at twice its frequency.
What the film's motion excites is ``attached_mode``.
"""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "sense"]

EFFECT = Effect(
    name="swinging load",
    family="unknown",
    acts_on="sensor",
    summary="the load swings from the start, ever less, whatever the voltage does",
    law=Law(
        equations=(
            r"r = x + (a \cos \omega t + b \sin \omega t) \exp(-t/\tau) - a",
            r"\omega = 2 \pi f",
        ),
        symbols=("a", "b", "f", r"\tau"),
        source="a damped oscillator",
        where=((r"\omega", "angular frequency of the reading"),),
    ),
    parameters=(
        Parameter("cosine", "m", (-1e-3, 1e-3), "at the start", 5e-6, 0.0),
        Parameter("sine", "m", (-1e-3, 1e-3), "at the start", 5e-6, 0.0),
        Parameter(
            "frequency",
            "Hz",
            (0.5, 8.0),  # of the reading: pendulums of 4 m down to 2 cm
            "of the reading",
            2.0,
            starts=(2.0, 4.0),
            relative_to="spectrum",
        ),
        Parameter(
            "decay_time",
            "s",
            (0.5, 1e3),
            "in which the swing falls to 1/e",
            10.0,
            starts=(10.0, 3.0),
            logarithmic=True,
        ),
    ),
)


@jit
def sense(c, k, m, j, t, dt, x, u):
    phase = 2.0 * math.pi * c[k + 2] * t
    swing = c[k] * math.cos(phase) + c[k + 1] * math.sin(phase)
    return x + swing * math.exp(-t / c[k + 3]) - c[k]
