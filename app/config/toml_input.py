"""Reading TOML that people write, with messages about what is wrong and what is allowed."""

from __future__ import annotations

import difflib
import itertools
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
from dearig.input_file import read_input

__all__ = ["NAME_MAX", "TomlTable", "allowed", "meant", "parse_toml", "read_text", "shown"]

#: Bytes of a file, at most: three times a sequence of 10,000 segments of some 70 bytes, which is
#: the largest that is played. Python's parser takes about a second for so much.
BYTES_MAX = 2**21
#: Tables and headers of tables, at most: twice the 10,000 segments of a sequence.
TABLES_MAX = 20_000
#: Keys of a table and values of a list, at most: as many as a sequence has segments. Each may be
#: wrong, and a kilobyte is kept of each fault.
ITEMS_MAX = 10_000
#: Depth of tables and lists in each other, at most. The files that are read have 4, and the history
#: of a model is free; the parser's time grows as the square of the parts of a key.
DEPTH_MAX = 32
#: Characters of a key, at most; the longest known one has 40.
KEY_MAX = 200
#: Bits of a whole number besides its sign, as TOML has it.
INTEGER_BITS = 63
#: Characters of a name or title, at most: more than fits into a heading or on a terminal's screen.
NAME_MAX = 1000

_TABLE = re.compile(r"^[ \t]*\[", re.MULTILINE)
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
# begins where a part begins: searched from each character of a long word, the time would be square
_DEEP_KEY = re.compile(rf"(?<![A-Za-z0-9_.-])(?:{_PART}){{{DEPTH_MAX}}}")

#: Characters of a value in a message.
_SHOWN = 40
#: Characters of a line of a file in a message.
_LINE = 120
_HDF5 = b"\x89HDF\r\n\x1a\n"
# what a key can end in: used to tell a wrong unit from a wrong name
_UNITS = frozenset(
    {"nm", "um", "mm", "cm", "m", "m3", "us", "ms", "s", "mv", "v", "kv", "ua", "ma", "a"}
    | {"hz", "khz", "mhz", "g", "kg", "n", "k", "mk", "celsius", "ppm", "percent", "pct", "per"}
)


