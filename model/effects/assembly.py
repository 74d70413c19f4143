"""The kernel's hooks, assembled from the functions of all effects and compiled once.

An effect at its neutral values is skipped, so one compiled kernel serves every combination. Which
effects are active is determined once a simulation, as bits of one number. Numba needs real
functions with literal offsets, and a file to cache them by. So the source of the hooks is written
next to the compiled kernels, in the folder that is named after the sources of all effects.

An assembled hook takes ``(on, c, m)`` and the arguments of ``HOOKS``; ``on`` is ``active(c)``, or
``active_sensors(c)`` for ``sense``. ``m`` is the state of all effects of the motion, or of all
effects of the sensor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import reduce
from operator import or_
from types import MappingProxyType
from typing import Any

from dearig.model.compiled.by_name import VECTOR
from dearig.model.compiled.generated import generated_module
from dearig.model.effects.hooks import FASTEST, HOOKS
from dearig.model.effects.registry import EFFECTS, PLACES

__all__ = [
    "AMPLIFIER",
    "HOOKS",
    "HOOK_BITS",
    "HYSTERETIC",
    "active",
    "active_sensors",
    "at_rest",
    "breathe",
    "charge",
    "commit",
    "conduct",
    "drop",
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

# How the values of several effects combine: first line, line for each effect ({} is its value),
# returned expression. Any other name is that of an argument that each effect hands to the next.
_COMBINE = MappingProxyType(
    {
        "": ("", "{}", "0"),
        "sum": ("total = 0.0", "total += {}", "total"),
        "sums": ("a, b = 0.0, 0.0", "p, q = {}; a, b = a + p, b + q", "a, b"),
        "product": ("total = 1.0", "total *= {}", "total"),
    }
)
# Hooks that each stage of a step calls: of a short law the call would take most of the time.
_INTO_CALLERS = ("supply", "polarise", "permittivity", "soften", "stress")
# Types of what a hook returns, by the number of its values, and of on, c, m.
_RETURNED = ("int64", "float64", "UniTuple(float64, 2)")
_FIRST = f"int64, {VECTOR}, {VECTOR}"
# The order of effects is that of the signal path; a sensor's lag comes before its nonlinearity.
_ORDER = ("amplifier", "electrode", "dielectric", "film stress", "inertia", "load", "environment")
_LAST_BIT = 62  # of a 64-bit number that is not negative
_SENSOR_ORDER = ("sensor_lag", "sensor_nonlinearity", "drift", "interference", "unknown")


def _rank(name: str) -> tuple[int, int, str]:
    effect = EFFECTS[name]
    where = _ORDER.index(effect.acts_on) if effect.acts_on in _ORDER else len(_ORDER)
    sensor = _SENSOR_ORDER.index(effect.family) if effect.family in _SENSOR_ORDER else 0
    return where, sensor, name


def _bits() -> dict[str, int]:
    """One bit for each effect; those of the sensor are counted apart from those of the motion.

    Where there are more effects than bits, the last of the signal path share one: it says that one
    of them may be active, and which is asked of its coefficients.
    """
    bits = {}
    for of_sensor in (False, True):
        names = [n for n in sorted(EFFECTS, key=_rank) if PLACES[n].is_sensor == of_sensor]
        bits.update({name: 1 << min(i, _LAST_BIT) for i, name in enumerate(names)})
    return bits


def _test(name: str) -> str:
    """Return the condition under which the hooks of an effect are called."""
    bit = _OF_EFFECT[name]
    alone = sum(
        other == bit and PLACES[n].is_sensor == PLACES[name].is_sensor
        for n, other in _OF_EFFECT.items()
    )
    return f"on & {bit}" if alone == 1 else f"on & {bit} and ({_active(name)})"


def _has(name: str, hook: str) -> bool:
    """Whether an effect takes part in a hook; ``stiffness`` follows from ``stress``."""
    if hook == "stiffness" and _is_numeric(name):
        return True
    return getattr(PLACES[name].module, hook, None) is not None


def _is_numeric(name: str) -> bool:
    """Whether the derivatives of an effect's stress are taken numerically."""
    module = PLACES[name].module
    return hasattr(module, "stress") and not hasattr(module, "stiffness")


def _mask(names: Iterable[str]) -> int:
    return reduce(or_, (_OF_EFFECT[n] for n in names), 0)


def _active(name: str) -> str:
    effect, at = EFFECTS[name], PLACES[name].at
    tests = (
        f"c[{at + i}] != {p.neutral!r}"
        for i, p in enumerate(effect.parameters)
        if p.neutral is not None
    )
    return " or ".join(tests)


