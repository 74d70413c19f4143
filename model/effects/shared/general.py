"""General laws, declared: which shapes are summed, over what, and what their weights are.

A general law is linear in the weights of given shapes. Its file states them; ``general`` makes the
parameters with their symbols, the words of the equations, and the curve that a report shows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from dearig.model.effects.description import Curve, Effect, Law, Parameter
from dearig.model.effects.shared.splines import SOURCE, step

__all__ = ["Axis", "Elements", "Relaxations", "Shapes", "SmoothSteps", "Weights", "general"]

_POINTS = 60  # of a curve


class Shapes(Protocol):
    """Some functions of one quantity, which a law sums."""

    @property
    def count(self) -> int:
        """How many."""
        ...

    @property
    def where(self) -> tuple[tuple[str, str], ...]:
        """Symbols of the equation with their meaning."""
        ...

    def range(self) -> np.ndarray:
        """Return where a curve shows them (N,), over the scale of the law."""
        ...

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return each shape (N, count) at ``x`` (N,), over the scale of the law."""
        ...


@dataclass(frozen=True)
class SmoothSteps:
    """Smooth steps; the hat of step i lies on the knots i, i + 1 and i + 2 (``splines``)."""

    knots: tuple[float, ...]
    hats: str  # where they are, for a person

    @property
    def count(self) -> int:
        """How many."""
        return len(self.knots) - 2

    @property
    def where(self) -> tuple[tuple[str, str], ...]:
        """Symbols of the equation with their meaning."""
        return (("B_i", f"smooth step from 0 to 1, the integral of a hat of area 1 {self.hats}"),)

    def range(self) -> np.ndarray:
        """Return even places from 0 to the last knot."""
        return np.linspace(0.0, self.knots[-1], _POINTS)

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return each step (N, count)."""
        hats = list(zip(self.knots, self.knots[1:], self.knots[2:], strict=False))
        return np.array([[step(at, *hat) for hat in hats] for at in x])


@dataclass(frozen=True)
class Relaxations:
    """What is left of steps that relax in times of the series 1, ratio, ratio^2, ..."""

    count: int
    ratio: float
    where: tuple[tuple[str, str], ...]
    is_rising: bool = False  # what has relaxed instead

    def range(self) -> np.ndarray:
        """Return times from a tenth of the first to the last."""
        return np.geomspace(0.1, self.ratio ** (self.count - 1), _POINTS)

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return each exponential (N, count)."""
        left = np.exp(-x[:, None] / self.ratio ** np.arange(float(self.count)))
        return 1.0 - left if self.is_rising else left


@dataclass(frozen=True)
class Elements:
    """First loading of elements that yield, at thresholds up to 1 (``yield_elements``)."""

    count: int
    ratio: float

    @property
    def where(self) -> tuple[tuple[str, str], ...]:
        """Symbols of the equation with their meaning."""
        return (
            ("z_i", "stretch of element i, which yields at its threshold"),
            ("s_i", "threshold of element i"),
        )

    @property
    def _thresholds(self) -> np.ndarray:
        return self.ratio ** -np.arange(self.count - 1.0, -1.0, -1.0)

    def range(self) -> np.ndarray:
        """Return 0 and changes of stretch up to the last threshold."""
        return np.concatenate(([0.0], np.geomspace(0.3 * self._thresholds[0], 1.0, _POINTS)))

    def values(self, x: np.ndarray) -> np.ndarray:
        """Return the stress of each element over its yield stress (N, count)."""
        return np.minimum(x[:, None] / self._thresholds, 1.0)


@dataclass(frozen=True)
class Weights:
    """The weights of a law: their ``name`` without its number, and what one of them is."""

    name: str
    symbol: str
    unit: str
    bounds: tuple[float, float]
    meaning: str  # ends before the number
    typical: float
    stands_for: str  # the same next to the equation, for any number

    def parameters(self, count: int) -> tuple[Parameter, ...]:
        """Return ``count`` amplitudes, numbered from 1."""
        return tuple(
            Parameter(
                f"{self.name}_{i}",
                self.unit,
                self.bounds,
                f"{self.meaning} {i}",
                self.typical,
                0.0,
            )
            for i in range(1, count + 1)
        )

    def symbols(self, count: int) -> tuple[str, ...]:
        """Return the symbols of ``count`` weights."""
        return tuple(f"{self.symbol}_{{{i}}}" for i in range(1, count + 1))


@dataclass(frozen=True)
class Axis:
    """Label of an axis of the curve with its unit, and that unit over the SI unit."""

    label: str
    per_si: float = 1.0


def general(
    *,
    equations: tuple[str, ...],
    shapes: Shapes,
    weights: Weights,
    over: Axis,
    shows: Axis,
    scale: tuple[Parameter, str] | None = None,
    onto: float = 0.0,
    scaled: Callable[[np.ndarray], np.ndarray] = lambda x: x,
    more: tuple[tuple[Parameter, str], ...] = (),
    where: tuple[tuple[str, str], ...] = (),
    source: str = SOURCE,
    **described: Any,
) -> Effect:
    """Return the description of a general law.

    Parameters
    ----------
    equations, source, where
        As in ``Law``; symbols of ``shapes`` and ``weights`` are added to ``where``.
    shapes, weights
        What is summed. ``more`` are further parameters with their symbols.
    scale
        The parameter, with its symbol, that the places of ``shapes`` are fractions of; without one
        they are in SI units.
    over, shows
        The axes of the curve. It is the sum, and ``onto`` is added.
    scaled
        Makes of the quantity of the axis, over its scale, that of the shapes.
    described
        All else that ``Effect`` takes.
    """
    count = shapes.count
    others = (*((scale,) if scale else ()), *more)

    def curve(values: Mapping[str, float]) -> Curve:
        x = shapes.range()
        w = np.array([values[f"{weights.name}_{i}"] for i in range(1, count + 1)])
        size = values[scale[0].name] if scale else 1.0
        y = onto + shapes.values(scaled(x)) @ w
        return Curve(x * size * over.per_si, y * shows.per_si, over.label, shows.label)

    return Effect(
        parameters=(*weights.parameters(count), *(p for p, _ in others)),
        law=Law(
            equations=equations,
            symbols=(*weights.symbols(count), *(symbol for _, symbol in others)),
            source=source,
            where=(*where, *shapes.where, (f"{weights.symbol}_i", weights.stands_for)),
        ),
        is_general=True,
        curve=curve,
        **described,
    )
