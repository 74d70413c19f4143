"""Where gain and limits of a run come from, in words for the operator and for the recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

from dearig.config.rigfile import RigFile
from dearig.model.film.material import Film, Load

__all__ = ["NO_RIG_FILE", "SOURCE", "differences", "film_differences", "in_force", "source_of"]

#: Key in the provenance of a recording: where its rig file came from.
SOURCE = "configuration_from"
NO_RIG_FILE = "no rig file: the rig of the thesis"


def source_of(path: Path | str | None) -> str:
    """Return the rig file at ``path`` in words, None being the rig of the thesis."""
    return NO_RIG_FILE if path is None else f"rig file {path}"


def in_force(rig_file: RigFile, source: str) -> str:
    """Return a sentence with the scaling and the limits that apply, and their ``source``."""
    amplifier, limits, laser = rig_file.amplifier, rig_file.limits, rig_file.laser
    if source == NO_RIG_FILE:
        source = "the thesis's rig, as no rig file was given"
    return (
        f"scaling and limits are those of {source}: amplifier {amplifier.gain_V_per_V:g} V/V, "
        f"voltage monitor {amplifier.monitor_V_per_kV:g} V/kV, laser {laser.mm_per_V:g} mm/V, "
        f"at most {limits.voltage_max_kV:g} kV"
    )


def differences(there: RigFile, here: RigFile) -> tuple[str, ...]:
    """Return what differs between the rig file of a recording and the one in force, a key each."""
    one, two = dict(_keys(there.model_dump())), dict(_keys(here.model_dump()))
    return tuple(
        f"{key}: {_shown(one.get(key))} in the recording, {_shown(two.get(key))} here"
        for key in dict.fromkeys([*one, *two])
        if one.get(key) != two.get(key)
    )


def film_differences(film: Film, load: Load, rig_file: RigFile) -> tuple[str, ...]:
    """Return what differs between the film and the load of a model and those of ``rig_file``.

    The gate computes the true field of the rig file's film, whatever the model's film is.
    """
    pairs: tuple[tuple[Film | Load, Film | Load], ...] = (
        (film, rig_file.as_film()), (load, rig_file.as_load()),
    )  # fmt: skip
    return tuple(
        f"{one.name.replace('_', ' ')}: {_shown(getattr(theirs, one.name))} in the model, "
        f"{_shown(getattr(mine, one.name))} in the rig file (SI units)"
        for theirs, mine in pairs
        for one in fields(theirs)
        if getattr(theirs, one.name) != getattr(mine, one.name)
    )


def _keys(tables: dict[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tables.items():
        if isinstance(value, dict):
            yield from _keys(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def _shown(value: object) -> str:
    if value is None or value == "":
        return "not given"
    return f"{value:g}" if isinstance(value, float) else str(value)
