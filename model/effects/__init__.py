"""Effects that the thesis's model lacks: each one file, each with a value at which it vanishes.

A file holds ``EFFECT``, its description, from which reports, windows, fits and model files read all
they need to know, and the compiled functions by which it takes part in the kernel (``HOOKS`` of
``dearig.model.effects.assembly`` says which there are). To add an effect, add a file: it is found
here, given its place in the coefficient vector and in the kernel's memory, and compiled in.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType, ModuleType

import numpy as np

from dearig.model.coefficients import EFFECTS_AT
from dearig.model.effects.description import FAMILIES, Effect, EffectValues, Parameter

__all__ = [
    "EFFECTS",
    "FAMILIES",
    "MEMORY",
    "NEUTRAL",
    "PARAMETER_COUNT",
    "PLACES",
    "SENSOR_COLUMNS",
    "SENSOR_MEMORY",
    "Effect",
    "EffectValues",
    "Parameter",
    "Place",
    "any_hysteretic",
]

_NOT_EFFECTS = ("assembly", "description")


@dataclass(frozen=True)
class Place:
    """Where an effect lives: its ``module``, first coefficient ``at``, first ``memory`` slot.

    The sensor's effects remember apart from those of the motion.
    """

    module: ModuleType
    at: int
    memory: int

    def column(self, effect: Effect, parameter: str) -> int:
        """Index of one of the effect's numbers in the coefficient vector."""
        return self.at + [p.name for p in effect.parameters].index(parameter)


def _found() -> tuple[dict[str, Effect], dict[str, Place], int, int]:
    effects: dict[str, Effect] = {}
    places: dict[str, Place] = {}
    at, memory = EFFECTS_AT, {False: 0, True: 0}
    names = sorted(m.name for m in iter_modules(__path__) if m.name not in _NOT_EFFECTS)
    for name in names:
        module = import_module(f"{__name__}.{name}")
        effect: Effect = module.EFFECT
        if effect.name in effects:
            raise ImportError(f"two effects are called {effect.name!r}")
        effects[effect.name] = effect
        sensed = hasattr(module, "sense")
        places[effect.name] = Place(module, at, memory[sensed])
        at += len(effect.parameters)
        memory[sensed] += effect.memory
    return effects, places, memory[False], memory[True]


_effects, _places, _motion, _sensor = _found()

#: Every effect this version knows, by name.
EFFECTS: Mapping[str, Effect] = MappingProxyType(_effects)
#: Where each of them lives.
PLACES: Mapping[str, Place] = MappingProxyType(_places)
#: How many coefficients all effects have together, and how many numbers those of the motion and
#: those of the sensor remember.
PARAMETER_COUNT = sum(len(e.parameters) for e in EFFECTS.values())
MEMORY, SENSOR_MEMORY = _motion, _sensor
#: Indices of the coefficients of effects that act on the reading alone: no film moves by them.
SENSOR_COLUMNS = np.array(
    [
        PLACES[e.name].at + i
        for e in EFFECTS.values()
        if hasattr(PLACES[e.name].module, "sense")
        for i in range(len(e.parameters))
    ]
)
#: The coefficients (PARAMETER_COUNT,) of a model without effects; shapes are at a typical value.
NEUTRAL = np.array(
    [
        p.neutral if p.neutral is not None else p.typical
        for e in EFFECTS.values()
        for p in e.parameters
    ]
)


def any_hysteretic(effects: EffectValues) -> bool:
    """Whether one of ``effects`` follows the path from turn to turn: then steps are small."""
    return any(EFFECTS[name].is_hysteretic for name, _ in effects)
