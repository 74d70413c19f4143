"""Kinds of segment: one file for each kind or close family, one line here for each kind.

Another distribution adds a kind through an entry point in the group ``dearig.segments``.
``README.md`` next to this file shows how.
"""

from __future__ import annotations

import inspect
from types import MappingProxyType
from typing import Any, Literal, get_args, get_origin

from dearig.config.segments.base import Positive, SegmentTable, Voltage
from dearig.drivers.registry import Registry

__all__ = ["SEGMENT_KINDS", "Positive", "SegmentTable", "Voltage"]

_OWN = MappingProxyType(
    {
        "half_sine": "dearig.config.segments.lobes:HalfSineSegment",
        "sine": "dearig.config.segments.sine:SineSegment",
        "triangle": "dearig.config.segments.lobes:TriangleSegment",
        "ramp": "dearig.config.segments.levels:RampSegment",
        "hold": "dearig.config.segments.levels:HoldSegment",
        "chirp": "dearig.config.segments.chirp:ChirpSegment",
        "steps": "dearig.config.segments.levels:StepsSegment",
        "multisine": "dearig.config.segments.multisine:MultisineSegment",
        "thesis": "dearig.config.segments.lobes:Thesis",
        "csv": "dearig.config.segments.waveform:Csv",
    }
)


def _check(name: str, kind: Any) -> None:
    """Raise ``ValueError`` unless ``kind`` is the class of a segment of that name."""
    if not (isinstance(kind, type) and issubclass(kind, SegmentTable)):
        raise TypeError("it is not a subclass of dearig.config.segments.SegmentTable")
    if inspect.isabstract(kind):
        raise TypeError("it has no method build")
    annotation = kind.model_fields["kind"].annotation
    if get_origin(annotation) is not Literal or get_args(annotation) != (name,):
        raise ValueError(f'its field kind must be of the type Literal["{name}"]')
    if not isinstance(getattr(kind, "example", None), dict):
        raise TypeError("it has no example, the keys of a new segment")


#: Every kind of segment by name.
SEGMENT_KINDS: Registry[type[SegmentTable]] = Registry("dearig.segments", _OWN, _check)
