"""Leakage: the film conducts, and the resistor in series with it takes part of the voltage.

``poole_frenkel``: I = G v exp(b sqrt(v lam)), emission from traps (Frenkel, Phys. Rev. 54,
1938). ``hopping``: I = G/k sinh(k v), hops over equal barriers (Mott and Gurney). The field in the
stretched film is v lam/Z, hence lam. ``space_charge``: I = G v^2 lam^4/V_0, limited by the space
charge in the film (Mott and Gurney's law: square of the voltage, inverse cube of the thickness,
and area). ``tunnelling``: I = G v^2/B exp(-B/(v lam)), through barriers that the field makes
thinner (Fowler and Nordheim, Proc. R. Soc. A 119, 1928). The pull neglects that the film charges
through the series resistor: it takes less than a millisecond. The current does not.
"""

from __future__ import annotations

import math

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.film import FilmNumbers
from dearig.sim_backend.truth.sampling import log_uniform

__all__ = ["hopping", "poole_frenkel", "space_charge", "tunnelling"]

_SERIES = (1e6, 3e6)  # ohm
_LEAST, _MOST = 25.0, 500.0  # V lost at 8 kV
_AT = 8000.0  # V
_STRETCH = 1.2  # about that of the thesis's film; sizes are compared at this stretch


def poole_frenkel(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw Poole-Frenkel conduction."""
    series, current = _drawn(generator)
    exponent = generator.uniform(1.5, 4.5)
    return _leak(
        f"Poole-Frenkel, exponent {exponent:.2f}",
        series,
        current,
        leak_conductance=current / _AT / math.exp(exponent),
        leak_frenkel=exponent / math.sqrt(_AT * _STRETCH),
    )


def hopping(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw hopping conduction."""
    series, current = _drawn(generator)
    exponent = generator.uniform(1.0, 4.0)
    return _leak(
        f"hopping, exponent {exponent:.2f}",
        series,
        current,
        leak_conductance=current * exponent / _AT / math.sinh(exponent),
        leak_hopping=exponent / (_AT * _STRETCH),
    )


def space_charge(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw conduction limited by space charge."""
    series, current = _drawn(generator)
    return _leak(
        "space charge, by the square",
        series,
        current,
        leak_conductance=current / _AT / _STRETCH**4,
        leak_space=_AT,
    )


def tunnelling(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw conduction by tunnelling."""
    series, current = _drawn(generator)
    exponent = generator.uniform(1.0, 5.0)
    barrier = exponent * _AT * _STRETCH
    return _leak(
        f"tunnelling, exponent {exponent:.2f}",
        series,
        current,
        leak_conductance=current * barrier / _AT**2 * math.exp(exponent),
        leak_tunnel=barrier,
    )


def _drawn(generator: np.random.Generator) -> tuple[float, float]:
    """Return a drawn series resistance in ohm, and the current at 8 kV in A."""
    series = log_uniform(generator, *_SERIES)
    return series, log_uniform(generator, _LEAST, _MOST) / series


def _leak(words: str, series: float, current: float, **numbers: float) -> TruthEffect:
    def on_film(film: FilmNumbers) -> FilmNumbers:
        return film.hiding(leak_series=series, **numbers)

    return TruthEffect(
        family="leakage",
        acts_on="electrode",
        description=(
            f"leakage of {current * 1e6:.3g} uA at 8 kV ({words}) behind {series / 1e6:.3g} Mohm"
        ),
        on_film=on_film,
    )
