"""Permittivity that changes with the stretch up to a limit: chains align, up to full alignment.

The Maxwell stress is multiplied by 1 + a d/(1 + |d/r|^n)^(1/n), d = lam - lam_rest: the slope
is a at first and levels off at a change of a r, over the stretch r, with the sharpness n.
"""

from __future__ import annotations

from dearig.model.coefficients import REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter

__all__ = ["EFFECT", "permittivity"]

EFFECT = Effect(
    name="saturating permittivity",
    family="permittivity",
    acts_on="dielectric",
    summary="the force of the field changes with the stretch, up to a limit",
    law=Law(
        equations=(
            (
                r"\sigma_E = \max\left(1 + \frac{a \delta}{\left(1 + |\delta / "
                r"r|^n\right)^{1/n}}, 0.05\right) \sigma_M"
            ),
            r"\delta = \lambda - \lambda_0",
        ),
        symbols=("a", "r", "n"),
        source="a slope that levels off, of the form of C. Rapp's (1991)",
    ),
    parameters=(
        Parameter("strain_coefficient", "", (-100.0, 100.0), "slope at rest", 1.0, 0.0),
        Parameter(
            "reach",
            "",
            (1e-3, 1.0),
            "change of stretch over which it levels off",
            0.02,
            starts=(0.005, 0.02, 0.08),
            logarithmic=True,
        ),
        Parameter(
            "sharpness",
            "",
            (0.7, 10.0),
            "of the bend: 1 a hyperbola, 2.5 nearly a tanh",
            2.0,
            starts=(2.0,),
            logarithmic=True,
        ),
    ),
)


@jit
def permittivity(c, k, m, j, lam, field2):
    moved = lam - c[REST]
    n = c[k + 2]
    return max(1.0 + c[k] * moved / (1.0 + (abs(moved) / c[k + 1]) ** n) ** (1.0 / n), 0.05)
