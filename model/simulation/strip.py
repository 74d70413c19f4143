"""The film in a tensile test: stretch in, nominal stress out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dearig.model import kernel
from dearig.model.coefficients import EFFECTS_AT, MODULUS, REST, WIDTH
from dearig.model.compiled.jit import read_only
from dearig.model.effects import MEMORY, NEUTRAL, PARAMETER_COUNT, EffectValues
from dearig.model.errors import ModelError
from dearig.model.film.material import Network
from dearig.model.film.network import HEAD
from dearig.model.film.specimen import KINEMATICS
from dearig.model.simulation.actuator import STATUS_TEXTS, effect_values
from dearig.model.simulation.film_kernel import add_effects, drive_by_stretch

__all__ = [
    "StressResponse",
    "Strip",
    "network_stress",
    "stress_of",
    "through_effects",
    "unit_stresses",
]


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
    def status_text(self) -> str:
        """Text of the status."""
        return STATUS_TEXTS[self.status]


@dataclass(frozen=True)
class Strip:
    """A piece of film whose stretch is imposed: its network, how it is held, and any effects.

    ``effects`` maps the names of ``dearig.model.effects.EFFECTS`` to their parameter values.
    """

    network: Network
    kinematics: str = "uniaxial"
    effects: EffectValues = field(default=())

    def __post_init__(self) -> None:
        if self.kinematics not in KINEMATICS:
            raise ModelError(
                f"kinematics {self.kinematics!r} is not one of {', '.join(KINEMATICS)}"
            )
        effect_values(self.effects, "stretch")

    @property
    def held(self) -> int:
        """Code of the kinematics, as the kernels use it."""
        return KINEMATICS.index(self.kinematics)

    def coefficients(self) -> np.ndarray:
        """The kernels' coefficient vector (see ``model.coefficients``)."""
        c = self.network.coefficients(self.held)
        c[EFFECTS_AT : EFFECTS_AT + PARAMETER_COUNT] = effect_values(self.effects, "stretch")
        return c

    def simulate(self, time: np.ndarray, stretch: np.ndarray) -> StressResponse:
        """Stress under ``stretch`` (N,) at ``time`` (N,) s, linear between samples.

        The film is taken to be relaxed at the first sample. Raises ``ModelError`` for arrays that
        do not fit; everything else is a status.
        """
        time = np.ascontiguousarray(time, dtype=np.float64)
        stretch = np.ascontiguousarray(stretch, dtype=np.float64)
        if time.ndim != 1 or time.shape != stretch.shape or time.size == 0:
            raise ModelError(
                f"time {time.shape} and stretch {stretch.shape} must be rows of one length"
            )
        return StressResponse(*stress_of(self.coefficients(), time, stretch))


def stress_of(c: np.ndarray, time: np.ndarray, stretch: np.ndarray) -> tuple[np.ndarray, int, int]:
    """``(stress, status, reached)`` of coefficient vector ``c`` (see ``model.coefficients``)."""
    stress, status, reached = network_stress(c, time, stretch)
    return through_effects(c, time, stretch, stress), status, reached


def network_stress(
    c: np.ndarray, time: np.ndarray, stretch: np.ndarray
) -> tuple[np.ndarray, int, int]:
    """``(stress, status, reached)`` of the springs of ``c`` alone, without its effects."""
    parts, status, reached = unit_stresses(c, time, stretch)
    return c[HEAD + MODULUS :: WIDTH] @ parts, status, reached


def through_effects(
    c: np.ndarray, time: np.ndarray, stretch: np.ndarray, stress: np.ndarray
) -> np.ndarray:
    """Return what is read of the network's ``stress`` (N,) with the effects of ``c``, in Pa."""
    if np.array_equal(c[EFFECTS_AT : EFFECTS_AT + PARAMETER_COUNT], NEUTRAL):
        return stress
    c, read = c.copy(), stress.copy()
    c[REST] = stretch[0]
    add_effects(c, read_only(time), read_only(stretch), np.zeros(MEMORY), read)
    return read


def unit_stresses(
    c: np.ndarray, time: np.ndarray, stretch: np.ndarray
) -> tuple[np.ndarray, int, int]:
    """``(parts, status, reached)``: stress of each spring per unit modulus, (1 + n, N)."""
    springs = (c.size - HEAD) // WIDTH
    parts = np.zeros((springs, time.size))
    xi = np.full(springs - 1, stretch[0])
    status, reached = drive_by_stretch(c, read_only(time), read_only(stretch), xi, parts)
    return parts, status, reached
