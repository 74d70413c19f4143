"""Metadata of an exported recording, read back."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TypeVar

from dearig.drivers.channels import RESERVED_NAMES
from dearig.drivers.rig import Event
from dearig.model.errors import ModelError
from dearig.model.film.specimen import KINEMATICS, Film, Load
from dearig.recording.content.fields import TEXTS
from dearig.recording.content.layout import (
    EVENT_LEVELS,
    FORMAT,
    UNITS,
    ZERO_ORDER,
    counts_name,
)
from dearig.recording.content.provenance import is_start_known

__all__ = ["Exported", "exported"]

#: Values of the provenance that an import keeps, and their types.
_ORIGIN: dict[str, type] = {
    "simulated": bool,
    "seed": int,
    "model": str,
    **{f.place.partition("/")[2]: str for f in TEXTS.values() if f.in_provenance},
}

T = TypeVar("T", Film, Load)


@dataclass(frozen=True)
class Exported:
    """Fields as in a ``Recording``; missing or invalid ones have their defaults.

    ``channels`` are the columns of declared channels: name, unit and label; ``computed`` are
    the columns that a model computed, which are not imported. ``missing`` are the columns with
    missing readings. ``timing`` are skew, delay and the error of the delay of the displacement
    in s. ``origin`` has those values of the provenance that say where the data are from.
    ``rest_reading`` is that of a displacement that is counted from it already, None if the file
    tells none. ``started`` is the Unix time in s of the start of the run, None if the file does
    not tell it.
    """

    hold: bool = False
    average: int = 1
    kinematics: str | None = None
    film: Film | None = None
    load: Load | None = None
    sequence: str = ""
    origin: Mapping[str, object] = field(default_factory=dict)
    rest_reading: float | None = None
    events: tuple[Event, ...] = ()
    channels: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)
    computed: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    timing: tuple[float, float, float] = (0.0, 0.0, 0.0)
    started: float | None = None


def exported(about: Mapping[str, str]) -> Exported:
    """Return the metadata in ``about``, texts by name as an exporter wrote them; else empty."""
    if about.get("format") != FORMAT:
        return Exported()
    kinematics = about.get("kinematics")
    noted = _noted(about.get("provenance", ""))
    columns = list(_columns(about.get("channels", "")))
    return Exported(
        hold=about.get("hold") == ZERO_ORDER,
        average=_whole(about.get("average", "")),
        kinematics=kinematics if kinematics in KINEMATICS else None,
        film=_made(Film, about.get("film", "")),
        load=_made(Load, about.get("load", "")),
        sequence=about.get("sequence", ""),
        origin=_origin(noted),
        rest_reading=_number(about.get("rest_reading", "")),
        events=tuple(_events(about.get("events", ""))),
        channels={column: (n, u, t) for column, (n, u, t) in columns if _is_channel(n, u)},
        computed=tuple(column for column, (n, u, _) in columns if not u and n in UNITS),
        missing=tuple(_noted(about.get("missing", ""))),
        timing=_timing(about.get("displacement_timing", "")),
        started=_started(noted),
    )


def _whole(text: str) -> int:
    """Return a whole number of 1 or more; 1 for any other text."""
    return max(int(text), 1) if text.isascii() and text.isdigit() and len(text) < 10 else 1


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _events(text: str) -> Iterator[Event]:
    """Yield the events that an exporter wrote; none for another text."""
    try:
        found = json.loads(text) if text else []
    except (ValueError, RecursionError):
        return
    for row in found if isinstance(found, list) else ():
        match row:
            case [int(sample), str(level), str(message)] if sample >= 0 and level in EVENT_LEVELS:
                yield Event(sample, level, message)


def _columns(text: str) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Yield each column in ``text`` with name, unit and label; both are empty for a model's."""
    for column, stated in _noted(text).items():
        match stated:
            case [str(name)]:
                yield column, (name, "", "")
            case [str(name), str(unit), str(label)]:
                yield column, (name, unit, label)


#: Names and units that a rig file can give to a channel.
_NAME, _UNIT_MAX = re.compile(r"[a-z][a-z0-9_]{0,39}"), 16


def _is_channel(name: str, unit: str) -> bool:
    return (
        bool(_NAME.fullmatch(name))
        and 0 < len(unit) <= _UNIT_MAX
        and name not in RESERVED_NAMES
        and not name.endswith(counts_name(""))
    )


def _timing(text: str) -> tuple[float, float, float]:
    """Return three times in s that are finite and not negative; 0 s for another text."""
    try:
        skew, delay, error = (float(seconds) for seconds in json.loads(text))
    except (TypeError, ValueError, RecursionError):
        return 0.0, 0.0, 0.0
    if not all(0.0 <= seconds < math.inf for seconds in (skew, delay, error)):
        return 0.0, 0.0, 0.0
    return skew, delay, error


def _noted(text: str) -> dict[str, object]:
    """Return the object of JSON in ``text``, such as the provenance; empty where it is none."""
    try:
        found = json.loads(text) if text else {}
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _started(noted: Mapping[str, object]) -> float | None:
    """Return the start of the run that was exported; None where it was not known there either."""
    if not is_start_known(noted):
        return None
    try:
        moment = datetime.fromisoformat(str(noted.get("start_time", "")))
        return moment.timestamp() if moment.tzinfo is not None else None
    except (OverflowError, OSError, ValueError):
        return None


def _origin(found: Mapping[str, object]) -> dict[str, object]:
    """Return the texts of the provenance, seed and model, and whether the rig was simulated."""
    return {
        name: found[name]
        for name, kind in _ORIGIN.items()
        # a truth is an int too
        if isinstance(found.get(name), kind) and isinstance(found[name], bool) == (kind is bool)
    }


def _made(kind: type[T], text: str) -> T | None:
    try:
        return kind(**json.loads(text)) if text else None
    except (ModelError, TypeError, ValueError, RecursionError):
        return None
