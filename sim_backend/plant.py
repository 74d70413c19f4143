"""The plant: the film under its load, between amplifier and laser, whatever computes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

__all__ = ["Motion", "Plant"]


@dataclass(frozen=True)
class Motion:
    """The film at N nodes in time, each array (N,).

    ``displacement`` m from the loaded rest state (longer is positive), ``velocity`` m/s,
    ``capacitance`` F, ``leakage`` A through the film, ``heating`` K above the room. ``fault`` says
    in words why the film did not go on beyond node ``fault_at``; it is None when all is well.
    """

    displacement: np.ndarray
    velocity: np.ndarray
    capacitance: np.ndarray
    leakage: np.ndarray
    heating: np.ndarray
    fault: str | None = None
    fault_at: int = 0


class Plant(Protocol):
    """A film in some state. It is a value: advancing gives the film as it is afterwards.

    So a run can be taken up again from any point that was kept, which is how a run that is stopped
    early shares every sample up to there with one that is not.
    """

    @property
    def capacitance(self) -> float:
        """Present capacitance in F."""
        ...

    def renewed(self, generator: np.random.Generator) -> Plant:
        """The film at rest as another run finds it: what is of one run alone is drawn anew."""
        ...

    def advance(self, time: np.ndarray, voltage: np.ndarray, hold: bool) -> tuple[Motion, Plant]:
        """Follow ``voltage`` (N,) V on ``time`` (N,) s; with ``hold`` each stands until the next.

        Node 0 is the present state, so the last node of one call is the first of the next.
        """
        ...
