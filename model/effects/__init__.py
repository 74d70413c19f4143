"""Effects that the thesis's model lacks: each one file, each with a value at which it vanishes.

An effect describes itself (name, family, what it acts on, its parameters with units, bounds and
neutral value), so that reports, windows and model files need to know none of them by name, and it
contributes to the coefficients that the kernel reads. To add one, add a file and list it here.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from model.effects import load_inertia
from model.effects.description import Effect, Parameter

__all__ = ["EFFECTS", "Effect", "Parameter"]

#: Every effect this version knows, by name.
EFFECTS: Mapping[str, Effect] = MappingProxyType(
    {effect.name: effect for effect in (load_inertia.EFFECT,)}
)
