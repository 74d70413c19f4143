"""Film and load in /entry/sample."""

from __future__ import annotations

from dataclasses import fields
from types import MappingProxyType

import h5py

from dearig.model.film.specimen import Film, Load
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.content.safe import dataset, group
from dearig.recording.content.text import fixed, put_text, text_of

__all__ = ["read_film", "read_load", "write_sample"]

UNITS = MappingProxyType(
    {
        "length": "m",
        "width": "m",
        "thickness": "m",
        "density": "kg/m3",
        "permittivity": "1",
        "mass": "kg",
        "rest_length": "m",
    }
)


def write_sample(entry: h5py.Group, metadata: RunMetadata) -> None:
    """Write the known values of the film and its load; unknown ones are left out."""
    sample = entry.create_group("sample")
    sample.attrs["NX_class"] = fixed("NXsample")
    put_text(sample, "name", metadata.film_id)
    put_text(sample, "notes", metadata.notes)
    for name, owner in (("film", metadata.film), ("load", metadata.load)):
        if owner is None:
            continue
        part = sample.create_group(name)
        part.attrs["NX_class"] = fixed("NXcollection")
        for item in fields(owner):
            value = getattr(owner, item.name)
            if value is None:
                continue
            if isinstance(value, str):
                put_text(part, item.name, value)
            else:
                part.create_dataset(item.name, data=float(value))
                part[item.name].attrs["units"] = fixed(UNITS.get(item.name, ""))


def _values(parent: h5py.Group, owner: type[Film] | type[Load]) -> dict[str, object]:
    found: dict[str, object] = {}
    for item in fields(owner):
        stored = dataset(parent, item.name)
        if stored is not None:
            value = stored[()]
            found[item.name] = text_of(value) if isinstance(value, bytes) else float(value)
    return found


def read_film(sample: h5py.Group) -> Film | None:
    """Return the film, None if it is unknown. Raises ``ModelError``, ``TypeError``."""
    film = group(sample, "film")
    return None if film is None else Film(**_values(film, Film))  # type: ignore[arg-type]


def read_load(sample: h5py.Group) -> Load | None:
    """Return the load, None if it is unknown. Raises ``ModelError``, ``TypeError``."""
    load = group(sample, "load")
    return None if load is None else Load(**_values(load, Load))  # type: ignore[arg-type]
