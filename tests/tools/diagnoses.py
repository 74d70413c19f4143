"""Made data and requirements that the tests of whole diagnoses and of the search share."""

from __future__ import annotations

import functools
from dataclasses import replace

from dearig.model.diagnosis import Diagnosis, diagnose
from dearig.model.simulation.actuator import Actuator
from tests.tools.engine import (
    PLAIN,
    effect,
    record_of,
)

HIDDEN = {
    "load inertia": {"moving_mass": 0.2},
    "sensor curvature": {"quadratic": 15.0},
    "mains interference": {
        "cosine": 3e-6, "sine": 2e-6, "third_cosine": 1e-6, "third_sine": 0.0, "frequency": 49.97,
    },
}  # fmt: skip


def plant(name: str) -> Actuator:
    return replace(PLAIN, effects=effect(name, **HIDDEN[name]))


@functools.cache
def of_hidden(name: str) -> Diagnosis:
    return diagnose([record_of(plant(name))], PLAIN, workers=1)
