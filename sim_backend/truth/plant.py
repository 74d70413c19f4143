"""A film with hidden effects, in the place where the rig expects its film."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sim_backend.plant import Motion
from sim_backend.truth.effect import Stage, TruthEffect
from sim_backend.truth.film import FilmNumbers, follow, rest_stretch

__all__ = ["TruthPlant"]


@dataclass(frozen=True)
class TruthPlant:
    """The film of ``numbers`` with its present state, and the stages before and after it."""

    numbers: FilmNumbers
    rest: float
    state: np.ndarray
    on_voltage: tuple[Stage, ...]
    on_motion: tuple[Stage, ...]
    carries: tuple[object, ...]
    failed: bool = False

    @classmethod
    def at_rest(cls, numbers: FilmNumbers, effects: Sequence[TruthEffect] = ()) -> TruthPlant:
        """The film relaxed under its load, with ``effects`` in it.

        Raises ``ValueError`` where it has no rest state.
        """
        for effect in effects:
            if effect.on_film is not None:
                numbers = effect.on_film(numbers)
        rest = rest_stretch(numbers)
        # relaxed branches carry no elastic stretch: z_i = 0
        state = np.zeros(2 + len(numbers.times))
        state[0] = rest
        on_voltage = tuple(e.on_voltage for e in effects if e.on_voltage is not None)
        on_motion = tuple(e.on_motion for e in effects if e.on_motion is not None)
        carries = (None,) * (len(on_voltage) + len(on_motion))
        return cls(numbers, rest, state, on_voltage, on_motion, carries)

    @property
    def capacitance(self) -> float:
        """Present capacitance in F: the area grows by lam, the thickness falls by it."""
        return self.numbers.capacitance * float(self.state[0]) ** 2

    def advance(
        self, time: np.ndarray, voltage: np.ndarray, hold: bool
    ) -> tuple[Motion, TruthPlant]:
        """See ``sim_backend.plant.Plant.advance``. A film that has failed stays where it was."""
        carries = list(self.carries)
        voltage = voltage.copy()
        for i, stage in enumerate(self.on_voltage):
            voltage, carries[i] = stage(time, voltage, carries[i])
        stretch, rate = np.full(time.size, self.state[0]), np.zeros(time.size)
        state, fault, fault_at = self.state.copy(), None, 0
        if not self.failed:
            numbers = self.numbers
            lost, reached = follow(
                numbers.vector(), numbers.step, time, voltage, hold, state, stretch, rate
            )
            if lost:
                fault, fault_at = "the stretch ran away or a spring locked", int(reached)
                state = np.concatenate((stretch[-1:], np.zeros(state.size - 1)))
        seen = np.stack((stretch - self.rest, rate)) * self.numbers.length
        for i, stage in enumerate(self.on_motion, start=len(self.on_voltage)):
            seen, carries[i] = stage(time, seen, carries[i])
        nothing = np.zeros(time.size)
        motion = Motion(
            displacement=seen[0],
            velocity=seen[1],
            capacitance=self.numbers.capacitance * stretch**2,
            leakage=nothing,
            heating=nothing,
            fault=fault,
            fault_at=fault_at,
        )
        failed = self.failed or fault is not None
        return motion, replace(self, state=state, carries=tuple(carries), failed=failed)
