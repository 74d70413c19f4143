"""Dry friction of any presliding: Prandtl and Ishlinskii's elements that slip within micrometres.

Six elements side by side, as in ``general_hysteresis``, whose thresholds are those of a friction
(Maxwell slip: Lampaert, Swevers and Al-Bender, IEEE Trans. Autom. Control 47, 2002): a geometric
series up to the reach. The friction does not depend on the rate.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dearig.model.effects.description import Curve, Effect, Parameter
from dearig.model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_ELEMENTS = 6
_RATIO = 2.2  # of neighbouring thresholds


def _loading(values: Mapping[str, float]) -> Curve:
    """Return the first loading, from which every loop follows by Masing's rules."""
    thresholds = values["reach"] * _RATIO ** -np.arange(_ELEMENTS - 1.0, -1.0, -1.0)
    stretch = np.concatenate(([0.0], np.geomspace(0.3 * thresholds[0], thresholds[-1], 60)))
    yields = np.array([values[f"yield_{i + 1}"] for i in range(_ELEMENTS)])
    stress_Pa = np.minimum(stretch[:, None] / thresholds, 1.0) @ yields
    return Curve(stretch, stress_Pa, "change of stretch", "stress of first loading (Pa)")


EFFECT = Effect(
    name="general friction",
    family="friction",
    acts_on="load",
    summary="a force against the motion that bends within micrometres before it slips",
    parameters=(
        *(
            Parameter(
                f"yield_{i + 1}", "Pa", (0.0, 1e5), f"yield stress of element {i + 1}", 10.0, 0.0
            )
            for i in range(_ELEMENTS)
        ),
        Parameter(
            "reach",
            "",
            (5e-5, 0.1),
            "change of stretch at which the last element yields",
            8e-4,
            starts=(8e-4,),
            logarithmic=True,
        ),
    ),
    memory=_ELEMENTS,
    drives=("voltage", "stretch"),
    is_hysteretic=True,
    is_general=True,
    curve=_loading,
)


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    total, threshold, travel = 0.0, c[k + _ELEMENTS], lam - lam0
    for i in range(_ELEMENTS - 1, -1, -1):
        if c[k + i] > 0.0:
            strain = min(max(m[j + i] + travel, -threshold), threshold)
            total += c[k + i] * strain / threshold
        threshold /= _RATIO
    return total


@jit
def stiffness(c, k, m, j, lam, rate):
    total, threshold = 0.0, c[k + _ELEMENTS]
    for i in range(_ELEMENTS - 1, -1, -1):
        total += c[k + i] / threshold
        threshold /= _RATIO
    return total, 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    threshold, travel = c[k + _ELEMENTS], lam - lam0
    for i in range(_ELEMENTS - 1, -1, -1):
        m[j + i] = min(max(m[j + i] + travel, -threshold), threshold)
        threshold /= _RATIO
    return 0
