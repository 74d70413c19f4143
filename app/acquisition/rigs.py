"""The kinds of rigs, and the one that an address names."""

from __future__ import annotations

from typing import Any

from dearig.acquisition.run_parts import RunOptions
from dearig.config.rigfile import RigFile
from dearig.drivers.registry import Registry
from dearig.drivers.rig_kind import RigKind, RigOptions
from dearig.errors import InputError

__all__ = [
    "RIGS",
    "check_address",
    "check_simulation",
    "is_simulated",
    "kind_of",
    "options_of",
]


def _check(name: str, kind: Any) -> None:
    if not isinstance(kind, RigKind):
        raise TypeError(
            f"{name} is not a kind of rig: it needs addresses, simulated, open, inspect"
        )


#: Kinds of rigs by the scheme of their addresses, the part before the first colon; other
#: distributions add theirs by the entry point.
RIGS: Registry[RigKind] = Registry(
    "dearig.rigs",
    {
        "sim": "dearig.sim_backend.kind:KIND",
        "daqmx": "dearig.drivers.daqmx.kind:KIND",
    },
    _check,
)


def kind_of(address: str) -> RigKind:
    """Return the kind of rig that ``address`` names. Raises ``InputError`` where there is none."""
    scheme = address.partition(":")[0]
    kind = RIGS.get(scheme)
    if kind is None:
        known = [form for one in RIGS.values() for form in one.addresses]
        refused = [sentence for sentence in RIGS.left_out if f"plug-in {scheme} " in sentence]
        raise InputError(
            f"rig {address!r} is not known: write {', '.join(known[:-1])} or {known[-1]}"
            + (f" ({refused[0]})" if refused else "")
        )
    return kind


def check_address(address: str, rig_file: RigFile, options: RunOptions) -> RigKind:
    """Return the kind of the rig at ``address``, which is not contacted.

    Raises ``InputError`` for an address that names no rig, and for a rig file and options that it
    does not take.
    """
    kind = kind_of(address)
    if options.actuator is not None and address != "sim":
        raise InputError(f"rig {address!r} has a film of its own; only sim takes a model")
    if kind.simulated:
        return kind
    if options.fault_plan.faults:
        raise InputError(f"rig {address!r} is not simulated; faults are for simulated rigs")
    if not rig_file.film.name:
        raise InputError(
            f"rig {address!r}: no film is declared; give a rig file whose [film] has a name, "
            f"so that its limits are those of the film on the rig",
            option="rig_file",
        )
    return kind


def check_simulation(address: str, seed: int | None, paced: bool) -> None:
    """Raise ``InputError`` for a seed or a pace that a person gave for a rig that is not simulated.

    A ``seed`` of None was not given, and one of 0 is the default.
    """
    asked = {"seed": bool(seed), "paced": paced}
    given = [name for name, is_given in asked.items() if is_given]
    if given and not kind_of(address).simulated:
        raise InputError(
            f"rig {address!r} is not simulated; a seed of the noise and a simulation in real time "
            f"are for simulated rigs: leave them out",
            option=given,
        )


def is_simulated(address: str) -> bool:
    """Return True if the rig at ``address`` is simulated; False where there is no such rig."""
    kind = RIGS.get(address.partition(":")[0])
    return kind is not None and kind.simulated


def options_of(rig_file: RigFile) -> RigOptions:
    """Return the options of a simulated rig with the film and the load of ``rig_file``."""
    return RigOptions(rig_file.as_film(), rig_file.as_load())
