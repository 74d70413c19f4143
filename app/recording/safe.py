"""Safe access to items of a file from an unknown source.

Links out of the file, virtual datasets and values in other files are not followed. A dataset that
claims more values than are stored is refused before memory is allocated for it.
"""

from __future__ import annotations

import h5py

__all__ = ["Refused", "checked", "dataset", "group", "item"]

#: Largest size that a dataset may claim, in multiples of its size in the file.
PACKED_MAX = 100


class Refused(Exception):  # noqa: N818  (what happened to the file, said by the reader)
    """An item that is not read; the text is the reason."""


def item(parent: h5py.Group, name: str, stored: bool = True) -> h5py.Group | h5py.Dataset | None:
    """Return ``name`` in ``parent``, None if there is none.

    Raises ``Refused`` for a link out of the file, and with ``stored`` also for a
    dataset that claims more values than are stored.
    """
    link = parent.get(name, getlink=True)
    if link is None:
        return None
    where = f"{parent.name.rstrip('/')}/{name}"
    if not isinstance(link, h5py.HardLink):
        raise Refused(f"{where} is a link, and links are not followed")
    return checked(parent[name], stored)


def checked(found: h5py.Group | h5py.Dataset, stored: bool = True) -> h5py.Group | h5py.Dataset:
    """Return ``found``, an object of the file. Raises ``Refused`` as ``item`` does."""
    if isinstance(found, h5py.Dataset):
        _check_own(found)
        if stored:
            _check_stored(found)
    return found


def group(parent: h5py.Group, name: str) -> h5py.Group | None:
    """Return the group ``name`` in ``parent``, None if there is none."""
    found = item(parent, name)
    return found if isinstance(found, h5py.Group) else None


def dataset(parent: h5py.Group, name: str) -> h5py.Dataset | None:
    """Return the dataset ``name`` in ``parent``, None if there is none."""
    found = item(parent, name)
    return found if isinstance(found, h5py.Dataset) else None


def _check_own(values: h5py.Dataset) -> None:
    if values.is_virtual or values.external:
        raise Refused(f"{values.name} takes its values from other files; they are not followed")


def _check_stored(values: h5py.Dataset) -> None:
    claimed, stored = int(values.nbytes), int(values.id.get_storage_size())
    filtered = values.id.get_create_plist().get_nfilters() > 0
    if claimed > stored * (PACKED_MAX if filtered else 1):
        raise Refused(f"{values.name} claims {claimed} bytes and {stored} are stored")
