"""How a strain energy describes itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["LIMIT", "ShapeParameter", "SpringLaw"]

#: The parameter that a spring keeps as its ``limit``; all others are in its ``shape``.
LIMIT = "limit"


@dataclass(frozen=True)
class ShapeParameter:
    """A number of a strain energy besides its modulus; a pure number.

    Parameters
    ----------
    name
        Key in model files.
    symbol
        Beginning of its name among the parameters of a fit: ``symbol`` J gives J_0, J_1, ...
    bounds
        Values that a spring may have; the ends are allowed where they are finite.
    neutral
        Value at which a term vanishes.
    meaning
        Completes "the ``name`` is ...".
    typical
        A change that is noticed at stretches of a few units: the scale of a fit's steps. 0 for
        parameters that are fitted as their logarithm, without a scale.
    fit_within
        Narrower bounds for fits.
    """

    name: str
    symbol: str
    bounds: tuple[float, float]
    neutral: float
    meaning: str
    typical: float = 0.0
    fit_within: tuple[float, float] | None = None

    @property
    def logarithmic(self) -> bool:
        """Whether a fit moves in its logarithm."""
        return self.typical == 0.0

    @property
    def fit_bounds(self) -> tuple[float, float]:
        """The bounds of a fit: ``fit_within``, or ``bounds``."""
        return self.fit_within or self.bounds

    def allows(self, value: float) -> bool:
        """Whether ``value`` is within ``bounds``; an open end of 0 or infinity is not reached."""
        low, high = self.bounds
        if self.logarithmic:
            return low < value <= high
        return math.isfinite(value) and low <= value <= high


@dataclass(frozen=True)
class SpringLaw:
    """A strain energy W = modulus (U(I1 - 3) + w(lam1) + w(lam2) + w(lam3)).

    The law with all parameters neutral is the neo-Hookean one (for sums of terms: one of them is).

    Parameters
    ----------
    name
        Unique among all; it stands in model files.
    summary
        One sentence for a person.
    source
        Where the formula was published.
    parameters
        Besides the modulus; ``limit``, where a law has one, comes first. Three others at most.
    starts
        Function of the greatest squared stretch of the records: parameter values, in their order,
        from which the global search starts.
    title
        Name as papers write it, where that is not ``name`` with blanks.
    """

    name: str
    summary: str
    source: str
    parameters: tuple[ShapeParameter, ...]
    starts: Callable[[float], tuple[tuple[float, ...], ...]]
    title: str = ""

    @property
    def shown(self) -> str:
        """Name as papers write it."""
        return self.title or self.name.replace("-", " ")

    @property
    def has_limit(self) -> bool:
        """Whether the first parameter is a locking limit."""
        return bool(self.parameters) and self.parameters[0].name == LIMIT

    @property
    def neutral(self) -> tuple[float, ...]:
        """Values of the parameters at which the law is the neo-Hookean one."""
        return tuple(p.neutral for p in self.parameters)
