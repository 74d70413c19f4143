"""Dry friction of any presliding: Prandtl and Ishlinskii's elements that slip within micrometres.

Six elements side by side, as in ``general_hysteresis``, whose thresholds are those of a friction
(Maxwell slip: Lampaert, Swevers and Al-Bender, IEEE Trans. Autom. Control 47, 2002): a geometric
series up to the reach. The friction does not depend on the rate.
"""

from __future__ import annotations

from collections.abc import Mapping

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.shared.yield_elements import carry, first_loading, pull, slope

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_ELEMENTS = 6
_RATIO = 2.2  # of neighbouring thresholds


def _loading(values: Mapping[str, float]) -> Curve:
    return first_loading(values, _ELEMENTS, _RATIO)


EFFECT = Effect(
    name="general friction",
    family="friction",
    acts_on="load",
    summary="a force against the motion that bends within micrometres before it slips",
    law=Law(
        equations=(
            r"\sigma = \sigma_0 + \sum_{i=1}^{6} Y_i \frac{z_i}{s_i}",
            r"\dot{z}_i = \dot{\lambda} \quad \mathrm{within} \quad |z_i| \le s_i",
            r"s_i = 2.2^{i - 6}\,r",
        ),
        symbols=(*(f"Y_{{{i}}}" for i in range(1, 7)), "r"),
        source=(
            "V. Lampaert, J. Swevers and F. Al-Bender, IEEE Trans. Autom. Control 47, 683 (2002)"
        ),
        where=(
            ("z_i", "stretch of element i, which yields at its threshold"),
            ("s_i", "threshold of element i"),
            ("Y_i", "yield stress of element i"),
        ),
    ),
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
    return pull(c, k, m, j, lam - lam0, _ELEMENTS, _RATIO)


@jit
def stiffness(c, k, m, j, lam, rate):
    return slope(c, k, _ELEMENTS, _RATIO), 0.0


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    carry(c, k, m, j, lam - lam0, _ELEMENTS, _RATIO)
    return 0
