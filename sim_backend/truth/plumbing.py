"""How hidden effects are attached to a rig; generators A and B share it, not their laws."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from dearig.sim_backend.truth import kernels as loops
from dearig.sim_backend.truth.effect import TruthEffect
from dearig.sim_backend.truth.supply import Supply

__all__ = ["looking_back", "relaxing", "tones"]

OnMotion = Callable[[np.ndarray, np.ndarray, object], tuple[np.ndarray, object]]


def relaxing(shares: np.ndarray, times: np.ndarray, words: str) -> TruthEffect:
    """Return a polarisation: ``shares`` (K,) of the permittivity relax in ``times`` (K,) s."""

    def on_voltage(time: np.ndarray, supply: Supply, carry: object) -> tuple[Supply, object]:
        slow = np.zeros(times.size) if carry is None else np.array(carry)
        effective = np.empty_like(supply.pull)
        bound, creep = np.empty((2, time.size)), np.empty((2, time.size))
        ends = np.stack((supply.first, supply.last))
        loops.polarise(time, supply.pull, ends, shares, times, slow, effective, bound, creep)
        return replace(supply, pull=effective, bound=bound, creep=creep), slow

    return TruthEffect(
        family="dielectric_relaxation",
        acts_on="dielectric",
        description=f"{shares.sum():.2%} of the permittivity relaxes, {words}",
        on_voltage=on_voltage,
    )


def looking_back(
    span: float, read: Callable[[np.ndarray, np.ndarray, int, float, np.ndarray], object]
) -> OnMotion:
    """Return an ``on_motion`` whose reading is made of the last ``span`` s of the motion.

    ``read`` takes times, motion, the first sample of this call, ``span``, and the rows to fill.
    """

    def on_motion(time: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        if carry is None:
            past, seen = time[:1], rows[:, :1]
        else:
            past, seen = cast(tuple[np.ndarray, np.ndarray], carry)
        times = np.concatenate((past, time[1:]))
        motion = np.concatenate((seen, rows[:, 1:]), axis=1)
        read(times, motion, past.size - 1, span, rows)
        # the next call needs the positions from ``span`` before this call's last node on
        keep = max(0, int(np.searchsorted(times, time[-1] - span, side="right")) - 1)
        return rows, (times[keep:].copy(), motion[:, keep:].copy())

    return on_motion


def tones(parts: Sequence[tuple[float, float, float]], hertz: float) -> OnMotion:
    """Return an ``on_motion`` that adds sines: amplitude in m, multiple of ``hertz``, phase."""

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        for amplitude, times, phase in parts:
            omega = 2.0 * math.pi * hertz * times
            rows[0] += amplitude * np.sin(omega * t + phase)
            rows[1] += amplitude * omega * np.cos(omega * t + phase)
        return rows, carry

    return on_motion
