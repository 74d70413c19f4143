"""Inputs made of good ones by damage that a parser may believe."""

from __future__ import annotations

import random
import struct
from collections.abc import Sequence

from dearig.recording.content.superblock import lookup3

__all__ = ["mutated_bytes", "mutated_hdf5", "mutated_text"]

#: Numbers that are the edge of something.
EDGES = (0, 1, 2, 3, 7, 8, 15, 16, 127, 128, 255, 256, 32767, 32768, 65535, 65536, 2**31 - 1, 2**31,
         2**32 - 1, 2**32, 10**12, 2**63 - 1, 2**63, 2**64 - 1)  # fmt: skip
FORMATS = ("<B", "<H", ">H", "<I", ">I", "<Q", ">Q")


def mutated_bytes(rng: random.Random, seeds: Sequence[bytes]) -> bytes:
    """One of ``seeds`` with a few places changed, taken out, doubled, or mixed with another."""
    raw = bytearray(rng.choice(seeds))
    for _ in range(rng.choice((1, 1, 1, 2, 2, 4, 16))):
        if not raw:
            break
        _once(rng, raw, seeds)
    return bytes(raw)


def _once(rng: random.Random, raw: bytearray, seeds: Sequence[bytes]) -> None:
    # headers stand in front, and are worth more
    at = rng.randrange(len(raw)) if rng.random() < 0.6 else rng.randrange(min(len(raw), 600))
    size = rng.choice((1, 2, 4, 8, 16, 64, 500))
    match rng.randrange(8):
        case 0:
            raw[at] ^= 1 << rng.randrange(8)
        case 1:
            raw[at] = rng.randrange(256)
        case 2:
            form = rng.choice(FORMATS)
            value = rng.choice(EDGES) % (1 << 8 * struct.calcsize(form))
            put = struct.pack(form, value)
            raw[at : at + len(put)] = put
        case 3:
            del raw[at : at + size]
        case 4:
            raw[at:at] = raw[at : at + size]
        case 5:
            raw[at:at] = bytes(size)
        case 6:
            del raw[at:]
        case 7:
            other = rng.choice(seeds)
            start = rng.randrange(len(other))
            raw[at : at + size] = other[start : start + size]


def mutated_hdf5(rng: random.Random, seeds: Sequence[bytes]) -> bytes:
    """An HDF5 file with damage under checksums that are right again, half of the time."""
    raw = bytearray(mutated_bytes(rng, seeds))
    if rng.random() < 0.7:
        _mend(raw)
    return bytes(raw)


def _mend(raw: bytearray) -> None:
    """Give the superblock and every object header of version 2 the checksum of what it holds."""
    if len(raw) > 48:
        raw[44:48] = struct.pack("<I", lookup3(bytes(raw[:44])))
    at = raw.find(b"OHDR")
    while at >= 0 and at + 7 < len(raw):
        flags = raw[at + 5]
        head = 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        size = int.from_bytes(raw[at + head : at + head + width], "little")
        end = at + head + width + size
        if size < 4096 and end + 4 <= len(raw):
            raw[end : end + 4] = struct.pack("<I", lookup3(bytes(raw[at:end])))
        at = raw.find(b"OHDR", at + 4)


PIECES = (
    "=", "[", "]", "[[", "]]", "{", "}", '"', "'", '"""', "\n", "#", ".", ",", "-", "+", "e", "_",
    "inf", "nan", "true", "0x", "1e400", "-1", "0", "1e-300", "9" * 400, "1979-05-27", "\\u0000",
    "\0", "\ufeff", "µ", "\U0001f600", "[" * 60, "{a=" * 60, "[[segment]]\n", "kind = ", '"csv"',
    "file = ", '"/etc/passwd"', '"../../x.csv"', "a.b.c = 1\n", ";", "\t", "\r", "1,2", "1.234,5",
)  # fmt: skip


def mutated_text(rng: random.Random, seeds: Sequence[bytes]) -> bytes:
    """A text with lines, words or numbers of it changed, or bytes."""
    if rng.random() < 0.2:
        return mutated_bytes(rng, seeds)
    lines = rng.choice(seeds).decode().split("\n")
    for _ in range(rng.choice((1, 1, 2, 3, 8))):
        at = rng.randrange(len(lines))
        line = lines[at]
        match rng.randrange(7):
            case 0:
                del lines[at]
                lines = lines or [""]
            case 1:
                lines.insert(at, line)
            case 2:
                other = rng.choice(seeds).decode().split("\n")
                lines.insert(at, rng.choice(other))
            case 3:
                place = rng.randrange(len(line) + 1)
                lines[at] = line[:place] + rng.choice(PIECES) + line[place:]
            case 4:
                place = rng.randrange(len(line) + 1)
                lines[at] = line[:place] + line[place + rng.randint(1, 6) :]
            case 5:
                name, equals, _ = line.partition("=")
                lines[at] = name + equals + rng.choice(PIECES)
            case 6:
                name, equals, _ = line.partition("=")
                lines[at] = f"{name}{equals} {rng.choice((-1, 1)) * rng.choice(EDGES)}"
    return "\n".join(lines).encode("utf-8", "surrogatepass")
