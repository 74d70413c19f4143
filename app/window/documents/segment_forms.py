"""Forms of the segments of a sequence in kilovolts, and of a target in millimetres."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from dearig.config.segments import SEGMENT_KINDS, SegmentTable
from dearig.config.targetfile import as_millimetres, millimetre_key, target_kinds
from dearig.units import name_and_unit
from dearig.window.kit.fields import FormField, form_fields

__all__ = ["SegmentForms", "sequence_forms", "target_forms"]

#: mm for a kV in the example of a segment: the film of the thesis moves by less than 1 mm.
_MM_PER_KV = 0.05


@dataclass(frozen=True)
class SegmentForms:
    """Fields of each kind of segment, the keys of a new one, and what it is, by kind.

    ``what`` is the file ("sequence"), and ``rest`` the value before and after the segments.
    """

    what: str
    rest: str
    fields: Mapping[str, tuple[FormField, ...]]
    examples: Mapping[str, Mapping[str, Any]]
    tips: Mapping[str, str]


def sequence_forms() -> SegmentForms:
    """Return the forms of a sequence."""
    return SegmentForms(
        "sequence",
        "0 V",
        {kind: _fields(table) for kind, table in SEGMENT_KINDS.items()},
        {kind: table.example for kind, table in SEGMENT_KINDS.items()},
        {kind: _tip(table) for kind, table in SEGMENT_KINDS.items()},
    )


def target_forms() -> SegmentForms:
    """Return the forms of a target: those of a sequence, in mm in place of kV."""
    kinds = target_kinds()
    return SegmentForms(
        "target",
        "0 mm",
        {kind: tuple(map(_in_mm, _fields(table))) for kind, table in kinds.items()},
        {kind: _example_in_mm(table) for kind, table in kinds.items()},
        {kind: as_millimetres(_tip(table)) for kind, table in kinds.items()},
    )


def _fields(table: type[SegmentTable]) -> tuple[FormField, ...]:
    """Return the fields of a segment kind, the number of repeats last."""
    return tuple(sorted(form_fields(table, ("kind",)), key=lambda field: field.key == "repeats"))


def _tip(table: type[SegmentTable]) -> str:
    return (inspect.getdoc(table) or "").partition("\n")[0]


def _in_mm(field: FormField) -> FormField:
    key = millimetre_key(field.key)
    if key == field.key:
        return replace(field, description=as_millimetres(field.description))
    name, unit = name_and_unit(key)
    return replace(
        field, key=key, label=name, unit=unit, description=as_millimetres(field.description)
    )


def _example_in_mm(table: type[SegmentTable]) -> dict[str, Any]:
    """Return the keys of a new segment, with those whose default is a voltage of kilovolts."""
    defaults = {field.key: field.default for field in _fields(table) if field.default}
    given = {k: v for k, v in defaults.items() if millimetre_key(k) != k} | dict(table.example)
    return {millimetre_key(k): _scaled(k, v) for k, v in given.items()}


def _scaled(key: str, value: Any) -> Any:
    """Return the ``value`` of a sequence's ``key`` as it is in a target."""
    if millimetre_key(key) == key or value is None:
        return value
    if isinstance(value, list):
        return [_scaled(key, part) for part in value]
    return round(value * _MM_PER_KV, 6)
