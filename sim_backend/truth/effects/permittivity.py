"""Permittivity that depends on strain or on the field.

The value in the film's data is that of the film at its loaded rest state, without voltage.
``with_strain``: 1 + a u/sqrt(1 + u^2), u = (lam - lam_rest)/s: chains rotate until they are
aligned. ``with_field``: 1/(1 + (E/E_0)^2): dipoles saturate (as in Johnson's law to second order,
J. Appl. Phys. 33, 1962).
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import either_sign, log_uniform

__all__ = ["with_field", "with_strain"]

_STRAIN = (0.006, 0.25)  # change at a reach beyond rest
_REACH = (0.4e-3, 3e-3)  # m
_FIELD = (0.006, 0.25)  # (E/E_0)^2 at 8 kV over the film at a stretch of 1.2


def with_strain(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a change that saturates with strain."""
    reach = log_uniform(generator, *_REACH)
    change = either_sign(generator) * log_uniform(generator, *_STRAIN)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(
            permittivity_strain=change * math.sqrt(2.0), permittivity_reach=reach / numbers.length
        )

    return TruthEffect(
        family="permittivity",
        acts_on="dielectric",
        description=(
            f"the permittivity changes by {change:.2%} over the first {reach * 1e3:.2g} mm and "
            f"saturates"
        ),
        on_film=on_film,
    )


def with_field(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a permittivity that falls with the field."""
    size = log_uniform(generator, *_FIELD)
    per_square = size / (8000.0 * 1.2) ** 2

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(permittivity_field=per_square)

    return TruthEffect(
        family="permittivity",
        acts_on="dielectric",
        description=f"the field multiplies the permittivity by 1/(1 + {size:.3g}) at 8 kV",
        on_film=on_film,
    )
