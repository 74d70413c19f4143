"""Plant with hidden effects, for the simulated rig."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.sim_backend.plant import Air, Motion
from dearig.sim_backend.truth.effect import Course, Stage, TruthEffect
from dearig.sim_backend.truth.film import (
    COURSE_ELECTRIC,
    COURSE_HEATING,
    NO_COURSE,
    FilmNumbers,
    FilmState,
    follow,
    leakage,
    rest_stretch,
)

__all__ = ["TruthPlant"]


@dataclass(frozen=True)
class TruthPlant:
    """Film of ``numbers`` with its present state and the stages before and after it.

    ``plain`` are the numbers without the changes of ``effects``.
    """

    plain: FilmNumbers
    effects: tuple[TruthEffect, ...]
    numbers: FilmNumbers
    rest: float
    state: FilmState
    on_course: tuple[Course, ...]
    on_voltage: tuple[Stage, ...]
    on_motion: tuple[Stage, ...]
    carries: tuple[object, ...]
    failed: bool = False

    @classmethod
    def at_rest(cls, plain: FilmNumbers, effects: Sequence[TruthEffect] = ()) -> TruthPlant:
        """Return the film of ``plain`` numbers, relaxed under its load, with ``effects``.

        Raises ``ValueError`` where it has no rest state.
        """
        numbers = plain
        for effect in effects:
            if effect.on_film is not None:
                numbers = effect.on_film(numbers)
        rest = rest_stretch(numbers)
        on_course = tuple(e.on_course for e in effects if e.on_course is not None)
        on_voltage = tuple(e.on_voltage for e in effects if e.on_voltage is not None)
        on_motion = tuple(e.on_motion for e in effects if e.on_motion is not None)
        carries = (None,) * (len(on_voltage) + len(on_motion))
        state = numbers.at_rest(rest)
        return cls(
            plain, tuple(effects), numbers, rest, state, on_course, on_voltage, on_motion, carries
        )

    def renewed(self, generator: np.random.Generator) -> TruthPlant:
        """See ``dearig.sim_backend.plant.Plant.renewed``."""
        effects = [e if e.redrawn is None else e.redrawn(generator) for e in self.effects]
        return TruthPlant.at_rest(self.plain, effects)

    def in_room(self, air: Air) -> TruthPlant:
        """See ``dearig.sim_backend.plant.Plant.in_room``."""
        if all(effect.in_room is None for effect in self.effects):
            return self
        effects = [e if e.in_room is None else e.in_room(air) for e in self.effects]
        return TruthPlant.at_rest(self.plain, effects)

    @property
    def capacitance(self) -> float:
        """Return the capacitance in F: the area grows by lam, the thickness falls by lam."""
        return self.numbers.capacitance * float(self.state.y[0]) ** 2

    def advance(
        self, time: np.ndarray, voltage: np.ndarray, hold: bool
    ) -> tuple[Motion, TruthPlant]:
        """Follow a voltage; see ``Plant.advance``. A failed film keeps its last position."""
        carries = list(self.carries)
        voltage = voltage.copy()
        for i, stage in enumerate(self.on_voltage):
            voltage, carries[i] = stage(time, voltage, carries[i])
        courses = np.repeat(np.array(NO_COURSE)[:, None], time.size, axis=1)
        for course in self.on_course:
            courses = course(time, courses)

        numbers, hidden = self.numbers, self.numbers.hidden
        y, memory = self.state.y.copy(), self.state.memory.copy()
        rows = np.zeros((3, time.size))
        rows[0] = y[0]
        fault, fault_at = None, 0
        if not self.failed:
            lost, reached = follow(
                numbers.body(self.rest),
                hidden,
                numbers.springs(),
                numbers.slipping(),
                numbers.step,
                time,
                voltage,
                courses,
                hold,
                y,
                memory,
                rows,
            )
            if lost:
                fault, fault_at = "the stretch diverged or a spring locked", int(reached)
                y = np.concatenate((rows[0, -1:], np.zeros(y.size - 1)))
        stretch, rate, warming = rows
        current = np.zeros(time.size)
        if hidden.leak_conductance > 0.0:
            leakage(hidden, voltage, stretch, current)
        seen = np.stack((stretch - self.rest, rate)) * numbers.length
        for i, stage in enumerate(self.on_motion, start=len(self.on_voltage)):
            seen, carries[i] = stage(time, seen, carries[i])
        motion = Motion(
            displacement=seen[0],
            velocity=seen[1],
            capacitance=numbers.capacitance * courses[COURSE_ELECTRIC] * stretch**2,
            leakage=current,
            heating=warming + courses[COURSE_HEATING],
            fault=fault,
            fault_at=fault_at,
        )
        after = replace(
            self,
            state=FilmState(y, memory),
            carries=tuple(carries),
            failed=self.failed or fault is not None,
        )
        return motion, after
