"""A commented sequence with every kind of segment, and the same kinds as a page of Markdown."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from pydantic.fields import FieldInfo

from dearig.config.segments import SEGMENT_KINDS, SegmentTable
from dearig.config.segments.base import KV
from dearig.config.sequencefile import HEAD_FIELDS
from dearig.config.toml_input import allowed
from dearig.model.simulation.excitation import Segment

__all__ = ["example", "page"]

_HEAD = """\
# A sequence: the voltage that a run plays, segment after segment.
# Units stand at the end of each key. A line that begins with # is a comment: remove the # to set
# the key; as it stands there, it has its default.
# Each segment must start at the voltage where the one before ends, and the run ends at 0 kV.
"""

_PAGE_HEAD = """\
# Kinds of segment

This page is generated from the code. A sequence file is TOML: a few keys at the top, then one table
`[[segment]]` for each segment. Units stand at the end of a key's name. Each segment must start at
the voltage where the one before ends, and the run ends at 0 kV. `dearig sequence-file FILE.toml`
writes an example with every kind.
"""

#: Points at which the voltage of an example is looked at for its least value.
_POINTS = 2001


def example() -> str:
    """Return a commented sequence file with every kind of segment; it can be played as it stands.

    Ramps join the segments. A kind that reads a file stands there as a comment, because the file
    is the operator's.
    """
    parts = [_HEAD + "\n".join(_keys(HEAD_FIELDS, {"name": "example"}))]
    voltage = 0.0
    for name, kind in SEGMENT_KINDS.items():
        made = kind.model_validate({"kind": name, **kind.example})
        text = _table(name, kind)
        if made.files:
            parts.append("\n".join(_comment(line) for line in text.splitlines()))
            continue
        segment = made.build(Path())
        start = _start(segment, voltage)
        if start != voltage:
            parts.append(_ramp(start))
        parts.append(text)
        voltage = segment.after(start).end
    if voltage != 0.0:
        parts.append(_ramp(0.0))
    return "\n\n".join(parts) + "\n"


def page() -> str:
    """Return a page of Markdown about every kind of segment, generated from its class."""
    lines = [_PAGE_HEAD, *_rows(HEAD_FIELDS), ""]
    for name, kind in SEGMENT_KINDS.items():
        lines += [f"## {name}", "", *inspect.cleandoc(kind.__doc__ or "").splitlines(), ""]
        lines += [*_rows(_fields(kind)), "", "```toml", "[[segment]]"]
        lines += [_setting("kind", name)]
        lines += [_setting(key, value) for key, value in kind.example.items()]
        lines += ["```", ""]
    return "\n".join(lines).rstrip("\n") + "\n"


def _fields(kind: type[SegmentTable]) -> dict[str, FieldInfo]:
    """Return the keys of a kind but ``kind`` itself; ``repeats``, which all have, comes last."""
    fields = {key: info for key, info in kind.model_fields.items() if key != "kind"}
    fields["repeats"] = fields.pop("repeats")
    return fields


def _table(name: str, kind: type[SegmentTable]) -> str:
    summary = inspect.cleandoc(kind.__doc__ or "").splitlines()[0]
    lines = [f"# {name}: {summary}", "[[segment]]", _setting("kind", name)]
    return "\n".join([*lines, *_keys(_fields(kind), kind.example)])


def _keys(fields: Mapping[str, FieldInfo], given: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line for each key: as given, or its default as a comment."""
    for key, info in fields.items():
        about = f"  # {info.description}: {allowed(info)}"
        default = info.get_default(call_default_factory=True)
        if key in given:
            yield _setting(key, given[key]) + about
        elif default is None:
            yield f"# {key} ={about}"
        else:
            yield f"# {_setting(key, default)}{about}"


def _rows(fields: Mapping[str, FieldInfo]) -> Iterator[str]:
    """Yield a table of Markdown."""
    yield "| key | meaning | allowed | default |"
    yield "|---|---|---|---|"
    for key, info in fields.items():
        default = info.get_default(call_default_factory=True)
        shown = "required" if info.is_required() else "" if default is None else f"`{default}`"
        yield f"| `{key}` | {info.description} | {allowed(info)} | {shown} |"


def _setting(key: str, value: Any) -> str:
    # tomli_w writes a list over several lines; an inline one is valid TOML too
    if isinstance(value, list | tuple):
        items = (_setting(key, item).removeprefix(f"{key} = ") for item in value)
        return f"{key} = [{', '.join(items)}]"
    return tomli_w.dumps({key: value}).rstrip("\n")


def _comment(line: str) -> str:
    return line if line.startswith("#") else f"# {line}"


def _start(segment: Segment, voltage: float) -> float:
    """Return where an example should start, in V: an amplifier may have no negative voltage.

    A segment that starts where the one before ends is lifted until it stays above 0 V.
    """
    following = segment.after(voltage)
    if following.start != voltage:
        return following.start
    times = np.linspace(0.0, following.duration, _POINTS)
    lowest = float(following.voltage(times).min())
    if lowest >= 0.0:
        return voltage
    lifted = voltage + math.ceil(-lowest / KV) * KV
    return lifted if segment.after(lifted).start == lifted else voltage


def _ramp(voltage: float) -> str:
    settings = [_setting("kind", "ramp"), _setting("to_kV", voltage / KV)]
    return "\n".join(["[[segment]]", *settings, _setting("duration_s", 1.0)])
