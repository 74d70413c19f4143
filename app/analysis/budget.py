"""Uncertainties of given values: those of the rig file, as a fit takes them."""

from __future__ import annotations

from dearig.config.rigfile import RigFile
from dearig.errors import InputError
from dearig.model.fitting import GivenValue

__all__ = ["given_values"]

#: Table and key of a rig file by the value that a fit takes for given.
_KEYS = {
    "length": ("film", "length_mm"),
    "width": ("film", "width_mm"),
    "thickness": ("film", "thickness_mm"),
    "permittivity": ("film", "relative_permittivity"),
    "mass": ("load", "mass_g"),
    "displacement": ("laser", "mm_per_V"),
}
_VOLTAGE = {"command": ("amplifier", "gain_V_per_V"), "monitor": ("amplifier", "monitor_V_per_kV")}


def given_values(rig_file: RigFile | None, drive: str) -> list[GivenValue]:
    """Return the values whose uncertainty ``rig_file`` states, each with its relative one.

    ``drive`` is command or monitor: the voltage that drives the model, with its scaling. Raises
    ``InputError`` for one of half of its value or more.
    """
    if rig_file is None:
        return []
    found = []
    for name, (table, key) in {**_KEYS, "voltage": _VOLTAGE[drive]}.items():
        section = getattr(rig_file, table)
        value, uncertainty = getattr(section, key), getattr(section, f"{key}_uncertainty")
        if uncertainty > 0.0 and value > 0.0:
            if uncertainty >= 0.5 * value:
                raise InputError(
                    f"{table}.{key}_uncertainty = {uncertainty:g} in the rig file is half of "
                    f"{table}.{key} = {value:g} or more; a fit cannot allow for so much"
                )
            found.append(GivenValue(name, uncertainty / value))
    return found
