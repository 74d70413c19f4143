"""End stop: the load touches something beyond some travel. In no family.

A soft contact of Hunt and Crossley, J. Appl. Mech. 42 (1975): k d^1.5 (1 + c d'), in compression
only.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["end_stop"]

_TRAVEL = (0.5e-3, 0.85e-3)  # m
_FORCE = (1.5e-3, 0.05)  # N at a depth of 0.5 mm
_DEPTH = 0.5e-3  # m
_DAMPING = 20.0  # s/m


def end_stop(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw an elastic stop within the film's stroke."""
    travel = generator.uniform(*_TRAVEL)
    force = log_uniform(generator, *_FORCE)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        stiffness = force / numbers.section / (_DEPTH / numbers.length) ** 1.5
        # slope of the stop at a depth of 1.5 mm
        slope = 1.5 * stiffness * math.sqrt(1.5e-3 / numbers.length)
        return numbers.stepping(0.5 / math.sqrt(slope / numbers.inertia)).hiding(
            stop_travel=travel / numbers.length,
            stop_stiffness=stiffness,
            stop_damping=_DAMPING * numbers.length,
        )

    return TruthEffect(
        family="unknown",
        acts_on="load",
        description=(
            f"the load touches a stop at {travel * 1e3:.3g} mm, {force * 1e3:.3g} mN at half a "
            f"millimetre more"
        ),
        on_film=on_film,
    )
