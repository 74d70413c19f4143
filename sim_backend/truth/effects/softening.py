"""Softening with use: the equilibrium spring loses a share of its modulus.

``first_loading``: a permanent damage d = a q/(1 + q), q = (reach of the largest stretch so far /
s)^p (the Mullins effect, with an algebraic law of our own). ``ageing``: d = a ln(1 + path/s) over
the path travelled, as of fatigue that slows down.
"""

from __future__ import annotations

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["ageing", "first_loading"]

_FIRST = (0.00015, 0.006)  # share lost at a reach of s; the limit is twice that
_PATH = (0.00012, 0.008)  # share lost for each unit of the logarithm


def first_loading(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw damage by the largest stretch so far."""
    lost = log_uniform(generator, *_FIRST)
    reach = log_uniform(generator, 0.4e-3, 1.5e-3)
    exponent = generator.uniform(1.0, 2.0)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(
            damage=2.0 * lost, damage_reach=reach / numbers.length, damage_exponent=exponent
        )

    return TruthEffect(
        family="softening",
        acts_on="film stress",
        description=(
            f"first loading to {reach * 1e3:.2g} mm costs {lost:.2%} of mu_0 (power "
            f"{exponent:.2f}, twice that in the end)"
        ),
        on_film=on_film,
    )


def ageing(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw damage by the path travelled."""
    lost = log_uniform(generator, *_PATH)
    reach = log_uniform(generator, 1e-3, 8e-3)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(ageing=lost, ageing_reach=reach / numbers.length)

    return TruthEffect(
        family="softening",
        acts_on="film stress",
        description=(
            f"mu_0 falls by {lost:.3%} times the logarithm of the path in {reach * 1e3:.2g} mm"
        ),
        on_film=on_film,
    )
