"""Inertia of the hanging load, which the thesis leaves out.

The load moves with the film's lower edge, l1 = lam L1, so its inertial force m L1 lam'' over the
section L2 Z adds m L1/(L2 Z) to the coefficient of lam'': 208 kg/m for 200 g on the thesis's film,
against the film's own 1.9 kg/m. The film alone rings at about 70 Hz, with the load at about 7 Hz.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from model.effects.description import Effect, Parameter
from model.network import INERTIA

if TYPE_CHECKING:
    from model.material import Film, Load

__all__ = ["EFFECT"]


def _contribute(c: np.ndarray, values: Mapping[str, float], film: Film, _load: Load) -> None:
    c[INERTIA] += values["moving_mass"] * film.length / (film.width * film.thickness)


EFFECT = Effect(
    name="load inertia",
    family="load_inertia",
    acts_on="inertia",
    parameters=(
        Parameter(
            "moving_mass", "kg", 0.0, (0.0, 2.0), "mass that moves with the film's lower edge"
        ),
    ),
    contribute=_contribute,
)
