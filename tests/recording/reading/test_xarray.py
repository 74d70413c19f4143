"""Recordings in xarray and pandas, by the dimension scales in the file and by methods."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.drivers.rig import Block
from dearig.errors import InputError
from dearig.recording import (
    RunMetadata,
    import_file,
    open_recording,
    recover,
    save_recording,
    verify,
)
from dearig.recording.writing import finish as finish_module
from tests.tools.recordings import Clock, run_counts, write_run, writer

pandas = pytest.importorskip("pandas")
xarray = pytest.importorskip("xarray")
pytest.importorskip("h5netcdf")

SAMPLES = Path(__file__).parents[3] / "recordings"


def opened(path: Path, group: str = "entry/data") -> object:
    with xarray.open_dataset(path, group=group, engine="h5netcdf") as found:
        return found.load()


def live(folder: Path) -> Path:
    write_run(folder / "run.h5")
    return folder / "run.h5"


def saved(folder: Path) -> Path:
    time = np.linspace(0.0, 1.0, 50) ** 2
    values = {"time": time, "stretch": 1.0 + time, "nominal_stress": 1e3 * time}
    return save_recording(folder / "film.h5", "film", values, RunMetadata(title="x"), now=Clock())


def recovered(folder: Path) -> Path:
    recorder, path = writer(folder / "other.h5"), folder / "killed.h5"
    recorder.append(Block(0, run_counts(1500)))
    recorder._flush_all(1.8e9)
    shutil.copyfile(recorder.path, path)
    recorder.discard()
    assert recover(path, now=lambda: path.stat().st_mtime + 60.0)
    return path


def imported(folder: Path) -> Path:
    source = folder / "in.csv"
    source.write_text("time_s,voltage_kV,displacement_mm\n0,0,0\n0.5,1,0.25\n0.75,2,1\n")
    import_file(source, folder / "in.h5", now=Clock())
    return folder / "in.h5"


@pytest.mark.parametrize("made", [live, saved, recovered, imported])
def test_xarray_finds_the_time_coordinate(tmp_path: Path, made: object) -> None:
    path = made(tmp_path)
    recording, found = open_recording(path), opened(path)
    assert set(found.sizes) == set(found.coords) == {"time"}
    np.testing.assert_array_equal(found.time, recording.time)
    for name, values in recording.values.items():
        np.testing.assert_array_equal(found[name], values)
    assert found.time.attrs["units"] == "s"
    assert found[found.attrs["signal"]].attrs["units"] in ("m", "Pa")
    assert (verify(path).faults, recording.complete) == ([], made is not recovered)


def test_a_run_without_physical_values_has_the_coordinate_in_its_overview(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(finish_module, "PHYSICAL_MAX", 1000)
    path = live(tmp_path)
    found = opened(path, "entry/overview")
    assert set(found.coords) == {"time"}
    assert found.displacement.max() == open_recording(path).displacement.max()
    assert verify(path).sound


@pytest.mark.parametrize("name", ["sample-plain.h5", "sample-hidden-effect.h5"])
def test_recordings_of_earlier_versions_have_no_scales_and_are_read(
    tmp_path: Path, name: str
) -> None:
    path = tmp_path / name
    shutil.copyfile(SAMPLES / name, path)
    with h5py.File(path, "r+") as file:
        data = file["entry/data"]
        for row in data.values():
            for scale in row.dims[0].values() if not row.is_scale else ():
                row.dims[0].detach_scale(scale)
        if data["time"].is_scale:
            for attribute in ("CLASS", "NAME"):
                del data["time"].attrs[attribute]
    assert verify(path).sound
    assert open_recording(path).to_xarray().sizes["time"] == open_recording(path).samples


def test_a_row_with_another_scale_is_a_fault(tmp_path: Path) -> None:
    path = live(tmp_path)
    with h5py.File(path, "r+") as file:
        data = file["entry/data"]
        data["voltage_monitor"].dims[0].detach_scale(data["time"])
    assert verify(path).faults == ["the dimension scale of /entry/data/voltage_monitor is not time"]


def test_to_xarray_has_units_and_what_was_recorded(tmp_path: Path) -> None:
    recording = open_recording(live(tmp_path))
    found = recording.to_xarray()
    np.testing.assert_array_equal(found.displacement, recording.displacement)
    np.testing.assert_array_equal(found.time, recording.time)
    assert found.voltage_command.attrs["units"] == "V"
    assert found.displacement.attrs["long_name"] == "displacement from the loaded rest state"
    assert (found.attrs["title"], found.attrs["kind"]) == ("two lobes", "actuator")
    found.displacement[0] = 1.0  # a copy: the recording stays as it is
    assert recording.displacement[0] != 1.0


def test_to_pandas_has_time_as_index_and_units(tmp_path: Path) -> None:
    recording = open_recording(live(tmp_path))
    found = recording.to_pandas()
    np.testing.assert_array_equal(found["displacement"], recording.displacement)
    np.testing.assert_array_equal(found.index, recording.time)
    assert found.index.name == "time"
    assert found.attrs["units"] == {
        "time": "s", "displacement": "m", "voltage_command": "V", "voltage_monitor": "V",
        "current_monitor": "A",
    }  # fmt: skip


@pytest.mark.parametrize("package", ["xarray", "pandas"])
def test_a_missing_package_is_said_with_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    recording = open_recording(live(tmp_path))
    with pytest.raises(InputError, match=r'not installed: pip install "dearig\[notebook\]"'):
        getattr(recording, f"to_{package}")()
