"""Keys of a sequence by their paths, ``segment.0.amplitude_kV``: set, and read for names."""

from __future__ import annotations

import re
import string
from collections.abc import Iterator, Mapping
from typing import Any

import tomli_w

from dearig.config.toml_input import NAME_MAX, parse_toml, shown
from dearig.errors import InputError

__all__ = ["clean", "filled", "flat", "with_settings"]


def flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield path and value of each key: ``a.b = 1`` in TOML is a table in a table."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def with_settings(
    text: str,
    settings: Mapping[str, Any],
    where: str,
    parsed: dict[str, Any] | None = None,
) -> str:
    """Return the TOML of a sequence with the values of ``settings``. Raises ``InputError``."""
    if not settings:
        return text
    data: Any = _copied(parse_toml(text, where) if parsed is None else parsed, list(settings))
    for path, value in settings.items():
        *parents, last = path.split(".")
        inner = data
        for i, part in enumerate(parents):
            inner = _step(inner, part, ".".join(parents[: i + 1]), where)
        if isinstance(inner, list):
            inner[_place(inner, last, path, where)] = value
        elif isinstance(inner, dict):
            inner[last] = value
        else:
            raise InputError(f"{where}: {path} leads into {shown(inner)}, which has no keys")
    return tomli_w.dumps(data)


def _copied(data: dict[str, Any], paths: list[str]) -> Any:
    """Return ``data``, of which what the ``paths`` lead through is copied."""
    inside: dict[str, list[str]] = {}
    for path in paths:
        first, _, rest = path.partition(".")
        inside.setdefault(first, []).append(rest)
    return _copied_along(data, inside)


def _copied_along(value: Any, inside: dict[str, list[str]]) -> Any:
    if isinstance(value, dict):
        copied: Any = dict(value)
    elif isinstance(value, list):
        copied = list(value)
    else:
        return value
    for key, rests in inside.items():
        deeper = [rest for rest in rests if rest]
        if not deeper:
            continue
        place: Any = key
        if isinstance(value, list):
            if not key.isdecimal() or int(key[:9]) >= len(value):
                continue
            place = int(key)
        elif key not in value:
            continue
        copied[place] = _copied(value[place], deeper)
    return copied


def _step(inner: Any, part: str, path: str, where: str) -> Any:
    if isinstance(inner, list):
        return inner[_place(inner, part, path, where)]
    if isinstance(inner, dict) and part in inner:
        return inner[part]
    known = ", ".join(inner) if isinstance(inner, dict) else shown(inner)
    raise InputError(f"{where}: {path} is not in the sequence, which has {known} there")


def _place(inner: list[Any], part: str, path: str, where: str) -> int:
    if not (part.isdecimal() and part.isascii()) or int(part[:9]) >= len(inner):
        raise InputError(
            f"{where}: {path} is not in the sequence: its list has the places 0 to {len(inner) - 1}"
        )
    return int(part)


# ---------------------------------------------------------------- names

_SPEC = re.compile(r"0?[0-9]{0,2}(?:\.[0-9]{1,2})?[dgfs]?")


def filled(
    template: str,
    fields: Mapping[str, object],
    settings: Mapping[str, Any],
    sequence: Mapping[str, Any],
) -> str:
    """Return the name of a run. Raises ``InputError`` for a template that cannot be filled."""
    made = []
    try:
        parts = list(string.Formatter().parse(template))
    except ValueError as error:
        raise InputError(f"template = {shown(template)} is not allowed: {error}") from error
    for text, field, spec, conversion in parts:
        made.append(text)
        if field is None:
            continue
        if conversion or not _SPEC.fullmatch(spec or ""):
            raise InputError(
                f"template: {{{field}}} has the format {shown(spec or conversion)}; formats such "
                f"as 04d, .2f and g are known"
            )
        value = fields.get(field)
        if value is None:
            value = _looked_up(field, settings, sequence)
        if isinstance(value, list):
            value = "-".join(str(part) for part in value)
        try:
            made.append(format(value, spec or ""))
        except (TypeError, ValueError) as error:
            raise InputError(
                f"template: {{{field}:{spec}}} does not fit to the value {shown(value)}"
            ) from error
        if sum(map(len, made)) > NAME_MAX:
            raise InputError(f"template: a name would have more than {NAME_MAX} characters")
    return clean("".join(made))


def _looked_up(field: str, settings: Mapping[str, Any], sequence: Mapping[str, Any]) -> Any:
    """Return the value at the path ``field``, as set, or else as in the sequence."""
    parts = field.split(".")
    for i in range(len(parts), 0, -1):
        path = ".".join(parts[:i])
        if path in settings:
            value, rest = settings[path], parts[i:]
            break
    else:
        value, rest = sequence, parts
    for i, part in enumerate(rest):
        value = _step(value, part, ".".join(rest[: i + 1]), f"template: {{{field}}}")
    if isinstance(value, dict):
        raise InputError(f"template: {{{field}}} is a table; name one of {', '.join(value)}")
    if isinstance(value, list) and any(isinstance(part, dict | list) for part in value):
        raise InputError(f"template: {{{field}}} is a list of tables or lists; name one of them")
    return value


def clean(text: str) -> str:
    """Return ``text`` as a name that files can have on every system."""
    return re.sub(r"[^A-Za-z0-9._+-]+", "-", text).lstrip("-.").rstrip(".")
