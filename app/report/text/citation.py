"""Citation of this program and of the thesis that its model is from, as in ``CITATION.cff``."""

from __future__ import annotations

__all__ = ["SOFTWARE_AUTHORS", "SOFTWARE_TITLE", "SOFTWARE_YEAR", "THESIS", "citation"]

SOFTWARE_AUTHORS = "The dearig authors"
SOFTWARE_TITLE = (
    "dearig: runs a dielectric-elastomer actuator rig, records it, and finds what its physical "
    "model is missing"
)
SOFTWARE_YEAR = 2026
THESIS = (
    "Fan, J. (2024). Free-Energy Based Modeling of Planar Dielectric Elastomer Actuators. Master "
    "of Applied Science thesis, Concordia University."
)


def citation(program: str) -> tuple[str, str]:
    """Return what a paper cites: the ``program`` with its version, and the thesis."""
    of = program.removeprefix("dearig ")
    software = f"{SOFTWARE_AUTHORS} ({SOFTWARE_YEAR}). {SOFTWARE_TITLE}. Software, version {of}."
    return software, THESIS
