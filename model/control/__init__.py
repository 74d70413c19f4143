"""Control: the voltage with which the film follows a path, learned run by run, and the hold."""

from __future__ import annotations

from dearig.model.control.hold import HoldAnswer, HoldController, HoldSettings, sensitivity_of
from dearig.model.control.inversion import CAUSES, Inversion, Unreachable, invert
from dearig.model.control.learning import Learner, Lesson
from dearig.model.control.learning_settings import LearningSettings
from dearig.model.control.limits import VoltageLimits
from dearig.model.control.linear import readings_under
from dearig.model.control.readings import lines_at_rest, mean_without_outliers
from dearig.model.control.task import BANDWIDTH, TrackingTask

__all__ = [
    "BANDWIDTH",
    "CAUSES",
    "HoldAnswer",
    "HoldController",
    "HoldSettings",
    "Inversion",
    "Learner",
    "LearningSettings",
    "Lesson",
    "TrackingTask",
    "Unreachable",
    "VoltageLimits",
    "invert",
    "lines_at_rest",
    "mean_without_outliers",
    "readings_under",
    "sensitivity_of",
]
