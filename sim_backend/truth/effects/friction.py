"""Friction of the load in its guide: bristles bend before they slip, with a Stribeck curve.

``lugre``: Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Autom. Control 40 (1995):
x' = v - |v| x / x_s(v), force s0 x + s1 x', with x_s = (Fc + (Fs - Fc) exp(-(v/vs)^2))/s0 after
Stribeck. ``elasto_plastic``: Dupont, Hayward, Armstrong and Altpeter, same Trans. 47 (2002): up to
a share of x_s the bristles only bend, so the load does not creep under an oscillating force.
``tustin``: as the first, but weakening with speed as exp(-|v|/vs) (Tustin, J. IEE 94 (1947)), with
a corner at rest. ``oiled``: as the first, but weakening as 1/(1 + (v/vs)^2), for a contact in oil
(Hess and Soom, J. Tribology 112 (1990)), so that some of it remains at any speed.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["elasto_plastic", "lugre", "oiled", "tustin"]

_LEAST, _MOST = 0.4e-3, 18e-3  # N
_REACH = (4e-6, 30e-6)  # m
_RATIO = (1.05, 1.6)  # static over Coulomb
_STRIBECK = (0.5e-3, 5e-3)  # m/s
_DAMPING = 0.3  # of the critical damping of the film's mass


def _friction(
    generator: np.random.Generator, elastic: float, words: str, easing: float = 2.0
) -> TruthEffect:
    force = log_uniform(generator, _LEAST, _MOST)
    reach = log_uniform(generator, *_REACH)
    ratio = generator.uniform(*_RATIO)
    stribeck = log_uniform(generator, *_STRIBECK)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        stress = force / numbers.section
        stiffness = stress * numbers.length / reach
        fastest = math.sqrt(stiffness / numbers.inertia)
        return numbers.stepping(0.25 / fastest).hiding(
            friction=stress,
            friction_static=ratio * stress,
            friction_stribeck=stribeck / numbers.length,
            friction_reach=reach / numbers.length,
            friction_damping=2.0 * _DAMPING * math.sqrt(stiffness * numbers.inertia),
            friction_elastic=elastic,
            friction_easing=easing,
        )

    return TruthEffect(
        family="friction",
        acts_on="load",
        description=(
            f"{words} of {force * 1e3:.3g} mN, {ratio:.2f} times that below {stribeck * 1e3:.2g} "
            f"mm/s, bending over {reach * 1e6:.3g} um"
        ),
        on_film=on_film,
    )


def lugre(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw bristles that slip from the first deflection on."""
    return _friction(generator, 0.0, "friction (LuGre)")


def elasto_plastic(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw bristles that are elastic up to a share of the slip deflection."""
    share = generator.uniform(0.4, 0.8)
    return _friction(generator, share, f"friction (elastic up to {share:.2f} of slip)")


def tustin(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw LuGre bristles whose friction falls with exp(-|v|/vs)."""
    return _friction(generator, 0.0, "friction (Tustin)", easing=1.0)


def oiled(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw LuGre bristles whose friction falls with 1/(1 + (v/vs)^2)."""
    return _friction(generator, 0.0, "friction (Hess and Soom)", easing=0.0)
