"""From the residual of a fitted model to the effect that it lacks."""

from __future__ import annotations

from model.diagnosis.findings import Diagnosis
from model.diagnosis.search import diagnose

__all__ = ["Diagnosis", "diagnose"]
