"""What a person states of parameters before a fit: a file (TOML), options or a mapping.

A table for each parameter, by the name that campaigns and studies give it, which ends in its unit::

    [mu_0_kPa]          # a Gaussian prior, from a tensile test
    mean = 46.0
    sd = 0.5

    [T_1_s]             # a range
    low = 0.1
    high = 1.0

    [mu_3_kPa]          # not fitted
    fixed = 20.0

    [linear_drag.drag_Pa_s]   # of an effect
    high = 50.0
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dearig.config.toml_input import parse_toml, read_text, shown
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.units import parameter_key, parameter_unit

if TYPE_CHECKING:
    from dearig.model.fitting.parameters import Constraint
    from dearig.model.simulation.actuator import Actuator
    from dearig.model.simulation.strip import Strip

__all__ = ["KEYS", "Stated", "constraints_of", "load_parameter_file", "stated_of"]

#: What may be stated of a parameter: the keys of its table.
KEYS = ("fixed", "low", "high", "mean", "sd")

#: What is stated of each parameter, by its name with its unit, in that unit.
Stated = Mapping[str, Mapping[str, float]]

#: Options of the command by which it is stated; in Python the first.
_OPTION = ("parameters", "fix", "bound", "prior")
_LISTED = 12  # names in a message


def load_parameter_file(path: Path | str) -> dict[str, dict[str, float]]:
    """Return what the file at ``path`` states. Raises ``InputError`` with one sentence."""
    name = f"parameter file {path}"
    data = parse_toml(read_text(Path(path), "parameter file"), name)
    try:
        return stated_of(data)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def stated_of(given: Mapping[str, object]) -> dict[str, dict[str, float]]:
    """Return what a mapping or the tables of a file state. Raises ``InputError``."""
    found: dict[str, dict[str, float]] = {}
    for name, table in _flat(given).items():
        if not isinstance(table, Mapping):
            raise InputError(
                f"{name} = {shown(table)} is not a table: write [{name}] and below it "
                f"{', '.join(KEYS)}"
            )
        found[str(name)] = {}
        for key, value in table.items():
            if key not in KEYS:
                raise InputError(f"{name}.{key} is not a key; {name} takes {', '.join(KEYS)}")
            try:
                number = math.nan if isinstance(value, bool | str) else float(value)
            except (TypeError, ValueError):
                number = math.nan
            if not math.isfinite(number):
                raise InputError(f"{name}.{key} = {shown(value)} is not a number")
            found[str(name)][key] = number
    return found


def _flat(given: Mapping[str, object]) -> dict[str, object]:
    """Return the tables of parameters; those of an effect are inside of the effect's table."""
    found: dict[str, object] = {}
    for name, table in given.items():
        inside = table if isinstance(table, Mapping) else {}
        if inside and all(isinstance(value, Mapping) for value in inside.values()):
            found |= {f"{name}.{key}": value for key, value in inside.items()}
        else:
            found[str(name)] = table
    return found


def constraints_of(
    stated: Stated | None, candidates: Sequence[Actuator | Strip], with_effects: bool = False
) -> tuple[Constraint, ...]:
    """Return what is ``stated``, in SI units, of parameters that one of the ``candidates`` has.

    They are the models that may be fitted; ``with_effects`` any effect may be added to them. Raises
    ``InputError`` with one sentence for an unknown name, for what contradicts itself and for what
    no fit allows.
    """
    if not stated:
        return ()
    from dearig.model.effects import EFFECTS
    from dearig.model.fitting.parameters import Constraint, FitLayout, FreeParameter

    known = {q.name: q for base in candidates for q in FitLayout(base).quantities}
    derived = [] if "mu_0" in known else ["mu_0"]
    if with_effects:
        # drift is part of the noise: its amplitudes are not fitted
        laws = [(name, law) for name, law in EFFECTS.items() if law.drift_basis is None]
        more = [
            FreeParameter("effect", i, n) for n, law in laws for i in range(len(law.parameters))
        ]
        known |= {q.name: q for q in more}
    by_key = {parameter_key(q.name, q.unit): q for q in known.values()}
    found = []
    for key, table in stated_of(stated).items():
        if key not in by_key:
            raise InputError(_unknown(key, list(by_key), derived), option=_OPTION)
        q = by_key[key]
        factor, unit = parameter_unit(q.unit)
        least, most = (end * factor for end in q.search_range)
        for name, value in table.items():
            if name != "sd" and not least <= value <= most:
                raise InputError(
                    f"{key}: {name} = {value:g} is outside of what a fit allows: {least:g} to "
                    f"{most:g} {unit}".rstrip(),
                    option=_OPTION,
                )
        try:
            found.append(Constraint(q.name, **{n: v / factor for n, v in table.items()}))
        except ModelError as error:
            said = ", ".join(f"{n} = {v:g}" for n, v in table.items())
            raise InputError(f"{key}: {said or '[]'}: {error}", option=_OPTION) from error
    return tuple(found)


def _unknown(key: str, known: Sequence[str], derived: Sequence[str]) -> str:
    """Return a sentence on a ``key`` that is not a parameter of the fit."""
    for name in derived:
        if key.startswith(name):
            return f"{key}: {name} follows from the measured rest length, and is not fitted"
    with_unit = [k for k in known if k.startswith(f"{key}_") and not k[len(key) + 1].isdigit()]
    if with_unit:
        return f"{key} is not a parameter of this fit: its name ends in its unit, {with_unit[0]}"
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.6)
    # that of another branch is not meant
    if near and re.sub("[0-9]", "", near[0]) != re.sub("[0-9]", "", key):
        return f"{key} is not a parameter of this fit; did you mean {near[0]}?"
    more = f" and {len(known) - _LISTED} more" if len(known) > _LISTED else ""
    return f"{key} is not a parameter of this fit, which has {', '.join(known[:_LISTED])}{more}"
