"""A contact beyond some travel: an elastic stop, a cable that becomes taut.

The stress k d (d/d_0)^(n - 1) (1 + c x'), d = (x - x_s)/L1 beyond the displacement x_s and d_0 half
a millimetre: n = 1 is a spring, 1.5 a ball on a flat (Hertz), more a cushion; c is the loss in
the contact (Hunt and Crossley, J. Appl. Mech. 42, 440 (1975)). It belongs to no named family.
"""

from __future__ import annotations

from dearig.model.coefficients import LENGTH, REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.hooks import FASTEST

__all__ = ["EFFECT", "stiffness", "stress"]

EFFECT = Effect(
    name="stress beyond a displacement",
    family="unknown",
    acts_on="load",
    summary="a stress that sets in at one displacement and grows beyond it, at any speed",
    law=Law(
        equations=(
            (
                r"\sigma = \sigma_0 + k d \left(\frac{d L_1}{0.5\,\mathrm{mm}}\right)^{n - 1} "
                r"\max\left(1 + c L_1 \dot{\lambda}, 0\right)"
            ),
            r"d = \max\left(\lambda - \lambda_0 - \frac{x_s}{L_1}, 0\right)",
        ),
        symbols=("k", "x_s", "n", "c"),
        source="K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42, 440 (1975)",
        where=(("d", "depth of the contact, as a stretch"),),
    ),
    parameters=(
        Parameter(
            "stiffness", "Pa", (0.0, 5e7), "stress per stretch, 0.5 mm beyond the onset", 2e4, 0.0
        ),
        Parameter(
            "onset",
            "m",
            (2e-5, 2e-2),
            "displacement at which it sets in",
            1e-3,
            starts=(0.5, 0.3, 0.7, 0.85),
            relative_to="displacement",
            logarithmic=True,
        ),
        Parameter(
            "exponent",
            "",
            (1.0, 4.0),
            "of the stress as a power of the depth",
            1.0,
            starts=(1.0, 1.5),
        ),
        Parameter("damping", "s/m", (0.0, 300.0), "of the contact", 10.0, starts=(5.0,)),
    ),
)


_DEPTH = 0.5e-3  # m: the depth at which the stiffness is defined


@jit
def _held(c, k, depth):
    """Stress of a contact at rest, and its slope."""
    if depth <= 0.0:
        return 0.0, 0.0
    slope = c[k] * (depth * c[LENGTH] / _DEPTH) ** (c[k + 2] - 1.0)
    return slope * depth, c[k + 2] * slope


@jit
def stress(c, k, m, j, lam, rate, lam0, since, t):
    held, _ = _held(c, k, lam - c[REST] - c[k + 1] / c[LENGTH])
    return held * max(1.0 + c[k + 3] * rate * c[LENGTH], 0.0)


@jit
def stiffness(c, k, m, j, lam, rate):
    # The slope counts from half of the way on, so that steps are short when the contact is met.
    _, slope = _held(c, k, lam - c[REST] - 0.5 * c[k + 1] / c[LENGTH])
    held, _ = _held(c, k, lam - c[REST] - c[k + 1] / c[LENGTH])
    fast = c[k + 3] * c[LENGTH]
    return slope * (1.0 + fast * min(rate, FASTEST)), held * fast
