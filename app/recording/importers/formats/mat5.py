"""Reader of the variables of a MAT file of version 5, safe on damaged files.

Written from "MAT-File Format" (The MathWorks): a header of 128 bytes, then elements of kind, size
and body; each variable is an element that may be packed (zlib). Every size is checked against
the bytes that exist before it is used. Numbers, text, structs and cells are read; other values are
skipped.
"""

from __future__ import annotations

import itertools
import struct
import zlib
from collections.abc import Iterable, Iterator
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

__all__ = ["Cells", "Damaged", "Opaque", "Value", "variables"]


class Cells(list["Value"]):
    """Cells of an array, column by column, of ``rows`` each."""

    def __init__(self, values: Iterable[Value], rows: int) -> None:
        super().__init__(values)
        self.rows = rows


class Opaque:
    """An object of a class of MATLAB, such as a table, which only MATLAB reads."""


#: An array of numbers, text, the fields of a struct, the structs of an array, or None for
#: anything else.
Value: TypeAlias = "np.ndarray | str | dict[str, Value] | list[Value] | Cells | Opaque | None"

HEADER = 128
VERSION_5, VERSION_7_3 = 0x0100, 0x0200
MATRIX, COMPRESSED, UTF8, UTF16, UTF32 = 14, 15, 16, 17, 18
NUMBERS = MappingProxyType(
    {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
)
CELL, STRUCT, OBJECT, CHAR, OPAQUE = 1, 2, 3, 4, 17
#: Classes of arrays of numbers.
NUMERIC = range(6, 16)
COMPLEX = 0x08
#: Depth to which structs in structs are read.
DEEPEST = 8
#: Bytes that are unpacked at most: the first plus the second times the size of the file.
UNPACKED_MAX, PACKED_MAX = 2**28, 100
#: Bytes that are unpacked at once to count them.
COUNTED_AT_ONCE = 2**20
#: Largest number of fields or columns, of cells, and of items in all; measurements have fewer.
FIELDS_MAX, CELLS_MAX, ITEMS_MAX = 4096, 30_000, 200_000


class Damaged(Exception):  # noqa: N818  (what happened to the file, said by the importer)
    """A file that cannot be read; the text is the end of a sentence that begins with its path."""


class _Bytes:
    """Reader of consecutive elements in ``raw``, in the byte order ``order``."""

    def __init__(self, raw: memoryview, order: str, where: str, count: Iterator[int]) -> None:
        self.raw = raw
        self.order = order
        self.where = where
        self.count = count
        self.at = 0

    def inside(self, body: memoryview) -> _Bytes:
        """Return a reader of the elements in the ``body`` of an element."""
        return _Bytes(body, self.order, self.where, self.count)

    def element(self) -> tuple[int, memoryview]:
        """Return kind and body of the next element."""
        if next(self.count) > ITEMS_MAX:
            raise Damaged(f"is not read: it has more than {ITEMS_MAX} items")
        if len(self.raw) < self.at + 8:
            raise Damaged(f"is truncated in the variable {self.where}")
        first, size = struct.unpack_from(f"{self.order}2I", self.raw, self.at)
        if first >> 16:
            # up to four bytes are in the tag itself
            kind, size, start, step = first & 0xFFFF, first >> 16, self.at + 4, 8
            if size > 4:
                raise Damaged(f"is damaged in the variable {self.where}: a short item of {size}")
        else:
            kind, start = first, self.at + 8
            step = 8 + size if kind == COMPRESSED else 8 + -(-size // 8) * 8
        body = self.raw[start : start + size]
        if len(body) < size:
            raise Damaged(f"is truncated: the variable {self.where} is incomplete")
        self.at += step
        return kind, body

    def numbers(self, kind: int, body: memoryview) -> np.ndarray:
        """Return the numbers in an element's ``body``."""
        if kind not in NUMBERS:
            raise Damaged(f"is damaged in the variable {self.where}: numbers of kind {kind}")
        dtype = np.dtype(self.order + NUMBERS[kind])
        if len(body) % dtype.itemsize:
            raise Damaged(f"is damaged in the variable {self.where}: {len(body)} bytes of {dtype}")
        return np.frombuffer(body, dtype)

    def left(self) -> bool:
        return self.at < len(self.raw)


def variables(raw: bytes) -> dict[str, Value]:
    """Return the variables of the file with the content ``raw``; the last of equal names counts.

    Raises ``Damaged`` for a file of another version, and for one that is cut short or damaged.
    """
    order = {b"IM": "<", b"MI": ">"}.get(raw[126:HEADER])
    if order is None:
        raise Damaged(
            "cannot be read as a MAT file: it does not begin with the header of one (a file of "
            "version 4 has none: save it again with -v7)"
        )
    version = struct.unpack_from(f"{order}H", raw, 124)[0]
    if version == VERSION_7_3:
        raise Damaged(
            "is damaged: it has the header of a MAT file of version 7.3 and no HDF5 file behind it"
        )
    if version != VERSION_5:
        raise Damaged(f"is a MAT file of unknown version {version:#06x}")
    room = UNPACKED_MAX + PACKED_MAX * len(raw)
    found: dict[str, Value] = {}
    top = _Bytes(memoryview(raw)[HEADER:], order, "", itertools.count())
    while top.left():
        top.where = f"at byte {HEADER + top.at}"
        kind, body = top.element()
        if kind == COMPRESSED:
            unpacked = _unpacked(body, order, room, top.where)
            room -= len(unpacked)
            kind, body = top.inside(memoryview(unpacked)).element()
        if kind != MATRIX:
            raise Damaged(f"is damaged: there is no variable at byte {HEADER + top.at}")
        name, value = _matrix(top.inside(body), 0)
        if name and not name.startswith("__"):
            found[name] = value
    return found


def _unpacked(body: memoryview, order: str, room: int, where: str) -> bytes:
    # unpacked twice: the first time only to count, so that a bomb takes no memory
    try:
        counting, size, left = zlib.decompressobj(), 0, bytes(body)
        while not counting.eof and size <= room:
            piece = counting.decompress(left, COUNTED_AT_ONCE)
            if not piece and not left:
                break
            size, left = size + len(piece), counting.unconsumed_tail
        if size > room:
            raise Damaged(f"is not read: the variable {where} unpacks to more than {room} bytes")
        found = zlib.decompressobj().decompress(body, max(size, 1))
    except zlib.error as error:
        raise Damaged(f"is damaged: the variable {where}: {error}") from error
    # only the end of the stream checks its checksum; MATLAB leaves it out after some variables,
    # of 65536 bytes for instance, whose element is whole then
    if not counting.eof and not _is_whole(found, order):
        raise Damaged(f"is truncated: the variable {where} is incomplete")
    return found


def _is_whole(element: bytes, order: str) -> bool:
    """Return True if ``element`` has as many bytes as its tag says."""
    if len(element) < 8:
        return False
    kind, size = struct.unpack_from(f"{order}2I", element)
    return bool(kind == MATRIX and len(element) >= 8 + size)


def _matrix(items: _Bytes, depth: int) -> tuple[str, Value]:
    """Return name and value of the array whose items are in ``items``."""
    kind, body = items.element()
    flags = items.numbers(kind, body)
    if flags.dtype.kind != "u" or flags.dtype.itemsize != 4 or flags.size < 1:
        raise Damaged(f"is damaged in the variable {items.where}: no array flags")
    array_class, complex_ = int(flags[0]) & 0xFF, bool(int(flags[0]) >> 8 & COMPLEX)
    if array_class == OPAQUE:
        return bytes(items.element()[1]).decode("latin-1"), Opaque()
    shape = [int(n) for n in items.numbers(*items.element())]
    name = bytes(items.element()[1]).decode("latin-1")
    if not shape or min(shape) < 0 or len(shape) > 32:
        raise Damaged(f"is damaged in the variable {items.where}: a shape of {shape[:32]}")
    size = 1
    for n in shape:
        size *= n
    if depth > DEEPEST:
        return name, None
    if array_class in NUMERIC:
        return name, _table(items, shape, size, complex_)
    if array_class == CHAR:
        return name, _text(items, shape, size)
    if array_class == CELL:
        return name, Cells([_next(items, depth) for _ in _few(size, items)], shape[0])
    if array_class in (STRUCT, OBJECT):
        if array_class == OBJECT:
            items.element()
        fields = _fields(items)
        _few(size * len(fields), items)
        structs: list[Value] = [
            {field: _next(items, depth) for field in fields} for _ in range(size)
        ]
        return name, structs[0] if size == 1 else structs
    return name, None


def _few(size: int, items: _Bytes) -> range:
    if size > CELLS_MAX:
        raise Damaged(f"is not read: the variable {items.where} has {size} cells")
    return range(size)


def _next(items: _Bytes, depth: int) -> Value:
    kind, body = items.element()
    if kind != MATRIX:
        raise Damaged(f"is damaged in the variable {items.where}: an item is not an array")
    # an item without a body is an empty array
    return _matrix(items.inside(body), depth + 1)[1] if len(body) else None


def _fields(items: _Bytes) -> list[str]:
    sizes = items.numbers(*items.element())
    raw = bytes(items.element()[1])
    width = int(sizes[0]) if sizes.size == 1 else 0
    if width < 1 or len(raw) % width or len(raw) // width > FIELDS_MAX:
        raise Damaged(f"is damaged in the variable {items.where}: names of fields")
    names = (raw[i : i + width].split(b"\0")[0] for i in range(0, len(raw), width))
    return [name.decode("latin-1") for name in names]


def _table(items: _Bytes, shape: list[int], size: int, complex_: bool) -> np.ndarray | None:
    values = items.numbers(*items.element())
    if values.size != size:
        raise Damaged(
            f"is damaged in the variable {items.where}: {values.size} numbers, expected {size}"
        )
    return None if complex_ else values.reshape(shape, order="F")


def _text(items: _Bytes, shape: list[int], size: int) -> str | None:
    kind, body = items.element()
    if size == 0:
        return ""
    if len(shape) != 2 or 1 not in shape:
        return None
    encodings = {UTF8: "utf-8", UTF16: "utf-16", UTF32: "utf-32", 1: "latin-1", 2: "latin-1"}
    encoding = encodings.get(kind, "utf-16")
    if encoding in ("utf-16", "utf-32"):
        encoding += "-le" if items.order == "<" else "-be"
    return bytes(body).decode(encoding, "replace")
