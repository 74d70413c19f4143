"""Sudden change at one moment. In no family.

``load_slips``: part of the weight comes to rest on a support, or slips onto the hook.
``mount_slips``: the sensor jumps. ``electrode_tears``: part of the electrode is cut off and no
longer contributes to the Maxwell stress. Each occurs in every run at the same time after the start.
"""

from __future__ import annotations

import numpy as np

from dearig.model.film.material import Load
from dearig.sim_backend.truth.effect import Course, TruthEffect
from dearig.sim_backend.truth.film import COURSE_AREA, COURSE_PULL
from dearig.sim_backend.truth.sampling import either_sign, log_uniform

__all__ = ["electrode_tears", "load_slips", "mount_slips"]

_MOMENT = (4.5, 10.5)  # s: within the shortest of the thesis's runs, and after its first lobe
_WEIGHT = (0.0002, 0.011)  # of the load
_JUMP = (3.5e-6, 200e-6)  # m
_AREA = (0.006, 0.15)  # of the electrode


def _step(row: int, moment: float, factor: float) -> Course:
    def on_course(t: np.ndarray, rows: np.ndarray) -> np.ndarray:
        rows[row, t >= moment] *= factor
        return rows

    return on_course


def load_slips(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a step in the load."""
    moment = generator.uniform(*_MOMENT)
    change = either_sign(generator) * log_uniform(generator, *_WEIGHT)
    return TruthEffect(
        family="unknown",
        acts_on="load",
        description=f"at {moment:.2f} s the load changes by {change:.3%}",
        on_course=_step(COURSE_PULL, moment, 1.0 + change),
    )


def electrode_tears(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a step in the Maxwell stress."""
    moment = generator.uniform(*_MOMENT)
    lost = log_uniform(generator, *_AREA)
    return TruthEffect(
        family="unknown",
        acts_on="electrode",
        description=f"at {moment:.2f} s {lost:.2%} of the electrode is cut off",
        on_course=_step(COURSE_AREA, moment, 1.0 - lost),
    )


def mount_slips(generator: np.random.Generator, load: Load) -> TruthEffect:  # noqa: ARG001
    """Draw a step in the reading."""
    moment = generator.uniform(*_MOMENT)
    jump = either_sign(generator) * log_uniform(generator, *_JUMP)

    def on_motion(t: np.ndarray, rows: np.ndarray, carry: object) -> tuple[np.ndarray, object]:
        rows[0, t >= moment] += jump
        return rows, carry

    return TruthEffect(
        family="unknown",
        acts_on="sensor",
        description=f"at {moment:.2f} s the reading jumps by {jump * 1e6:.3g} um",
        on_motion=on_motion,
    )
