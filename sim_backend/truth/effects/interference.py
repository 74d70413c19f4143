"""Mains interference in the reading, with its third harmonic.

A (sin(w t + a) + r sin(3 w t + b)), at a frequency near 50 or 60 Hz, as that of real mains.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.plumbing import tones
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["mains"]

_LEAST, _MOST = 3.5e-6, 60e-6  # m


def mains(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw mains hum of any phase."""
    size = log_uniform(generator, _LEAST, _MOST)
    hertz = float(generator.choice((50.0, 60.0)) + generator.uniform(-0.05, 0.05))
    third = generator.uniform(0.05, 0.5)
    phases = generator.uniform(0.0, 2.0 * math.pi, 2)

    parts = ((size, 1.0, phases[0]), (third * size, 3.0, phases[1]))
    return TruthEffect(
        family="interference",
        acts_on="sensor",
        description=(
            f"mains of {size * 1e6:.3g} um at {hertz:.2f} Hz, {third:.2f} of that at three times"
        ),
        on_motion=tones(parts, hertz),
    )
