"""All effects: those of this folder and those of other distributions, with their places.

An effect of another distribution is named by an entry point of the group ``dearig.effects``, whose
value is a module. One that cannot be imported, described or compiled is left out, with a sentence
in ``PROBLEMS``; the program goes on without it.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoint
from pkgutil import walk_packages
from types import MappingProxyType, ModuleType
from typing import Any

import numba
import numpy as np

from dearig.model.coefficients import EFFECTS_AT
from dearig.model.compiled.jit import is_enabled, use_cache_without
from dearig.model.compiled.plugins import entry_points_found, origin
from dearig.model.effects import library
from dearig.model.effects.description import Effect, EffectValues, faults_of
from dearig.model.effects.hooks import HOOKS, Hook

__all__ = [
    "EFFECTS",
    "MEMORY",
    "NEUTRAL",
    "ORIGINS",
    "OURS",
    "PARAMETER_COUNT",
    "PLACES",
    "PROBLEMS",
    "SENSOR_COLUMNS",
    "SENSOR_MEMORY",
    "Place",
    "any_hysteretic",
    "hook_faults",
]

#: What ``ORIGINS`` says of the effects of this folder.
OURS = "dearig"


@dataclass(frozen=True)
class Place:
    """An effect's ``module``, and where its numbers are: first coefficient, first state variable.

    ``memory`` counts in the state of the sensor for an effect with the hook ``sense``, in that of
    the motion for all others.
    """

    module: ModuleType
    at: int
    memory: int

    @property
    def is_sensor(self) -> bool:
        """Whether the effect acts on the reading alone, so that it moves no film."""
        return hasattr(self.module, "sense")

    def column(self, effect: Effect, parameter: str) -> int:
        """Return the index of one of the effect's parameters in the coefficient vector."""
        return self.at + [p.name for p in effect.parameters].index(parameter)


class _Finder:
    """Effects found so far, the places given to them, and who was left out."""

    def __init__(self) -> None:
        self.effects: dict[str, Effect] = {}
        self.places: dict[str, Place] = {}
        self.origins: dict[str, str] = {}
        self.problems: dict[str, str] = {}
        self.memory = {False: 0, True: 0}
        self._at = EFFECTS_AT

    def refusal(self, module: ModuleType) -> str:
        """Return why the effect of ``module`` can have no place here, or nothing."""
        effect = getattr(module, "EFFECT", None)
        faults = faults_of(effect)
        if faults or not isinstance(effect, Effect):
            return "; ".join(faults)
        if effect.name in self.effects:
            return f"an effect of {self.origins[effect.name]} is called {effect.name!r} already"
        return "; ".join(hook_faults(module))

    def add(self, module: ModuleType, source: str) -> None:
        """Give the effect of ``module`` its place."""
        effect: Effect = module.EFFECT
        place = Place(module, self._at, self.memory[hasattr(module, "sense")])
        self.effects[effect.name] = effect
        self.places[effect.name] = place
        self.origins[effect.name] = source
        self._at += len(effect.parameters)
        self.memory[place.is_sensor] += effect.memory

    def add_plugin(self, entry_point: EntryPoint) -> None:
        """Add the effect that an entry point names, if it can be used."""
        source = origin(entry_point)
        try:
            module = import_module(entry_point.module)
            refusal = self.refusal(module)
        except Exception as error:  # noqa: BLE001 - a third party's module may raise anything
            refusal = f"{type(error).__name__}: {error}"
        if refusal:
            self.problems[f"{source}: {entry_point.value}"] = (
                f"The effect {entry_point.name!r} of {source} (module {entry_point.value}) is left "
                f"out: {refusal}. Repair or uninstall {source}."
            )
        else:
            self.add(module, source)


