"""Rate-independent hysteresis of any form: Prandtl and Ishlinskii's sum of yielding elements.

Ten elements side by side, each a spring that yields beyond its threshold of stretch; the thresholds
are a geometric series up to the reach. The yield stresses are the weights (Visintin, Differential
Models of Hysteresis, 1994). It has every loop that obeys Masing's rules, between its thresholds to
a straight line.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.shared.general import Axis, Elements, Weights, general
from dearig.model.effects.shared.yield_elements import carry, pull, slope

__all__ = ["EFFECT", "commit", "stiffness", "stress"]

_ELEMENTS = 10
_RATIO = 1.7  # of neighbouring thresholds

EFFECT = general(
    name="general hysteresis",
    family="rate_independent_hysteresis",
    acts_on="film stress",
    summary="hysteresis loops of any form, at any speed",
    equations=(
        r"\sigma = \sigma_0 + \sum_{i=1}^{10} Y_i \frac{z_i}{s_i}",
        r"\dot{z}_i = \dot{\lambda} \quad \mathrm{within} \quad |z_i| \le s_i",
        r"s_i = 1.7^{i - 10}\,r",
    ),
    source="A. Visintin, Differential Models of Hysteresis (1994)",
    shapes=Elements(_ELEMENTS, _RATIO),
    weights=Weights(
        "yield", "Y", "Pa", (0.0, 1e5), "yield stress of element", 15.0,
        stands_for="yield stress of element i",
    ),
    scale=(
        Parameter(
            "reach", "", (1e-3, 4.0), "change of stretch at which the last element yields", 2.4e-2,
            starts=(2.4e-2, 1.0), logarithmic=True,
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
