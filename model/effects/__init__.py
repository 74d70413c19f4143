"""Effects that the thesis's model lacks, each in one file, each with values at which it vanishes.

A file holds ``EFFECT``, the description that reports, windows, fits and model files read, and the
compiled functions by which it takes part in the kernel (``hooks.HOOKS``). ``registry`` finds the
files of this folder and the modules that other distributions name under the entry point group
``dearig.effects``; ``assembly`` compiles them into the kernel; ``contract`` checks one of them.
``README.md`` says how to add an effect.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dearig.model.effects.description import FAMILIES, Curve, Effect, EffectValues, Law, Parameter

if TYPE_CHECKING:
    from dearig.model.effects.registry import (
        EFFECTS,
        MEMORY,
        NEUTRAL,
        ORIGINS,
        PARAMETER_COUNT,
        PLACES,
        PROBLEMS,
        SENSOR_COLUMNS,
        SENSOR_MEMORY,
        Place,
        any_hysteretic,
    )

__all__ = [
    "EFFECTS",
    "FAMILIES",
    "MEMORY",
    "NEUTRAL",
    "ORIGINS",
    "PARAMETER_COUNT",
    "PLACES",
    "PROBLEMS",
    "SENSOR_COLUMNS",
    "SENSOR_MEMORY",
    "Curve",
    "Effect",
    "EffectValues",
    "Law",
    "Parameter",
    "Place",
    "any_hysteretic",
]


def __getattr__(name: str) -> Any:
    # Effects are sought at the first use. An effect's module imports this package for its
    # description, and must be complete when the search finds it.
    if name in __all__:
        from dearig.model.effects import registry

        return getattr(registry, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
