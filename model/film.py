"""The film in a tensile test: stretch in, nominal stress out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model import kernel
from model.actuator import STATUS_WORDS
from model.errors import ModelError
from model.film_kernel import drive_by_stretch
from model.kinematics import KINEMATICS
from model.material import Network
from model.network import HEAD, MODULUS, WIDTH

__all__ = ["StressResponse", "nominal_stress"]


@dataclass(frozen=True)
class StressResponse:
    """Nominal ``stress`` (N,) in Pa, and how the computation ended (see ``model.kernel``)."""

    stress: np.ndarray
    status: int
    reached: int

    @property
    def ok(self) -> bool:
        """True when the whole record was followed."""
        return self.status == kernel.OK

    @property
    def in_words(self) -> str:
        """The status in words."""
        return STATUS_WORDS[self.status]


def nominal_stress(
    network: Network, kinematics: str, time: np.ndarray, stretch: np.ndarray
) -> StressResponse:
    """Stress of ``network`` under ``stretch`` (N,) at ``time`` (N,) s, linear between samples.

    The film is taken to be relaxed at the first sample. Raises ``ModelError`` for unknown
    kinematics or arrays that do not fit; everything else is a status.
    """
    if kinematics not in KINEMATICS:
        raise ModelError(f"kinematics {kinematics!r} is not one of {', '.join(KINEMATICS)}")
    time = np.ascontiguousarray(time, dtype=np.float64)
    stretch = np.ascontiguousarray(stretch, dtype=np.float64)
    if time.ndim != 1 or time.shape != stretch.shape or time.size == 0:
        raise ModelError(
            f"time {time.shape} and stretch {stretch.shape} must be rows of one length"
        )
    c = network.coefficients(KINEMATICS.index(kinematics))
    stress, status, reached = stress_of(c, time, stretch)
    return StressResponse(stress, status, reached)


def stress_of(c: np.ndarray, time: np.ndarray, stretch: np.ndarray) -> tuple[np.ndarray, int, int]:
    """``(stress, status, reached)`` of coefficient vector ``c`` (see ``model.network``)."""
    parts, status, reached = unit_stresses(c, time, stretch)
    return c[HEAD + MODULUS :: WIDTH] @ parts, status, reached


def unit_stresses(
    c: np.ndarray, time: np.ndarray, stretch: np.ndarray
) -> tuple[np.ndarray, int, int]:
    """``(parts, status, reached)``: stress of each spring per unit modulus, (1 + n, N)."""
    springs = (c.size - HEAD) // WIDTH
    parts = np.zeros((springs, time.size))
    xi = np.full(springs - 1, stretch[0])
    status, reached = drive_by_stretch(c, time, stretch, xi, parts)
    return parts, status, reached
