"""Softening by the largest change of stretch so far, of any form.

With steps B_i (``model.splines``), e the change of stretch from rest and e_max its largest value so
far, which heals (falls towards e) with a time, the network carries

    1 - sum_i d_i B_i(e_max) - e_max/(e_max + e_0) sum_i r_i B_i(p)
    p = (e_max - e)/(e_max + w) (R + w)/R

of its stress: damage d that stays, as on first loading (even knots up to the reach R), and a loss r
that is regained on the way back to the largest stretch. A wide w makes it depend on how far below
that the film is (Ogden and Roxburgh, Proc. R. Soc. A 455, 1999), a narrow one on the part of the
way; between them is their form with a width that grows with the largest stretch. The stretch
e_0 = 0.001 keeps a film that was never stretched from softening by small vibrations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from dearig.model.coefficients import EFFECTS_AT, REST
from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.shared.splines import even, spline

__all__ = ["EFFECT", "commit", "soften"]

_STEPS = 6
_PARTS = 5
_DAMAGED = even(_STEPS, _STEPS, at_rest=False)
_REGAINED = even(_PARTS, _PARTS - 1, at_rest=True)
_TREMOR = 1e-3  # of stretch


def _loss(values: Mapping[str, float]) -> Curve:
    """Return the loss at rest after the largest change of stretch."""
    stretch = np.linspace(0.0, values["reach"] * (1.0 + 1.0 / _STEPS), 60)
    c = np.array([*[0.0] * EFFECTS_AT, *(values[p.name] for p in EFFECT.parameters)])
    rest = float(c[REST])
    kept = [soften(c, EFFECTS_AT, np.array([e]), 0, rest, 0.0, 0.0, 0.0) for e in stretch]
    return Curve(
        stretch, 1.0 - np.array(kept), "largest change of stretch", "relative loss of stress"
    )


EFFECT = Effect(
    name="general softening",
    family="softening",
    acts_on="film stress",
    summary="the film loses stress with its largest stretch so far, for good or below it",
    law=Law(
        equations=(
            (
                r"\sigma = \left(1 - \sum_{i=1}^{6} d_i B_i(m) - \frac{m}{m + 0.001} "
                r"\sum_{j=1}^{5} r_j D_j(p)\right) \sigma_0"
            ),
            r"p = \frac{m - |\delta|}{m + w} \cdot \frac{R + w}{R}",
            (
                r"m(t) = \max_{t' \le t} |\delta|, \quad \mathrm{healing} \quad \dot{m} = "
                r"\frac{|\delta| - m}{\tau}"
            ),
            r"\delta = \lambda - \lambda_0",
        ),
        symbols=(
            *(f"d_{i}" for i in range(1, 7)),
            *(f"r_{i}" for i in range(1, 6)),
            "R",
            "w",
            r"\tau",
        ),
        source=(
            "R. W. Ogden and D. G. Roxburgh, Proc. R. Soc. A 455, 2861 (1999), with the "
            "splines of J. O. Ramsay, Statistical Science 3, 425 (1988)"
        ),
        where=(
            (
                "B_i",
                (
                    "smooth step from 0 to 1, the integral of a hat of area 1 with its knots "
                    "at i - 1, i and i + 1 times R/6"
                ),
            ),
            ("D_j", "the same with its knots at j - 2, j - 1 and j quarters, none below 0"),
            (
                "m",
                ("largest change of stretch so far, which heals: it falls towards the change now"),
            ),
            ("p", "part of the way back from it"),
            ("d_i", "loss that stays at step i"),
            ("r_j", "loss that is regained at part j"),
        ),
    ),
    parameters=(
        *(
            Parameter(f"damage_{i}", "", (0.0, 0.5), f"loss that stays at step {i}", 5e-4, 0.0)
            for i in range(1, _STEPS + 1)
        ),
        *(
            Parameter(
                f"regained_{i}", "", (0.0, 0.5), f"loss that is regained at part {i}", 5e-4, 0.0
            )
            for i in range(1, _PARTS + 1)
        ),
        Parameter(
            "reach",
            "",
            (2e-3, 5.0),
            "change of stretch at the last step",
            2.4e-2,
            starts=(2.4e-2, 1.0),
            logarithmic=True,
        ),
        Parameter(
            "width",
            "",
            (1e-3, 1.0),
            "change of stretch from which on the loss depends on the part of the way back",
            1e-3,
            starts=(1e-3, 1.0),
            logarithmic=True,
        ),
        Parameter(
            "healing_time",
            "s",
            (1.0, 1e5),
            "in which the largest stretch is forgotten",
            1e4,
            starts=(1e4, 40.0),
            logarithmic=True,
        ),
    ),
    memory=1,
    is_hysteretic=True,
    drives=("voltage", "stretch"),
    is_general=True,
    fitted_shapes=("width", "healing_time"),
    curve=_loss,
)


@jit
def _largest(c, k, before, now, since):
    left = math.exp(-since / c[k + _STEPS + _PARTS + 2])
    return now + max(before - now, 0.0) * left


@jit
def soften(c, k, m, j, lam, since, t, warmth):
    now = abs(lam - c[REST])
    reach, width = c[k + _STEPS + _PARTS], c[k + _STEPS + _PARTS + 1]
    most = _largest(c, k, m[j], now, since)
    lost = spline(c, k, most / reach, _DAMAGED)
    part = (most - now) / (most + width) * (1.0 + width / reach)
    lost += most / (most + _TREMOR) * spline(c, k + _STEPS, part, _REGAINED)
    return 1.0 - lost


@jit
def commit(c, k, m, j, lam, rate, lam0, h, t):
    m[j] = _largest(c, k, m[j], abs(lam - c[REST]), h)
    return 0
