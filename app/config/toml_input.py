"""Reading TOML that people write, with messages about what is wrong and what is allowed."""

from __future__ import annotations

import difflib
import json
import re
import tomllib
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict
from pydantic.fields import FieldInfo

from dearig.errors import InputError

__all__ = ["Table", "allowed", "meant", "parse_toml", "read_text", "shown"]

_HDF5 = b"\x89HDF\r\n\x1a\n"
# what a key can end in: used to tell a wrong unit from a wrong name
_UNITS = frozenset(
    {"nm", "um", "mm", "cm", "m", "m3", "us", "ms", "s", "mv", "v", "kv", "ua", "ma", "a"}
    | {"hz", "khz", "mhz", "g", "kg", "n", "k", "mk", "celsius", "ppm", "percent", "pct", "per"}
)


class Table(BaseModel):
    """A table of a file that people write: immutable, no unknown keys, no text for numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


def read_text(path: Path, what: str) -> str:
    """Return the text of the ``what`` (rig file, sequence) at ``path``. Raises ``InputError``."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{what} {path} cannot be read: {error.strerror or error}") from error
    if raw.startswith(_HDF5):
        raise InputError(f"{path} is a recording (HDF5) where a {what} (TOML) should be")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise InputError(
            f"{what} {path}, line {line}: not UTF-8 text; save the file in UTF-8"
        ) from error


def parse_toml(text: str, name: str) -> dict[str, Any]:
    """Return the tables of the TOML ``text`` called ``name``; ``InputError`` with the line."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name}{_toml_fault(str(error), text)}") from error
    except (RecursionError, ValueError) as error:
        # what the parser leaves to the interpreter: brackets without end, a number of 5000 digits
        raise InputError(
            f"{name}: it cannot be read as TOML: brackets are nested too deeply, or a number has "
            f"thousands of digits"
        ) from error


def allowed(info: FieldInfo, item: bool = False) -> str:
    """Return the allowed values of a key in words: ``a number from 0.1 to 10``.

    ``item``: what one value in its list may be.
    """
    kind, metadata = _bare(info.annotation, info.metadata)
    if get_origin(kind) is Literal:
        return " or ".join(json.dumps(value) for value in get_args(kind))
    if get_origin(kind) is list:
        kind, inner = _bare(get_args(kind)[0], [])
        if item:
            metadata = inner
        elif kind is float:
            return f"a list such as [6.0, 6.5], each {_bounded('a number', inner)}"
    words = {float: "a number", int: "a whole number", str: "a text"}
    text = words.get(kind, "a table") if isinstance(kind, type) else "a table"
    return _bounded(text, metadata, info.examples)


def _bare(kind: Any, metadata: list[Any]) -> tuple[Any, list[Any]]:
    """Return a type without ``| None`` and constraints, and the constraints."""
    if get_origin(kind) in (Union, types.UnionType):
        kind = next(part for part in get_args(kind) if part is not type(None))
    if get_origin(kind) is Annotated:
        kind, *more = get_args(kind)
        for constraint in more:
            metadata = [*metadata, *(getattr(constraint, "metadata", None) or [constraint])]
    return kind, metadata


def _bounded(text: str, metadata: list[Any], examples: list[Any] | None = None) -> str:
    bounds: dict[str, Any] = {}
    for constraint in metadata:
        for name in ("gt", "ge", "lt", "le", "pattern", "min_length"):
            value = getattr(constraint, name, None)
            if value is not None:
                bounds[name] = value
    if "ge" in bounds:
        text += f" from {bounds['ge']:g}"
    if "gt" in bounds:
        text += f" above {bounds['gt']:g}"
    if "le" in bounds:
        text += f" to {bounds['le']:g}" if "ge" in bounds else f", at most {bounds['le']:g}"
    if "pattern" in bounds:
        usual = "ao0" if "ao" in bounds["pattern"] else "ai0"
        text += f" such as {examples[0] if examples else usual}"
    if "min_length" in bounds:
        text += " that is not empty"
    return text


def _toml_fault(message: str, text: str) -> str:
    """`, line N: what` from tomllib's message, which says where only in its text."""
    found = re.fullmatch(r"(.*?)\s*\(at (?:line (\d+), column (\d+)|end of document)\)", message)
    if not found:
        return f": not TOML: {message}"
    what, line, column = found.groups()
    if what == r"Illegal character '\n'":
        what = "a text is not closed by a quotation mark"
    lines = text.splitlines()
    if line is None:
        return f", line {max(len(lines), 1)}: {what} at the end of the file"
    shown = lines[int(line) - 1].strip() if int(line) <= len(lines) else ""
    return f", line {line}, column {column}: {what}" + (f" in `{shown}`" if shown else "")


def shown(value: object) -> str:
    """Return a value for a message, shortened."""
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 40 else f"{text[:37]}..."


def meant(key: str, known: Mapping[str, FieldInfo], parents: str = "") -> str | None:
    """Return the end of a sentence with the key that was probably meant, or None."""
    for name in known:
        if _stem(key) and _stem(name) == _stem(key):
            unit = name.removeprefix(_stem(name)).strip("_")
            if unit:
                return f"this value is given in {unit.replace('_', ' ')}, as {parents}{name}"
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.6)
    return f"did you mean {parents}{near[0]}?" if near else None


def _stem(key: str) -> str:
    """Return a key without its unit: ``slew_max`` of ``slew_max_kV_per_s``."""
    parts = key.split("_")
    while parts and parts[-1].lower() in _UNITS:
        parts.pop()
    return "_".join(parts)
