"""Names and kinds of the columns of a table that pandas wrote into HDF5."""

from __future__ import annotations

import re

import h5py
import numpy as np

from dearig.recording.content.safe import Refused, item
from dearig.recording.importers.formats.hdf5_attributes import (
    ATTRIBUTE_MAX,
    pickled_texts,
    texts_in,
)

__all__ = ["block_names", "field_names", "index_name", "is_index_group", "time_kind"]

_TIMES = re.compile(r"(datetime64|timedelta64)(?:\[(s|ms|us|ns)\b)?")


def is_index_group(group: h5py.Group) -> bool:
    """Return True for a group in which PyTables keeps the index of a table."""
    return texts_in(group, "CLASS")[:1] == ["TINDEX"]


def block_names(group: h5py.Group, name: str, width: int) -> list[str]:
    """Return the names of the columns of a block of values (format "fixed"); [] if none are told.

    ``name`` is the block's: ``block0_values``.
    """
    items = name.removesuffix("_values") + "_items"
    levels: list[list[str]] = []
    try:
        if items in group:
            levels = [_texts_of(item(group, items))]
        for number in range(8):
            if f"{items}_level{number}" not in group:
                break
            texts = _texts_of(item(group, f"{items}_level{number}"))
            labels = item(group, f"{items}_label{number}")
            if not isinstance(labels, h5py.Dataset) or labels.nbytes > ATTRIBUTE_MAX:
                return []
            codes = np.asarray(labels[()]).astype(int).ravel()
            levels.append([texts[code] if 0 <= code < len(texts) else "" for code in codes])
    except (Refused, KeyError, OSError, TypeError, ValueError):
        return []
    if not levels or any(len(level) != width for level in levels):
        return []
    return ["/".join(filter(None, parts)) for parts in zip(*levels, strict=True)]


def _texts_of(data: object) -> list[str]:
    if not isinstance(data, h5py.Dataset) or data.dtype.kind != "S" or data.ndim != 1:
        return []
    if data.nbytes > ATTRIBUTE_MAX:
        return []
    return [text.decode("utf-8", "replace") for text in data[()].tolist()]


def field_names(data: h5py.Dataset, field: str, width: int) -> list[str]:
    """Return the names of the columns in a ``field`` of a table (format "table")."""
    found = pickled_texts(data, f"{field}_kind")
    levels, left = divmod(len(found), max(width, 1))
    if left or not levels:
        return []
    return ["/".join(found[i * levels : (i + 1) * levels]) for i in range(width)]


def index_name(group: h5py.Group, data: h5py.Dataset, name: str) -> str:
    """Return the name of the index ``name`` of a table, or ""."""
    if name == "index":
        stated = pickled_texts(group, "info")
        return stated[stated.index("index_name") + 1] if "index_name" in stated[:-1] else ""
    return next(iter(pickled_texts(data, "name")), "") or next(
        (text for text in texts_in(data, "name") if text.isidentifier()), ""
    )


def time_kind(data: h5py.Dataset, attribute: str) -> str:
    """Return the numpy type of dates or durations that ``attribute`` tells: "M8[ns]", or ""."""
    match = next(filter(None, map(_TIMES.match, texts_in(data, attribute))), None)
    if match is None:
        return ""
    return f"{'M8' if match[1] == 'datetime64' else 'm8'}[{match[2] or 'ns'}]"
