"""Extremes of the cycles of a recording that is not kept."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from dearig.analysis.loops import cycles, valleys
from dearig.batch.extremes import write_extremes
from dearig.recording import RunMetadata
from dearig.recording.writing.save import save_recording

RATE = 100.0
REST = np.zeros(30)


def table(folder: Path, voltage: np.ndarray, displacement: np.ndarray, every: int = 0) -> list:
    values = {"time": np.arange(voltage.size) / RATE, "voltage_command": voltage,
              "displacement": displacement}  # fmt: skip
    path = save_recording(folder / "run.h5", "actuator", values, RunMetadata())
    write_extremes(path, folder / "run.csv", every)
    with (folder / "run.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def sine(periods: int, samples: int = 20) -> np.ndarray:
    return np.cos(2.0 * np.pi * np.arange(periods * samples + 1) / samples)


@pytest.mark.parametrize(
    ("voltage", "count"),
    [
        (np.concatenate([REST, np.abs(np.sin(np.pi * np.arange(401) / 20)) * 6e3, REST]), 20),
        # about a bias the voltage never comes near 0 V
        (np.concatenate([REST, 4e3 - 1e3 * sine(15), REST]), 15),
        # lobes of different heights
        (
            np.concatenate([REST, *[np.r_[np.hanning(20), 0.0] * h for h in (2e3, 8e3) * 5], REST]),
            10,
        ),
        (np.linspace(0.0, 5e3, 60), 1),
        (np.zeros(60), 0),
    ],
)
def test_each_cycle_is_a_row(tmp_path: Path, voltage: np.ndarray, count: int) -> None:
    assert len(table(tmp_path, voltage, voltage * 1e-7)) == count


def test_no_extreme_is_lost(tmp_path: Path) -> None:
    """Neither before the first cycle nor after the last one."""
    voltage = np.concatenate([REST, np.abs(np.sin(np.pi * np.arange(201) / 20)) * 6e3, REST])
    displacement = np.full(voltage.size, 1e-4)
    displacement[2], displacement[-2], displacement[141] = -3e-3, 5e-3, 4e-3
    rows = table(tmp_path, voltage, displacement)
    assert len(rows) == 10
    assert float(rows[0]["displacement_min_mm"]) == -3.0
    assert float(rows[-1]["displacement_max_mm"]) == 5.0
    assert max(float(row["displacement_max_mm"]) for row in rows[:-1]) == 4.0


def test_every_nth_cycle_is_kept(tmp_path: Path) -> None:
    voltage = np.concatenate([REST, np.abs(np.sin(np.pi * np.arange(201) / 20)) * 6e3, REST])
    table(tmp_path, voltage, voltage * 1e-7, every=4)
    with (tmp_path / "run-cycles.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert sorted({int(row["cycle"]) for row in rows}) == [1, 5, 9]
    middle = [float(row["displacement_mm"]) for row in rows if row["cycle"] == "5"]
    assert len(middle) == 21
    assert max(middle) == pytest.approx(0.6)


def test_small_bumps_between_equal_valleys_divide_nothing() -> None:
    drive = np.array([0.0, 10.0, 0.0, 0.5, 0.0, 10.0, 0.0])
    assert len(cycles(drive)) == 2


def test_a_flat_valley_is_divided_in_its_middle() -> None:
    drive = np.array([0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 0.0])
    assert valleys(drive) == [0, 4, 8]
