"""The load moves through air and a guide, which resist in proportion to its speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.material import Load
from sim_backend.truth.effect import TruthEffect
from sim_backend.truth.film import FilmNumbers

__all__ = ["draw"]

# N s/m for each kg of load: at 7 Hz these are 0.6 % to 4 % of critical damping
_LEAST, _MOST = 0.5, 3.5


def draw(generator: np.random.Generator, load: Load) -> TruthEffect:
    """A linear drag coefficient in the range of a light guide."""
    coefficient = load.mass * generator.uniform(_LEAST, _MOST)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        # c L1 lam' over the section L2 Z
        return replace(numbers, drag=numbers.drag + coefficient * numbers.length / numbers.section)

    return TruthEffect(
        family="drag",
        acts_on="load",
        description=f"a linear drag of {coefficient:.3g} N s/m acts on the load",
        on_film=on_film,
    )
