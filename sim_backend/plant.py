"""Interface of the plant: the film under its load, between amplifier and laser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

__all__ = ["Air", "Motion", "Plant"]


@dataclass(frozen=True)
class Motion:
    """Motion of the film at N nodes in time, each array (N,).

    ``displacement`` m from the loaded rest state (longer is positive), ``velocity`` m/s,
    ``capacitance`` F, ``leakage`` A through the film, ``heating`` K above the room. ``fault`` is
    the reason why the motion stops at node ``fault_at``, or None without a fault.
    """

    displacement: np.ndarray
    velocity: np.ndarray
    capacitance: np.ndarray
    leakage: np.ndarray
    heating: np.ndarray
    fault: str | None = None
    fault_at: int = 0


class Air(Protocol):
    """Air of the room over s from the start of a run, any shape; earlier times are its past."""

    def temperature(self, at: np.ndarray) -> np.ndarray:
        """Return the temperature in degrees Celsius."""
        ...

    def humidity(self, at: np.ndarray) -> np.ndarray:
        """Return the relative humidity in per cent."""
        ...


class Plant(Protocol):
    """A film with its present state. It is immutable: ``advance`` returns the film afterwards.

    A run can therefore continue from any state that was kept. A run that is stopped early has the
    same samples up to the stop as one that is not.
    """

    @property
    def capacitance(self) -> float:
        """Return the present capacitance in F."""
        ...

    def renewed(self, generator: np.random.Generator) -> Plant:
        """Return the film at rest for another run, with the effects that vary by run redrawn."""
        ...

    def in_room(self, air: Air) -> Plant:
        """Return the film at rest in the ``air`` of its next run."""
        ...

    def advance(self, time: np.ndarray, voltage: np.ndarray, hold: bool) -> tuple[Motion, Plant]:
        """Follow ``voltage`` (N,) V at ``time`` (N,) s; with ``hold`` each is held until the next.

        Node 0 is the present state: the last node of one call is the first of the next.
        """
        ...
