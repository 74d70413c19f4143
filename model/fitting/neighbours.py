"""Readings of films that hardly differ, for derivatives: in common steps, side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dearig.model import kernel
from dearig.model.coefficients import REST
from dearig.model.compiled.jit import is_enabled
from dearig.model.effects import SENSOR_MEMORY
from dearig.model.film.sensor import at_sensor
from dearig.model.kernel.lanes import drive_in_lanes
from dearig.model.simulation.actuator import Drive, at_rest, initial_state

__all__ = ["readings_of_neighbours"]


def readings_of_neighbours(
    cs: np.ndarray,
    films: Sequence[Sequence[int]],
    length: float,
    drive: Drive,
    fidelity: int,
    lag: float,
    times: np.ndarray,
) -> tuple[np.ndarray | None, int]:
    """Return readings (P, M) in m of coefficient vectors ``cs`` (P, C) near the first, and steps.

    ``films`` are the places in ``cs`` of members whose films move alike; the first member is in the
    first of them. ``length`` m is that of the films, ``fidelity`` as the kernel has it, ``lag`` s
    the age of a reading, ``times`` (M,) s those of the readings. None where the films cannot share
    steps (``dearig.model.kernel.lanes``), or where one of them has no rest state. The steps are
    those of the first film and of packs of all.
    """
    moving = np.array([cs[members[0]] for members in films])
    # without a compiler there are no packs of numbers
    if not is_enabled() or any(at_rest(c, drive)[0] != kernel.OK for c in moving):
        return None, 0
    moved, rate = np.empty((len(films), drive.time.size)), np.empty((len(films), drive.time.size))
    status, steps = drive_in_lanes(
        moving, drive.time, drive.voltage, drive.ends, drive.air,
        initial_state(moving[0], float(moving[0, REST])), moved, rate, fidelity,
    )  # fmt: skip
    if status != kernel.OK:
        return None, steps
    moved *= length
    rate *= length
    readings = np.empty((len(cs), times.size))
    shown, speed = np.empty(times.size), np.empty(times.size)
    for members, x, u in zip(films, moved, rate, strict=True):
        at_sensor(drive.time, x, u, times - lag, shown, speed)
        for member in members:
            readings[member] = shown
            kernel.read_sensor(cs[member], times, readings[member], speed, np.zeros(SENSOR_MEMORY))
    return readings, steps
