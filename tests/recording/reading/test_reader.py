"""What the reader refuses, and that it says what and where."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.drivers.rig import Block
from dearig.errors import InputError
from dearig.recording import RunMetadata, open_recording, save_recording
from tests.tools.recordings import Clock, run_counts, write_run, writer

N = 200


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("good") / "run.h5"
    write_run(path)
    return path


def film_values() -> dict[str, np.ndarray]:
    time = np.linspace(0.0, 10.0, N) ** 1.5
    return {"time": time, "stretch": 1.0 + time / 40.0, "nominal_stress": 1e3 * time}


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("good") / "film.h5"
    return save_recording(
        path, "film", film_values(), RunMetadata(title="pull"), kinematics="uniaxial", now=Clock()
    )


def attribute(where: str, name: str, value: object) -> Callable[[h5py.File], None]:
    return lambda file: file[where].attrs.__setitem__(name, value)


def value(name: str, at: int, number: float) -> Callable[[h5py.File], None]:
    return lambda file: file[f"entry/data/{name}"].__setitem__(at, number)


def removed(where: str) -> Callable[[h5py.File], None]:
    return lambda file: file.__delitem__(where)


def replaced(where: str, data: object) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[where]
        file[where] = data

    return change


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (attribute("/", "format", "dearig-recording/2"), r"format dearig-recording/2, .* newer"),
        (attribute("/", "format", "other/1"), "format 'other/1', not dearig-recording/1"),
        (lambda f: f.attrs.__delitem__("format"), "not a recording: it has no attribute format"),
        (attribute("entry", "kind", "spring"), "kind 'spring' of /entry is not one of actuator"),
        (removed("entry"), "group /entry is missing"),
        (removed("entry/data"), "group /entry/data is missing"),
        (removed("entry/sample"), "group /entry/sample is missing"),
        (removed("entry/data/displacement"), "/entry/data/displacement is missing"),
        (removed("entry/data/voltage_command"), "/entry/data/voltage_command is missing"),
        (
            replaced("entry/data/voltage_monitor", np.zeros(7)),
            "voltage_monitor has 7 samples, time 3",
        ),
        (replaced("entry/data/time", "noon"), "/entry/data/time is not a row of numbers"),
        (replaced("entry/data/time", np.zeros((3, 2))), "/entry/data/time is not a row of numbers"),
        (attribute("entry/data/displacement", "units", "mm"), "displacement is in 'mm'; .* in 'm'"),
        (attribute("entry/data/displacement", "skew_s", "soon"), r"bad\.h5 is damaged: could not"),
        (value("displacement", 17, np.nan), "displacement is nan at sample 17"),
        (value("current_monitor", 3, np.inf), "current_monitor is inf at sample 3"),
        (value("time", 40, 0.0), r"/entry/data/time goes back at sample 40 \(0 s\)"),
        (value("time", 41, 0.040), r"/entry/data/time stands still at sample 41 \(0\.04 s\)"),
        (attribute("entry/data", "kinematics", "twisted"), "kinematics 'twisted'"),
        (replaced("entry/sample/film/length", -1.0), "/entry/sample cannot be used: film: length"),
        (removed("entry/sample/load/mass"), "/entry/sample cannot be used"),
        (replaced("entry/events", np.zeros(3)), "/entry/events cannot be read"),
    ],
)
def test_refusals(
    tmp_path: Path, run: Path, change: Callable[[h5py.File], None], match: str
) -> None:
    path = tmp_path / "bad.h5"
    shutil.copyfile(run, path)
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(InputError, match=match) as caught:
        open_recording(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (removed("entry/data/stretch"), "/entry/data/stretch is missing"),
        (removed("entry/data/time"), "/entry/data/time is missing"),
        (value("stretch", 5, 0.0), "stretch is 0 at sample 5; a stretch is above 0"),
    ],
)
def test_refusals_of_film_data(
    tmp_path: Path, film: Path, change: Callable[[h5py.File], None], match: str
) -> None:
    path = tmp_path / "bad.h5"
    shutil.copyfile(film, path)
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(InputError, match=match):
        open_recording(path)


def test_files_that_are_no_recordings(tmp_path: Path, run: Path) -> None:
    with pytest.raises(InputError, match=r"none\.h5 is not there"):
        open_recording(tmp_path / "none.h5")
    with pytest.raises(InputError, match="is a folder"):
        open_recording(tmp_path)
    for content in (b"", b"time_s,voltage_V\n", run.read_bytes()[:20]):
        path = tmp_path / "text.h5"
        path.write_bytes(content)
        said = "is not an HDF5 file" if content else "is empty: its run or its program ended"
        with pytest.raises(InputError, match=rf"text\.h5 {said}"):
            open_recording(path)
    (tmp_path / "short.h5").write_bytes(run.read_bytes()[:-5000])
    with pytest.raises(InputError, match=r"short\.h5 is truncated"):
        open_recording(tmp_path / "short.h5")


def test_a_file_that_another_program_writes(tmp_path: Path) -> None:
    path, copy = tmp_path / "new.h5", tmp_path / "copy.h5"
    with h5py.File(path, "w", libver=("v110", "v110")) as file:
        file["x"] = 1
        file.flush()
        copy.write_bytes(path.read_bytes())
    with pytest.raises(InputError, match="is being written by another program, or was killed"):
        open_recording(copy)


def test_a_damaged_first_block_never_reaches_the_library(tmp_path: Path, run: Path) -> None:
    whole = run.read_bytes()
    path = tmp_path / "bad.h5"
    for at in range(48):
        raw = bytearray(whole)
        raw[at] ^= 0x10
        path.write_bytes(raw)
        with pytest.raises(InputError, match=r"bad\.h5 (is damaged|is not an HDF5|cannot be read)"):
            open_recording(path)


def test_damage_to_a_killed_run_is_told_at_once(tmp_path: Path) -> None:
    # the library's mode for such files would read the damaged place again for ever
    path, copy = tmp_path / "run.h5", tmp_path / "copy.h5"
    recorder = writer(path)
    recorder.append(Block(0, run_counts(200)))
    recorder._flush_all(1.8e9)
    whole = path.read_bytes()
    recorder.close()
    headers, damaged = [found.start() for found in re.finditer(b"OHDR", whole)], 0
    for at in headers[::2]:
        raw = bytearray(whole)
        raw[at + 30] ^= 0x10
        copy.write_bytes(raw)
        try:
            open_recording(copy)
        except InputError as error:
            assert "copy.h5" in str(error)  # noqa: PT017
            damaged += 1
    assert damaged > 10


def test_bytes_turned_anywhere_are_a_sentence_or_harmless(tmp_path: Path, film: Path) -> None:
    whole = film.read_bytes()
    rng = np.random.default_rng(5)
    refused = 0
    for _ in range(60):
        raw = bytearray(whole)
        for at in rng.integers(0, 8000, 4):
            raw[int(at) % len(raw)] ^= int(rng.integers(1, 256))
        path = tmp_path / "bad.h5"
        path.write_bytes(raw)
        try:
            open_recording(path)
        except InputError:
            refused += 1
    assert refused > 8


def test_film_recordings(film: Path) -> None:
    read = open_recording(film)
    assert (read.kind, read.kinematics, read.hold) == ("film", "uniaxial", False)
    assert read.film is None
    assert read.load is None
    assert read.displacement is None
    assert read.noise_floor is None
    assert not read.quiet.any()
    assert list(read.values) == ["time", "stretch", "nominal_stress"]
    assert read.signal is read.nominal_stress
    for name, expected in film_values().items():
        np.testing.assert_array_equal(getattr(read, name), expected)


def test_a_viewer_shows_stress_over_time(film: Path) -> None:
    pytest.importorskip("silx.io")
    from silx import io
    from silx.io import nxdata

    with io.open(str(film)) as file:
        plot = nxdata.get_default(file)
        assert plot.signal_name == "nominal stress (Pa)"
        assert plot.axes_names == ["time (s)"]


@pytest.mark.parametrize(
    ("kind", "change", "match"),
    [
        ("film", {"nominal_stress": None}, "missing .'nominal_stress'"),
        ("film", {"humidity": np.zeros(N)}, "unknown .'humidity'"),
        ("film", {"stretch": np.zeros(3)}, "rows of one length"),
        ("spring", {}, "kind 'spring'"),
    ],
)
def test_arrays_that_are_no_recording(
    tmp_path: Path, kind: str, change: dict[str, np.ndarray | None], match: str
) -> None:
    values = {n: v for n, v in (film_values() | change).items() if v is not None}
    with pytest.raises(ValueError, match=match):
        save_recording(tmp_path / "x.h5", kind, values, RunMetadata(title="x"))
    assert not list(tmp_path.iterdir())


def test_predictions_are_saved_with_their_sequence(tmp_path: Path) -> None:
    time = np.arange(100) / 100.0
    values = {"time": time, "displacement": time**2, "voltage_command": 1e3 * time}
    path = save_recording(
        tmp_path / "x.h5",
        "actuator",
        values,
        RunMetadata(
            title="predicted",
            sequence_toml='name = "x"\n',
            model_toml="mu = 1\n",
            provenance={"model": "model.toml"},
        ),
        hold=True,
        now=Clock(),
    )
    read = open_recording(path)
    assert read.hold
    assert (read.sequence_toml, read.model_toml) == ('name = "x"\n', "mu = 1\n")
    assert read.provenance["model"] == "model.toml"
    with pytest.raises(InputError, match="exists already"):
        save_recording(path, "actuator", values, RunMetadata(title="again"))
