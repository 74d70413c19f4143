"""Displacements that a film is asked to follow, for the tests of control."""

from __future__ import annotations

import numpy as np

from dearig.model.control import TrackingTask, VoltageLimits

__all__ = ["LEAD_IN", "LIMITS", "RATE", "TAIL", "UP_AND_DOWN", "path", "task"]

RATE = 250.0  # Hz
LEAD_IN = TAIL = 50  # samples
LIMITS = VoltageLimits(8.5e3, 1.5e6, 15e6)
#: A target file: up within a second, down slowly.
UP_AND_DOWN = """\
name = "up and down"
lead_in_s = 0.5
tail_s = 0.1
[[segment]]
kind = "ramp"
to_mm = 0.3
duration_s = 1.0
[[segment]]
kind = "ramp"
to_mm = 0.04
duration_s = 2.5
[[segment]]
kind = "ramp"
to_mm = 0.0
duration_s = 5.0
"""


def path(frequency=1.0, amplitude=50e-6, offset=450e-6, seconds=4.0):
    """A smooth rise to ``offset`` m in 1 s, a sine about it, and a fall in 1.5 s, at ``RATE``."""
    time = np.arange(round(seconds * RATE)) / RATE
    part = np.clip(time, 0.0, 1.0) * np.clip((time[-1] - time) / 1.5, 0.0, 1.0)
    envelope = part * part * (3.0 - 2.0 * part)
    moved = envelope * (offset + amplitude * np.sin(2.0 * np.pi * frequency * time))
    return np.concatenate([np.zeros(LEAD_IN), moved, np.zeros(TAIL)])


def task(target, limits=LIMITS):
    """The task of following ``target`` (N,) m, with the rests of ``path``."""
    return TrackingTask(target, RATE, limits, LEAD_IN, TAIL)
