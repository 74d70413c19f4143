"""Readings of a thermo-hygrometer in a recording, and the means that every recording has."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.drivers.channels import HUMIDITY, Channel, Scaling
from dearig.drivers.rig import Block
from dearig.recording import RunMetadata, save_recording
from dearig.recording.reading.index import glance
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.summary import describe, describe_rows
from dearig.recording.verify import verify
from tests.tools.recordings import CHANNELS, IDENTITY, VOLTS_PER_COUNT, Clock, run_counts, writer


def written(path: Path, *, close: bool = True) -> None:
    """Write a run of 3 s with a reading each second, the second one without humidity."""
    counts, clock = run_counts(), Clock()
    made = writer(path, environment=True, now=clock)
    for second, (celsius, percent) in enumerate(((21.0, 40.0), (22.0, np.nan), (23.0, 44.0))):
        made.room(1000 * second, celsius, percent)
        clock.moment += 1.0
        made.append(Block(1000 * second, counts[:, 1000 * second : 1000 * second + 1000]))
    if close:
        made.close()


def test_readings_are_a_table_and_their_means_attributes(tmp_path: Path) -> None:
    written(tmp_path / "run.h5")
    run = open_recording(tmp_path / "run.h5")
    assert run.environment is not None
    np.testing.assert_array_equal(run.environment.sample, [0, 1000, 2000])
    assert run.temperature_degC == pytest.approx(22.0)
    assert run.relative_humidity_percent == pytest.approx(42.0)
    # a value that is missing is bridged for a fit, never invented in the table
    assert np.isnan(run.environment.relative_humidity_percent[1])
    humidity = run.room("relative_humidity_percent")
    assert humidity is not None
    assert humidity[[0, 1000, 2999]] == pytest.approx([40.0, 42.0, 44.0])
    with h5py.File(tmp_path / "run.h5") as file:
        assert dict(file["entry"].attrs)["relative_humidity_percent"] == pytest.approx(42.0)
    entry = glance(tmp_path / "run.h5", "run.h5", 0)
    assert entry.room == {"temperature_degC": 22.0, "relative_humidity_percent": 42.0}
    assert verify(tmp_path / "run.h5").sound
    assert describe(run, checksum=False)["environment"]["readings"] == 3
    room = dict(describe_rows(run))["room"]
    assert room == (
        "temperature 21.0 to 23.0 °C, humidity 40.0 to 44.0 %; 3 readings of a thermo-hygrometer"
    )
    assert run.until(1.5).relative_humidity_percent == pytest.approx(40.0)


def test_a_run_that_is_still_written_has_the_readings_so_far(tmp_path: Path) -> None:
    written(tmp_path / "run.h5", close=False)
    readings = open_recording(tmp_path / "run.h5").environment
    assert readings is not None
    np.testing.assert_array_equal(readings.temperature_degC, [21.0, 22.0, 23.0])


def test_a_run_without_readings_has_no_table(tmp_path: Path) -> None:
    made = writer(tmp_path / "run.h5")
    with pytest.raises(ValueError, match="without readings of the room"):
        made.room(0, 21.0, 40.0)
    made.append(Block(0, run_counts()))
    made.close()
    run = open_recording(tmp_path / "run.h5")
    assert run.environment is None
    assert run.temperature_degC is None
    assert run.room("temperature_degC") is None
    with h5py.File(tmp_path / "run.h5") as file:
        assert "environment" not in file["entry"]


def test_channels_at_the_card_give_the_same_means(tmp_path: Path) -> None:
    scale = (0.0, VOLTS_PER_COUNT)
    channels = (
        *CHANNELS,
        Channel("temperature", "K", Scaling(scale, 10.0, 273.15)),
        Channel(HUMIDITY, "%", Scaling(scale, 10.0), label="humidity"),
    )
    identity = IDENTITY.__class__("sim:7", True, IDENTITY.instruments, channels)
    made = writer(tmp_path / "run.h5", identity=identity)
    counts = np.concatenate((run_counts(), np.full((2, 3000), 6554, dtype=np.int16)))
    made.append(Block(0, counts))
    made.close()
    run = open_recording(tmp_path / "run.h5")
    assert run.temperature_degC == pytest.approx(6554 * VOLTS_PER_COUNT * 10.0)
    assert run.relative_humidity_percent == pytest.approx(6554 * VOLTS_PER_COUNT * 10.0)
    room = run.room("relative_humidity_percent")
    assert room is not None
    assert room.size == 3000


def test_an_imported_temperature_has_its_mean(tmp_path: Path) -> None:
    time = np.linspace(0.0, 1.0, 50)
    values = {
        "time": time, "displacement": 0.0 * time, "voltage_command": 0.0 * time,
        "temperature": 20.0 + time,
    }  # fmt: skip
    save_recording(tmp_path / "in.h5", "actuator", values, RunMetadata())
    assert open_recording(tmp_path / "in.h5").temperature_degC == pytest.approx(20.5)
    assert glance(tmp_path / "in.h5", "in.h5", 0).room["temperature_degC"] == pytest.approx(20.5)


def test_a_verification_finds_readings_that_cannot_be(tmp_path: Path) -> None:
    written(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        rows = file["entry/environment"][()]
        rows["relative_humidity"][2] = -3.0
        rows["sample"][1] = 2500
        file["entry/environment"][...] = rows
    faults = " ".join(verify(tmp_path / "run.h5").faults)
    assert "go back, or that do not exist" in faults
    assert "values that no room has" in faults
