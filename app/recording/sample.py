"""The film and its load, as /entry/sample holds them."""

from __future__ import annotations

from dataclasses import fields
from types import MappingProxyType

import h5py

from app.recording.text import fixed, put_text, text_of
from model.material import Film, Load

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


def write_sample(
    entry: h5py.Group, film: Film | None, load: Load | None, film_id: str = "", notes: str = ""
) -> None:
    """Write what is known of the film and its load; what is not known is absent."""
    sample = entry.create_group("sample")
    sample.attrs["NX_class"] = fixed("NXsample")
    put_text(sample, "name", film_id)
    put_text(sample, "notes", notes)
    for name, owner in (("film", film), ("load", load)):
        if owner is None:
            continue
        group = sample.create_group(name)
        group.attrs["NX_class"] = fixed("NXcollection")
        for item in fields(owner):
            value = getattr(owner, item.name)
            if value is None:
                continue
            if isinstance(value, str):
                put_text(group, item.name, value)
            else:
                group.create_dataset(item.name, data=float(value))
                group[item.name].attrs["units"] = fixed(UNITS.get(item.name, ""))


def _values(group: h5py.Group, owner: type[Film] | type[Load]) -> dict[str, object]:
    found: dict[str, object] = {}
    for item in fields(owner):
        if item.name in group:
            value = group[item.name][()]
            found[item.name] = text_of(value) if isinstance(value, bytes) else float(value)
    return found


def read_film(sample: h5py.Group) -> Film | None:
    """The film, None if the recording does not know it. Raises ``ModelError``, ``TypeError``."""
    if "film" not in sample:
        return None
    return Film(**_values(sample["film"], Film))  # type: ignore[arg-type]


def read_load(sample: h5py.Group) -> Load | None:
    """The load, None if the recording does not know it. Raises ``ModelError``, ``TypeError``."""
    if "load" not in sample:
        return None
    return Load(**_values(sample["load"], Load))  # type: ignore[arg-type]
