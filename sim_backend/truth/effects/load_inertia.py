"""The hung mass has to be moved too, with the fixture that it hangs on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.material import Load
from sim_backend.truth.effect import TruthEffect
from sim_backend.truth.film import FilmNumbers

__all__ = ["draw"]

# of the hung mass: what moves may be a little less (a guided load) or more (clamp and target)
_LEAST, _MOST = 0.9, 1.15


def draw(generator: np.random.Generator, load: Load) -> TruthEffect:
    """A moving mass near the hung one."""
    mass = load.mass * generator.uniform(_LEAST, _MOST)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        # m L1 lam'' over the section L2 Z
        return replace(numbers, inertia=numbers.inertia + mass * numbers.length / numbers.section)

    return TruthEffect(
        family="load_inertia",
        acts_on="inertia",
        description=f"a mass of {mass * 1e3:.1f} g moves with the film's lower edge",
        on_film=on_film,
    )
