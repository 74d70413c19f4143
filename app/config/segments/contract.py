"""Contract of a kind of segment: what every kind must do, as a check that tests can call."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import tomli_w
from pydantic import ValidationError

from dearig.config.segments.base import SegmentTable
from dearig.config.sequencefile import parse_sequence
from dearig.config.toml_input import parse_toml
from dearig.drivers.registry import EntryError
from dearig.errors import InputError
from dearig.model.simulation.excitation import Segment

__all__ = ["check_segment"]

#: V: segments join within this (``dearig.model.simulation.excitation``).
_JOIN = 1e-3
_POINTS = 1001


def check_segment(name: str, kind: type[SegmentTable], folder: Path) -> None:
    """Check that ``kind`` does what every kind of segment must do.

    ``name`` is its name in the registry; ``folder`` is where the files lie that its example names.
    Raises ``EntryError`` with a sentence for the first thing that is wrong.
    """
    _check_description(name, kind)
    try:
        made = kind.model_validate({"kind": name, **kind.example})
    except ValidationError as error:
        raise EntryError(f"{name}: its example is refused: {error}") from error
    if made.highest_frequency < 0.0:
        raise EntryError(f"{name}: highest_frequency is {made.highest_frequency} Hz, below 0")
    built = made.build(folder)
    for start in (0.0, 2e3):
        _check_segment(f"{name} after {start:g} V", built.after(start))
    closed = built.after(0.0)
    if closed.after(5e2).start != closed.start:
        raise EntryError(f"{name}: after() changes a start that has been set already")
    _check_file(name, kind, closed, folder)


def _check_description(name: str, kind: type[SegmentTable]) -> None:
    if not (kind.__doc__ or "").strip() or kind.__doc__ == SegmentTable.__doc__:
        raise EntryError(f"{name}: the class has no docstring of its own")
    for key, info in kind.model_fields.items():
        if not info.description and key != "kind":
            raise EntryError(f"{name}: the key {key} has no description")


def _check_segment(what: str, segment: Segment) -> None:
    """Check duration, ends and voltage."""
    if not (np.isfinite(segment.duration) and segment.duration > 0.0):
        raise EntryError(f"{what}: duration is {segment.duration} s; it must be above 0")
    time = np.linspace(0.0, segment.duration, _POINTS)
    before = time.copy()
    voltage = segment.voltage(time)
    if not np.array_equal(time, before):
        raise EntryError(f"{what}: voltage() changes the times that it is given")
    if voltage.shape != time.shape or not np.isfinite(voltage).all():
        raise EntryError(f"{what}: voltage() must return a finite value in V for each time")
    for where, value, stated in (
        ("start", voltage[0], segment.start),
        ("end", voltage[-1], segment.end),
    ):
        if abs(value - stated) > _JOIN:
            raise EntryError(
                f"{what}: voltage() is {value:.6g} V at the {where}, and {where} is {stated:.6g} V"
            )
    if not np.array_equal(segment.voltage(time.copy()), voltage):
        raise EntryError(
            f"{what}: voltage() gives other values when it is asked again; a run that computes it "
            f"again would end at the first difference"
        )
    # the run is sampled in one piece, the preview in another
    parts = np.concatenate([segment.voltage(part) for part in np.array_split(time, 7)])
    if not np.allclose(parts, voltage, rtol=0.0, atol=1e-9 * np.abs(voltage).max(initial=1.0)):
        raise EntryError(f"{what}: voltage() depends on which times are asked for together")


def _check_file(name: str, kind: type[SegmentTable], built: Segment, folder: Path) -> None:
    """Check that the example can stand in a sequence file, and that a wrong key is refused."""
    table = {"kind": name, **kind.example}
    segments = [table]
    if abs(built.start) > _JOIN:
        segments.insert(0, _ramp(built.start))
    if abs(built.end) > _JOIN:
        segments.append(_ramp(0.0))
    text = tomli_w.dumps({"name": name, "segment": segments})
    loaded = parse_sequence(text, f"the example of {name}", folder)
    if name not in loaded.sequence.labels:
        raise EntryError(f"{name}: the example plays {loaded.sequence.labels}")
    if parse_toml(loaded.toml, name)["segment"] != segments:
        raise EntryError(f"{name}: the recorded sequence is not the one that was given")
    wrong = tomli_w.dumps({"name": name, "segment": [table | {"no_such_key": 1.0}]})
    try:
        parse_sequence(wrong, name, folder)
    except InputError:
        return
    raise EntryError(f"{name}: a key that it does not have is accepted")


def _ramp(voltage: float) -> dict[str, object]:
    return {"kind": "ramp", "to_kV": voltage / 1e3, "duration_s": 1.0}
