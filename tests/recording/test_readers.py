"""Recordings in the programs in which people open them, finished, live and of earlier versions."""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import pytest

from dearig.drivers.rig import Block
from dearig.recording import open_recording, recover, verify
from dearig.recording.content.layout import NUMBERED
from dearig.recording.content.text import fixed
from tests.deep import mostly_deep
from tests.tools.recordings import run_counts, write_run, writer

SAMPLES = Path(__file__).parents[2] / "recordings"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.h5"
    write_run(path)
    return path


def read_in(packages: tuple[str, ...], script: str, path: Path) -> object:
    """What ``script`` prints as JSON in a process of its own.

    netCDF4 and h5py bring an HDF5 library each, and one process does not always survive both.
    """
    for package in packages:
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", script, str(path)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


NETCDF = """
import json, sys, netCDF4
with netCDF4.Dataset(sys.argv[1]) as file:
    data, links = file["entry/data"], file["entry/instrument/channels"].variables
    print(json.dumps([
        data["time"].dimensions, data["displacement"].dimensions,
        data["displacement"][:].tolist(),
        {n: [v.dimensions, bool((v[:] == data[n + "_counts"][:]).all())] for n, v in links.items()},
    ]))
"""
LINKED = ("displacement", "voltage_command", "voltage_monitor", "current_monitor")


def test_netcdf4_opens_a_recording_and_follows_its_links(run: Path) -> None:
    assert read_in(("netCDF4",), NETCDF, run) == [
        ["time"], ["time"], open_recording(run).displacement.tolist(),
        {name: [["time"], True] for name in LINKED},
    ]  # fmt: skip


XARRAY = """
import json, sys, warnings, xarray
warnings.simplefilter("error")
with xarray.open_dataset(sys.argv[1], group={group!r}, engine={engine!r}) as found:
    found["time"].load()
    print(json.dumps([sorted(map(str, found.sizes)), found["time"].values.tolist()]))
"""
TREE = """
import json, sys, xarray
with xarray.open_datatree(sys.argv[1], engine={engine!r}) as tree:
    print(json.dumps(tree["entry/data/displacement"].values.tolist()))
"""
ENGINES = [None, "netcdf4", "h5netcdf"]


def packages_of(engine: str | None) -> tuple[str, ...]:
    return ("xarray", "h5netcdf" if engine == "h5netcdf" else "netCDF4")


@pytest.mark.parametrize("engine", mostly_deep(ENGINES, [None]))
@pytest.mark.parametrize("group", mostly_deep(["entry/data", "entry"], ["entry"]))
def test_xarray_opens_it_with_each_engine(run: Path, engine: str | None, group: str) -> None:
    script = XARRAY.format(group=group, engine=engine)
    sizes, time = read_in(packages_of(engine), script, run)
    assert time == open_recording(run).time.tolist()
    assert "time" in sizes
    assert not [name for name in sizes if name.startswith("phony")]


@pytest.mark.parametrize("engine", mostly_deep(ENGINES, []))
def test_xarray_opens_it_as_a_tree(run: Path, engine: str | None) -> None:
    found = read_in(packages_of(engine), TREE.format(engine=engine), run)
    assert found == open_recording(run).displacement.tolist()


SILX = """
import json, sys, silx.io
from silx.io.nxdata import get_default
with silx.io.open(sys.argv[1]) as file:
    found = get_default(file)
    print(json.dumps([found.signal.name, [a.name for a in found.axes if a is not None]]))
"""


def test_silx_plots_the_counts_of_a_live_run_and_the_displacement_of_a_finished_one(
    tmp_path: Path, run: Path
) -> None:
    recorder = writer(tmp_path / "live.h5")
    recorder.append(Block(0, run_counts(1500)))
    recorder._flush_all(1.8e9)
    try:
        live = read_in(("silx",), SILX, recorder.path)
        shutil.copyfile(recorder.path, tmp_path / "killed.h5")
    finally:
        recorder.discard()
    assert live == ["/entry/data/displacement_counts", []]
    path = tmp_path / "killed.h5"
    assert recover(path, now=lambda: path.stat().st_mtime + 60.0)
    for finished in (path, run):
        shown = read_in(("silx",), SILX, finished)
        assert shown == ["/entry/data/displacement", ["/entry/data/time"]]


def test_octave_loads_a_recording(run: Path) -> None:
    octave = shutil.which("octave-cli")
    if octave is None:
        pytest.skip("Octave is not installed")
    script = f"s = load('{run}'); printf('%d %s', numel(s.entry.data.displacement), s.entry.title)"
    done = subprocess.run(
        [octave, "--norc", "--eval", script], capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == f"{open_recording(run).samples} two lobes", done.stderr


def test_texts_are_ascii_where_they_can_be() -> None:
    for text, kind in (("two lobes", "ascii"), (["kV", "mm"], "ascii"), ("23 \u00b0C", "utf-8")):
        assert h5py.check_string_dtype(fixed(text).dtype).encoding == kind


def as_written_by_0_2(path: Path) -> None:
    with h5py.File(path, "r+", libver=("v110", "v110")) as file:
        entry = file["entry"]
        del entry["time"]
        for table, names in NUMBERED.items():
            for axis, name in enumerate(names):
                entry[table].dims[axis].detach_scale(entry[name])
                del entry[name]
            entry[table].make_scale(table)
        for one in entry["instrument"].values():
            if "settings" in one.attrs:
                rows = one.attrs["settings"]
                del one.attrs["settings"]
                one.create_dataset("settings", data=rows.reshape(-1, 2))


def test_recover_mends_the_dimensions_of_a_finished_recording_of_0_2(
    tmp_path: Path, run: Path
) -> None:
    path = tmp_path / "old.h5"
    shutil.copyfile(run, path)
    as_written_by_0_2(path)
    assert open_recording(path).instruments == open_recording(run).instruments
    assert verify(path).faults == []
    assert recover(path, now=lambda: path.stat().st_mtime + 60.0)
    assert not recover(path)
    assert verify(path).faults == []
    assert open_recording(path).complete
    test_netcdf4_opens_a_recording_and_follows_its_links(path)


@pytest.mark.parametrize("name", ["sample-plain.h5", "sample-hidden-effect.h5"])
def test_samples_of_an_earlier_version_are_read(name: str) -> None:
    found = open_recording(SAMPLES / name)
    assert found.samples > 1000
    assert verify(SAMPLES / name).faults == []
