"""The kernel's hooks, assembled from the functions of all effects and compiled once.

Each hook is one place of the equations where effects take part. An effect at its neutral values is
skipped, so one compiled kernel serves every combination; which are not neutral is looked up once a
simulation, as bits of one number. Numba needs real functions with literal
offsets, and a file to cache them by, so the text of the hooks is written beside the compiled
kernels, in the folder that is named after the sources of this package.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from dearig.model.effects import EFFECTS, PLACES
from dearig.model.jit import cache_folder

__all__ = [
    "HOOKS",
    "HOOK_BITS",
    "HYSTERETIC",
    "active",
    "active_sensors",
    "commit",
    "inertia",
    "measured_stress",
    "permittivity",
    "polarise",
    "sense",
    "soften",
    "stiffness",
    "stress",
    "supply",
]

#: Hooks: what an effect's function of that name takes besides ``(c, k, m, j)``, and what becomes
#: of the answers. ``c`` are the coefficients and ``k`` where the effect's own begin; ``m`` is the
#: memory of all effects of the motion, or of all of the sensor, and ``j`` where its own begins. A
#: hook itself takes ``(on, c, m)`` and that, ``on`` being what ``active(c)`` says, or, for
#: ``sense``, ``active_sensors(c)``.
#:
#: * ``inertia`` kg/m, added to the coefficient of lam'';
#: * ``supply`` carries the voltage from ``start`` to ``end`` V over ``h`` s to the film, one effect
#:   after another, each with its state in the memory; ``lam`` and ``rate`` are those amid that
#:   time, and ``h`` = 0 asks for the voltage at the film now;
#: * ``polarise`` gives what a slow dielectric adds to the voltage squared at start and end;
#: * ``permittivity`` is a factor on the Maxwell stress, ``soften`` one on the network's stress;
#: * ``stress`` Pa is added to the network's: at stretch ``lam`` and rate ``rate``, ``since`` s
#:   after the step began at ``lam0``, the memory being that of the beginning; ``commit`` carries
#:   the memory to the end of the step;
#: * ``stiffness`` says what ``stress`` adds at a rate, (Pa, Pa s) at most: for the length of steps;
#: * ``measured_stress`` is what a sample feels of the stress in it;
#: * ``sense`` is what the sensor makes of displacement ``x`` m and velocity ``u`` m/s, ``dt`` s
#:   after the reading before.
#:
#: ``t`` s is the time since the record began, ``warmth`` K the temperature above that of the start.
HOOKS = MappingProxyType(
    {
        "inertia": ("", "sum"),
        "supply": ("t, start, end, h, lam, rate", "start, end"),
        "polarise": ("start, end, h", "sums"),
        "permittivity": ("lam, field2", "product"),
        "soften": ("lam, since, t, warmth", "product"),
        "stress": ("lam, rate, lam0, since, t", "sum"),
        "stiffness": ("lam, rate", "sums"),
        "commit": ("lam, rate, lam0, h, t", ""),
        "measured_stress": ("sigma", "sigma"),
        "sense": ("t, dt, x, u", "x"),
    }
)
# how the answers of several effects are put together: what to begin with, what to do with each (an
# answer is {}), what to return; any other word is an argument that goes from one to the next
_TOGETHER = MappingProxyType(
    {
        "": ("", "{}", "0"),
        "sum": ("total = 0.0", "total += {}", "total"),
        "sums": ("a, b = 0.0, 0.0", "p, q = {}; a, b = a + p, b + q", "a, b"),
        "product": ("total = 1.0", "total *= {}", "total"),
    }
)
# along the signal path, where the order matters: a sensor is slow before it is wrong
_ORDER = ("amplifier", "electrode", "dielectric", "film stress", "inertia", "load", "environment")
_EFFECTS_MAX = 62  # bits of a number that is not negative
_SENSOR_ORDER = ("sensor_lag", "sensor_nonlinearity", "drift", "interference", "unknown")


def _rank(name: str) -> tuple[int, int, str]:
    effect = EFFECTS[name]
    where = _ORDER.index(effect.acts_on) if effect.acts_on in _ORDER else len(_ORDER)
    sensor = _SENSOR_ORDER.index(effect.family) if effect.family in _SENSOR_ORDER else 0
    return where, sensor, name


def _bits() -> dict[str, int]:
    """One bit for each effect; those of the sensor are counted apart from those of the motion."""
    bits = {}
    for sensed in (False, True):
        names = [n for n in sorted(EFFECTS, key=_rank) if _has(n, "sense") == sensed]
        if len(names) > _EFFECTS_MAX:
            raise ImportError(f"{len(names)} effects: bits of one number tell {_EFFECTS_MAX} apart")
        bits.update({name: 1 << i for i, name in enumerate(names)})
    return bits


def _has(name: str, hook: str) -> bool:
    return hasattr(PLACES[name].module, hook)


def _mask(names: Iterable[str]) -> int:
    return sum(_OF_EFFECT[n] for n in names)


def _active(name: str) -> str:
    effect, at = EFFECTS[name], PLACES[name].at
    tests = (
        f"c[{at + i}] != {p.neutral!r}"
        for i, p in enumerate(effect.parameters)
        if p.neutral is not None
    )
    return " or ".join(tests)


def _text() -> str:
    """Source of the hooks."""
    names = sorted(EFFECTS, key=_rank)
    lines = ["from dearig.model.jit import jit"]
    modules = {n: PLACES[n].module.__name__.rsplit(".", 1)[1] for n in names}
    lines += [f"from dearig.model.effects import {m} as _{m}" for m in modules.values()]
    for hook, (arguments, how) in HOOKS.items():
        taking = f", {arguments}" if arguments else ""
        first, each, last = _TOGETHER.get(how, ("", f"{how} = {{}}", how))
        lines += ["", "", "@jit", f"def {hook}(on, c, m{taking}):", f"    {first}"]
        taken = [n for n in names if _has(n, hook)]
        # by fours: one test spares four where nobody acts
        for some in (taken[i : i + 4] for i in range(0, len(taken), 4)):
            lines.append(f"    if on & {_mask(some)}:")
            for name in some:
                place = PLACES[name]
                call = f"_{modules[name]}.{hook}(c, {place.at}, m, {place.memory}{taking})"
                lines += [
                    f"        if on & {_OF_EFFECT[name]}:",
                    f"            {each.format(call)}",
                ]
        lines.append(f"    return {last}")
    for function, sensed in (("active", False), ("active_sensors", True)):
        lines += ["", "", "@jit", f"def {function}(c):", "    found = 0"]
        for name in (n for n in names if _has(n, "sense") == sensed):
            lines += [f"    if {_active(name)}:", f"        found |= {_OF_EFFECT[name]}"]
        lines.append("    return found")
    return "\n".join([*lines, ""])


def _load() -> ModuleType:
    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "hooks.py"
    text = _text()
    # written once and whole: its time of change is part of what the compiled kernels are known by
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        handle, partial = tempfile.mkstemp(dir=folder, suffix=".py")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        Path(partial).replace(path)
    spec = importlib.util.spec_from_file_location("dearig.model.effects.hooks", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


_OF_EFFECT = _bits()
#: What ``active(c)`` has in common with these says which hooks have anything to do; for ``sense``,
#: what ``active_sensors(c)`` has.
HOOK_BITS = MappingProxyType({h: _mask(n for n in EFFECTS if _has(n, h)) for h in HOOKS})
#: The same of the effects that depend on turning points.
HYSTERETIC = _mask(n for n, effect in EFFECTS.items() if effect.is_hysteretic)

_hooks: Any = _load()
_Hook = Callable[..., Any]

inertia: _Hook = _hooks.inertia
supply: _Hook = _hooks.supply
polarise: _Hook = _hooks.polarise
permittivity: _Hook = _hooks.permittivity
soften: _Hook = _hooks.soften
stress: _Hook = _hooks.stress
stiffness: _Hook = _hooks.stiffness
commit: _Hook = _hooks.commit
measured_stress: _Hook = _hooks.measured_stress
sense: _Hook = _hooks.sense
active: _Hook = _hooks.active
active_sensors: _Hook = _hooks.active_sensors
