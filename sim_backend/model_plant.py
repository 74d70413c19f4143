"""Film that follows the model exactly, so that identification should recover its parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dearig.model import kernel
from dearig.model.actuator import STATUS_WORDS, Actuator, at_rest, ends_of, initial_state
from dearig.model.effects import SENSOR_MEMORY
from dearig.sim_backend.plant import Motion

__all__ = ["ModelPlant"]


@dataclass(frozen=True)
class ModelPlant:
    """Plant of ``actuator``: kernel coefficients, rest stretch and present kernel state."""

    actuator: Actuator
    coefficients: np.ndarray
    rest: float
    state: np.ndarray
    sensor: np.ndarray
    failed: bool = False

    @classmethod
    def at_rest(cls, actuator: Actuator) -> ModelPlant:
        """Return the film relaxed under its load. Raises ``ModelError`` without a rest state."""
        actuator.rest()
        coefficients = actuator.coefficients()
        _, rest = at_rest(coefficients)
        return cls(
            actuator, coefficients, rest, initial_state(coefficients, rest), np.zeros(SENSOR_MEMORY)
        )

    @property
    def capacitance(self) -> float:
        """Return the present capacitance in F."""
        return float(self.actuator.film.capacitance(self.state[:1])[0])

    def renewed(self, generator: np.random.Generator) -> ModelPlant:  # noqa: ARG002
        """Return the film unchanged: nothing in a model is random."""
        return self

    def advance(
        self, time: np.ndarray, voltage: np.ndarray, hold: bool
    ) -> tuple[Motion, ModelPlant]:
        """Follow a voltage; see ``Plant.advance``. A failed film keeps its last position."""
        stretch, rate = np.full(time.size, self.state[0]), np.zeros(time.size)
        fault, fault_at = None, 0
        after = self
        if not self.failed:
            state = self.state.copy()
            status, reached, _ = kernel.drive_by_voltage(
                self.coefficients, time, voltage, ends_of(voltage, hold), np.zeros(0),
                state, stretch, rate,
            )  # fmt: skip
            if status != kernel.OK:
                fault, fault_at = STATUS_WORDS[status], int(reached)
                state = np.concatenate((stretch[-1:], [0.0], state[2:]))
            after = replace(self, state=state, failed=fault is not None)
        length = self.actuator.film.length
        displacement, velocity = (stretch - self.rest) * length, rate * length
        memory = self.sensor.copy()
        kernel.read_sensor(self.coefficients, time, displacement, velocity, memory)
        after = replace(after, sensor=memory)
        nothing = np.zeros(time.size)
        motion = Motion(
            displacement=displacement,
            velocity=velocity,
            capacitance=self.actuator.film.capacitance(stretch),
            leakage=nothing,
            heating=nothing,
            fault=fault,
            fault_at=fault_at,
        )
        return motion, after
