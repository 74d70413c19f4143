"""Amplifier of any characteristic: the voltage at the film is a smooth function of the command."""

from __future__ import annotations

import math

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Parameter
from dearig.model.effects.shared.general import Axis, SmoothSteps, Weights, general
from dearig.model.effects.shared.splines import even, spline

__all__ = ["EFFECT", "supply"]

_STEPS = 6
_KNOTS = even(_STEPS, 5, at_rest=True)

EFFECT = general(
    name="general amplifier curve",
    family="amplifier",
    acts_on="amplifier",
    summary="the voltage at the film is a smooth curve of the command",
    equations=(r"V = U + \operatorname{sign}(U) \sum_{i=1}^{6} a_i B_i(|U|)",),
    shapes=SmoothSteps(_KNOTS, "with its knots at i - 2, i - 1 and i times V_f/5, none below 0"),
    weights=Weights(
        "gained", "a", "V", (-2e3, 2e3), "at step", 10.0, stands_for="weight of step i"
    ),
    scale=(
        Parameter(
            "full", "V", (100.0, 1e5), "command at the last step", 8e3,
            starts=(1.0,), logarithmic=True, relative_to="voltage",
        ),
        "V_f",
    ),
    over=Axis("command (kV)", 1e-3),
    shows=Axis("error of the output (V)"),
)  # fmt: skip


@jit
def _output(c, k, voltage):
    gained = spline(c, k, abs(voltage) / c[k + _STEPS], _KNOTS)
    return voltage + math.copysign(gained, voltage)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    before = _output(c, k, start)
    if h > 0.0:
        return before, _output(c, k, end)
    return before, before
