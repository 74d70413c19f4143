"""Dielectric relaxation: part of the polarisation lags behind the field, and so does the stress.

The Maxwell stress is proportional to voltage times polarisation, in which each part w obeys
w' = (v - w)/T. The parts add up to the static permittivity, which is that of the film's data.
``three_terms``: three Debye terms drawn one by one. ``cole_cole``: the broad spectrum of Cole and
Cole, J. Chem. Phys. 9 (1941), in eight terms.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.plumbing import relaxing
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["cole_cole", "three_terms"]

_LEAST, _MOST = 0.028, 0.4  # of the permittivity


def three_terms(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw three Debye terms about a decade apart."""
    times = np.array([0.02, 0.2, 2.0]) * np.exp(generator.uniform(-0.8, 0.8, 3))
    shares = log_uniform(generator, _LEAST, _MOST) * generator.dirichlet((3.0, 3.0, 3.0))
    late = ", ".join(f"{time:.2g}" for time in times)
    return relaxing(shares, times, f"with time constants of {late} s")


def cole_cole(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a broad spectrum about one time."""
    share = log_uniform(generator, _LEAST, _MOST)
    centre = log_uniform(generator, 0.05, 0.8)
    alpha = generator.uniform(0.25, 0.55)
    x = np.linspace(-4.0, 4.0, 8)  # ln(T/T_0)
    density = math.sin(alpha * math.pi) / (np.cosh((1.0 - alpha) * x) - math.cos(alpha * math.pi))
    return relaxing(
        share * density / density.sum(),
        centre * np.exp(x),
        f"spread about {centre:.2g} s (Cole-Cole, alpha {alpha:.2f})",
    )
