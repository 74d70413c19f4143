"""How an effect describes itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from model.material import Film, Load

__all__ = ["ACTS_ON", "Effect", "Parameter"]

#: The places of the signal path where an effect can act.
ACTS_ON = (
    "amplifier",
    "electrode",
    "dielectric",
    "film stress",
    "inertia",
    "load",
    "sensor",
    "environment",
)


@dataclass(frozen=True)
class Parameter:
    """One number of an effect: SI ``unit``, ``neutral`` value at which it vanishes, ``bounds``."""

    name: str
    unit: str
    neutral: float
    bounds: tuple[float, float]
    meaning: str


@dataclass(frozen=True)
class Effect:
    """A physical effect: what it is called, where it acts, its parameters, what it contributes.

    ``contribute(coefficients, values, film, load)`` adds the effect, in place, to a coefficient
    vector as laid out in ``model.network``; at the neutral values it adds nothing.
    """

    name: str
    family: str
    acts_on: str
    parameters: tuple[Parameter, ...]
    contribute: Callable[[np.ndarray, Mapping[str, float], Film, Load], None]
