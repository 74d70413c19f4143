"""Creep of the film for minutes: slow Maxwell branches, more than a fit has.

``fractional``: a springpot, relaxation modulus G t^-a (Koeller, J. Appl. Mech. 51, 1984) between
two times: branches with logarithmically spaced times and moduli in proportion to T^-a.
``broad``: a flat spectrum between two times, which creeps with the logarithm of time.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["broad", "fractional"]

_FRACTIONAL = (0.015, 0.5)  # sum of the moduli, of mu_0
_BROAD = (0.012, 0.3)
_BRANCHES = 6


def _creeping(shares: np.ndarray, times: np.ndarray, words: str) -> TruthEffect:
    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        moduli = numbers.moduli[0] * shares
        return replace(
            numbers,
            moduli=(*numbers.moduli, *moduli.tolist()),
            limits=(*numbers.limits, *(math.inf for _ in times)),
            times=(*numbers.times, *times.tolist()),
        )

    return TruthEffect(
        family="creep",
        acts_on="film stress",
        description=(
            f"creep: {shares.sum():.2%} of mu_0 more relaxes between {times[0]:.2g} and "
            f"{times[-1]:.3g} s, {words}"
        ),
        on_film=on_film,
    )


def fractional(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw creep by a power law of time."""
    exponent = generator.uniform(0.1, 0.35)
    times = log_uniform(generator, 1.5, 4.0) * np.geomspace(1.0, 150.0, _BRANCHES)
    shares = times**-exponent
    shares *= log_uniform(generator, *_FRACTIONAL) / shares.sum()
    return _creeping(shares, times, f"by the power {exponent:.2f} of time")


def broad(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw creep by the logarithm of time."""
    times = log_uniform(generator, 1.0, 3.0) * np.geomspace(1.0, 300.0, _BRANCHES)
    shares = np.full(_BRANCHES, log_uniform(generator, *_BROAD) / _BRANCHES)
    return _creeping(shares, times, "by the logarithm of time")
