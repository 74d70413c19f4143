"""Film, load and spring network: immutable values in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from dearig.model import coefficients as at
from dearig.model.effects import NEUTRAL, PARAMETER_COUNT
from dearig.model.errors import ModelError
from dearig.model.network import HEAD
from dearig.model.specimen import (
    STANDARD_GRAVITY,
    VACUUM_PERMITTIVITY,
    Film,
    Load,
)
from dearig.model.springs import SPRINGS, locking_strain

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
    """One spring: ``kind`` of strain energy, ``modulus`` in Pa, ``limit`` J (Gent) or n (links)."""

    modulus: float
    limit: float = math.inf
    kind: str = "gent"

    def __post_init__(self) -> None:
        if self.kind not in SPRINGS:
            raise ModelError(f"spring: kind {self.kind!r} is not one of {', '.join(SPRINGS)}")
        if not (math.isfinite(self.modulus) and self.modulus >= 0.0):
            raise ModelError(f"spring: modulus = {self.modulus!r} Pa must be finite, 0 or more")
        lowest = 1.0 if self.kind == "arruda-boyce" else 0.0
        if not self.limit > lowest:
            raise ModelError(f"spring ({self.kind}): limit = {self.limit!r} must be above {lowest}")
        if math.isinf(self.limit) and self.kind != "neo-hookean":
            # without a limit both other springs are the neo-Hookean one
            object.__setattr__(self, "kind", "neo-hookean")


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
            c[k + at.LOCKING] = locking_strain(kind, spring.limit)
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
