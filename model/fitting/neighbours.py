"""Readings of films that hardly differ, for derivatives: in common steps, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from threading import local

import numpy as np

from dearig.model import kernel
from dearig.model.coefficients import REST
from dearig.model.compiled.jit import is_enabled, read_only
from dearig.model.kernel.lanes import drive_in_lanes
from dearig.model.simulation.actuator import Drive, at_rest, initial_state

__all__ = ["readings_of_neighbours"]

_KEPT = 1 << 22  # numbers: 32 MB

_rooms = local()


def _room(films: int, samples: int) -> np.ndarray:
    """Return room (2, films, samples) for a motion, the same at each call of a thread.

    Memory that is new to a process is handed over page by page, which takes longer than to fill it.
    """
    size = 2 * films * samples
    if size > _KEPT:
        return np.empty((2, films, samples))
    kept = getattr(_rooms, "kept", None)
    if kept is None or kept.size < size:
        kept = _rooms.kept = np.empty(size)
    return np.asarray(kept[:size].reshape(2, films, samples))


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
    moved, rate = _room(len(films), drive.time.size)
    status, steps = drive_in_lanes(
        moving, drive.time, drive.voltage, drive.ends, drive.air,
        initial_state(moving[0], float(moving[0, REST])), moved, rate, fidelity,
    )  # fmt: skip
    if status != kernel.OK:
        return None, steps
    film_of = np.empty(len(cs), dtype=np.int64)
    for film, members in enumerate(films):
        film_of[members] = film
    readings = np.empty((len(cs), times.size))
    kernel.read_members(
        cs, film_of, 0, len(films), length, read_only(drive.time), moved, rate, lag,
        read_only(times), readings,
    )  # fmt: skip
    return readings, steps
