"""Fields of a form, made from the keys of a file: labels, units, defaults and bounds."""

from __future__ import annotations

import re
import types
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from dearig.config.toml_input import allowed
from dearig.units import name_and_unit

__all__ = ["FormField", "form_fields", "shown_value", "typed_value"]

#: Between the numbers of a list: semicolons, spaces, and commas that are not between digits.
_SEPARATOR = re.compile(r"[;\s]|(?<![0-9]),|,(?![0-9])")


@dataclass(frozen=True)
class FormField:
    """One key of a file: label, unit, description and allowed values.

    ``kind`` is number, whole, text, numbers (a list) or choice (one of ``choices``). ``default`` is
    the value of an empty field; None if the field is required or may stay empty.
    """

    key: str
    label: str
    unit: str
    description: str
    allowed: str
    kind: str
    choices: tuple[Any, ...]
    default: Any

    @property
    def tip(self) -> str:
        """Key, description, unit and allowed values, for a tooltip."""
        unit = f", in {self.unit}" if self.unit else ""
        return f"{self.key}: {self.description}{unit} ({self.allowed})"


def form_fields(table: type[BaseModel], leave_out: tuple[str, ...] = ()) -> Iterator[FormField]:
    """Yield the fields of a table, in its order."""
    for key, info in table.model_fields.items():
        if key not in leave_out:
            yield _field(key, info)


def _field(key: str, info: FieldInfo) -> FormField:
    name, unit = name_and_unit(key)
    kind = _bare(info.annotation)
    choices: tuple[Any, ...] = ()
    words = {float: "number", int: "whole", str: "text"}.get(kind, "text")
    if get_origin(kind) is Literal:
        words, choices = "choice", get_args(kind)
    elif get_origin(kind) is list:
        words = "numbers"
    default = None if info.is_required() else info.get_default(call_default_factory=True)
    return FormField(
        key, name, unit, info.description or "", allowed(info), words, choices,
        default,
    )  # fmt: skip


def _bare(kind: Any) -> Any:
    if get_origin(kind) in (Union, types.UnionType):
        kind = next(part for part in get_args(kind) if part is not type(None))
    if get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    return kind


def shown_value(value: Any) -> str:
    """Return the text of a value in a form."""
    if value is None:
        return ""
    if isinstance(value, list):
        return ", ".join(shown_value(part) for part in value)
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def typed_value(field: FormField, text: str) -> Any:
    """Return the value of the typed ``text``; None for an empty field.

    Text that is not a number stays text; the check of the file refuses it with a sentence. A comma
    between two digits is a decimal comma, which no number has, and does not separate a list.
    """
    text = text.strip()
    if not text:
        return None
    if field.kind == "number":
        return _number(text)
    if field.kind == "whole":
        number = _number(text)
        return int(number) if isinstance(number, float) and number.is_integer() else number
    if field.kind == "numbers":
        return [_number(part) for part in _SEPARATOR.split(text) if part]
    if field.kind == "choice":
        return next((choice for choice in field.choices if str(choice) == text), text)
    return text


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
