"""Drag on the load from air, oil or a greased guide; it grows with the speed.

``mixed``: c v + d |v| v, a viscous guide and the wake of a paddle, with d such that both terms are
equal at a drawn speed. ``air_film``: k |v|^1.5 sign(v), between the two, as for a boundary layer
(Blasius: skin friction of a plate is proportional to v^1.5).
"""

from __future__ import annotations

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["air_film", "mixed"]

_SPEED = 0.003  # m/s, typical of a lobe; sizes are compared at this speed
_LEAST, _MOST = 0.8, 18.0  # N s/m at that speed


def mixed(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a linear and a quadratic drag together."""
    size = log_uniform(generator, _LEAST, _MOST)
    equal_at = log_uniform(generator, 0.002, 0.02)
    linear = size / (1.0 + _SPEED / equal_at)
    quadratic = linear / equal_at

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        per_rate = numbers.length / numbers.section
        return numbers.hiding(
            drag=linear * per_rate, drag_quadratic=quadratic * numbers.length * per_rate
        )

    return TruthEffect(
        family="drag",
        acts_on="load",
        description=(
            f"drag of {linear:.3g} N s/m, and as much again in proportion to the square of the "
            f"speed at {equal_at * 1e3:.2g} mm/s"
        ),
        on_film=on_film,
    )


def air_film(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a drag in proportion to the speed to the power of 1.5."""
    factor = log_uniform(generator, _LEAST, _MOST) / _SPEED**0.5

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        per_rate = numbers.length / numbers.section
        return numbers.hiding(drag_power=factor * numbers.length**0.5 * per_rate)

    return TruthEffect(
        family="drag",
        acts_on="load",
        description=f"drag of {factor:.3g} N (s/m)^1.5 times the speed to the power of 1.5",
        on_film=on_film,
    )
