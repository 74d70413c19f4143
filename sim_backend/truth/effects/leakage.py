"""The film conducts, and what it takes is lost over the resistor in series with it.

``poole_frenkel``: I = G v exp(b sqrt(v lam)), traps emptied by the field (Frenkel, Phys. Rev. 54,
1938). ``hopping``: I = G/k sinh(k v), hops over equal barriers (Mott and Gurney). The field in the
stretched film is v lam/Z, hence lam. ``space_charge``: I = G v^2 lam^4/V_0, limited by the charge
that is in the film (Mott and Gurney's law, by the square of the voltage, the inverse cube of the
thickness and the area). The film charges through the series resistor in far less than a sample:
that is left out.
"""

from __future__ import annotations

import math

import numpy as np

from model.material import Load
from sim_backend.truth.chance import log_uniform
from sim_backend.truth.effect import TruthEffect
from sim_backend.truth.film import FilmNumbers

__all__ = ["hopping", "poole_frenkel", "space_charge"]

_SERIES = (1e6, 3e6)  # ohm
_LEAST, _MOST = 25.0, 500.0  # V lost at 8 kV
_AT = 8000.0  # V
_STRETCH = 1.2  # about that of the thesis's film: where the sizes are compared


def poole_frenkel(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Conduction by traps."""
    series = log_uniform(generator, *_SERIES)
    current = log_uniform(generator, _LEAST, _MOST) / series
    exponent = generator.uniform(1.5, 4.5)
    frenkel = exponent / math.sqrt(_AT * _STRETCH)
    conductance = current / _AT / math.exp(exponent)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(
            leak_series=series, leak_conductance=conductance, leak_frenkel=frenkel
        )

    return TruthEffect(
        family="leakage",
        acts_on="electrode",
        description=(
            f"leakage of {current * 1e6:.3g} uA at 8 kV (Poole-Frenkel, exponent {exponent:.2f}) "
            f"behind {series / 1e6:.3g} Mohm"
        ),
        on_film=on_film,
    )


def hopping(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Conduction by hops."""
    series = log_uniform(generator, *_SERIES)
    current = log_uniform(generator, _LEAST, _MOST) / series
    exponent = generator.uniform(1.0, 4.0)
    per_volt = exponent / (_AT * _STRETCH)
    conductance = current * exponent / _AT / math.sinh(exponent)

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(
            leak_series=series, leak_conductance=conductance, leak_hopping=per_volt
        )

    return TruthEffect(
        family="leakage",
        acts_on="electrode",
        description=(
            f"leakage of {current * 1e6:.3g} uA at 8 kV (hopping, exponent {exponent:.2f}) behind "
            f"{series / 1e6:.3g} Mohm"
        ),
        on_film=on_film,
    )


def space_charge(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Conduction that is limited by the charge on its way."""
    series = log_uniform(generator, *_SERIES)
    current = log_uniform(generator, _LEAST, _MOST) / series

    def on_film(numbers: FilmNumbers) -> FilmNumbers:
        return numbers.hiding(
            leak_series=series, leak_conductance=current / _AT / _STRETCH**4, leak_space=_AT
        )

    return TruthEffect(
        family="leakage",
        acts_on="electrode",
        description=(
            f"leakage of {current * 1e6:.3g} uA at 8 kV (space charge, by the square) behind "
            f"{series / 1e6:.3g} Mohm"
        ),
        on_film=on_film,
    )
