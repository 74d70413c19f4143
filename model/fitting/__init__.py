"""Identification: from measured records to parameters, with what the data do and do not say."""

from __future__ import annotations

from model.fitting.identify import Identification, identify
from model.fitting.parameters import Estimate

__all__ = ["Estimate", "Identification", "identify"]
