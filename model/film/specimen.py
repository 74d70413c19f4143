"""A film before it is loaded, and the load that hangs on it: immutable values, in SI units.

Nothing compiled is imported, so that a recording is read without Numba.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.model.errors import ModelError

__all__ = [
    "KINEMATICS",
    "STANDARD_GRAVITY",
    "VACUUM_PERMITTIVITY",
    "Film",
    "Load",
    "require_positive",
]

#: Ways to hold a film, in the order of the integer codes that the kernels use.
KINEMATICS: tuple[str, ...] = ("constrained-width", "uniaxial", "equibiaxial")

VACUUM_PERMITTIVITY = 8.854e-12  #: F/m
STANDARD_GRAVITY = 9.80665  #: m/s^2


def require_positive(owner: str, **values: float) -> None:
    """Raise ``ModelError`` for the first of ``values`` that is not a finite number above 0."""
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ModelError(f"{owner}: {name} = {value!r} must be a finite number above 0")


@dataclass(frozen=True)
class Film:
    """A film before it is loaded: ``length`` L1 along the motion, ``width`` L2, ``thickness`` Z, m.

    ``density`` in kg/m^3 (the thesis prints none; 1000 is that of PDMS within a few per cent) and
    the relative ``permittivity``.
    """

    length: float
    width: float
    thickness: float
    permittivity: float = 4.7
    density: float = 1000.0
    kinematics: str = "constrained-width"

    def __post_init__(self) -> None:
        require_positive(
            "film",
            length=self.length,
            width=self.width,
            thickness=self.thickness,
            permittivity=self.permittivity,
            density=self.density,
        )
        if self.kinematics not in KINEMATICS:
            raise ModelError(
                f"film: kinematics {self.kinematics!r} is not one of {', '.join(KINEMATICS)}"
            )

    @property
    def held(self) -> int:
        """Code of the kinematics, as the kernels use it."""
        return KINEMATICS.index(self.kinematics)

    @property
    def inertia(self) -> float:
        """Coefficient of lam'' in the motion equation, rho L1^2/3, in kg/m (eq. 43)."""
        return self.density * self.length**2 / 3.0

    @property
    def electric_volume(self) -> float:
        """Permittivity times volume, in F m: the capacitance is that over the thickness squared."""
        return VACUUM_PERMITTIVITY * self.permittivity * self.length * self.width * self.thickness

    def capacitance(self, stretch: np.ndarray) -> np.ndarray:
        """F, of ``stretch`` (N,): the volume stays, so the area gains what the thickness loses."""
        from dearig.model.kinematics import (
            thinning,  # compiled: only those who compute load it
        )

        return self.electric_volume * (thinning(self.held, stretch) / self.thickness) ** 2


@dataclass(frozen=True)
class Load:
    """The hanging load: ``mass`` in kg.

    ``rest_length`` (m) selects the reading of the pre-stretch. None is Table 3's: the rest state
    follows from the modulus and the weight. A number is the measured length under the load (82 mm
    in section 4.1.1): then the equilibrium modulus follows from it, and the one written in the
    network is not used.
    """

    mass: float
    rest_length: float | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mass) and self.mass >= 0.0):
            raise ModelError(f"load: mass = {self.mass!r} kg must be a finite number, 0 or more")
        if self.rest_length is not None:
            require_positive("load", rest_length=self.rest_length)
            require_positive("load with a measured rest length", mass=self.mass)

    @property
    def weight(self) -> float:
        """N."""
        return self.mass * STANDARD_GRAVITY
