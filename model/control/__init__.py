"""Control: the voltage with which the film follows a path, and how it is learned run by run."""

from __future__ import annotations

from dearig.model.control.inversion import CAUSES, Inversion, Unreachable, invert
from dearig.model.control.learning import Learner, Lesson
from dearig.model.control.limits import VoltageLimits
from dearig.model.control.task import BANDWIDTH, TrackingTask

__all__ = [
    "BANDWIDTH",
    "CAUSES",
    "Inversion",
    "Learner",
    "Lesson",
    "TrackingTask",
    "Unreachable",
    "VoltageLimits",
    "invert",
]
