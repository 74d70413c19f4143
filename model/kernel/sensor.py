"""What the sensor makes of the displacement."""

from __future__ import annotations

import numpy as np

from dearig.model.compiled.jit import jit
from dearig.model.effects import assembly

__all__ = ["read_sensor"]

_sense, _sensing = assembly.sense, assembly.active_sensors


@jit
def read_sensor(
    c: np.ndarray,
    time: np.ndarray,
    displacement: np.ndarray,
    velocity: np.ndarray,
    memory: np.ndarray,
) -> None:
    """Turn ``displacement`` (N,) m, in place, into readings by the effects that act on the sensor.

    ``velocity`` (N,) m/s is the film's; ``memory`` (SENSOR_MEMORY,) is carried along. Element
    0 is the last reading of the call before, or the first of the record.
    """
    sensing = _sensing(c)
    if not sensing:
        return
    for k in range(time.shape[0]):
        dt = time[k] - time[k - 1] if k else 0.0
        displacement[k] = _sense(sensing, c, memory, time[k], dt, displacement[k], velocity[k])
