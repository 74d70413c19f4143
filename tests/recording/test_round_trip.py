"""Recordings that are exported and imported again: values, units, rest, events and channels."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dearig.drivers.channels import RESERVED_NAMES
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
from tests.deep import examples
from tests.tools.recordings import Clock

ROWS = 40
TIMES = ("displacement_skew", "displacement_delay", "displacement_delay_error")
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


# names that are those of quantities, or of exported columns without or with their units
CHANNELS = st.dictionaries(
    st.sampled_from(["current", "voltage", "force", "laser_2", "a", "a_m", "conversions_per_row"])
    | st.from_regex(r"[a-z][a-z0-9_]{0,39}", fullmatch=True).filter(
        lambda name: name not in RESERVED_NAMES and not name.endswith("_counts")
    ),
    st.tuples(
        st.sampled_from(["A", "V", "N", "m", "m/s", "s", "%", "°C"])
        | st.from_regex(r"[A-Za-z0-9%µ][A-Za-z0-9%µ*/^.-]{0,15}", fullmatch=True),
        TEXT,
    ),
    max_size=3,
)


def there_and_back(
    folder: Path, to: str, values: dict[str, np.ndarray], events: list[Event], rest: float = 0.0,
    channels: Mapping[str, tuple[str, str]] = MappingProxyType({}),
) -> tuple[Recording, Recording]:  # fmt: skip
    kind = "film" if "stretch" in values else "actuator"
    first = save_recording(
        folder / "first.h5", kind, values, RunMetadata(title="x"), events=events,
        rest_reading=rest if kind == "actuator" else 0.0, channels=channels,
        timing=(1e-5, 2e-3, 1e-4) if kind == "actuator" else (0.0, 0.0, 0.0), now=Clock(),
    )  # fmt: skip
    import_file(export_recording(first, to, folder / f"out.{to}"), folder / "again.h5", now=Clock())
    return open_recording(first), open_recording(folder / "again.h5")


@pytest.mark.parametrize("to", EXPORTS)
@examples(25, 5)
@given(
    values=st.one_of(actuators(), films()),
    events=EVENTS,
    rest=st.floats(-0.1, 0.1),
    channels=CHANNELS,
    data=st.data(),
)
def test_what_is_exported_comes_back(
    to: str, values: dict[str, np.ndarray], events: list[Event], rest: float,
    channels: dict[str, tuple[str, str]], data: st.DataObject,
) -> None:  # fmt: skip
    folder = Path(tempfile.mkdtemp())
    values |= {name: data.draw(rows(1.0), name) for name in channels}
    try:
        first, again = there_and_back(folder, to, values, events, rest, channels)
        assert again.kind == first.kind
        assert again.values.keys() == first.values.keys()
        for name, column in first.values.items():
            np.testing.assert_array_equal(again.values[name], column, err_msg=f"{to} {name}")
            assert again.unit(name) == first.unit(name)
        assert list(again.declared.items()) == list(first.declared.items())
        for what in ("rest_reading", *TIMES):
            assert getattr(again, what) == getattr(first, what)
        said = [(e.sample, e.level, e.message) for e in again.events]
        for event in first.events:
            assert (event.sample, event.level, event.message) in said
    finally:
        shutil.rmtree(folder)
