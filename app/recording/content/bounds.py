"""Bounds of plausible values, by which an import asks about a unit and a fit refuses one."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = [
    "CURRENT",
    "DISPLACEMENT_SPAN",
    "MODULUS",
    "SPAN_TO_EXPECTED",
    "STRESS",
    "STRETCH",
    "TEMPERATURE",
    "VOLTAGE",
    "Bounds",
    "Range",
]


@dataclass(frozen=True)
class Range:
    """From ``low`` to ``high``, both of them in it."""

    low: float
    high: float

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high


@dataclass(frozen=True)
class Bounds:
    """What is ``usual`` for a quantity, in SI units, and what is ``possible``.

    An import asks about values that are not usual. A fit refuses values that are not possible:
    those of a wrong unit, or of no film. Every usual value is possible.
    """

    usual: Range
    possible: Range


#: Largest voltage of a recording, V. Below 30 V the Maxwell stress in a film of 50 um is some
#: 15 Pa, 1e-4 of its modulus. Amplifiers for films give up to 30 kV; films break down below 100 kV.
VOLTAGE = Bounds(usual=Range(30.0, 30e3), possible=Range(30.0, 1e5))
#: Length over length at rest. Elastomers tear at stretches of 5 to 10.
STRETCH = Bounds(usual=Range(0.2, 15.0), possible=Range(0.1, 20.0))
#: Modulus, Pa. That of elastomers is 1e4 to 1e7 Pa; a factor of safety is for films that are held
#: or loaded otherwise than the estimate assumes, and a unit wrong by a thousand is outside.
MODULUS = Range(200.0, 2e7)
#: Span of the displacement over what a film of 1e5 Pa moves under that voltage. A unit that is
#: wrong by a thousand is outside; films ten times softer or a hundred times stiffer are not.
SPAN_TO_EXPECTED = Range(3e-3, 100.0)
#: Largest nominal stress, Pa, over all films.
STRESS = Range(10.0, 1e8)
#: Span of the displacement, m: from the noise of a laser to the longest film on a bench.
DISPLACEMENT_SPAN = Range(1e-7, 0.5)
#: Temperature of a film or of the room, degC.
TEMPERATURE = Range(-100.0, 150.0)
#: Largest current, A: no high-voltage amplifier of a rig gives more.
CURRENT = Range(0.0, 1.0)
