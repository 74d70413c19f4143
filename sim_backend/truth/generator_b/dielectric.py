"""Permittivity and its relaxation, by generator B.

Relaxation. ``kohlrausch``: the polarisation follows a step as 1 - exp(-(t/T)^b) (Kohlrausch 1854;
Williams and Watts, Trans. Faraday Soc. 66, 1970). ``havriliak_negami``: the spectrum of 1/(1 +
(i w T)^a)^b (Havriliak and Negami, Polymer 8, 1967), which is asymmetric.

Permittivity. ``booth``: the share of dipoles follows Langevin's function, 3/u (coth u - 1/u)
(Booth, J. Chem. Phys. 19, 1951). ``johnson``: (1 + 3 b E^2)^(-1/3) (Johnson, J. Appl. Phys. 33,
1962). ``peaked``: a parabola in the stretch, as fitted to measured films (Jean-Mistral, Sylvestre,
Basrour and Chaillout, Smart Mater. Struct. 19, 2010).
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.generator_b.spectrum import asymmetric, stretched_exponential
from dearig.sim_backend.truth.plumbing import relaxing
from dearig.sim_backend.truth.sampling import either_sign, log_uniform

__all__ = ["booth", "havriliak_negami", "johnson", "kohlrausch", "peaked"]

_RELAXING = (0.04, 0.4)  # of the permittivity
_CHANGE = (0.008, 0.2)  # of the permittivity at 8 kV, or over 1.5 mm
_FIELD = (8000.0 * 1.2) ** 2  # V^2, of 8 kV over the film at a stretch of 1.2


def kohlrausch(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a stretched exponential."""
    share = log_uniform(generator, *_RELAXING)
    time = log_uniform(generator, 0.05, 1.5)
    exponent = generator.uniform(0.35, 0.75)
    weights, times = stretched_exponential(exponent)
    return relaxing(
        share * weights,
        time * times,
        f"as a stretched exponential of {time:.2g} s to the power of {exponent:.2f}",
    )


def havriliak_negami(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw an asymmetric broad spectrum."""
    share = log_uniform(generator, *_RELAXING)
    time = log_uniform(generator, 0.05, 1.5)
    a, b = generator.uniform(0.5, 0.85), generator.uniform(0.3, 0.7)
    weights, times = asymmetric(a, b)
    return relaxing(
        share * weights,
        time * times,
        f"spread about {time:.2g} s (Havriliak-Negami, {a:.2f} and {b:.2f})",
    )


def _depending(words: str, **numbers: float) -> TruthEffect:
    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.obeying(**numbers)

    return TruthEffect(
        family="permittivity", acts_on="dielectric", description=words, on_film=on_film
    )


def booth(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw dipoles that saturate in the field."""
    lost = log_uniform(generator, *_CHANGE)
    u = generator.uniform(1.0, 5.0)  # of Langevin's function at 8 kV
    share = lost / (1.0 - 3.0 / u * (1.0 / math.tanh(u) - 1.0 / u))
    share = min(share, 0.9)
    return _depending(
        f"{share:.2%} of the permittivity saturates by Langevin's function, {u:.2f} at 8 kV",
        booth=share,
        booth_square=_FIELD / u**2,
    )


def johnson(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw Johnson's law."""
    lost = log_uniform(generator, *_CHANGE)
    return _depending(
        f"the field lowers the permittivity by {lost:.2%} at 8 kV (Johnson)",
        johnson=((1.0 - lost) ** -3.0 - 1.0) / 3.0 / _FIELD,
    )


def peaked(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a parabola in the stretch."""
    change = either_sign(generator) * log_uniform(generator, *_CHANGE)
    far = 0.02  # stretch of 1.5 mm
    bend = generator.uniform(-1.5, 1.5)
    return _depending(
        f"the permittivity changes by {change:.2%} (x + {bend:.2f} x^2), x the travel in 1.5 mm",
        peak_slope=change / far,
        peak_bend=bend * change / far**2,
    )
