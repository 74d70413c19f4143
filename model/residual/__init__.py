"""What a fitted model leaves over: whether it is noise, what it depends on, and as a stress."""

from __future__ import annotations

from dearig.model.residual.formula import Unnamed, describe_unnamed, looks
from dearig.model.residual.missing_stress import MissingStress, missing_stress
from dearig.model.residual.signature import Dependence, Signature, signatures

__all__ = [
    "Dependence",
    "MissingStress",
    "Signature",
    "Unnamed",
    "describe_unnamed",
    "looks",
    "missing_stress",
    "signatures",
]
