"""Slow polarisation in three stages (side groups, chains, charges): a Prony series.

Three Debye terms as of ``dielectric_relaxation``, each with its own strength, at T/s, T and r T.
"""

from __future__ import annotations

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Effect, Law, Parameter
from dearig.model.effects.library.electric.dielectric_relaxation import SETTLED
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "polarise"]

_STRENGTH = (0.0, 2.0)  # nothing that is polarised late takes from the field

EFFECT = Effect(
    name="dielectric relaxation in stages",
    family="dielectric_relaxation",
    acts_on="dielectric",
    summary="parts of the force follow the voltage with three delays, at any stretch",
    law=Law(
        equations=(
            r"V_E^2 = \frac{V (V + d_1 u_1 + d_2 u_2 + d_3 u_3)}{1 + g (d_1 + d_2 + d_3)}",
            r"T \dot{u}_1 = V - u_1",
            r"\frac{T}{s} \dot{u}_2 = V - u_2",
            r"r T \dot{u}_3 = V - u_3",
        ),
        symbols=("d_1", "d_2", "d_3", "T", "r", "s", "g"),
        source="a Prony series of P. Debye's terms, Polar Molecules (1929)",
        where=(
            ("u_1", "slow polarisation of the middle stage, as a voltage"),
            ("u_2", "that of the sooner stage"),
            ("u_3", "that of the later stage"),
        ),
    ),
    parameters=(
        Parameter(
            "strength",
            "",
            _STRENGTH,
            "slow part of the permittivity over the fast, at T",
            0.01,
            0.0,
        ),
        Parameter("sooner", "", _STRENGTH, "the same at T/r", 0.01, 0.0),
        Parameter("later", "", _STRENGTH, "the same at r T", 0.01, 0.0),
        Parameter(
            "relaxation_time",
            "s",
            (2e-3, 60.0),
            "of the middle stage, T",
            0.2,
            starts=(0.2, 0.7),
            logarithmic=True,
        ),
        Parameter(
            "ratio",
            "",
            (2.0, 40.0),
            "of the later relaxation time to the middle one, r",
            10.0,
            starts=(10.0,),
            logarithmic=True,
        ),
        Parameter(
            "sooner_ratio",
            "",
            (2.0, 40.0),
            "of the middle relaxation time to the sooner one, s",
            10.0,
            starts=(10.0,),
            logarithmic=True,
        ),
        SETTLED,
    ),
    memory=3,
)


@jit
def polarise(c, k, m, j, start, end, h):
    before = c[k] * m[j] + c[k + 1] * m[j + 1] + c[k + 2] * m[j + 2]
    tau = c[k + 3]
    m[j] = lagged(m[j], start, end, h, tau)
    m[j + 1] = lagged(m[j + 1], start, end, h, tau / c[k + 5])
    m[j + 2] = lagged(m[j + 2], start, end, h, tau * c[k + 4])
    after = c[k] * m[j] + c[k + 1] * m[j + 1] + c[k + 2] * m[j + 2]
    slow = c[k] + c[k + 1] + c[k + 2]
    rest = c[k + 6] * slow
    return start * (before - rest * start) / (1.0 + rest), end * (after - rest * end) / (1.0 + rest)
