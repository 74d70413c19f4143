"""The hung mass has to be moved too, with the fixture that it hangs on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dearig.model.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["hung", "moving"]

# of the hung mass: what moves may be less (a guided load, a counterweight) or more (clamp, target)
_LEAST, _MOST = 0.6, 1.2


def moving(mass: float) -> TruthEffect:
    """``mass`` in kg moves with the film's lower edge: m L1 lam'' over the section L2 Z."""

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return replace(numbers, inertia=numbers.inertia + mass * numbers.length / numbers.section)

    return TruthEffect(
        family="load_inertia",
        acts_on="inertia",
        description=f"a mass of {mass * 1e3:.1f} g moves with the film's lower edge",
        on_film=on_film,
    )


def hung(generator: np.random.Generator, load: Load) -> TruthEffect:
    """A moving mass near the hung one."""
    return moving(load.mass * log_uniform(generator, _LEAST, _MOST))
