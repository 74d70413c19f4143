"""Safe access to items of a file from an unknown source.

Links out of the file, virtual datasets and values in other files are not followed. A dataset that
claims more values than are stored is refused before memory is allocated for it.
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path

import h5py

__all__ = ["Refused", "check_heaps", "checked", "dataset", "group", "item"]

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
    if not isinstance(link, h5py.HardLink):
        where = f"{parent.name.rstrip('/')}/{name}"
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


def check_heaps(path: Path) -> None:
    """Raise ``Refused`` if a global heap, which texts are in, would be read without an end.

    The library takes the size of a free space as the way to the next object, and a size of 0 leads
    nowhere. The layout is that of "HDF5 File Format Specification", III.E, with sizes of 8 bytes.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as raw:
        # heaps that overlap would have more objects than the file has room for
        left = len(raw) // _OBJECT.size
        at = raw.find(_HEAP)
        while at >= 0:
            if at + _OBJECT.size <= len(raw):
                end = min(at + int.from_bytes(raw[at + 8 : at + 16], "little"), len(raw))
                left = _check_heap(raw, at + 16, end, left)
            at = raw.find(_HEAP, at + 1)


def _check_heap(raw: mmap.mmap, at: int, end: int, left: int) -> int:
    """Return how many of the ``left`` objects of all heaps this one leaves."""
    first = at
    while at + _OBJECT.size <= end:
        index, size = _OBJECT.unpack_from(raw, at)
        # of an object without the header, of free space with it; the library adds modulo 2**64
        need = (_OBJECT.size + -(-size // 8) * 8) % 2**64 if index else size
        left -= 1
        if need == 0 or left < 0:
            raise Refused(f"the heap at byte {first - 16} is damaged")
        at += need
    return left


#: Beginning of a global heap of version 1; index and size of an object in it.
_HEAP, _OBJECT = b"GCOL\x01\0\0\0", struct.Struct("<H6xQ")


def _check_own(values: h5py.Dataset) -> None:
    if values.is_virtual or values.external:
        raise Refused(f"{values.name} takes its values from other files; they are not followed")


def _check_stored(values: h5py.Dataset) -> None:
    claimed, stored = int(values.nbytes), int(values.id.get_storage_size())
    filtered = values.id.get_create_plist().get_nfilters() > 0
    if claimed > stored * (PACKED_MAX if filtered else 1):
        raise Refused(f"{values.name} claims {claimed} bytes and {stored} are stored")
