"""Metadata of an exported recording, read back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from dearig.model.errors import ModelError
from dearig.model.specimen import KINEMATICS, Film, Load
from dearig.recording.layout import FORMAT, ZERO_ORDER

__all__ = ["Exported", "exported"]

T = TypeVar("T", Film, Load)


@dataclass(frozen=True)
class Exported:
    """Fields as in a ``Recording``; missing or invalid ones have their defaults."""

    hold: bool = False
    kinematics: str | None = None
    film: Film | None = None
    load: Load | None = None
    sequence: str = ""


def exported(about: Mapping[str, str]) -> Exported:
    """Return the metadata in ``about``, texts by name as an exporter wrote them; else empty."""
    if about.get("format") != FORMAT:
        return Exported()
    kinematics = about.get("kinematics")
    return Exported(
        hold=about.get("hold") == ZERO_ORDER,
        kinematics=kinematics if kinematics in KINEMATICS else None,
        film=_made(Film, about.get("film", "")),
        load=_made(Load, about.get("load", "")),
        sequence=about.get("sequence", ""),
    )


def _made(kind: type[T], text: str) -> T | None:
    try:
        return kind(**json.loads(text)) if text else None
    except (ModelError, TypeError, ValueError, RecursionError):
        return None