def hook_faults(module: ModuleType) -> list[str]:
    """Return why the hooks of ``module`` cannot be compiled into the kernel, in sentences."""
    present = {h: getattr(module, h) for h in HOOKS if getattr(module, h, None) is not None}
    if not present:
        return [f"it has none of the hooks {', '.join(HOOKS)}"]
    faults = []
    if "sense" in present and len(present) > 1:
        faults.append("an effect with the hook sense has no other hook")
    for name, function in present.items():
        wanted = ["c", "k", "m", "j", *HOOKS[name].arguments.replace(" ", "").split(",")]
        wanted = [argument for argument in wanted if argument]
        taken = list(inspect.signature(getattr(function, "py_func", function)).parameters)
        if taken != wanted:
            faults.append(f"its hook {name} takes ({', '.join(taken)}), not ({', '.join(wanted)})")
        elif is_enabled():
            faults += _compilation_faults(name, function, HOOKS[name])
    return faults


def _compilation_faults(name: str, function: Any, hook: Hook) -> list[str]:
    if not hasattr(function, "py_func"):
        return [f"its hook {name} is not compiled: decorate it with dearig.model.compiled.jit.jit"]
    array, number, index = numba.float64[::1], numba.float64, numba.int64
    count = len(inspect.signature(function.py_func).parameters) - 4
    taken = (array, index, array, index, *[number] * count)
    try:
        function.compile(taken)
    except numba.core.errors.NumbaError as error:
        plain = re.sub(r"\x1b\[[0-9;]*m", "", str(error))  # numba colours its messages
        return [f"its hook {name} does not compile: {' '.join(plain.split())}"]
    found = function.overloads[taken].signature.return_type
    parts = getattr(found, "types", (found,))  # of a tuple, the types of its values
    if hook.values and (
        len(parts) != hook.values or not all(isinstance(p, numba.types.Number) for p in parts)
    ):
        return [f"its hook {name} returns {found}, not {hook.values} number(s)"]
    return []


def _found() -> _Finder:
    finder = _Finder()
    files = walk_packages(library.__path__, f"{library.__name__}.")
    for name in sorted((m.name for m in files if not m.ispkg), key=lambda n: n.rpartition(".")[2]):
        module = import_module(name)
        # hooks of this folder are compiled with the kernel, and their tests check the rest
        if module.EFFECT.name in finder.effects:
            raise ImportError(f"two effects are called {module.EFFECT.name!r}")
        finder.add(module, OURS)
    for entry_point in entry_points_found():
        finder.add_plugin(entry_point)
    if finder.problems:
        use_cache_without(finder.problems)
    return finder


_finder = _found()

#: Every effect, by name.
EFFECTS: Mapping[str, Effect] = MappingProxyType(_finder.effects)
#: Where each of them has its numbers.
PLACES: Mapping[str, Place] = MappingProxyType(_finder.places)
#: Which distribution each of them is from: ``dearig``, or another's name and version.
ORIGINS: Mapping[str, str] = MappingProxyType(_finder.origins)
#: Which effects of other distributions were left out, and why: a sentence each.
PROBLEMS: tuple[str, ...] = tuple(_finder.problems.values())
#: Number of parameters of all effects together.
PARAMETER_COUNT = sum(len(e.parameters) for e in EFFECTS.values())
#: Number of state variables of the effects of the motion, and of those of the sensor.
MEMORY, SENSOR_MEMORY = _finder.memory[False], _finder.memory[True]
#: Indices of the coefficients of effects that act on the reading alone.
SENSOR_COLUMNS = np.array(
    [
        PLACES[e.name].at + i
        for e in EFFECTS.values()
        if PLACES[e.name].is_sensor
        for i in range(len(e.parameters))
    ]
)
#: Coefficients (PARAMETER_COUNT,) of a model without effects: amplitudes neutral, shape parameters
#: typical.
NEUTRAL = np.array(
    [
        p.neutral if p.neutral is not None else p.typical
        for e in EFFECTS.values()
        for p in e.parameters
    ]
)


def any_hysteretic(effects: EffectValues) -> bool:
    """Return whether one of ``effects`` is hysteretic: then steps are small."""
    return any(EFFECTS[name].is_hysteretic for name, _ in effects)
