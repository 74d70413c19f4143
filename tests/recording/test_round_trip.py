"""Recordings that are exported and imported again: the same values, units, rest and events."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.drivers.rig import Event
from dearig.recording import (
    EXPORTS,
    Recording,
    RunMetadata,
    export_recording,
    import_file,
    open_recording,
    save_recording,
)
from tests.tools.recordings import Clock

ROWS = 40
# digits that a converter has: an offset at rest is taken off where it is one
NUMBERS = st.floats(-1e4, 1e4).map(lambda x: round(x, 9))
TEXT = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), max_size=60)
EVENTS = st.lists(
    st.builds(
        Event,
        st.integers(0, ROWS - 1),
        st.sampled_from(["info", "warning", "fault"]),
        TEXT.filter(lambda text: "\0" not in text),
    ),
    max_size=4,
)


@st.composite
def rows(draw: st.DrawFn, scale: float, rest: int = 0) -> np.ndarray:
    """Values of a column, 0 at rest for the first ``rest`` samples."""
    values = np.array(draw(st.lists(NUMBERS, min_size=ROWS, max_size=ROWS))) * scale
    values[:rest] = 0.0
    return values


@st.composite
def times(draw: st.DrawFn) -> np.ndarray:
    steps = draw(st.lists(st.floats(1e-6, 1e3), min_size=ROWS, max_size=ROWS))
    return draw(st.floats(-1e3, 1e6)) + np.cumsum(steps)


@st.composite
def actuators(draw: st.DrawFn) -> dict[str, np.ndarray]:
    rest = draw(st.sampled_from([0, 20]))
    found = {
        "time": draw(times()),
        "displacement": draw(rows(1e-6, rest)),
        "voltage_command": draw(rows(1.0, rest)),
    }
    for name, scale in (("voltage_monitor", 1.0), ("current_monitor", 1e-9), ("temperature", 0.01)):
        if draw(st.booleans()):
            found[name] = draw(rows(scale))
    return found


@st.composite
def films(draw: st.DrawFn) -> dict[str, np.ndarray]:
    stretch = 1.0 + np.abs(draw(rows(1e-4)))
    return {"time": draw(times()), "stretch": stretch, "nominal_stress": draw(rows(10.0))}


def there_and_back(
    folder: Path, to: str, values: dict[str, np.ndarray], events: list[Event], rest: float = 0.0
) -> tuple[Recording, Recording]:
    kind = "film" if "stretch" in values else "actuator"
    first = save_recording(
        folder / "first.h5", kind, values, RunMetadata(title="x"), events=events,
        rest_reading=rest if kind == "actuator" else 0.0, now=Clock(),
    )  # fmt: skip
    import_file(export_recording(first, to, folder / f"out.{to}"), folder / "again.h5", now=Clock())
    return open_recording(first), open_recording(folder / "again.h5")


@pytest.mark.parametrize("to", EXPORTS)
@settings(max_examples=25, deadline=None)
@given(
    values=st.one_of(actuators(), films()),
    events=EVENTS,
    rest=st.floats(-0.1, 0.1),
)
def test_what_is_exported_comes_back(
    to: str, values: dict[str, np.ndarray], events: list[Event], rest: float
) -> None:
    folder = Path(tempfile.mkdtemp())
    try:
        first, again = there_and_back(folder, to, values, events, rest)
        assert again.kind == first.kind
        assert again.values.keys() == first.values.keys()
        for name, column in first.values.items():
            np.testing.assert_array_equal(again.values[name], column, err_msg=f"{to} {name}")
            assert again.unit(name) == first.unit(name)
        if to != "csv":  # a plain table has no place for more
            assert again.rest_reading == first.rest_reading
            said = [(e.sample, e.level, e.message) for e in again.events]
            for event in first.events:
                assert (event.sample, event.level, event.message) in said
    finally:
        shutil.rmtree(folder)
