"""Editing of a rig file: errors by key, and its text with one value changed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, get_args

import tomli_w
from pydantic import BaseModel, ValidationError

from dearig.config.rigfile import REPEATED, RigFile, fault_sentence
from dearig.config.toml_input import allowed, parse_toml, shown
from dearig.errors import InputError

__all__ = ["SECTIONS", "faults_of", "parse_rig_file", "section_values", "with_value"]

_NEXT_TABLE = re.compile(r"^[ \t]*\[", re.MULTILINE)


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
    """Return the errors in ``text``: a sentence for each (table, key).

    The key is ("", "") where no single key is at fault. Raises ``InputError`` where the text is not
    TOML.
    """
    data = parse_toml(text, "the rig file")
    try:
        RigFile.model_validate(data)
    except ValidationError as error:
        found: dict[tuple[str, str], str] = {}
        for fault in error.errors(include_url=False):
            place = [str(part) for part in fault["loc"]]
            if place[:1] and place[0] in REPEATED:
                found.setdefault((place[0], ".".join(place[1:])), fault_sentence(fault))
                continue
            table, key = [*place, "", ""][:2]
            words = str(fault["ctx"]["error"]) if fault["type"] == "value_error" else ""
            if not key and words:
                # an error of two keys is shown beside the key that its sentence names first
                named = re.match(r"(\w+)(?:\.(\w+))?", words)
                if named and named[1] in SECTIONS and named[2]:
                    table, key = named[1], named[2]
            found.setdefault((table, key), _sentence(table, key, fault["input"], words))
        return found
    return {}


def section_values(text: str, table: str) -> dict[str, Any]:
    """Return the keys of ``table`` in ``text``. Raises ``InputError`` where it is not TOML."""
    found = parse_toml(text, "the rig file").get(table, {})
    return dict(found) if isinstance(found, dict) else {}


def with_value(text: str, table: str, key: str, value: Any) -> str:
    """Return ``text`` with the value of a key changed; None removes the key.

    Comments, order and blank lines stay: only the line of that key changes.
    """
    line = "" if value is None else f"{key} = {_toml(value)}\n"
    header = re.search(rf"^[ \t]*\[{table}\][ \t]*(?:#.*)?$\n?", text, re.MULTILINE)
    if header is None:
        if value is None:
            return text
        gap = "" if not text else "\n" if text.endswith("\n") else "\n\n"
        return f"{text}{gap}[{table}]\n{line}"
    start = header.end()
    following = _NEXT_TABLE.search(text, start)
    end = following.start() if following else len(text)
    body = text[start:end]
    old = re.search(rf"^[ \t]*{key}[ \t]*=[ \t]*", body, re.MULTILINE)
    if old is not None:
        rest = _value_end(body, old.end())
        remark = body[rest:].split("\n", 1)[0].strip()
        after = rest + len(body[rest:].split("\n", 1)[0]) + 1
        if line and remark:
            line = f"{line.rstrip()}  {remark}\n"
        body = body[: old.start()] + line + body[after:]
    else:
        # below the commented-out key where the file has one, else at the end of the table
        hint = re.search(rf"^[ \t]*#[ \t]*{key}[ \t]*=.*$\n?", body, re.MULTILINE)
        place = hint.end() if hint else len(body.rstrip("\n")) + (1 if body.rstrip("\n") else 0)
        if not hint and body and not body.endswith("\n"):
            body += "\n"
        body = body[:place] + line + body[place:]
    return text[:start] + body + text[end:]


def _value_end(body: str, start: int) -> int:
    """Return the end of the value that begins at ``start``; a value takes one line."""
    quoted = re.match(r"\"(?:[^\"\\]|\\.)*\"|'[^']*'", body[start:])
    if quoted:
        return start + quoted.end()
    plain = re.match(r"[^#\n]*", body[start:])
    return start + (len(plain[0].rstrip()) if plain else 0)


def _toml(value: Any) -> str:
    return tomli_w.dumps({"x": value}).removeprefix("x = ").rstrip("\n")


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
