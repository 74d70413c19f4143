"""Softening by the largest stretch so far (Mullins; after Ogden and Roxburgh).

Below the largest strain I_max - I_rest so far, the network carries only
1 - s tanh((I_max - I)/(w (I_max - I_rest + I_0))) of its stress; on the first loading, all of it.
I_0 = 0.001 keeps a film that was never stretched from softening by small vibrations: without it the
rest state would be unstable.
"""

from __future__ import annotations

import math

from dearig.model.coefficients import HELD, REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.kinematics import strain_and_pull

__all__ = ["EFFECT", "commit", "soften"]

EFFECT = Effect(
    name="Mullins softening",
    family="softening",
    acts_on="film stress",
    summary="the film is softer below its largest stretch so far: the first lobe differs",
    law=Law(
        equations=(
            r"\sigma = \left(1 - s \tanh \frac{I_m - I}{w (I_m - I_0 + 0.001)}\right) \sigma_0",
            r"I_m = \max_{t' \le t} I(t')",
        ),
        symbols=("s", "w"),
        source="R. W. Ogden and D. G. Roxburgh, Proc. R. Soc. A 455, 2861 (1999)",
        where=(
            ("I", "first invariant of the strain"),
            ("I_0", "that at rest"),
            ("I_m", "the largest so far, at least that at rest"),
        ),
    ),
    parameters=(
        Parameter(
            "softening",
            "",
            (-0.5, 0.9),
            "relative loss of stress",
            2e-3,
            0.0,
            fit_within=(0.0, 0.9),
        ),
        Parameter(
            "width",
            "",
            (0.02, 3.0),
            "fraction of the largest strain over which it is lost",
            0.3,
            starts=(0.3, 1.0),
            logarithmic=True,
        ),
    ),
    memory=1,
    is_hysteretic=True,
    drives=("voltage", "stretch"),
)


_TREMOR = 1e-3  # of I1


@jit
def _strain(c, lam):
    rest = c[REST]
    held = int(c[HELD])
    strain, _ = strain_and_pull(held, lam * lam, 1.0 / (lam * lam))
    at_rest, _ = strain_and_pull(held, rest * rest, 1.0 / (rest * rest))
    return strain - at_rest


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    now = _strain(c, lam)
    most = max(m[j], now)
    return 1.0 - c[k] * math.tanh((most - now) / (c[k + 1] * (most + _TREMOR)))


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = max(m[j], _strain(c, lam))
    return 0
