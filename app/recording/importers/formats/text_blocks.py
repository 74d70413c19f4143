"""Blocks of whole lines of a text file, in UTF-8 and with single line feeds."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.recording.files import system_text

__all__ = ["BytesReader", "blocks_of", "halves_of"]

#: Bytes of a block: so long that what is done once for each block does not count, and so short
#: that the parser stays in the cache of the processor, which halves its time.
BLOCK = 2**20


class BytesReader:
    """A file in memory for the parser of pandas, which takes bytes faster than text."""

    def __init__(self, content: bytes) -> None:
        self._file = io.BytesIO(content)

    def read(self, size: int = -1) -> bytes:
        """Return the next ``size`` bytes, or all."""
        return self._file.read(size)

    def __iter__(self) -> Iterator[bytes]:
        """Yield the lines."""
        return iter(self._file)


def blocks_of(
    path: Path, encoding: str, skip: int, stop: int | None = None
) -> Iterator[tuple[int, bytes]]:
    """Yield the number, from 1, of a block's first line, and the block.

    The first ``skip`` lines are left out, and those from the number ``stop``, from 0, on. Raises
    ``InputError`` if the file cannot be read.
    """
    line = 1
    try:
        with open_input(path) as file:
            for block in _lines(file) if encoding.startswith("utf-8") else _recoded(file, encoding):
                piece = block
                if line == 1 and encoding == "utf-8-sig":
                    piece = piece.removeprefix(b"\xef\xbb\xbf")
                count = _line_feeds(piece) + (not piece.endswith(b"\n"))
                if line + count <= skip + 1:
                    line += count
                    continue
                at = 0
                for _ in range(skip + 1 - line):
                    at = piece.index(b"\n", at) + 1
                    line += 1
                    count -= 1
                if stop is not None and line + count > stop:
                    end = at
                    for _ in range(stop + 1 - line):
                        end = piece.find(b"\n", end) + 1 or len(piece)
                    yield line, piece[at:end]
                    return
                yield line, piece[at:]
                line += count
    except (OSError, UnicodeError) as error:
        said = system_text(error) if isinstance(error, OSError) else str(error)
        raise InputError(f"{path} cannot be read: {said}") from error


def _line_feeds(block: bytes) -> int:
    """Return the number of line feeds in ``block``."""
    # some times faster than bytes.count for a character that is so frequent
    return int(np.count_nonzero(np.frombuffer(block, np.uint8) == ord("\n")))


def halves_of(line: int, block: bytes) -> list[tuple[int, bytes]]:
    """Return the two halves of a block, cut behind a line, or the block alone if it has one line.

    Each is with the number of its first line.
    """
    at = block.find(b"\n", len(block) // 2) + 1
    if not 0 < at < len(block):
        at = block.rfind(b"\n", 0, len(block) // 2) + 1
    if not 0 < at < len(block):
        return [(line, block)]
    return [(line, block[:at]), (line + block.count(b"\n", 0, at), block[at:])]


def _lines(file: BinaryIO) -> Iterator[bytes]:
    left = b""
    while piece := file.read(BLOCK):
        end = piece.rfind(b"\n") + 1 or piece.rfind(b"\r") + 1
        if end:
            yield _withline_feeds(left + piece[:end])
            left = piece[end:]
        else:
            left += piece
    if left:
        yield _withline_feeds(left)


def _withline_feeds(block: bytes) -> bytes:
    return block.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in block else block


def _recoded(file: BinaryIO, encoding: str) -> Iterator[bytes]:
    with io.TextIOWrapper(file, encoding, newline=None) as stream:
        while text := stream.read(BLOCK):
            yield (text if text.endswith("\n") else text + stream.readline()).encode()
