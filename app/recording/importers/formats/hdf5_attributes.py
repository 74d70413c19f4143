"""Attributes of HDF5 objects as the programs that write them mean them."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Callable

import h5py
import numpy as np

from dearig.recording.importers.formats.stored import (
    is_thinned,
    rate_step,
    scale_of,
    stated_scale,
)
from dearig.recording.importers.source import PARSER_FAILURES

__all__ = [
    "ATTRIBUTE_MAX",
    "gap_text",
    "numbers_in",
    "own_scale",
    "pickled_texts",
    "stated_step",
    "texts_in",
    "unpacked",
]

#: Bytes of an attribute that is read.
ATTRIBUTE_MAX = 2**14
#: A text in a pickle of protocol 0, in which pandas writes names, and one that is there again.
_PICKLED = re.compile(
    r"(?:^|(?<=[(\[a}sl\n]))(?:V(?P<text>[^\n]*)\n(?:p(?P<kept>\d+)\n)?|g(?P<again>\d+)\n)"
)


def texts_in(owner: h5py.Group | h5py.Dataset, name: str) -> list[str]:
    """Return the texts in the attribute ``name`` of ``owner``; none if it is something else."""
    return [_plain(text) for text in _values(owner, name) if isinstance(text, str)]


def numbers_in(owner: h5py.Group | h5py.Dataset, name: str) -> list[float]:
    """Return the numbers in the attribute ``name`` of ``owner``."""
    return [v for v in _values(owner, name) if isinstance(v, (int, float))]


def _values(owner: h5py.Group | h5py.Dataset, name: str) -> list[object]:
    if name not in owner.attrs:
        return []
    try:
        # of an attribute without a value it cannot be asked for
        if owner.attrs.get_id(name).get_storage_size() > ATTRIBUTE_MAX:
            return []
        found = np.ravel(owner.attrs[name]).tolist()
    except PARSER_FAILURES:
        return []
    return [v.decode("utf-8", "replace") if isinstance(v, bytes) else v for v in found]


def _plain(text: str) -> str:
    """Return ``text``; of PyMoDAQ, which writes the representation of a text as JSON, its text."""
    if not text.startswith('{"module"'):
        return text
    try:
        found = json.loads(text)
        inner = found["data"] if isinstance(found, dict) and found.get("type") == "str" else text
        plain = ast.literal_eval(inner) if inner is not text else text
    except (ValueError, KeyError, TypeError, SyntaxError, RecursionError, MemoryError):
        return text
    return plain if isinstance(plain, str) else text


def pickled_texts(owner: h5py.Group | h5py.Dataset, name: str) -> list[str]:
    """Return the texts in a pickle that pandas wrote as an attribute; it is never unpickled.

    Other protocols than 0, the one of HDF5 files, give none.
    """
    found: list[str] = []
    for pickle in _values(owner, name):
        kept: dict[str, str] = {}
        for match in _PICKLED.finditer(pickle) if isinstance(pickle, str) else ():
            text = match["text"]
            if text is None and (text := kept.get(match["again"])) is None:
                continue  # something else than a text
            kept[match["kept"] or ""] = text
            found.append(text)
    return found


def own_scale(data: h5py.Dataset) -> str:
    """Return an attribute that scales ``data`` in a way of which no convention says how, or ""."""
    stated = {
        name: numbers_in(data, name) or texts_in(data, name)[:1]
        for name in data.attrs
        if name not in _OF_CF or not numbers_in(data, name)
    }
    if own := stated_scale(stated, integers=data.dtype.kind in "iu"):
        return own
    # of its group: a scale that is called as the dataset is, or a plain one
    group, called = data.parent, data.name.rpartition("/")[2]
    scales = (
        (name, numbers_in(group, name)) for name in group.attrs
        if scale_of(name, called) or name.lower() in ("gain", "scale")
    )  # fmt: skip
    found = next(((n, v) for n, v in scales if set(v) - {1.0}), None)
    return f"{found[0]} = {', '.join(f'{one:g}' for one in found[1][:4])}" if found else ""


#: Attributes whose values mark a missing reading.
_GAPS = ("_FillValue", "missing_value")
#: Attributes by which CF scales, if they are numbers.
_OF_CF = ("scale_factor", "add_offset")


def stated_step(data: h5py.Dataset) -> float | None:
    """Return the time in s from row to row that an attribute of ``data`` or its groups gives."""
    owner, found = data, None
    for _ in range(GROUPS_MAX):
        for name in owner.attrs:
            value = next(iter(numbers_in(owner, name)), 0.0)
            unit = next((u for e in _UNIT_OF for u in texts_in(owner, name + e)[:1]), "")
            if is_thinned(name, value):
                return None
            step = rate_step(f"{name}_{unit}" if unit else name, value)
            found = step if found is None else found
        if owner.name == "/":
            break
        owner = owner.parent
    return found


#: Groups above a dataset in which attributes are looked for, at most.
GROUPS_MAX = 16
_UNIT_OF = ("_units", "_unit")


def unpacked(data: h5py.Dataset) -> Callable[[np.ndarray], np.ndarray] | None:
    """Return what makes numbers of the stored values of ``data``, as CF says; None if nothing.

    ``scale_factor`` and ``add_offset`` scale; values in ``_GAPS`` are gaps;
    ``_Unsigned`` says that stored integers have no sign.
    """
    scale = next(iter(numbers_in(data, "scale_factor")), 1.0)
    offset = next(iter(numbers_in(data, "add_offset")), 0.0)
    gaps = [value for name in _GAPS for value in numbers_in(data, name)]
    without_sign = data.dtype.kind == "i" and texts_in(data, "_Unsigned")[:1] == ["true"]
    if scale == 1.0 and offset == 0.0 and not gaps and not without_sign:
        return None

    def unpack(values: np.ndarray) -> np.ndarray:
        if without_sign:
            values = values.view(values.dtype.str.replace("i", "u"))
        found = values.astype(np.float64) * scale + offset
        for gap in gaps:
            found[_equal(values, gap)] = np.nan
        return found

    return unpack


def gap_text(data: h5py.Dataset, value: np.ndarray) -> str:
    """Return which attribute of ``data`` says that the stored ``value`` () is none, or ""."""
    for name in _GAPS:
        if any(_equal(value, gap) for gap in numbers_in(data, name)):
            return f"{value:.6g} is the {name} that the file declares, no reading"
    return ""


def _equal(values: np.ndarray, gap: float) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.asarray(values == np.asarray(gap).astype(values.dtype))
