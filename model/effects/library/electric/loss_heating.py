"""Warming by what the film loses as its voltage changes.

A dielectric that follows the field late, and electrodes that carry the charging current, lose
energy in proportion to the change of the stored energy: the heat is proportional to |V V'|, and
leaves with one time constant. ``self-heating`` warms under a constant voltage as well. theta is in
units of the warming under a constant |V V'| of (5 kV)^2/s.
"""

from __future__ import annotations

from dataclasses import replace

from dearig.model.compiled.jit import jit
from dearig.model.effects.description import Law
from dearig.model.effects.library.electric.self_heating import EFFECT as BY_VOLTAGE
from dearig.model.effects.library.electric.self_heating import soften
from dearig.model.effects.shared.filters import lagged

__all__ = ["EFFECT", "polarise", "soften"]

_STIFFENING, _TIME = BY_VOLTAGE.parameters

EFFECT = replace(
    BY_VOLTAGE,
    name="loss heating",
    summary="the stiffness follows how fast the voltage changes, with a delay of seconds or more",
    law=Law(
        equations=(
            r"\sigma = (1 + a \theta) \sigma_0",
            r"\tau \dot{\theta} = \frac{|V \dot{V}|}{(5\,\mathrm{kV})^2/\mathrm{s}} - \theta",
        ),
        symbols=("a", r"\tau"),
        source="losses in proportion to the energy that is stored, and Newton's law of cooling",
        where=((r"\theta", "warming over that under a constant |V dV/dt| of (5 kV)^2/s"),),
    ),
    parameters=(
        replace(
            _STIFFENING,
            meaning="relative change of stress under a constant |V dV/dt| of (5 kV)^2/s, final",
        ),
        _TIME,
    ),
    # the warming, and the square of the voltage at the end of the step before
    memory=2,
)

_REFERENCE = 2.0 * 5e3**2  # V^2/s, of the change of the square


@jit
def polarise(c, k, m, j, start, end, h):
    if h > 0.0:
        first, last = start * start, end * end
        # a voltage that is held jumps between steps
        warm = m[j] + abs(first - m[j + 1]) / _REFERENCE / c[k + 1]
        power = abs(last - first) / _REFERENCE / h
        m[j], m[j + 1] = lagged(warm, power, power, h, c[k + 1]), last
    return 0.0, 0.0
