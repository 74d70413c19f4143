"""The superblock of an HDF5 file: the parts that a recovery needs.

Version 3 (HDF5 File Format Specification, section II.A): 8 bytes of signature, version, sizes of
offsets and lengths, consistency flags (byte 11), base address, extension address, end of file
(offset 28), root address, and a checksum (Jenkins' lookup3) of the 44 bytes before it.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

__all__ = ["SIZE", "consistency_flags", "flags_of", "lookup3", "repair_superblock"]

SIGNATURE = b"\x89HDF\r\n\x1a\n"
VERSION = 3
VERSION_AT, FLAGS_AT, END_AT, CHECKSUM_AT, SIZE = 8, 11, 28, 44, 48
MASK = 0xFFFFFFFF


def consistency_flags(path: Path) -> int | None:
    """Return the flags of a file that was not closed, 0 if it was; None if it is not HDF5.

    Files with an older superblock have no flags and count as closed. Raises ``ValueError`` if the
    superblock is damaged: in SWMR mode HDF5 reads such a file again and again, with pauses that
    grow without limit.
    """
    with path.open("rb") as stream:
        return flags_of(stream.read(SIZE))


def flags_of(head: bytes) -> int | None:
    """Return ``consistency_flags`` from the first ``SIZE`` bytes of a file."""
    if head[: len(SIGNATURE)] != SIGNATURE or len(head) < SIZE:
        return None
    if head[VERSION_AT] != VERSION:
        return 0
    if struct.unpack_from("<I", head, CHECKSUM_AT)[0] != lookup3(head[:CHECKSUM_AT]):
        raise ValueError("the checksum of its first 48 bytes is wrong")
    return head[FLAGS_AT]


def repair_superblock(stream: io.RawIOBase) -> None:
    """Mark the file open in ``stream`` as closed, and write its size as the end of file.

    Raises ``ValueError`` for a superblock of another version than that of recordings.
    """
    stream.seek(0)
    head = bytearray(stream.read(SIZE) or b"")
    if head[: len(SIGNATURE)] != SIGNATURE or len(head) < SIZE or head[VERSION_AT] != VERSION:
        raise ValueError("it does not begin with the superblock of a recording")
    end = stream.seek(0, 2)
    head[FLAGS_AT] = 0
    head[END_AT : END_AT + 8] = struct.pack("<Q", end)
    head[CHECKSUM_AT:SIZE] = struct.pack("<I", lookup3(bytes(head[:CHECKSUM_AT])))
    stream.seek(0)
    stream.write(bytes(head))


def _rotate(value: int, bits: int) -> int:
    return ((value << bits) | (value >> (32 - bits))) & MASK


def lookup3(data: bytes, seed: int = 0) -> int:
    """Bob Jenkins' lookup3 hash (``hashlittle``, public domain) of ``data``."""
    a = b = c = (0xDEADBEEF + len(data) + seed) & MASK
    if not data:
        return c
    # all but the last 1 to 12 bytes are mixed three words at a time; the rest is padded
    last = (len(data) - 1) // 12 * 12
    for at in range(0, last, 12):
        x, y, z = struct.unpack_from("<3I", data, at)
        a, b, c = (a + x) & MASK, (b + y) & MASK, (c + z) & MASK
        a = ((a - c) & MASK) ^ _rotate(c, 4)
        c = (c + b) & MASK
        b = ((b - a) & MASK) ^ _rotate(a, 6)
        a = (a + c) & MASK
        c = ((c - b) & MASK) ^ _rotate(b, 8)
        b = (b + a) & MASK
        a = ((a - c) & MASK) ^ _rotate(c, 16)
        c = (c + b) & MASK
        b = ((b - a) & MASK) ^ _rotate(a, 19)
        a = (a + c) & MASK
        c = ((c - b) & MASK) ^ _rotate(b, 4)
        b = (b + a) & MASK
    x, y, z = struct.unpack("<3I", data[last:].ljust(12, b"\0"))
    a, b, c = (a + x) & MASK, (b + y) & MASK, (c + z) & MASK
    for bits in ((14, 11, 25), (16, 4, 14)):
        c = ((c ^ b) - _rotate(b, bits[0])) & MASK
        a = ((a ^ c) - _rotate(c, bits[1])) & MASK
        b = ((b ^ a) - _rotate(a, bits[2])) & MASK
    return int(((c ^ b) - _rotate(b, 24)) & MASK)
