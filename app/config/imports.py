"""What a rig file and the options of a film say of imported data."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.film.specimen import Film, Load
from dearig.recording.content.assumed import ASSUMED, FILM_VALUES
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.importers.quantities.units import UnitScale

if TYPE_CHECKING:
    from dearig.config.rigfile import RigFile

__all__ = ["imported_metadata", "raw_scales"]


def raw_scales(rig: RigFile) -> dict[str, UnitScale]:
    """Return the scales from volts at the card to the film, by quantity."""
    amplifier, laser = rig.amplifier, rig.laser
    monitor = UnitScale(1e3, amplifier.monitor_V_per_kV)
    return {
        "voltage": UnitScale(amplifier.gain_V_per_V),
        "voltage_monitor": monitor,
        "current": UnitScale(1e-3, amplifier.current_monitor_V_per_mA),
        "displacement": UnitScale(laser.mm_per_V, 1e3),
    }


def imported_metadata(
    configuration: str,
    settings: RigFile | None,
    film_name: str,
    notes: str,
    *,
    length_mm: float | None = None,
    width_mm: float | None = None,
    thickness_um: float | None = None,
    permittivity: float | None = None,
    load_g: float | None = None,
    kinematics: str | None = None,
) -> RunMetadata:
    """Return the film, load and remarks of imported data.

    ``configuration`` is the text of the rig file, whose ``settings`` are used; "" and None without.
    Values that are given replace those of the rig file; without one, those of the thesis, and the
    provenance names the others. Nothing given leaves the film and the load open. Raises
    ``InputError`` for a size that none can have.
    """
    given = {
        "length": _scaled(length_mm, 1e3),
        "width": _scaled(width_mm, 1e3),
        "thickness": _scaled(thickness_um, 1e6),
        "permittivity": permittivity,
    }
    changed: dict[str, object] = {n: value for n, value in given.items() if value is not None}
    film: Film | None = None if settings is None else settings.as_film()
    load: Load | None = None if settings is None else settings.as_load()
    if changed or load_g is not None:
        # imports the effects and their compiler, which most imports begin without
        from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
    try:
        if changed and kinematics is not None:
            changed["kinematics"] = kinematics
        if changed:
            film = replace(film or THESIS_FILM, **changed)  # type: ignore[arg-type]
        if load_g is not None:
            load = replace(load or THESIS_LOAD, mass=load_g / 1e3)
    except ModelError as error:
        raise InputError(str(error)) from error
    not_given = [name for name in FILM_VALUES if name not in changed]
    if settings is not None or not changed:
        not_given = []
    return RunMetadata(
        film=film,
        load=load,
        film_id=film_name,
        notes=notes,
        provenance={ASSUMED: ", ".join(not_given)} if not_given else {},
        configuration=configuration,
    )


def _scaled(value: float | None, over: float) -> float | None:
    return None if value is None else value / over
