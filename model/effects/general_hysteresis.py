"""Rate-independent hysteresis of any form: Prandtl and Ishlinskii's sum of yielding elements.

Ten elements side by side, each a spring that yields beyond its threshold of stretch; the thresholds
are a geometric series up to the reach. The yield stresses are the weights (Visintin, Differential
Models of Hysteresis, 1994). It has every loop that obeys Masing's rules, between its thresholds to
a straight line.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dearig.model.effects.description import Curve, Effect, Parameter
from dearig.model.jit import jit

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_ELEMENTS = 10
_RATIO = 1.7  # of neighbouring thresholds


def _loading(values: Mapping[str, float]) -> Curve:
    """Return the first loading, from which every loop follows by Masing's rules."""
    thresholds = values["reach"] * _RATIO ** -np.arange(_ELEMENTS - 1.0, -1.0, -1.0)
    stretch = np.concatenate(([0.0], np.geomspace(0.3 * thresholds[0], thresholds[-1], 60)))
    yields = np.array([values[f"yield_{i + 1}"] for i in range(_ELEMENTS)])
    stress_Pa = np.minimum(stretch[:, None] / thresholds, 1.0) @ yields
    return Curve(stretch, stress_Pa, "change of stretch", "stress of first loading (Pa)")


EFFECT = Effect(
    name="general hysteresis",
    family="rate_independent_hysteresis",
    acts_on="film stress",
    summary="hysteresis loops of any form, at any speed",
    parameters=(
        *(
            Parameter(
                f"yield_{i + 1}", "Pa", (0.0, 1e5), f"yield stress of element {i + 1}", 15.0, 0.0
            )
            for i in range(_ELEMENTS)
        ),
        Parameter(
            "reach",
            "",
            (1e-3, 4.0),
            "change of stretch at which the last element yields",
            2.4e-2,
            starts=(2.4e-2, 1.0),
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
