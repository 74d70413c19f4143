"""Amplifier of any characteristic: the voltage at the film is a smooth function of the command.

The output is V + sign(V) sum_i a_i B_i(|V|), with steps B_i (``model.splines``) on even knots from
0 up to the largest voltage. The weights a_i have either sign.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.shared.splines import step

__all__ = ["EFFECT", "supply"]

_STEPS = 6


@jit
def _output(c, k, voltage):
    spacing, total = c[k + _STEPS] / (_STEPS - 1), 0.0
    for i in range(_STEPS):
        if c[k + i] != 0.0:
            middle = i * spacing
            total += c[k + i] * step(
                abs(voltage), max(middle - spacing, 0.0), middle, middle + spacing
            )
    return voltage + math.copysign(total, voltage) if voltage != 0.0 else 0.0


def _over_voltage(values: Mapping[str, float]) -> Curve:
    """Return the error of the output over the command."""
    c = np.array([values[f"gained_{i + 1}"] for i in range(_STEPS)] + [values["full"]])
    voltage = np.linspace(0.0, 1.1 * values["full"], 60)
    error = np.array([_output(c, 0, v) for v in voltage]) - voltage
    return Curve(voltage * 1e-3, error, "command (kV)", "error of the output (V)")


EFFECT = Effect(
    name="general amplifier curve",
    family="amplifier",
    acts_on="amplifier",
    summary="the voltage at the film is a smooth curve of the command",
    law=Law(
        equations=(r"V = U + \operatorname{sign}(U) \sum_{i=1}^{6} a_i B_i(|U|)",),
        symbols=(*(f"a_{i}" for i in range(1, 7)), r"V_f"),
        source="J. O. Ramsay, Statistical Science 3, 425 (1988)",
        where=(
            (
                "B_i",
                (
                    "smooth step from 0 to 1, the integral of a hat of area 1 with its knots "
                    "at i - 2, i - 1 and i times V_f/5, none below 0"
                ),
            ),
            ("a_i", "weight of step i"),
        ),
    ),
    parameters=(
        *(
            Parameter(f"gained_{i + 1}", "V", (-2e3, 2e3), f"at step {i + 1}", 10.0, 0.0)
            for i in range(_STEPS)
        ),
        Parameter(
            "full",
            "V",
            (100.0, 1e5),
            "command at the last step",
            8e3,
            starts=(1.0,),
            logarithmic=True,
            relative_to="voltage",
        ),
    ),
    is_general=True,
    curve=_over_voltage,
)


@jit
def supply(c, k, m, j, t, start, end, h, lam, rate):
    before = _output(c, k, start)
    if h > 0.0:
        return before, _output(c, k, end)
    return before, before
