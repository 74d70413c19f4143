"""Film, load and spring network: immutable values in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from dearig.model import coefficients as at
from dearig.model.effects import NEUTRAL, PARAMETER_COUNT
from dearig.model.errors import ModelError
from dearig.model.film.network import HEAD, shape_at
from dearig.model.film.specimen import (
    STANDARD_GRAVITY,
    VACUUM_PERMITTIVITY,
    Film,
    Load,
)
from dearig.model.springs import LIMIT, SPRING_LAWS, SPRINGS, ShapeParameter, locking_strain

__all__ = [
    "STANDARD_GRAVITY",
    "TABLE_3",
    "THESIS_FILM",
    "THESIS_LOAD",
    "VACUUM_PERMITTIVITY",
    "Branch",
    "Film",
    "Load",
    "Network",
    "Spring",
]


@dataclass(frozen=True)
class Spring:
    """One spring: ``kind`` of strain energy and ``modulus`` in Pa, the initial shear modulus.

    ``limit`` is the locking limit of a law that has one: J, or the links n of a chain. ``shape``
    are the law's other parameters in its order (``dearig.model.springs.SPRING_LAWS``); empty for
    their neutral values.
    """

    modulus: float
    limit: float = math.inf
    kind: str = "gent"
    shape: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in SPRINGS:
            raise ModelError(f"spring: kind {self.kind!r} is not one of {', '.join(SPRINGS)}")
        if not (math.isfinite(self.modulus) and self.modulus >= 0.0):
            raise ModelError(f"spring: modulus = {self.modulus!r} Pa must be finite, 0 or more")
        law = SPRING_LAWS[self.kind]
        others = law.parameters[law.has_limit :]
        if not self.shape:
            object.__setattr__(self, "shape", tuple(p.neutral for p in others))
        if len(self.shape) != len(others):
            raise ModelError(
                f"spring ({self.kind}): shape = {self.shape!r} must be "
                f"{len(others)} numbers ({', '.join(p.name for p in others) or 'none'})"
            )
        for parameter, value in self.values:
            if not parameter.allows(value):
                low, high = parameter.bounds
                asked = (
                    f"must be above {low}"
                    if parameter.name == LIMIT
                    else f"must be from {low:g} to {high:g}"
                )
                raise ModelError(f"spring ({self.kind}): {parameter.name} = {value!r} {asked}")
        if math.isinf(self.limit) and self.kind in ("gent", "arruda-boyce"):
            # without a limit these are the neo-Hookean one
            object.__setattr__(self, "kind", "neo-hookean")

    @property
    def values(self) -> tuple[tuple[ShapeParameter, float], ...]:
        """The law's parameters besides the modulus, with their values."""
        law = SPRING_LAWS[self.kind]
        numbers = (self.limit, *self.shape) if law.has_limit else self.shape
        return tuple(zip(law.parameters, numbers, strict=True))

    @classmethod
    def of(cls, kind: str, modulus: float, values: Sequence[float]) -> Spring:
        """Return the spring with all parameters of its law, ``limit`` included, in its order."""
        limited = SPRING_LAWS[kind].has_limit
        return cls(
            modulus, values[0] if limited else math.inf, kind, tuple(values[1 if limited else 0 :])
        )


@dataclass(frozen=True)
class Branch:
    """A Maxwell branch: a spring in series with a dashpot; ``relaxation_time`` T = eta/mu in s."""

    spring: Spring
    relaxation_time: float

    def __post_init__(self) -> None:
        if not self.relaxation_time >= 0.0:
            raise ModelError(
                f"branch: relaxation_time = {self.relaxation_time!r} s must be 0 or more"
            )


@dataclass(frozen=True)
class Network:
    """A generalised Maxwell network: the equilibrium spring and any number of branches."""

    equilibrium: Spring
    branches: tuple[Branch, ...] = field(default=())

    @classmethod
    def gent(
        cls, moduli: Sequence[float], limits: Sequence[float], times: Sequence[float]
    ) -> Network:
        """The thesis's network: ``moduli`` mu_0..n Pa, ``limits`` J_0..n, ``times`` T_1..n s."""
        if not len(moduli) == len(limits) == len(times) + 1:
            raise ModelError(
                f"a network of n branches takes n + 1 moduli, n + 1 limits and n times, "
                f"not {len(moduli)}, {len(limits)} and {len(times)}"
            )
        springs = [Spring(m, j) for m, j in zip(moduli, limits, strict=True)]
        return cls(springs[0], tuple(Branch(s, t) for s, t in zip(springs[1:], times, strict=True)))

    @property
    def springs(self) -> tuple[Spring, ...]:
        """All springs, the equilibrium one first."""
        return (self.equilibrium, *(b.spring for b in self.branches))

    @property
    def times(self) -> tuple[float, ...]:
        """Relaxation times of the branches in s."""
        return tuple(b.relaxation_time for b in self.branches)

    def coefficients(self, held: int) -> np.ndarray:
        """Coefficients as ``model.coefficients`` has them; of the head only ``held`` is filled."""
        springs = self.springs
        c = np.zeros(HEAD + at.WIDTH * len(springs))
        c[at.HELD] = held
        c[at.INERTIA] = c[at.LENGTH] = c[at.SECTION] = c[at.THICKNESS] = c[at.REST] = 1.0
        c[at.EFFECTS_AT : at.EFFECTS_AT + PARAMETER_COUNT] = NEUTRAL
        kinds = {SPRINGS.index(spring.kind) for spring in springs}
        c[at.UNIFORM] = kinds.pop() if len(kinds) == 1 else -1
        for i, spring in enumerate(springs):
            k = HEAD + at.WIDTH * i
            kind = SPRINGS.index(spring.kind)
            c[k + at.KIND] = kind
            c[k + at.MODULUS] = spring.modulus
            c[k + at.LIMIT] = spring.limit
            c[k + at.SHAPE : k + at.SHAPE + len(spring.shape)] = spring.shape
            c[k + at.LOCKING] = locking_strain(kind, shape_at(c, k))
            if i:
                # a branch that relaxes within a nanosecond carries no stress; 1/0 is avoided
                c[k + at.RATE] = 1.0 / max(self.times[i - 1], 1e-9)
        return c


THESIS_FILM = Film(length=0.075, width=0.072, thickness=0.001)
THESIS_LOAD = Load(mass=0.2)

#: The identified parameters of the thesis's Table 3.
TABLE_3 = Network.gent(
    moduli=(4.5772e4, 4.0037e4, 5.1736e4, 2.3021e2),
    limits=(9.7749e3, 4.2709e3, 9.5677e3, 7.2315e3),
    times=(0.39802, 0.33969, 8.3874),
)
