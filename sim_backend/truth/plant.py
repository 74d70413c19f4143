"""Plant with hidden effects, for the simulated rig."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.sim_backend.plant import Air, Electricity, Motion
from dearig.sim_backend.truth.circuit import electricity
from dearig.sim_backend.truth.effect import Course, Stage, SupplyStage, TruthEffect
from dearig.sim_backend.truth.film import (
    COURSE_AREA,
    COURSE_ELECTRIC,
    COURSE_HEATING,
    NO_COURSE,
    FilmNumbers,
    FilmState,
    follow,
    rest_stretch,
)
from dearig.sim_backend.truth.supply import Supply

__all__ = ["TruthPlant"]


@dataclass(frozen=True)
class TruthPlant:
    """Film of ``numbers`` with its present state and the stages before and after it.

    ``plain`` are the numbers without the changes of ``effects``. ``carries`` are the states of the
    stages, ``circuit`` is that of ``circuit.electricity``.
    """

    plain: FilmNumbers
    effects: tuple[TruthEffect, ...]
    numbers: FilmNumbers
    rest: float
    state: FilmState
    on_course: tuple[Course, ...]
    on_voltage: tuple[tuple[TruthEffect, SupplyStage], ...]
    on_motion: tuple[Stage, ...]
    carries: tuple[object, ...]
    circuit: tuple[float, float] = (0.0, 0.0)
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
        on_voltage = tuple((e, e.on_voltage) for e in effects if e.on_voltage is not None)
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
        self,
        time: np.ndarray,
        voltage: np.ndarray,
        hold: bool,
        settled: np.ndarray | None = None,
    ) -> tuple[Motion, TruthPlant]:
        """Follow a voltage; see ``Plant.advance``. A failed film keeps its last position."""
        carries = list(self.carries)
        supply, output, shown = self._supplied(time, voltage, hold, settled, carries)
        courses = np.repeat(np.array(NO_COURSE)[:, None], time.size, axis=1)
        for course in self.on_course:
            courses = course(time, courses)
        acting = courses[:3].copy()
        acting[COURSE_ELECTRIC] *= courses[COURSE_AREA]

        numbers = self.numbers
        y, memory = self.state.y.copy(), self.state.memory.copy()
        rows = np.zeros((5, time.size))
        rows[0] = y[0]
        fault, fault_at = None, 0
        if not self.failed:
            lost, reached = follow(
                numbers.body(self.rest),
                numbers.hidden,
                numbers.springs(),
                numbers.slipping(),
                numbers.step,
                time,
                supply.pull,
                acting,
                hold,
                y,
                memory,
                rows,
            )
            if lost:
                fault, fault_at = "the stretch diverged or a spring locked", int(reached)
                y = np.concatenate((rows[0, -1:], np.zeros(y.size - 1)))
        stretch, rate, warming = rows[:3]
        seen = np.stack((stretch - self.rest, rate)) * numbers.length
        for i, stage in enumerate(self.on_motion, start=len(self.on_voltage)):
            seen, carries[i] = stage(time, seen, carries[i])
        electric, circuit = self._electricity(time, rows, supply, courses, output, shown)
        motion = Motion(
            displacement=seen[0],
            velocity=seen[1],
            electricity=electric,
            heating=warming + courses[COURSE_HEATING],
            fault=fault,
            fault_at=fault_at,
        )
        after = replace(
            self,
            state=FilmState(y, memory),
            carries=tuple(carries),
            circuit=circuit,
            failed=self.failed or fault is not None,
        )
        return motion, after

    def _supplied(
        self,
        time: np.ndarray,
        voltage: np.ndarray,
        hold: bool,
        settled: np.ndarray | None,
        carries: list[object],
    ) -> tuple[Supply, np.ndarray, np.ndarray | None]:
        """Return the supply of the film, the output and, if a fault is seen, what is shown of it.

        Output and what the monitor shows are (2, N - 1) V.
        ``carries`` are replaced by those after the call.
        """
        held = (voltage if settled is None else settled).copy()
        last = held if hold else np.append(held[1:], held[-1:])
        supply = Supply(voltage.copy(), held, last)
        output, shown = np.stack((held[:-1], last[:-1])), None
        for i, (effect, stage) in enumerate(self.on_voltage):
            supply, carries[i] = stage(time, supply, carries[i])
            if effect.acts_on == "amplifier":
                output = np.stack((supply.first[:-1], supply.last[:-1]))
                shown = output if effect.seen else shown
        return supply, output, shown

    def _electricity(
        self,
        time: np.ndarray,
        rows: np.ndarray,
        supply: Supply,
        courses: np.ndarray,
        output: np.ndarray,
        shown: np.ndarray | None,
    ) -> tuple[Electricity, tuple[float, float]]:
        """Return the electricity along the motion ``rows`` (5, N), and the state after it."""
        hidden, capacitance = self.numbers.hidden, self.numbers.capacitance
        elapsed = np.append(np.diff(time), 1.0)  # nothing is asked of what follows the last node
        ends, state = np.empty((4, 2, time.size - 1)), np.array(self.circuit)
        step = np.empty(time.size - 1)
        feeding = np.empty((6, time.size))
        feeding[0], feeding[1] = supply.first, supply.last
        feeding[2:4] = feeding[:2] if supply.bound is None else supply.bound
        feeding[4:] = (
            supply.creep if supply.creep is not None else (feeding[1] - feeding[0]) / elapsed
        )
        joined = np.ones(time.size, bool) if supply.joined is None else supply.joined
        electricity(
            hidden,
            capacitance,
            self.rest,
            time,
            rows,
            feeding,
            joined,
            courses[COURSE_ELECTRIC],
            courses[COURSE_AREA],
            state,
            ends,
            step,
        )
        leaks = hidden.leak_conductance > 0.0
        lag = hidden.leak_series * capacitance * self.rest**2 if leaks else 0.0
        voltage, charge, charging, conduction = ends
        electric = Electricity(output, voltage, charge, step, charging, conduction, lag, shown)
        return electric, (float(state[0]), float(state[1]))
