"""Rate-independent hysteresis: filler clusters slide, and slow cycles keep the loop's width.

``bouc_wen``: stress K b with b' = lam'/a (1 - |b|^n (1 - s + s sign(lam' b))) (Wen, J. Eng. Mech.
Div. ASCE 102, 1976), n different from 1. ``iwan``: many stops in parallel whose reaches follow a
power law (Iwan, J. Appl. Mech. 33, 1966; density as in Segalman, J. Appl. Mech. 72, 2005), so that
the loss in a small loop is a power of its width.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["bouc_wen", "iwan"]

_LEAST, _MOST = 5.0, 350.0  # Pa, nominal stress after full sliding
_REACH = (30e-6, 400e-6)  # m
_ELEMENTS = 12


def bouc_wen(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a smooth loop of Bouc and Wen."""
    stress = log_uniform(generator, _LEAST, _MOST)
    reach = log_uniform(generator, *_REACH)
    exponent = generator.uniform(1.3, 3.0)
    share = generator.uniform(0.5, 0.9)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(
            bouc=stress,
            bouc_reach=reach / numbers.length,
            bouc_exponent=exponent,
            bouc_share=share,
        )

    return TruthEffect(
        family="rate_independent_hysteresis",
        acts_on="film stress",
        description=(
            f"a rate-independent loop (Bouc-Wen, exponent {exponent:.2f}) of {stress:.3g} Pa over "
            f"{reach * 1e6:.3g} um"
        ),
        on_film=on_film,
    )


def iwan(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw twelve stops whose reaches follow a power law."""
    stress = log_uniform(generator, _LEAST, _MOST)
    longest = log_uniform(generator, 4.0 * _REACH[0], 3.0 * _REACH[1])
    power = generator.uniform(-0.7, 0.3)
    reaches = longest * np.geomspace(0.01, 1.0, _ELEMENTS)
    # yield stress of each: density r^power over a logarithmic grid, times its own reach
    yields = reaches ** (power + 2.0)
    yields *= stress / yields.sum()

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        strains = reaches / numbers.length
        elements = zip(strains.tolist(), (yields / strains).tolist(), strict=True)
        return replace(numbers, stops=(*numbers.stops, *elements))

    return TruthEffect(
        family="rate_independent_hysteresis",
        acts_on="film stress",
        description=(
            f"a rate-independent loop (Iwan, power {power:.2f}) of {stress:.3g} Pa over up to "
            f"{longest * 1e6:.3g} um"
        ),
        on_film=on_film,
    )