class TomlTable(BaseModel):
    """A table of a file that people write: immutable, no unknown keys, no text for numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


def read_text(path: Path, what: str) -> str:
    """Return the text of the ``what`` (rig file, sequence) at ``path``. Raises ``InputError``."""
    raw = read_input(path, what, BYTES_MAX)
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
    """Return the tables of the TOML ``text`` called ``name``.

    Raises ``InputError``: with the line of what is not TOML, and for a text that goes beyond the
    limits of this module, whose reading might take minutes.
    """
    _check_text(text, name)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name}{_toml_fault(str(error), text)}") from error
    except (RecursionError, ValueError) as error:
        # what the parser leaves to the interpreter: brackets without end, a number of 5000 digits
        raise InputError(
            f"{name}: it cannot be read as TOML: brackets are nested too deeply, or a number has "
            f"thousands of digits"
        ) from error
    _check_values(data, name)
    return data


def _check_text(text: str, name: str) -> None:
    """Refuse what the parser would read slowly: its time grows as the square of some counts."""
    if len(text) > BYTES_MAX:
        raise InputError(f"{name} has {len(text):,} characters; {BYTES_MAX:,} are read at most")
    tables = len(_TABLE.findall(text))
    if tables > TABLES_MAX:
        raise InputError(f"{name} has {tables:,} tables; {TABLES_MAX:,} are read at most")
    if deep := _DEEP_KEY.search(text):
        line = text.count("\n", 0, deep.start()) + 1
        raise InputError(
            f"{name}, line {line}: a key has more than {DEPTH_MAX} parts; tables are nested "
            f"{DEPTH_MAX} deep at most"
        )


def _check_values(data: dict[str, Any], name: str) -> None:
    """Refuse values that are too deep, too long or too many for what follows."""
    waiting: list[tuple[Any, int]] = [(data, 1)]
    while waiting:
        value, depth = waiting.pop()
        if isinstance(value, int) and value.bit_length() > INTEGER_BITS:
            raise InputError(f"{name}: a whole number does not fit into {INTEGER_BITS + 1} bits")
        if not isinstance(value, dict | list):
            continue
        if depth > DEPTH_MAX:
            raise InputError(f"{name}: tables and lists are nested more than {DEPTH_MAX} deep")
        if len(value) > ITEMS_MAX:
            what = "keys" if isinstance(value, dict) else "values"
            raise InputError(
                f"{name}: a {'table' if isinstance(value, dict) else 'list'} has {len(value):,} "
                f"{what}; {ITEMS_MAX:,} are read at most"
            )
        if isinstance(value, dict):
            longest = max(map(len, value), default=0)
            if longest > KEY_MAX:
                raise InputError(
                    f"{name}: a key has {longest:,} characters; {KEY_MAX} are read at most"
                )
        inside = value.values() if isinstance(value, dict) else value
        waiting += [(inner, depth + 1) for inner in inside]


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
        elif kind is str:
            return f"a list of texts such as {shown((info.examples or [['a text']])[0])}"
        elif get_origin(kind) is Literal:
            return f"a list of {' or '.join(map(shown, get_args(kind)))}"
        elif kind is float:
            return f"a list such as [6.0, 6.5], each {_bounded('a number', inner)}"
    words = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}
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
        for name in ("gt", "ge", "lt", "le", "pattern", "min_length", "max_length"):
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
    if "max_length" in bounds:
        what = "characters" if text.startswith("a text") else "tables"
        text += f" of at most {bounds['max_length']} {what}"
    return text


def _toml_fault(message: str, text: str) -> str:
    """`, line N: what` from tomllib's message, which says where only in its text."""
    found = re.fullmatch(r"(.*?)\s*\(at (?:line (\d+), column (\d+)|end of document)\)", message)
    if not found:
        return f": not TOML: {message}"
    what, line, column = found.groups()
    what = what if len(what) <= _LINE else f"{what[: _LINE - 3]}..."  # it quotes keys
    if what == r"Illegal character '\n'":
        what = "a text is not closed by a quotation mark"
    lines = text.splitlines()
    if line is None:
        return f", line {max(len(lines), 1)}: {what} at the end of the file"
    here = lines[int(line) - 1].strip() if int(line) <= len(lines) else ""
    if len(here) > _LINE:
        here = f"{here[: _LINE - 3]}..."
    return f", line {line}, column {column}: {what}" + (f" in `{here}`" if here else "")


def shown(value: object) -> str:
    """Return a value for a message, shortened."""
    text = json.dumps(_beginning(value), default=str, ensure_ascii=False)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def _beginning(value: object, depth: int = 0) -> object:
    """Return what is shown of ``value``: of a long one the beginning, before it becomes text."""
    if depth > DEPTH_MAX:
        return "..."
    if isinstance(value, str):
        return value[: _SHOWN + 1]
    if isinstance(value, list | tuple):
        return [_beginning(part, depth + 1) for part in value[: _SHOWN + 1]]
    if isinstance(value, dict):
        some = itertools.islice(value.items(), _SHOWN + 1)
        return {_beginning(str(k)): _beginning(v, depth + 1) for k, v in some}
    return value


def meant(key: str, known: Mapping[str, FieldInfo], parents: str = "") -> str | None:
    """Return the end of a sentence with the key that was probably meant, or None."""
    for name in known:
        if _stem(key) and _stem(name) == _stem(key):
            unit = name.removeprefix(_stem(name)).strip("_")
            if unit:
                return f"this value is given in {unit.replace('_', ' ')}, as {parents}{name}"
    near = difflib.get_close_matches(key[:KEY_MAX], known, n=1, cutoff=0.6)
    return f"did you mean {parents}{near[0]}?" if near else None


def _stem(key: str) -> str:
    """Return a key without its unit: ``slew_max`` of ``slew_max_kV_per_s``."""
    parts = key.split("_")
    while parts and parts[-1].lower() in _UNITS:
        parts.pop()
    return "_".join(parts)
