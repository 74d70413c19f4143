"""Changes of a file in place, made completely or not at all even if the program is killed.

Appended bytes go into the file at once, because nothing in the file refers to them yet. Bytes that
replace others are held back; they are written with the old bytes to ``FILE.journal`` next to the
file, and only then into the file. An incomplete journal has changed nothing. A complete one is
applied by the next recovery, and readers show the file as if it had been applied.
"""

from __future__ import annotations

import io
import os
import struct
import sys
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from dearig.input_file import open_input
from dearig.recording.files import journal_of, replaced_when_done
from dearig.recording.lock import FileLock, ReplacedError

#: Bytes of a page, wherever they are.
Buffer = bytes | bytearray | memoryview

__all__ = [
    "Patched",
    "carry_out",
    "changed_in_place",
    "journal_of",
    "replaced",
    "whole_journal",
]

MAGIC = b"dearig-journal/1"
#: Bytes of a page; changes are held back in pages.
PAGE = 4096
HEAD = struct.Struct("<16sQQQ")  # magic, size before, size after, pages
PIECE = struct.Struct("<QI")  # offset, length; then the old bytes, then the new ones


class Patched(io.RawIOBase):
    """A binary file for h5py, with ``pages`` in place of parts of its first ``edge`` bytes.

    Writes below ``edge`` are held back in ``pages``; those above go to the file. The first error
    there is kept in ``failure`` and not raised, and nothing is written after it: HDF5 cannot close
    a file that it cannot write, and crashes the program when it exits.
    """

    def __init__(
        self, file: io.FileIO, edge: int, pages: dict[int, bytearray | memoryview]
    ) -> None:
        self._file = file
        self._at = 0
        self.edge = edge
        self.pages = pages
        self.end = file.seek(0, 2)
        self.failure: OSError | None = None

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return self._file.writable()

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = 0, /) -> int:
        self._at = offset + (0, self._at, self.end)[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def readinto(self, buffer: memoryview, /) -> int:  # type: ignore[override]
        view = memoryview(buffer).cast("B")
        start = self._at
        stop = min(start + len(view), self.end)
        if stop <= start:
            return 0
        self._fill(start, view[: stop - start])
        for number in self._numbers(start, min(stop, self.edge)):
            page = self.pages.get(number)
            if page is None:
                continue
            low, high = max(start, number * PAGE), min(stop, self.edge, (number + 1) * PAGE)
            view[low - start : high - start] = page[low - number * PAGE : high - number * PAGE]
        self._at = stop
        return stop - start

    def _fill(self, at: int, view: memoryview) -> None:
        self._file.seek(at)
        got = 0
        while got < len(view):
            more = self._file.readinto(view[got:])
            if not more:
                if at + len(view) > self.edge:
                    raise OSError(f"the file ends before byte {at + len(view)}")
                # bytes that were cut off and added again are read as zeros
                view[got:] = bytes(len(view) - got)
                return
            got += more

    def write(self, data: bytes, /) -> int:  # type: ignore[override]
        view = memoryview(data).cast("B")
        start, stop = self._at, self._at + len(view)
        below = min(stop, self.edge)
        for number in self._numbers(start, below):
            page = self.pages.get(number)
            if page is None:
                page = self.pages[number] = bytearray(self.original(number))
            low, high = max(start, number * PAGE), min(below, (number + 1) * PAGE)
            page[low - number * PAGE : high - number * PAGE] = view[low - start : high - start]
        if stop > self.edge:
            first = max(start, self.edge)
            self._append(first, view[first - start :])
        self._at = stop
        self.end = max(self.end, stop)
        return len(view)

    def _append(self, at: int, rest: memoryview) -> None:
        """Write ``rest`` to the file at a place behind the edge."""
        if self.failure is not None:
            return
        try:
            self._file.seek(at)
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self.failure = error

    def replace(self, content: memoryview) -> None:
        """Make ``content`` all that the file holds; it is not copied, and may not change."""
        self.pages.clear()
        below = content[: self.edge]
        for number in self._numbers(0, len(below)):
            page = below[number * PAGE : (number + 1) * PAGE]
            size = min(PAGE, self.edge - number * PAGE)
            # a file that becomes shorter ends within its last page
            whole = page if len(page) == size else bytearray(bytes(page).ljust(size, b"\0"))
            self.pages[number] = whole
        self._append(self.edge, content[self.edge :])
        self.truncate(len(content))

    def truncate(self, size: int | None = None, /) -> int:
        self.end = self._at if size is None else size
        if self.end >= self.edge and self._file.writable() and self.failure is None:
            try:
                self._file.truncate(self.end)
            except OSError as error:
                self.failure = error
        return self.end

    def flush(self) -> None:
        """Do nothing: every write goes to the file at once."""

    def original(self, number: int) -> bytes:
        """Return the bytes of the file at page ``number``, up to the edge."""
        size = min(PAGE, self.edge - number * PAGE)
        held = bytearray(size)
        self._fill(number * PAGE, memoryview(held))
        return bytes(held)

    @staticmethod
    def _numbers(start: int, stop: int) -> range:
        return range(start // PAGE, -(-stop // PAGE)) if stop > start else range(0)


@contextmanager
def changed_in_place(path: Path, lock: FileLock, fsync: bool = False) -> Iterator[Patched]:
    """Yield the file at ``path`` to change; all changes are kept if the body succeeds, else none.

    The caller holds ``lock`` on the file. With ``fsync`` this holds for a power cut too. Raises
    ``InputError`` if another file has the name ``path`` by now, and ``OSError``; the file is then
    as it was before, or, if the journal was being applied, the journal is left to be applied later.
    """
    journal = journal_of(path)
    with path.open("r+b", buffering=0) as file:
        _check_same(path, file, lock)
        edge = file.seek(0, 2)
        patched = Patched(file, edge, {})
        try:
            try:
                yield patched
            finally:
                if patched.failure is not None:
                    raise patched.failure
            if fsync:
                os.fsync(file.fileno())
            _write_journal(journal, patched, fsync)
        except BaseException:
            file.truncate(edge)
            journal.unlink(missing_ok=True)
            raise
        _apply(file, patched.end, patched.pages)
        if fsync:
            os.fsync(file.fileno())
    journal.unlink()


def _check_same(path: Path, file: io.FileIO, lock: FileLock) -> None:
    if not os.path.samestat(os.fstat(file.fileno()), lock.status):
        raise replaced(path)


def replaced(path: Path) -> ReplacedError:
    """Return the error for a file that another one has replaced since it was locked."""
    return ReplacedError(
        f"{path} is another file by now, which replaced the one that was to be finished; nothing "
        f"was written to it"
    )


def _write_journal(journal: Path, patched: Patched, fsync: bool) -> None:
    head = HEAD.pack(MAGIC, patched.edge, patched.end, len(patched.pages))
    with replaced_when_done(journal, overwrite=True) as partial, partial.open("wb") as stream:
        crc = zlib.crc32(head)
        stream.write(head)
        for number, page in sorted(patched.pages.items()):
            piece = PIECE.pack(number * PAGE, len(page)) + patched.original(number) + bytes(page)
            crc = zlib.crc32(piece, crc)
            stream.write(piece)
        stream.write(struct.pack("<I", crc))
        stream.flush()
        if fsync:
            os.fsync(stream.fileno())
    if fsync and sys.platform != "win32":
        # the journal's name must reach the disk before the first change of the file
        folder = os.open(journal.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _apply(file: io.FileIO, end: int, pages: Mapping[int, Buffer]) -> None:
    for number, page in sorted(pages.items()):
        file.seek(number * PAGE)
        rest = memoryview(page)
        while rest:
            rest = rest[file.write(rest) :]
    file.truncate(end)


def whole_journal(path: Path) -> tuple[int, int, dict[int, bytes]] | None:
    """Return size before, size after and new pages from the journal of ``path``; None without one.

    None too for a journal that is cut short, that contradicts itself, or that belongs to another
    file: every byte in the file must be the old or the new one. Memory is bounded by the pages of
    the file. Raises ``InputError`` for one that is not a file, such as a pipe, and ``OSError``.
    """
    place = journal_of(path)
    if not os.path.lexists(place):
        return None
    with open_input(place, "journal") as stream, path.open("rb") as file:
        about = file.seek(0, 2)
        head = stream.read(HEAD.size)
        if len(head) < HEAD.size or head[: len(MAGIC)] != MAGIC:
            return None
        _, before, after, count = HEAD.unpack(head)
        # what was appended is in the file before the journal is written
        if about < after or count > -(-before // PAGE):
            return None
        crc, pages = zlib.crc32(head), dict[int, bytes]()
        for _ in range(count):
            piece = stream.read(PIECE.size)
            if len(piece) < PIECE.size:
                return None
            offset, length = PIECE.unpack(piece)
            if offset % PAGE or length != min(PAGE, before - offset):
                return None
            both = stream.read(2 * length)
            old, new = both[:length], both[length:]
            file.seek(offset)
            here = file.read(length).ljust(length, b"\0")
            if len(new) < length or not _either(here, old, new):
                return None
            crc = zlib.crc32(both, zlib.crc32(piece, crc))
            pages[offset // PAGE] = new
        if stream.read(5) != struct.pack("<I", crc):
            return None
    return before, after, pages


def _either(here: bytes, old: bytes, new: bytes) -> bool:
    bytes_of = [np.frombuffer(b, dtype=np.uint8) for b in (here, old, new)]
    return bool(((bytes_of[0] == bytes_of[1]) | (bytes_of[0] == bytes_of[2])).all())


def carry_out(path: Path, lock: FileLock) -> bool:
    """Apply the journal next to ``path``; return True if there was one.

    The caller holds ``lock`` on the file. Raises ``InputError`` if another file has that name by
    now, and ``OSError``.
    """
    found = whole_journal(path)
    if found is not None:
        _, after, pages = found
        with path.open("r+b", buffering=0) as file:
            _check_same(path, file, lock)
            _apply(file, after, pages)
    journal_of(path).unlink(missing_ok=True)
    return found is not None
