"""Identification: from measured records to parameters, with what the data do and do not say."""

from __future__ import annotations

from dearig.model.fitting.budget import uncertainty_budget, with_budget, with_systematic
from dearig.model.fitting.hierarchy import SharedFit, fit_shared
from dearig.model.fitting.identify import Identification, add_intervals, identify
from dearig.model.fitting.parameters import Constraint, Contribution, Estimate, GivenValue

__all__ = [
    "Constraint",
    "Contribution",
    "Estimate",
    "GivenValue",
    "Identification",
    "SharedFit",
    "add_intervals",
    "fit_shared",
    "identify",
    "uncertainty_budget",
    "with_budget",
    "with_systematic",
]
