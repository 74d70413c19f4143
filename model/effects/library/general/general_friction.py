"""Dry friction of any presliding: Prandtl and Ishlinskii's elements that slip within micrometres.

Six elements side by side, as in ``general_hysteresis``, whose thresholds are those of a friction
(Maxwell slip: Lampaert, Swevers and Al-Bender, IEEE Trans. Autom. Control 47, 2002): a geometric
series up to the reach. The friction does not depend on the rate.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.shared.general import Axis, Elements, Weights, general
from dearig.model.effects.shared.yield_elements import carry, pull, slope

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_ELEMENTS = 6
_RATIO = 2.2  # of neighbouring thresholds

EFFECT = general(
    name="general friction",
    family="friction",
    acts_on="load",
    summary="a force against the motion that bends within micrometres before it slips",
    equations=(
        r"\sigma = \sigma_0 + \sum_{i=1}^{6} Y_i \frac{z_i}{s_i}",
        r"\dot{z}_i = \dot{\lambda} \quad \mathrm{within} \quad |z_i| \le s_i",
        r"s_i = 2.2^{i - 6}\,r",
    ),
    source="V. Lampaert, J. Swevers and F. Al-Bender, IEEE Trans. Autom. Control 47, 683 (2002)",
    shapes=Elements(_ELEMENTS, _RATIO),
    weights=Weights(
        "yield", "Y", "Pa", (0.0, 1e5), "yield stress of element", 10.0,
        stands_for="yield stress of element i",
    ),
    scale=(
        Parameter(
            "reach", "", (5e-5, 0.1), "change of stretch at which the last element yields", 8e-4,
            starts=(8e-4,), logarithmic=True,
        ),
        "r",
    ),
    over=Axis("change of stretch"),
    shows=Axis("stress of first loading (Pa)"),
    memory=_ELEMENTS,
    drives=("voltage", "stretch"),
    is_hysteretic=True,
)  # fmt: skip


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
