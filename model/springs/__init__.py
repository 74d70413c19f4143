"""Strain energies of one spring, one file each; the README next to this says how to add one.

A law is W = modulus (U(I1 - 3) + sum w(lam_i)), of the spring's own principal stretches.
"""

from __future__ import annotations

from dearig.model.spring_names import SPRINGS
from dearig.model.springs.description import LIMIT, ShapeParameter, SpringLaw
from dearig.model.springs.dispatch import (
    Shape,
    curvature,
    energy,
    has_principal,
    locking_strain,
    principal_energy,
    principal_pull,
    principal_pull_slope,
    slope,
)
from dearig.model.springs.registry import MODULES, SPRING_LAWS

__all__ = [
    "LIMIT",
    "MODULES",
    "SPRINGS",
    "SPRING_LAWS",
    "Shape",
    "ShapeParameter",
    "SpringLaw",
    "curvature",
    "energy",
    "has_principal",
    "locking_strain",
    "principal_energy",
    "principal_pull",
    "principal_pull_slope",
    "slope",
]
