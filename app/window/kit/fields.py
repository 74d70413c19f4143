"""Fields of a form, made from the keys of a file: labels, units, defaults and bounds."""

from __future__ import annotations

import re
import types
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from dearig.config.rigform import SECTIONS
from dearig.config.segments import SEGMENT_KINDS
from dearig.config.sequencefile import HEAD_FIELDS
from dearig.config.targetfile import millimetre_key
from dearig.config.toml_input import allowed
from dearig.units import name_and_unit
from dearig.window.kit.number_text import NumberTextError, read_number, read_numbers

__all__ = [
    "FormField",
    "Typed",
    "as_labelled",
    "form_field",
    "form_fields",
    "read_back",
    "read_typed",
    "shown_value",
]


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
        """Name, description, unit and allowed values, for a tooltip."""
        unit = f", in {self.unit}" if self.unit else ""
        return f"{self.label}: {as_labelled(self.description)}{unit} ({self.allowed})"


def form_fields(table: type[BaseModel], leave_out: tuple[str, ...] = ()) -> Iterator[FormField]:
    """Yield the fields of a table, in its order."""
    for key, info in table.model_fields.items():
        if key not in leave_out:
            yield form_field(key, info)


def form_field(key: str, info: FieldInfo) -> FormField:
    """Return the field of ``key``, which has the type and the bounds of ``info``."""
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


@dataclass(frozen=True)
class Typed:
    """A typed text as it is read: the ``value``, or the text itself with ``fault``, a sentence."""

    value: Any
    fault: str = ""


def read_typed(field: FormField, text: str) -> Typed:
    """Return the value of the typed ``text``; None for an empty field.

    A text that is not a number keeps its place in the file, whose check refuses it too.
    """
    text = text.strip()
    if not text:
        return Typed(None)
    try:
        if field.kind == "number":
            return Typed(read_number(text))
        if field.kind == "whole":
            number = read_number(text, whole=True)
            return Typed(int(number) if number.is_integer() else number)
        if field.kind == "numbers":
            return Typed(read_numbers(text))
    except NumberTextError as error:
        return Typed(text, str(error))
    if field.kind == "choice":
        return Typed(next((c for c in field.choices if str(c) == text), text))
    return Typed(text)


def read_back(field: FormField, value: Any) -> str:
    """Return what was read from a number or list field, with its unit; "" for other fields."""
    if field.kind not in ("number", "whole", "numbers") or not isinstance(
        value, int | float | list
    ):
        return ""
    text = f"{shown_value(value)} {field.unit}".rstrip()
    if not isinstance(value, list):
        return f"= {text}"
    return f"{text}: {len(value)} value{'' if len(value) == 1 else 's'}"


@cache
def _keys() -> re.Pattern[str]:
    """Return a pattern of the keys of sequences and rig files that are not words by themselves."""
    tables = [*SECTIONS.values(), *SEGMENT_KINDS.values()]
    keys = {*HEAD_FIELDS, *(key for table in tables for key in table.model_fields)}
    keys |= set(map(millimetre_key, keys))  # of targets
    named = "|".join(sorted((key for key in keys if "_" in key), key=len, reverse=True))
    return re.compile(rf"\b(?:({'|'.join(SECTIONS)})\.)?({named})\b(?!\.)")


def as_labelled(text: str) -> str:
    """Return ``text`` with keys of files as the fields are labelled.

    ``limits.voltage_max_kV`` becomes limits: voltage max (kV).
    """

    def worded(match: re.Match[str]) -> str:
        name, unit = name_and_unit(match[2])
        return (f"{match[1]}: " if match[1] else "") + (f"{name} ({unit})" if unit else name)

    return _keys().sub(worded, text)
