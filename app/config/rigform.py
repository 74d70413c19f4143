"""Editing of a rig file: errors by key, and its text with one value changed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dearig.config.rigfile import REPEATED, RigFile, fault_text
from dearig.config.toml_input import allowed, parse_toml, shown
from dearig.errors import InputError

__all__ = ["SECTIONS", "faults_of", "parse_rig_file", "section_values"]


def _table(name: str) -> type[BaseModel]:
    annotation = RigFile.model_fields[name].annotation
    return next(
        part
        for part in (annotation, *get_args(annotation))
        if isinstance(part, type) and issubclass(part, BaseModel)
    )


#: The tables of a rig file that a form shows, those of the specimen first. Repeated tables have no
#: form: they are edited in the file.
SECTIONS: dict[str, type[BaseModel]] = {
    name: _table(name)
    for name in (
        "film", "load", *(n for n in RigFile.model_fields if n not in ("film", "load", *REPEATED))
    )
}  # fmt: skip


def parse_rig_file(text: str, folder: Path | None = None) -> RigFile:
    """Return the rig file in ``text``; the files that it names are relative to ``folder``.

    Raises ``InputError`` with a sentence for every fault.
    """
    found = faults_of(text)
    if found:
        raise InputError("the rig file: " + "; ".join(found.values()))
    data = parse_toml(text, "the rig file")
    return RigFile.model_validate(data, context={"folder": folder})


def faults_of(text: str) -> dict[tuple[str, str], str]:
    """Return all errors in ``text``: a sentence for each (table, key).

    The key is ("", "") where no single key is at fault. A check across several keys runs only if
    each key is valid. Invalid keys are therefore removed and the rest is checked again; an error
    that names a removed key is ignored. Raises ``InputError`` where the text is not TOML.
    """
    data = parse_toml(text, "the rig file")
    found: dict[tuple[str, str], str] = {}
    left_out: set[str] = set()
    while True:
        try:
            RigFile.model_validate(data)
        except ValidationError as error:
            faults = error.errors(include_url=False)
        else:
            return found
        progress = False
        for fault in faults:
            place = _place(fault)
            sentence = _sentence_at(place, fault)
            if place not in found and not any(key in sentence for key in left_out):
                found[place] = sentence
            progress |= _leave_out(data, *place)
            left_out.add(f"{place[0]}.{place[1]}")
        if not progress:
            return found


def _place(fault: ErrorDetails) -> tuple[str, str]:
    """Return table and key of a fault; of several keys, the one that its sentence names first."""
    loc = [str(part) for part in fault["loc"]]
    if loc[:1] and loc[0] in REPEATED:
        return loc[0], ".".join(loc[1:])
    table, key = [*loc, "", ""][:2]
    if not key and fault["type"] == "value_error":
        named = re.match(r"(\w+)(?:\.(\w+))?", str(fault["ctx"]["error"]))
        if named and named[1] in SECTIONS and named[2]:
            return named[1], named[2]
    return table, key


def _sentence_at(place: tuple[str, str], fault: ErrorDetails) -> str:
    if place[0] in REPEATED or fault["type"] in ("model_type", "model_attributes_type"):
        return fault_text(fault)
    text = str(fault["ctx"]["error"]) if fault["type"] == "value_error" else ""
    return _sentence(*place, fault["input"], text)


def _leave_out(data: dict[str, Any], table: str, key: str) -> bool:
    """Remove a key from ``data``, or its table where it lacks the key; False where neither is."""
    section = data.get(table)
    if isinstance(section, dict) and key in section:
        del section[key]
        return True
    return data.pop(table, None) is not None


def section_values(text: str, table: str) -> dict[str, Any]:
    """Return the keys of ``table`` in ``text``. Raises ``InputError`` where it is not TOML."""
    found = parse_toml(text, "the rig file").get(table, {})
    return dict(found) if isinstance(found, dict) else {}


def _sentence(table: str, key: str, value: Any, words: str) -> str:
    info = SECTIONS[table].model_fields.get(key) if table in SECTIONS and key else None
    if words and info is None:
        return words
    if info is None:
        where = f"{table}.{key}" if key else table
        return f"{where} is not a key of a rig file" if where else "this is not a rig file"
    if words.startswith((f"{table}.", "card")):
        return words
    return words or f"{shown(value)} is not allowed, but {allowed(info)}"
