"""A file that is not what it claims is found out, and told in words."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import h5py
import pytest

from dearig.drivers.rig import Block
from dearig.errors import InputError
from dearig.recording import RunMetadata, open_recording, save_recording
from dearig.recording.content.text import fixed
from dearig.recording.verify import verify
from tests.recording.reading.test_reader import attribute, film_values, removed, value
from tests.tools.command import dearig
from tests.tools.recordings import IDENTITY, Clock, run_counts, write_run, writer

N = 70_000


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("good") / "run.h5"
    write_run(path, run_counts(N))
    return path


def test_a_sound_run(run: Path) -> None:
    found = verify(run)
    assert (found.faults, found.notes) == ([], [])
    assert "checksums of the counts of 70000 samples" in found.checked


def test_sound_imported_data(tmp_path: Path) -> None:
    path = save_recording(
        tmp_path / "x.h5", "film", film_values(), RunMetadata(title="x"), now=Clock()
    )
    assert (verify(path).faults, verify(path).notes) == ([], [])


def cut(name: str, samples: int) -> Callable[[h5py.File], None]:
    return lambda file: file[f"entry/data/{name}_counts"].resize((samples,))


def row(where: str, at: int, column: str, number: float) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        rows = file[where][()]
        rows[column][at] = number
        file[where][...] = rows

    return change


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (
            value("displacement_counts", 66_000, 7),
            r"counts of displacement are not those .*: samples 65536 to 69999 \(65\.536 to 70 s\)",
        ),
        (value("displacement_counts", 3, 7), "displacement does not agree with its counts"),
        (
            value("voltage_monitor", 9, 4.5),
            "voltage_monitor does not agree with its counts: 4.5 at",
        ),
        (value("time", 10, 0.0101), "time does not agree with its counts"),
        (
            lambda f: f["entry/pyramid/bins_of_64"].__setitem__((5, 0, 0), -9),
            "pyramid does not agree with the counts",
        ),
        (lambda f: f["entry/pyramid/bins_of_64"].resize(3, axis=0), "pyramid has 3 bins of 64"),
        (lambda f: f["entry/checksums"].resize(1, axis=0), "the last 4464 samples have no checksu"),
        (attribute("entry", "samples", 69_000), "claims 69000 samples and holds 70000"),
        (
            attribute("entry/data", "samples_expected", 80_000),
            "finished, but there are only 70000 of 80000",
        ),
        (cut("voltage_monitor", 69_999), "voltage_monitor has 69999 counts, not 70000"),
        (
            attribute("entry/data/displacement_counts", "rest_reading", 0.1),
            "displacement is counted from 0.1 m",
        ),
        (row("entry/events", 0, "sample", 70_001), "is at sample 70001, which does not exist"),
        (row("entry/events", 0, "time", 2.0), "is at 2 s, and its sample 510 at 0.51 s"),
        (
            row("entry/wall_clock", 0, "sample", 70_001),
            "wall_clock has sample numbers that go back",
        ),
        (row("entry/events", 0, "sample", -1), "is at sample -1, which does not exist"),
        (row("entry/events", 0, "time", float("nan")), "is at nan s, and its sample 510"),
        (
            lambda f: f["entry/events"].resize((20,)),
            "19 of 20 events are empty",
        ),
        (removed("entry/events"), "/entry/events is missing"),
        (lambda f: f["entry/wall_clock"].resize(500, axis=0), "wall_clock has 500 rows, of which"),
        (lambda f: f["entry/wall_clock"].resize(1, axis=0), "wall_clock ends at sample 0, and the"),
        (row("entry/wall_clock", 0, "sample", -1), "wall_clock has sample numbers that go back"),
        (row("entry/wall_clock", 0, "unix_time", -5.0), "wall_clock has times that are impossible"),
        (row("entry/wall_clock", 0, "unix_time", 1.0e9), "the computer's clock said 2001-09-09"),
        (attribute("entry/data/displacement_counts", "rest_samples", -1), "a lead-in of -1 sample"),
        (attribute("entry/data/displacement", "rest_reading", 0.1), "rest_reading = 0.1, and its"),
        (attribute("entry/data/voltage_monitor_counts", "skew_s", -1.0), "skew_s = -1 is impossib"),
        (attribute("entry/data/voltage_monitor", "delay_s", 2.0), "delay_s = 2, and its counts ha"),
        (attribute("entry/pyramid/bins_of_64", "bin_samples", 7), "claims bins of 7 samples"),
        (removed("entry/data/current_monitor"), "current_monitor is missing"),
        (lambda f: f["entry"].attrs.__delitem__("samples"), "values, but no number of samples"),
        (
            attribute("entry/provenance", "start_time", fixed("2001-01-01T00:00:00+00:00")),
            "says that the run started at 2001",
        ),
        (
            attribute("entry/provenance", "configuration_sha256", fixed("0" * 64)),
            "does not have the SHA-256",
        ),
        (attribute("entry", "default", fixed("plot")), "names 'plot' as its default plot"),
        (attribute("entry/data", "signal", fixed("force")), "no plot of displacement over time"),
        (removed("entry/sample"), "the group /entry/sample is missing"),
    ],
)
def test_what_is_wrong_is_said(
    tmp_path: Path, run: Path, change: Callable[[h5py.File], None], match: str
) -> None:
    path = tmp_path / "bad.h5"
    shutil.copyfile(run, path)
    with h5py.File(path, "r+") as file:
        change(file)
    found = verify(path)
    assert not found.sound
    assert any(re.search(match, fault) for fault in found.faults), found.faults


@pytest.mark.parametrize("name", ["displacement", "voltage_command_counts"])
def test_a_byte_turned_on_the_disk_is_found(tmp_path: Path, run: Path, name: str) -> None:
    path = tmp_path / "bad.h5"
    raw = bytearray(run.read_bytes())
    with h5py.File(run) as file:
        at = file[f"entry/data/{name}"].id.get_chunk_info(0).byte_offset
    raw[at + 1000] ^= 0x40
    path.write_bytes(raw)
    found = verify(path)
    assert not found.sound
    assert any("checksum" in fault for fault in found.faults), found.faults


def test_what_a_killed_run_cannot_claim_is_noted(tmp_path: Path) -> None:
    path, copy = tmp_path / "run.h5", tmp_path / "copy.h5"
    clock = Clock()
    recorder = writer(path, now=clock)
    clock.moment += 1.0
    recorder.append(Block(0, run_counts(70_000)))
    recorder.event(70_000, "fault", "amplifier tripped")
    clock.moment += 1.0
    recorder.event(70_000, "info", "on again")
    copy.write_bytes(path.read_bytes())
    recorder.close()
    found = verify(copy)
    assert found.faults == []
    assert found.notes == [
        "the last 4464 samples have no checksum yet: the run was killed before it was written",
        "it was killed, or is being written; recover it to repair it",
        "the run is incomplete: killed, or still running",
        "fault at sample 70000 (70 s): amplifier tripped",
    ]


def test_clocks_that_disagree(tmp_path: Path) -> None:
    clock = Clock()
    path = tmp_path / "run.h5"
    identity = replace(IDENTITY, simulated=False)
    run = {"rate_Hz": 100.0, "samples_expected": 3000, "now": clock}
    with writer(path, identity=identity, **run) as recorder:
        counts = run_counts(3000)
        for i in range(30):
            clock.moment += 1.05
            recorder.append(Block(100 * i, counts[:, 100 * i : 100 * i + 100]))
    assert any("counted 29 s and the computer's clock 30.45 s" in f for f in verify(path).faults)


def test_the_command_says_it_and_ends_with_4(tmp_path: Path, run: Path) -> None:
    good = dearig("info", "--verify", run, "--json", "-")
    assert good.code == 0
    assert good.json["sound"]
    path = tmp_path / "bad.h5"
    shutil.copyfile(run, path)
    with h5py.File(path, "r+") as file:
        file["entry/data/displacement_counts"][1] = 77
    bad = dearig("info", path, "--verify", "--json", "-")
    assert bad.code == 4
    assert not bad.json["sound"]
    assert bad.json["format"] == "dearig-verification/1"
    assert "displacement" in bad.json["faults"][0]
    assert "WRONG: the counts of displacement" in dearig("info", path, "--verify").out
    assert dearig("info", tmp_path / "none.h5", "--verify").code == 2


def test_a_file_that_vanishes_while_it_is_read_is_not_there_and_not_wrong(
    tmp_path: Path, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Path(shutil.copy(run, tmp_path / "run.h5"))

    def vanishing(path: Path) -> object:
        path.unlink()
        return open_recording(path)

    monkeypatch.setattr(import_module("dearig.recording.verify"), "open_recording", vanishing)
    with pytest.raises(InputError, match=r"run\.h5 is not there"):
        verify(path)
