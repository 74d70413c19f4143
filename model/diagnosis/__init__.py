"""From the residual of a fitted model to the effect that it lacks."""

from __future__ import annotations

from dearig.model.diagnosis.results import Diagnosis
from dearig.model.diagnosis.run import diagnose

__all__ = ["Diagnosis", "diagnose"]
