"""The smallest error that any voltage leaves on a simulated rig, from the truth.

Some of a reading's error no voltage takes off: its noise, what one run has alone, mains
interference, and the path where the film returns more slowly or sticks. The benchmark knows the
film: it computes what is left when the voltage is improved on the film itself, without noise, by
the quasi-Newton iteration of ``dearig.model.control.inversion``. That is found, not proven to be
the smallest: the true floor is at most as high.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dearig.model.control import TrackingTask
from dearig.model.control.inversion import _Job
from dearig.model.simulation.actuator import Actuator
from dearig.sim_backend.truth.plant import TruthPlant

__all__ = ["Truth"]

PLAYS = 20  # of one voltage, for what each run has alone


@dataclass(frozen=True)
class Truth:
    """The film of a simulated rig, without noise of the readings, on the path of ``task``."""

    plant: TruthPlant
    task: TrackingTask

    def reading(self, voltage: np.ndarray) -> np.ndarray | None:
        """Return what repeats of the reading (N,) m; None where the film fails."""
        repeated = [effect for effect in self.plant.effects if effect.redrawn is None]
        return self._moved(TruthPlant.at_rest(self.plant.plain, repeated), voltage)

    def film(self, voltage: np.ndarray) -> np.ndarray | None:
        """Return the reading (N,) m without what the sensor adds whatever the film does.

        Those are drift, interference, and jumps of the sensor: what it reads at 0 V.
        """
        sensor = [e for e in self.plant.effects if e.acts_on == "sensor"]
        added = self._moved(TruthPlant.at_rest(self.plant.plain, sensor), 0.0 * voltage)
        moved = self._moved(self.plant, voltage)
        return None if moved is None or added is None else moved - added

    def alone(self, voltage: np.ndarray, counted: np.ndarray) -> float:
        """Return the RMS in m of what a run has alone where it is ``counted`` (N,)."""
        if all(effect.redrawn is None for effect in self.plant.effects):
            return 0.0
        base, power = self.reading(voltage), []
        for seed in range(PLAYS):
            play = self._moved(self.plant.renewed(np.random.default_rng(seed)), voltage)
            if play is not None and base is not None:
                power.append(float(np.mean((play - base)[counted] ** 2)))
        return float(np.sqrt(np.mean(power))) if power else float("nan")

    def floor(
        self,
        model: Actuator,
        reference: np.ndarray,
        counted: np.ndarray,
        starts: Sequence[np.ndarray],
    ) -> float:
        """Return the smallest RMS error in m of the reading that was found, without noise.

        It is of ``reference`` (N,) m where ``counted`` (N,). The iteration starts from the balance
        of stresses of ``model``, and from each of the voltages ``starts`` (N,) in V.
        """
        job = _OnTruth(model, self)
        found = [job.follow(u) for u in (job.from_balance(), *(v * v for v in starts))]
        errors = [(reference - one.reading)[counted] for one in found]
        best = min(float(np.sqrt(np.mean(error**2))) for error in errors)
        return float(np.hypot(best, self.alone(np.sqrt(found[0].u), counted)))

    def _moved(self, plant: TruthPlant, voltage: np.ndarray) -> np.ndarray | None:
        motion, _ = plant.advance(self.task.time, voltage, True)
        if motion.fault is not None:
            return None
        moved = motion.displacement
        return moved - moved[: self.task.lead_in].mean()


class _OnTruth(_Job):
    """The inversion of a path, with the film of a rig in place of its model."""

    def __init__(self, model: Actuator, truth: Truth) -> None:
        super().__init__(model, truth.task)
        self._truth = truth

    def reading(self, voltage: np.ndarray) -> np.ndarray | None:
        return self._truth.reading(voltage)