# Numeric derivatives of an effect's stress, where it gives none, at the beginning of a step at
# ``lam``: the film comes from there at the rate. At an infinite rate the largest ones are wanted.
_NUMERIC_STIFFNESS = """

@jit
def {effect}_stiffness(c, k, m, j, lam, rate):
    slope, drag = 0.0, 0.0
    speed, last = rate, rate
    if rate > {fastest!r}:
        speed, last = {fastest!r}, {slowest!r}
    while True:
        d, e = 1e-6 * lam, 1e-4 * max(speed, 1e-2)
        since = d / max(speed, 1.0)
        up = {effect}.stress(c, k, m, j, lam + d, speed, lam, since, 0.0)
        down = {effect}.stress(c, k, m, j, lam - d, speed, lam, since, 0.0)
        faster = {effect}.stress(c, k, m, j, lam, speed + e, lam, since, 0.0)
        slower = {effect}.stress(c, k, m, j, lam, speed - e, lam, since, 0.0)
        slope = max(slope, (up - down) / (2.0 * d))
        drag = max(drag, (faster - slower) / (2.0 * e))
        if speed <= last:
            return slope, drag
        speed *= 0.1
"""


def _text() -> str:
    """Return the source of the hooks."""
    names = sorted(EFFECTS, key=_rank)
    lines = [
        "from dearig.model.compiled.by_name import by_name",
        "from dearig.model.compiled.jit import jit",
    ]
    modules = {name: f"_effect_{i}" for i, name in enumerate(names)}
    lines += [f"import {PLACES[n].module.__name__} as {alias}" for n, alias in modules.items()]
    lines += [
        _NUMERIC_STIFFNESS.format(effect=modules[n], fastest=FASTEST, slowest=1e-3 * FASTEST)
        for n in names
        if _is_numeric(n)
    ]
    for hook, (arguments, how) in HOOKS.items():
        taking = f", {arguments}" if arguments else ""
        first, each, last = _COMBINE.get(how, ("", f"{how} = {{}}", how))
        types = f"{_RETURNED[HOOKS[hook].values]}({_FIRST}{', float64' * len(arguments.split())})"
        decorator = "jit" if hook in _INTO_CALLERS else f'by_name("{types}")'
        lines += ["", "", f"@{decorator}", f"def {hook}(on, c, m{taking}):", f"    {first}"]
        taken = [n for n in names if _has(n, hook)]
        # in groups of four: where none of a group is active, one test skips it
        for some in (taken[i : i + 4] for i in range(0, len(taken), 4)):
            lines.append(f"    if on & {_mask(some)}:")
            for name in some:
                place = PLACES[name]
                function = f"{modules[name]}.{hook}"
                if hook == "stiffness" and _is_numeric(name):
                    function = f"{modules[name]}_stiffness"
                call = f"{function}(c, {place.at}, m, {place.memory}{taking})"
                lines += [
                    f"        if {_test(name)}:",
                    f"            {each.format(call)}",
                ]
        lines.append(f"    return {last}")
    for function, of_sensor in (("active", False), ("active_sensors", True)):
        lines += ["", "", f'@by_name("int64({VECTOR})")', f"def {function}(c):", "    found = 0"]
        for name in (n for n in names if PLACES[n].is_sensor == of_sensor):
            lines += [f"    if {_active(name)}:", f"        found |= {_OF_EFFECT[name]}"]
        lines.append("    return found")
    return "\n".join([*lines, ""])


_OF_EFFECT = _bits()
#: Bits of the effects that have each hook.
HOOK_BITS = MappingProxyType({h: _mask(n for n in EFFECTS if _has(n, h)) for h in HOOKS})
#: Bits of the hysteretic effects.
HYSTERETIC = _mask(n for n, effect in EFFECTS.items() if effect.is_hysteretic)
#: Bits of the effects of the amplifier, whose output its voltage monitor reads.
AMPLIFIER = _mask(
    n for n, effect in EFFECTS.items() if effect.acts_on == "amplifier" and _has(n, "supply")
)

_hooks: Any = generated_module("dearig.model.effects.assembled_hooks", _text())
_Hook = Callable[..., Any]

at_rest: _Hook = _hooks.at_rest
breathe: _Hook = _hooks.breathe
inertia: _Hook = _hooks.inertia
supply: _Hook = _hooks.supply
polarise: _Hook = _hooks.polarise
permittivity: _Hook = _hooks.permittivity
charge: _Hook = _hooks.charge
conduct: _Hook = _hooks.conduct
drop: _Hook = _hooks.drop
soften: _Hook = _hooks.soften
stress: _Hook = _hooks.stress
stiffness: _Hook = _hooks.stiffness
commit: _Hook = _hooks.commit
measured_stress: _Hook = _hooks.measured_stress
sense: _Hook = _hooks.sense
active: _Hook = _hooks.active
active_sensors: _Hook = _hooks.active_sensors
