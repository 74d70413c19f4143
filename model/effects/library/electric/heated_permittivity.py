"""Permittivity that changes as the film warms by its own losses, where no thermometer was recorded.

The warming T is that of ``self_heating``. The Maxwell stress is multiplied by 1 + a T.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.library.electric.self_heating import polarise

__all__ = ["EFFECT", "permittivity", "polarise"]

EFFECT = Effect(
    name="heated permittivity",
    family="thermal",
    acts_on="dielectric",
    summary="the force of the field follows the square of the voltage, with a delay of seconds",
    law=Law(
        equations=(
            r"\sigma_E = \max(1 + a \theta, 0.05) \sigma_M",
            r"\tau \dot{\theta} = \left(\frac{V}{5\,\mathrm{kV}}\right)^2 - \theta",
        ),
        symbols=("a", r"\tau"),
        source="Newton's law of cooling",
        where=((r"\theta", "warming over that under constant 5 kV"),),
    ),
    parameters=(
        Parameter(
            "change",
            "",
            (-0.5, 0.5),
            "relative change of the permittivity under constant 5 kV, final",
            1e-2,
            0.0,
        ),
        Parameter(
            "time_constant",
            "s",
            (1.0, 3e3),
            "of the warming",
            20.0,
            starts=(20.0, 5.0, 100.0),
            logarithmic=True,
        ),
    ),
    memory=1,
)


@jit
def permittivity(c, k, m, j, lam, field2):
    return max(1.0 + c[k] * m[j], 0.05)
