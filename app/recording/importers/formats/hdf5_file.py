"""Columns of an HDF5 file of another program, NeXus and MAT of version 7.3 too, by their paths."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.content.layout import FORMAT
from dearig.recording.content.safe import Refused, check_heaps, checked, item
from dearig.recording.files import one_line, system_text
from dearig.recording.importers.formats.hdf5_attributes import (
    gap_text,
    own_scale,
    stated_step,
    unpacked,
)
from dearig.recording.importers.formats.hdf5_attributes import texts_in as _texts
from dearig.recording.importers.formats.mat_file import OBJECTS
from dearig.recording.importers.formats.pandas_hdf5 import (
    block_names,
    field_names,
    index_name,
    is_index_group,
    time_kind,
)
from dearig.recording.importers.formats.stored import StoredColumn, StoredColumns
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.quantities.units import unit_of
from dearig.recording.importers.source import PARSER_FAILURES, printable

__all__ = ["IMPORTER", "Hdf5File"]

#: Objects that are looked at, depth of groups, and columns of a matrix, at most.
OBJECTS_MAX, DEEPEST, MATRIX_MAX = 10_000, 16, 256
#: Rows of a matrix that are columns of it, at most: a measurement has more values.
ROWS_AS_COLUMNS = 16
#: Values of a range that is stored as its start, step and end, at most.
RANGE_MAX = 10**8
#: Names of datasets that say nothing: their group names them.
_GENERIC = frozenset({"data", "raw", "samples", "signal", "value", "values", "y"})
#: Names of fields that say nothing next to the name of the dataset that they are fields of.
_GENERIC_FIELDS = _GENERIC - {"y"}
_UNITS = ("units", "unit", "Units", "Unit", "UNITS", "unit_string", "unit_symbol")
_LABELS = ("long_name", "label", "description", "name")
_COLUMNS = ("columns", "column_names", "channels", "channel_names", "names", "labels")
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_BEHIND = 512  # bytes of text before a MAT file of version 7.3


class Hdf5File(StoredColumns):
    """The HDF5 file at ``path``. Raises ``InputError`` if it cannot be read or has no numbers.

    A column is a dataset (n,), a column of a dataset (n, k), or a field of a compound one. Links
    out of the file and virtual datasets are not followed.
    """

    def __init__(self, path: Path) -> None:
        try:
            with open_input(path) as file:
                head = file.read(_BEHIND + len(_SIGNATURE))
                # the text before it may name another version
                matlab = head.startswith(b"MATLAB") and head.startswith(_SIGNATURE, _BEHIND)
        except OSError as error:
            raise InputError(f"{path} cannot be read: {system_text(error)}") from error
        what = "a MAT file of version 7.3" if matlab else "an HDF5 file"
        try:
            check_heaps(path)
            with h5py.File(path, "r", locking=False) as file:
                walk = _Walk(path, file, matlab)
                columns, default = dict(walk.columns()), _default(file)
        except (*PARSER_FAILURES, Refused) as error:
            raise InputError(f"{path} cannot be read as {what}: {one_line(error)}") from error
        if not columns and walk.objects:
            raise InputError(f"{path} {OBJECTS}")
        super().__init__(
            path, what, columns, separator="." if matlab else "/", notes=walk.notes,
            default_table=default,
        )  # fmt: skip


class _Walk:
    """A walk through the groups of ``file``, in the order of their names."""

    def __init__(self, path: Path, file: h5py.File, matlab: bool) -> None:
        self._path, self._file, self._matlab = path, file, matlab
        self._between = "." if matlab else "/"
        self._seen = 0
        self._groups: set[int] = set()  # that were seen: links may lead back to one
        self.notes: list[str] = []
        self.objects = False  # of MATLAB, which cannot be read

    def columns(self) -> Iterator[tuple[str, StoredColumn]]:
        """Yield every column with its path."""
        for name, column in self._in_group(self._file, "", 0):
            yield printable(name), column

    def _in_group(
        self, group: h5py.Group, path: str, depth: int
    ) -> Iterator[tuple[str, StoredColumn]]:
        place = h5py.h5o.get_info(group.id).addr
        if depth > DEEPEST or place in self._groups:
            return
        self._groups.add(place)
        axes = _texts(group, "axes")
        for name in group:
            if self._matlab and name.startswith("#"):
                continue
            self._seen += 1
            if self._seen > OBJECTS_MAX:
                raise InputError(f"{self._path} is not read: it has more than {OBJECTS_MAX} items")
            try:
                found = self._item(group, name)
            except Refused as refused:
                self.notes.append(f"{refused}: it was not read")
                continue
            inside = f"{path}{self._between}{name}" if path else name
            if isinstance(found, h5py.Group):
                if "MATLAB_object_decode" in found.attrs:
                    self.objects = True
                    continue
                if is_index_group(found):
                    continue
                self._check_foreign(found)
                yield from self._in_group(found, inside, depth + 1)
            elif found is not None:
                yield from self._in_dataset(found, inside, path, depth, name in axes)

    def _item(self, group: h5py.Group, name: str) -> h5py.Group | h5py.Dataset | None:
        """Return an item; a link to a dataset of the file is followed, step by step."""
        link = group.get(name, getlink=True)
        if not isinstance(link, h5py.SoftLink):
            return item(group, name)
        found: h5py.Group | h5py.Dataset | None = self._file if link.path[:1] == "/" else group
        for part in filter(None, link.path.split("/")):
            found = item(found, part) if isinstance(found, h5py.Group) else None
        return found if isinstance(found, h5py.Dataset) else None

    def _check_foreign(self, group: h5py.Group) -> None:
        if FORMAT in _texts(group, "format"):
            raise InputError(
                f"{self._path} is a recording already, which needs no import: use it as it is, or "
                f"copy it into the folder of recordings"
            )

    def _in_dataset(
        self, data: h5py.Dataset, path: str, table: str, depth: int, axis: bool
    ) -> Iterator[tuple[str, StoredColumn]]:
        if "MATLAB_object_decode" in data.attrs:
            self.objects = True
            return
        if "MATLAB_empty" in data.attrs or data.size in (None, 0) or data.dtype.kind == "b":
            return
        if h5py.check_ref_dtype(data.dtype) is h5py.Reference:
            yield from self._in_cells(data, path, depth)
        elif data.dtype.names:
            yield from self._in_fields(data, path)
        elif data.dtype.kind in "fiu" and _texts(data, "MATLAB_class")[:1] != ["char"]:
            yield from self._in_numbers(data, path, table, axis)

    def _in_numbers(
        self, data: h5py.Dataset, path: str, table: str, axis: bool
    ) -> Iterator[tuple[str, StoredColumn]]:
        own, group = path.rpartition(self._between)[2], table
        if own.lower() in _GENERIC and table:
            group, _, own = table.rpartition(self._between)
        unit = next((u for name in _UNITS for u in _texts(data, name)[:1]), "")
        unit = re.split(r"\s+since\s", unit)[0]
        scaled, step = own_scale(data), stated_step(data)
        label = next((text for name in _LABELS for text in _texts(data, name)[:1]), "")
        known = unit_of(unit)
        if axis and known and "time" in known[1]:
            label = "time"
        unpack = unpacked(data)
        if unpack is not None and {"scale_factor", "add_offset"} & set(data.attrs):
            self.notes.append(f"{path!r} is scaled by its scale_factor and add_offset")
        shape = tuple(n for n in data.shape if n != 1)
        if len(shape) < 2:
            kind = time_kind(data, "kind")
            if "pandas_type" in data.parent.attrs:
                own = index_name(data.parent, data, own) or own
            yield (
                path,
                StoredColumn(
                    self._loader(data.name, _flat, unpack, kind), int(data.size), own,
                    "s" if kind else unit, "time" if kind else label, group, step, scaled=scaled,
                    cell=self._cell(data.name, _flat),
                ),
            )  # fmt: skip
            return
        if len(shape) > 2 or len(data.shape) > 2:
            return
        rows, width = data.shape[::-1] if self._matlab else data.shape
        turned = self._matlab
        if rows < width and rows <= ROWS_AS_COLUMNS:
            rows, width, turned = width, rows, not turned
        names = next((n for key in _COLUMNS if len(n := _texts(data, key)) == width), [])
        stated = next((u for key in _UNITS if len(u := _texts(data, key)) == width), [])
        names = names or block_names(data.parent, data.name.rpartition("/")[2], width)
        kind = time_kind(data, "value_type")
        axes = [_texts(data.parent, key)[:1] for key in ("xlabel", "xunit", "ylabel", "yunit")]
        xy = width <= 4 and all(axes) and own.startswith("xy")
        for place in range(width if width <= MATRIX_MAX else 0):
            inside = f"{path}{self._between}{names[place]}" if names else f"{path}[{place}]"
            own_name = names[place].rpartition("/")[2] if names else f"{own}[{place}]"
            if xy and place < 2:  # rows x and y of a curve, then their errors
                (label,), (unit,) = axes[2 * place : 2 * place + 2]
            elif xy:
                label = unit = ""
            elif stated:
                unit = stated[place]
            pick = _row(place) if turned else _column(place)
            yield inside, StoredColumn(
                self._loader(data.name, pick, unpack, kind),
                rows, own_name, "s" if kind else unit, "time" if kind else label,
                path if names else group, step, scaled=scaled, cell=self._cell(data.name, pick),
            )  # fmt: skip

    def _in_fields(self, data: h5py.Dataset, path: str) -> Iterator[tuple[str, StoredColumn]]:
        if data.ndim != 1:
            if data.shape == () and {"base", "limit", "increment"} <= set(data.dtype.names):
                yield from self._in_range(data, path)
            return
        fields = data.dtype.names
        units = next((u for key in _UNITS if len(u := _texts(data, key)) == len(fields)), [])
        for name, unit in itertools.zip_longest(fields[:MATRIX_MAX], units[:MATRIX_MAX]):
            kind = data.dtype[name]
            if kind.base.kind not in "fiu" or len(kind.shape) > 1:
                continue
            places = range(min(kind.shape[0], MATRIX_MAX)) if kind.shape else [None]
            names = [name] if not kind.shape else (
                field_names(data, name, kind.shape[0])
                or [f"{name}[{place}]" for place in places]
            )  # fmt: skip
            times = time_kind(data, f"{name}_kind")
            for place, called in zip(places, names, strict=False):
                own = called.rpartition("/")[2]
                if name == "index" and "pandas_type" in data.parent.attrs:
                    own = index_name(data.parent, data, name) or own
                elif own.lower() in _GENERIC_FIELDS:
                    own = path.rpartition(self._between)[2]
                yield (
                    f"{path}{self._between}{called}",
                    StoredColumn(
                        self._loader(data.name, _field(name, place), None, times),
                        int(data.size), own, "s" if times else unit or "",
                        "time" if times else "", path,
                    ),
                )  # fmt: skip

    def _in_range(self, data: h5py.Dataset, path: str) -> Iterator[tuple[str, StoredColumn]]:
        """Yield the values of a range, which Octave stores as base, limit and increment."""
        base, limit, step = (float(data[()][n]) for n in ("base", "limit", "increment"))
        count = (limit - base) / step if step else 0.0
        if not 0.0 < count < RANGE_MAX:
            return
        size = round(count) + 1 if abs(count - round(count)) < 1e-6 else int(count) + 1
        table = path.rpartition(self._between)[0]
        own = (table if path.endswith("value") else path).rpartition(self._between)[2]
        yield path, StoredColumn(lambda: base + step * np.arange(size), size, own)

    def _in_cells(
        self, data: h5py.Dataset, path: str, depth: int
    ) -> Iterator[tuple[str, StoredColumn]]:
        """Yield the columns behind references: cells, and fields of an array of structs."""
        if depth > DEEPEST or data.size > OBJECTS_MAX:
            return
        before, _, field = path.rpartition(self._between)
        cells = _texts(data, "MATLAB_class")[:1] == ["cell"]
        for number, reference in enumerate(np.ravel(data[...]), 1):
            self._seen += 1
            if self._seen > OBJECTS_MAX:
                raise InputError(f"{self._path} is not read: it has more than {OBJECTS_MAX} items")
            # a reference leads to an object of the same file
            try:
                found = checked(self._file[reference]) if reference else None
            except Refused as refused:
                self.notes.append(f"{refused}: it was not read")
                continue
            if cells:
                inside, table = f"{path}{{{number}}}", before
            else:
                table = f"{before}({number})"
                inside = f"{table}{self._between}{field}"
            if isinstance(found, h5py.Group):
                yield from self._in_group(found, inside, depth + 1)
            elif isinstance(found, h5py.Dataset):
                yield from self._in_dataset(found, inside, table, depth + 1, axis=False)

    def _loader(
        self,
        name: str,
        pick: Callable[[h5py.Dataset], np.ndarray],
        unpack: Callable[[np.ndarray], np.ndarray] | None = None,
        times: str = "",
    ) -> Callable[[], np.ndarray]:
        path = self._path

        def load() -> np.ndarray:
            with h5py.File(path, "r", locking=False) as file:
                values = pick(file[name])
            if times:
                return values.astype(np.int64).view(times)
            return values if unpack is None else unpack(values)

        return load

    def _cell(self, name: str, pick: Callable[[h5py.Dataset], np.ndarray]) -> Callable[[int], str]:
        path = self._path

        def cell(index: int) -> str:
            with h5py.File(path, "r", locking=False) as file:
                return gap_text(file[name], pick(file[name])[index])

        return cell


def _flat(data: h5py.Dataset) -> np.ndarray:
    return np.ravel(data[()])


def _column(place: int) -> Callable[[h5py.Dataset], np.ndarray]:
    return lambda data: np.asarray(data[:, place])


def _row(place: int) -> Callable[[h5py.Dataset], np.ndarray]:
    return lambda data: np.asarray(data[place, :])


def _field(name: str, place: int | None) -> Callable[[h5py.Dataset], np.ndarray]:
    def pick(data: h5py.Dataset) -> np.ndarray:
        values = np.asarray(data[name])
        return values if place is None else values[:, place]

    return pick


def _default(file: h5py.File) -> str | None:
    """Return the path of the group that a NeXus file names as its default, or None."""
    names: list[str] = []
    group: object = file
    while isinstance(group, h5py.Group) and len(names) < DEEPEST:
        name = next(iter(_texts(group, "default")), None)
        if name is None:
            break
        try:
            group = item(group, name)
        except Refused:
            return None
        names.append(name)
    return "/".join(names) or None


def _sniff(head: bytes) -> bool:
    # the file may begin with another program's block, as a MAT file does
    return any(head.startswith(_SIGNATURE, at) for at in (0, 512, 1024, 2048))


_SUFFIXES = (".h5", ".hdf5", ".hdf", ".he5", ".nxs", ".nx", ".nc")

IMPORTER = Importer("HDF5", _SUFFIXES, Hdf5File, _sniff)
