"""Text in a recording file: ASCII or UTF-8 of fixed length, written and read.

Variable length is not used: HDF5 keeps such text on a heap without a checksum. A run in SWMR mode
cannot append to the heap, and one damaged byte in it can put the library into an endless loop.
"""

from __future__ import annotations

from collections.abc import Sequence

import h5py
import numpy as np

__all__ = ["clip_text", "fixed", "put_text", "text_of"]


def _encoded(text: str) -> bytes:
    return text.replace("\0", " ").encode("utf-8", "replace")


def fixed(text: str | Sequence[str]) -> np.ndarray:
    """Return ``text``, or a row of texts, as an array for an attribute or a dataset."""
    raw = _encoded(text) if isinstance(text, str) else [_encoded(t) for t in text]
    longest = len(raw) if isinstance(raw, bytes) else max(map(len, raw), default=0)
    # Octave stops reading a file at the first text that is marked as UTF-8
    plain = all(map(bytes.isascii, [raw] if isinstance(raw, bytes) else raw))
    return np.array(raw, dtype=h5py.string_dtype("ascii" if plain else "utf-8", max(longest, 1)))


def put_text(group: h5py.Group, name: str, text: str) -> None:
    """Create the dataset ``name`` that holds ``text``."""
    group.create_dataset(name, data=fixed(text))


def clip_text(text: str, size: int) -> bytes:
    """Return ``text`` as UTF-8 in at most ``size`` bytes; ``...`` marks where it was cut."""
    raw = _encoded(text)
    if len(raw) <= size:
        return raw
    return raw[: size - 3].decode("utf-8", "ignore").encode("utf-8") + b"..."


def text_of(value: object) -> str:
    """Return the value of a string attribute or dataset as ``str``, whatever its type is."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value)
