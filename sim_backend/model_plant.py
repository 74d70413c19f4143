"""Film that follows the model exactly, so that identification should recover its parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dearig.model import kernel
from dearig.model.compiled.jit import jit
from dearig.model.effects import EFFECTS, SENSOR_MEMORY
from dearig.model.readings.environment import CELSIUS, HUMIDITY
from dearig.model.simulation.actuator import (
    NO_AIR,
    STATUS_TEXTS,
    Actuator,
    Drive,
    at_rest,
    ends_of,
    initial_state,
)
from dearig.sim_backend.plant import Air, Electricity, Motion

__all__ = ["ModelPlant"]


@jit
def _charge(
    time: np.ndarray,
    capacitance: np.ndarray,
    ends: np.ndarray,
    before: float,
    charge: np.ndarray,
    step: np.ndarray,
    charging: np.ndarray,
) -> None:
    """Fill ``Electricity`` of a ``capacitance`` (N,) F under ``ends`` (2, N - 1) V.

    ``before`` C is the charge before the first step. The charging current is the mean over an
    interval.
    """
    for k in range(step.shape[0]):
        first, last = capacitance[k] * ends[0, k], capacitance[k + 1] * ends[1, k]
        charge[0, k], charge[1, k] = first, last
        step[k] = first - before
        charging[0, k] = charging[1, k] = (last - first) / (time[k + 1] - time[k])
        before = last


@dataclass(frozen=True)
class ModelPlant:
    """Plant of ``actuator``: kernel coefficients, rest stretch and present kernel state."""

    actuator: Actuator
    coefficients: np.ndarray
    rest: float
    state: np.ndarray
    sensor: np.ndarray
    charge: float = 0.0
    failed: bool = False
    air: Air | None = None

    @classmethod
    def at_rest(cls, actuator: Actuator, air: Air | None = None) -> ModelPlant:
        """Return the film relaxed under its load. Raises ``ModelError`` without a rest state.

        As the model has it, the film is in equilibrium with the ``air`` at the start of a run.
        """
        actuator.rest()
        coefficients = actuator.coefficients()
        _, rest = at_rest(coefficients, None if air is None else _start(air))
        state = initial_state(coefficients, rest)
        return cls(actuator, coefficients, rest, state, np.zeros(SENSOR_MEMORY), air=air)

    @property
    def capacitance(self) -> float:
        """Return the present capacitance in F."""
        return float(self.actuator.film.capacitance(self.state[:1])[0])

    def renewed(self, generator: np.random.Generator) -> ModelPlant:  # noqa: ARG002
        """Return the film unchanged: nothing in a model is random."""
        return self

    def in_room(self, air: Air) -> ModelPlant:
        """See ``Plant.in_room``; a model without an effect of the room is left as it is."""
        if not any(EFFECTS[name].needs for name, _ in self.actuator.effects):
            return self
        return ModelPlant.at_rest(self.actuator, air)

    def advance(
        self,
        time: np.ndarray,
        voltage: np.ndarray,
        hold: bool,
        settled: np.ndarray | None = None,
    ) -> tuple[Motion, ModelPlant]:
        """Follow a voltage; see ``Plant.advance``. A failed film keeps its last position."""
        held = voltage if settled is None else settled
        ends = np.stack((held, ends_of(held, hold)))[:, :-1]
        stretch, rate = np.full(time.size, self.state[0]), np.zeros(time.size)
        fault, fault_at = None, 0
        after = self
        if not self.failed:
            state = self.state.copy()
            status, reached, _ = kernel.drive_by_voltage(
                self.coefficients, time, voltage, ends_of(voltage, hold), self._air(time),
                state, stretch, rate,
            )  # fmt: skip
            if status != kernel.OK:
                fault, fault_at = STATUS_TEXTS[status], int(reached)
                state = np.concatenate((stretch[-1:], [0.0], state[2:]))
            after = replace(self, state=state, failed=fault is not None)
        length = self.actuator.film.length
        displacement, velocity = (stretch - self.rest) * length, rate * length
        memory = self.sensor.copy()
        kernel.read_sensor(self.coefficients, time, displacement, velocity, memory)
        electric = self._electricity(time, ends, stretch)
        after = replace(after, sensor=memory, charge=float(electric.charge[1, -1]))
        motion = Motion(
            displacement=displacement,
            velocity=velocity,
            electricity=electric,
            heating=np.zeros(time.size),
            fault=fault,
            fault_at=fault_at,
        )
        return motion, after

    def _electricity(self, time: np.ndarray, ends: np.ndarray, stretch: np.ndarray) -> Electricity:
        """Return the electricity under ``ends`` (2, N - 1) V along ``stretch`` (N,)."""
        capacitance = self.actuator.film.capacitance(stretch)
        charge, charging = np.empty(ends.shape), np.empty(ends.shape)
        step = np.empty(ends.shape[1])
        _charge(time, capacitance, ends, self.charge, charge, step, charging)
        return Electricity(ends, ends, charge, step, charging, np.zeros(ends.shape))

    def _air(self, time: np.ndarray) -> np.ndarray:
        """Return the air at ``time`` (N,) s above that of the start, as the kernel takes it."""
        if self.air is None:
            return NO_AIR
        start = np.zeros(1)
        warmth = self.air.temperature(time) - self.air.temperature(start)
        moisture = 0.01 * (self.air.humidity(time) - self.air.humidity(start))
        return np.stack((warmth, moisture))


def _start(air: Air) -> Drive:
    """Return a drive at 0 V that begins in ``air``."""
    start = np.zeros(1)
    return Drive(
        np.arange(2.0), np.zeros(2),
        temperature=float(air.temperature(start)[0]) - CELSIUS,
        humidity=0.01 * float(air.humidity(start)[0]) - HUMIDITY,
    )  # fmt: skip
