"""Bounds of plausible values: an import asks about everything that a fit refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dearig.analysis.readings.record import Readings
from dearig.errors import InputError
from dearig.recording import open_recording
from dearig.recording.content import bounds
from dearig.recording.content.bounds import STRETCH, VOLTAGE, Bounds, Range
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.importers.columns.plausible import plausibility_warnings
from dearig.recording.writing.save import save_recording

TIME = np.arange(400) / 50.0
WAVE = 0.5 - 0.5 * np.cos(np.pi * TIME)


def of_voltage(peak: float) -> dict[str, np.ndarray]:
    moved = (5e-3 if peak > 1e3 else 1e-5) * WAVE + np.random.default_rng(1).normal(
        0.0, 1e-6, TIME.size
    )
    return {"time": TIME, "voltage_command": peak * WAVE, "displacement": moved}


def of_stretch(far: float) -> dict[str, np.ndarray]:
    stretch = 1.0 + (far - 1.0) * WAVE
    noise = np.random.default_rng(1).normal(0.0, 50.0, TIME.size)
    stress = 40e3 * (stretch - stretch**-2.0) + noise
    return {"time": TIME, "stretch": stretch, "nominal_stress": stress}


def refusal(path: Path, values: dict[str, np.ndarray]) -> str:
    kind = "film" if "stretch" in values else "actuator"
    save_recording(path, kind, values, RunMetadata(), overwrite=True)
    try:
        _ = Readings(open_recording(path)).quality
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("values", "about", "name"),
    [(of_voltage, VOLTAGE, "voltage"), (of_stretch, STRETCH, "stretch")],
)
@pytest.mark.parametrize("end", ["low", "high"])
def test_a_fit_refuses_from_the_bound_on_and_an_import_asks_before(
    values, about, name, end, tmp_path
):
    usual, possible = getattr(about.usual, end), getattr(about.possible, end)
    inside, outside = (1.01, 0.99) if end == "low" else (0.99, 1.01)
    for size, asks, refuses in (
        (usual * inside, False, False),
        (usual * outside, True, usual == possible),
        (possible * inside, usual != possible, False),
        (possible * outside, True, True),
    ):
        found = values(size)
        said = [text for text in plausibility_warnings(found, None) if text.startswith(name)]
        assert bool(said) is asks
        said = refusal(tmp_path / "run.h5", found)
        assert (f"the {name} " in said) is bool(said) is refuses


def test_every_usual_value_is_possible():
    both = [value for value in vars(bounds).values() if isinstance(value, Bounds)]
    assert len(both) == 2
    for each in both:
        assert each.usual.low in each.possible
        assert each.usual.high in each.possible


def test_a_range_holds_its_ends():
    assert 1.0 in Range(1.0, 2.0)
    assert 2.0 in Range(1.0, 2.0)
    assert 2.1 not in Range(1.0, 2.0)
