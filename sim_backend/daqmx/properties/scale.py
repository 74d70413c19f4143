"""Properties of custom scales."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dearig.sim_backend.daqmx.card.errors import Code, DaqmxError
from dearig.sim_backend.daqmx.card.scales import LINEAR, MAP, POLYNOMIAL, TABLE, Scale
from dearig.sim_backend.daqmx.properties.kinds import Asked, Property, changed, given

__all__ = ["SAVED_SCALE", "SCALE"]


def _scale(asked: Asked, kind: int | None) -> Scale:
    """Return the asked scale; raises an error unless it is of ``kind`` (None: any)."""
    scale = asked.device.scales.find(asked.channel)
    if kind not in (None, scale.kind):
        raise DaqmxError(Code.NOT_FOR_THIS_SCALE, f"Custom Scale Name: {scale.name}")
    return scale


def _field(name: str, kind: int | None = None, place: int | None = None) -> Property:
    """Return the property for a field of a scale, or for one of its two values."""

    def get(asked: Asked) -> Any:
        value = getattr(_scale(asked, kind), name)
        return value if place is None else value[place]

    def set_(asked: Asked, wanted: Any) -> None:
        scale = _scale(asked, kind)
        value: Any = wanted
        if place is not None:
            pair = list(getattr(scale, name))
            pair[place] = wanted
            value = tuple(pair)
        elif not isinstance(wanted, str | int | float):
            value = tuple(wanted)
        changes: dict[str, Any] = {name: value}
        # a table is set in two steps, so that its sizes may differ between them
        if kind != TABLE:
            replace(scale, **changes).check()
        setattr(scale, name, value)

    return changed(get, set_)


def _saved(asked: Asked) -> Scale:
    """Return the asked scale; raises an error unless it is saved."""
    scale = _scale(asked, None)
    if not scale.saved:
        raise DaqmxError(Code.UNKNOWN_SCALE, f"Custom Scale Name: {scale.name}")
    return scale


SAVED_SCALE = {
    "AUTHOR": given(lambda a: _saved(a).author),
    "ALLOW_INTERACTIVE_EDITING": given(lambda a: _saved(a).saved),
    "ALLOW_INTERACTIVE_DELETION": given(lambda a: _saved(a).saved),
}

SCALE = {
    "TYPE": given(lambda a: _scale(a, None).kind),
    "DESCR": _field("description"),
    "PRE_SCALED_UNITS": _field("pre_scaled_units"),
    "SCALED_UNITS": _field("scaled_units"),
    "LIN_SLOPE": _field("slope", LINEAR),
    "LIN_Y_INTERCEPT": _field("y_intercept", LINEAR),
    "MAP_PRE_SCALED_MIN": _field("map_pre_scaled", MAP, 0),
    "MAP_PRE_SCALED_MAX": _field("map_pre_scaled", MAP, 1),
    "MAP_SCALED_MIN": _field("map_scaled", MAP, 0),
    "MAP_SCALED_MAX": _field("map_scaled", MAP, 1),
    "POLY_FORWARD_COEFF": _field("forward", POLYNOMIAL),
    "POLY_REVERSE_COEFF": _field("reverse", POLYNOMIAL),
    "TABLE_PRE_SCALED_VALS": _field("table_pre_scaled", TABLE),
    "TABLE_SCALED_VALS": _field("table_scaled", TABLE),
}
