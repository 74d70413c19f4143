"""Inertia of the load: the hung mass and its fixture move with the film."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["hung", "moving"]

# of the hung mass; the moving mass is smaller with a guide or counterweight, larger with a clamp
_LEAST, _MOST = 0.6, 1.2


def moving(mass: float) -> TruthEffect:
    """Return the effect of ``mass`` kg at the film's lower edge: stress m L1 lam''/(L2 Z)."""

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return replace(numbers, inertia=numbers.inertia + mass * numbers.length / numbers.section)

    return TruthEffect(
        family="load_inertia",
        acts_on="inertia",
        description=f"a mass of {mass * 1e3:.1f} g moves with the film's lower edge",
        on_film=on_film,
    )


def hung(generator: np.random.Generator, load: Load) -> TruthEffect:
    """Draw a moving mass near the hung one."""
    return moving(load.mass * log_uniform(generator, _LEAST, _MOST))
