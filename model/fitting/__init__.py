"""Identification: from measured records to parameters, with what the data do and do not say."""

from __future__ import annotations

from dearig.model.fitting.identify import Identification, add_intervals, identify
from dearig.model.fitting.parameters import Estimate

__all__ = ["Estimate", "Identification", "add_intervals", "identify"]
