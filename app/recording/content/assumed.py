"""What a recording does not say of its film and load, which fits take from the thesis."""

from __future__ import annotations

from collections.abc import Mapping

from dearig.model.film.specimen import Film, Load

__all__ = ["ASSUMED", "FILM_VALUES", "assumed_of"]

#: Key in the provenance of imported data: the values of the film that were not given.
ASSUMED = "assumed"
#: Values of a film that fits need, and that an import has options for.
FILM_VALUES = ("length", "width", "thickness", "permittivity", "kinematics")


def assumed_of(
    film: Film | None, load: Load | None, provenance: Mapping[str, object]
) -> tuple[str, ...]:
    """Return what fits assume where ``film`` or ``load`` is None, or a value was not given.

    Each is a phrase with numbers: "the load (200 g)".
    """
    # imports the effects and their compiler, which other commands on recordings do without
    from dearig.model.film.material import THESIS_FILM, THESIS_LOAD

    found = []
    given = str(provenance.get(ASSUMED, ""))
    names = FILM_VALUES if film is None else [n for n in FILM_VALUES if n in given.split(", ")]
    if names:
        values = ", ".join(_words(film or THESIS_FILM, name) for name in names)
        found.append(f"the film ({values})")
    if load is None:
        found.append(f"the load ({THESIS_LOAD.mass * 1e3:g} g)")
    return tuple(found)


def _words(film: Film, name: str) -> str:
    """Return a value of ``film`` in words."""
    return {
        "length": f"{film.length * 1e3:g} mm long",
        "width": f"{film.width * 1e3:g} mm wide",
        "thickness": f"{film.thickness * 1e6:g} um thick",
        "permittivity": f"relative permittivity {film.permittivity:g}",
        "kinematics": film.kinematics,
    }[name]
