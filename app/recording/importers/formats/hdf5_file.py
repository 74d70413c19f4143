"""Columns of an HDF5 file of another program, NeXus and MAT of version 7.3 too, by their paths."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.content.layout import FORMAT
from dearig.recording.content.safe import Refused, check_heaps, checked, item
from dearig.recording.files import in_words, one_line
from dearig.recording.importers.formats.mat_file import OBJECTS
from dearig.recording.importers.formats.stored import Stored, StoredColumns
from dearig.recording.importers.importer import Importer
from dearig.recording.importers.quantities.units import unit_of
from dearig.recording.importers.source import PARSER_FAILURES, printable

__all__ = ["IMPORTER", "Hdf5File"]

#: Objects that are looked at, depth of groups, and columns of a matrix, at most.
OBJECTS_MAX, DEEPEST, MATRIX_MAX = 10_000, 16, 256
#: Bytes of an attribute that is read.
ATTRIBUTE_MAX = 2**14
#: Names of datasets that say nothing: their group names them.
_GENERIC = frozenset({"data", "raw", "samples", "signal", "value", "values", "y"})
_UNITS = ("units", "unit", "Units", "Unit", "UNITS", "unit_string")
_LABELS = ("long_name", "label", "description", "name")
_COLUMNS = ("columns", "column_names", "channels", "channel_names", "names", "labels")
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MATLAB = b"MATLAB 7.3 MAT-file"


class Hdf5File(StoredColumns):
    """The HDF5 file at ``path``. Raises ``InputError`` if it cannot be read or has no numbers.

    A column is a dataset (n,), a column of a dataset (n, k), or a field of a compound one. Links
    out of the file and virtual datasets are not followed.
    """

    def __init__(self, path: Path) -> None:
        try:
            with open_input(path) as file:
                matlab = file.read(len(_MATLAB)) == _MATLAB
        except OSError as error:
            raise InputError(f"{path} cannot be read: {in_words(error)}") from error
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

    def columns(self) -> Iterator[tuple[str, Stored]]:
        """Yield every column with its path."""
        for name, column in self._in_group(self._file, "", 0):
            yield printable(name), column

    def _in_group(self, group: h5py.Group, path: str, depth: int) -> Iterator[tuple[str, Stored]]:
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
                f"{self._path} is a recording already: give it to the commands as it is"
            )

    def _in_dataset(
        self, data: h5py.Dataset, path: str, table: str, depth: int, axis: bool
    ) -> Iterator[tuple[str, Stored]]:
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
    ) -> Iterator[tuple[str, Stored]]:
        own, group = path.rpartition(self._between)[2], table
        if own.lower() in _GENERIC and table:
            group, _, own = table.rpartition(self._between)
        unit = next((u for name in _UNITS for u in _texts(data, name)[:1]), "")
        unit = re.split(r"\s+since\s", unit)[0]
        label = next((text for name in _LABELS for text in _texts(data, name)[:1]), "")
        known = unit_of(unit)
        if axis and known and "time" in known[1]:
            label = "time"
        shape = tuple(n for n in data.shape if n != 1)
        if len(shape) < 2:
            yield (
                path,
                Stored(self._loader(data.name, _flat), int(data.size), own, unit, label, group),
            )
            return
        if len(shape) > 2 or len(data.shape) > 2:
            return
        rows, width = data.shape[::-1] if self._matlab else data.shape
        names = next((n for key in _COLUMNS if len(n := _texts(data, key)) == width), [])
        for place in range(width if width <= MATRIX_MAX else 0):
            inside = f"{path}{self._between}{names[place]}" if names else f"{path}[{place}]"
            yield inside, Stored(
                self._loader(data.name, _row(place) if self._matlab else _column(place)), rows,
                names[place] if names else f"{own}[{place}]", unit, label, path if names else group,
            )  # fmt: skip

    def _in_fields(self, data: h5py.Dataset, path: str) -> Iterator[tuple[str, Stored]]:
        if data.ndim != 1:
            return
        for name in data.dtype.names[:MATRIX_MAX]:
            kind = data.dtype[name]
            if kind.base.kind not in "fiu" or len(kind.shape) > 1:
                continue
            places = range(min(kind.shape[0], MATRIX_MAX)) if kind.shape else [None]
            for place in places:
                inside = f"{path}{self._between}{name}" + ("" if place is None else f"[{place}]")
                yield (
                    inside,
                    Stored(
                        self._loader(data.name, _field(name, place)),
                        int(data.size),
                        name,
                        table=path,
                    ),
                )

    def _in_cells(self, data: h5py.Dataset, path: str, depth: int) -> Iterator[tuple[str, Stored]]:
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
        self, name: str, pick: Callable[[h5py.Dataset], np.ndarray]
    ) -> Callable[[], np.ndarray]:
        path = self._path

        def load() -> np.ndarray:
            with h5py.File(path, "r", locking=False) as file:
                return pick(file[name])

        return load


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


def _texts(owner: h5py.Group | h5py.Dataset, name: str) -> list[str]:
    """Return the texts in the attribute ``name`` of ``owner``; none if it is something else."""
    if name not in owner.attrs:
        return []
    attribute = owner.attrs.get_id(name)
    if attribute.get_storage_size() > ATTRIBUTE_MAX:
        return []
    try:
        found = np.ravel(owner.attrs[name]).tolist()
    except PARSER_FAILURES:
        return []
    texts = [t.decode("utf-8", "replace") if isinstance(t, bytes) else t for t in found]
    return [text for text in texts if isinstance(text, str)]


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
