"""Interface of the plant: the film under its load, between amplifier and laser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

__all__ = ["Air", "Electricity", "Motion", "Plant"]


@dataclass(frozen=True)
class Electricity:
    """What the circuit of the film does in M intervals, in each of which the supply is held.

    Arrays are (2, M) unless said otherwise. Their rows are the values at the start of an interval,
    after the step of the supply, and at its end. ``output`` V is what the amplifier puts out,
    ``voltage`` V that at the film, ``charge`` C on the film. ``charging`` A changes this charge
    between two steps, ``conduction`` A is lost through the film. ``shown`` V is the output as the
    amplifier's own voltage monitor sees it; None where that sees no hidden fault.

    ``step`` (M,) C is the charge that flows at once at the start of an interval; where a resistance
    of the law is in series, it flows within ``lag`` s. The rest of the change of the charge is cut
    off from the amplifier: a torn electrode takes it away.
    """

    output: np.ndarray
    voltage: np.ndarray
    charge: np.ndarray
    step: np.ndarray
    charging: np.ndarray
    conduction: np.ndarray
    lag: float = 0.0
    shown: np.ndarray | None = None


@dataclass(frozen=True)
class Motion:
    """Motion of the film at N nodes in time, each array (N,).

    ``displacement`` m from the loaded rest state (longer is positive), ``velocity`` m/s,
    ``heating`` K above the room, ``electricity`` in the N - 1 intervals between the nodes.
    ``fault`` is the reason why the motion stops at node ``fault_at``, or None without a fault.
    """

    displacement: np.ndarray
    velocity: np.ndarray
    electricity: Electricity
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

    def advance(
        self,
        time: np.ndarray,
        voltage: np.ndarray,
        hold: bool,
        settled: np.ndarray | None = None,
    ) -> tuple[Motion, Plant]:
        """Follow ``voltage`` (N,) V at ``time`` (N,) s; with ``hold`` each is held until the next.

        Node 0 is the present state: the last node of one call is the first of the next.
        ``voltage`` has the mean Maxwell stress of the amplifier's output in an interval.
        ``settled`` (N,) V is what this output settles at within it, by default ``voltage``; the
        charge belongs to it.
        """
        ...
