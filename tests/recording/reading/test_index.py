"""A folder of recordings, looked at once and then only where it changed."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.drivers.rig import Block
from dearig.errors import InputError
from dearig.model.compiled.trusted_folder import CacheFolder
from dearig.recording import RunMetadata, save_recording
from dearig.recording.content.timestamps import local_time
from dearig.recording.reading import index as index_module
from dearig.recording.reading.index import OUTLINE, Entry, index_folder, lines
from tests.recording.reading.test_reader import film_values
from tests.tools.command import dearig
from tests.tools.recordings import Clock, run_counts, write_run, writer


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shelf")
    (folder / "day 1").mkdir()
    write_run(folder / "day 1" / "run.h5")
    save_recording(
        folder / "film.h5", "film", film_values(), RunMetadata(title="pull"), now=Clock(1.7e9)
    )
    recorder = writer(folder / "other.h5")
    recorder.append(Block(0, run_counts(500)))
    recorder._flush_all(1.8e9)
    shutil.copyfile(folder / "other.h5", folder / "killed.nxs")
    recorder.discard()
    (folder / "text.h5").write_text("no recording")
    (folder / "notes.txt").write_text("not looked at")
    return folder


def test_what_lies_in_a_folder(shelf: Path, tmp_path: Path) -> None:
    found = {entry.path: entry for entry in index_folder(shelf, cache=tmp_path / "c.json")}
    assert list(found) == ["day 1/run.h5", "film.h5", "killed.nxs", "text.h5"]
    run = found["day 1/run.h5"]
    assert (run.kind, run.title, run.samples, run.duration_s) == (
        "actuator", "two lobes", 3000, 2.999,
    )  # fmt: skip
    assert run.complete
    assert run.texts == {
        "film_id": "film 3", "rig": "sim:7", "operator": "Ada", "notes": "second day",
    }  # fmt: skip
    assert run.start_time.startswith("2027-01-15T08:00:00")
    with h5py.File(shelf / run.path) as file:
        data = file["entry/data"]
        for name in ("voltage_command", "displacement"):
            values = data[name][()]
            assert run.peaks[name] == pytest.approx(values[np.argmax(np.abs(values))], rel=1e-9)
    assert run.identifier
    assert len(run.outline) == 4 * OUTLINE
    assert set(found["film.h5"].peaks) == {"stretch", "nominal_stress"}
    assert run.bytes == (shelf / run.path).stat().st_size
    assert (found["film.h5"].kind, found["film.h5"].samples) == ("film", 200)
    assert found["film.h5"].duration_s == pytest.approx(10.0**1.5)
    killed = found["killed.nxs"]
    assert (killed.samples, killed.complete) == (500, False)
    assert killed.outcome == "killed, or still running"
    assert "is not an HDF5 file" in found["text.h5"].trouble


def test_only_what_changed_is_opened_again(
    shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, cache = tmp_path / "shelf", tmp_path / "c.json"
    shutil.copytree(shelf, folder)
    looked: list[str] = []
    real = index_module.glance

    def glance(path: Path, name: str, size: int) -> Entry:
        looked.append(name)
        return real(path, name, size)

    monkeypatch.setattr(index_module, "glance", glance)
    first = index_folder(folder, cache=cache)
    assert len(looked) == 4
    assert index_folder(folder, cache=cache) == first
    assert len(looked) == 4
    (folder / "text.h5").write_text("still none")
    (folder / "film.h5").unlink()
    parts: list[float] = []
    assert len(index_folder(folder, parts.append, cache)) == 3
    assert looked[4:] == ["text.h5"]
    assert parts == [1.0]
    for broken in ("", "[]", '{"format": "dearig-index/0"}', json.dumps({"format": "x"}), "[" * 9):
        cache.write_text(broken)
        assert len(index_folder(folder, cache=cache)) == 3
    assert len(looked) == 5 + 5 * 3


def test_a_cache_that_cannot_be_kept_is_no_reason_to_fail(shelf: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert len(index_folder(shelf, cache=tmp_path / "file" / "c.json")) == 4


def test_folders_that_cannot_be_looked_at(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere is not there"):
        index_folder(tmp_path / "nowhere", cache=tmp_path / "c.json")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file is not a folder"):
        index_folder(tmp_path / "file", cache=tmp_path / "c.json")
    assert lines(index_folder(tmp_path, cache=tmp_path / "c.json")) == ["no recordings"]
    (tmp_path / "moved.h5").symlink_to(tmp_path / "away.h5")
    (lost,) = index_folder(tmp_path, cache=tmp_path / "c.json")
    assert lost.path == "moved.h5"
    assert lost.trouble.endswith("moved.h5 is a link to a file that is not there")


def test_the_command(shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cache").mkdir()
    monkeypatch.setattr(index_module, "cache_root", lambda: CacheFolder(tmp_path / "cache"))
    answer = dearig("index", shelf, "--json", "-")
    assert answer.code == 0
    assert [e["path"] for e in answer.json["recordings"]] == [
        "text.h5", "film.h5", "day 1/run.h5", "killed.nxs",
    ]  # fmt: skip
    told = dearig("index", shelf).out.splitlines()
    assert told[0].startswith("not read")
    assert told[2] == (
        f"{local_time('2027-01-15T08:00:00+00:00')}     2.999 s  day 1/run.h5: two lobes, "
        f"6.1 kV, 11 mm, film 3, sim:7, Ada"
    )
    assert told[3].endswith("INCOMPLETE: killed, or still running")
    assert dearig("index", tmp_path / "no").code == 2
    assert len(list((tmp_path / "cache").iterdir())) == 1


def test_a_file_that_could_not_be_read_for_a_moment_is_read_again(
    shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, cache = tmp_path / "shelf", tmp_path / "c.json"
    shutil.copytree(shelf, folder)
    real = Path.open

    def refuse(path: Path, *args: object, **options: object) -> object:
        if path.name == "film.h5":
            raise PermissionError(13, "Permission denied")
        return real(path, *args, **options)  # type: ignore[call-overload]

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", refuse)
        found = {entry.path: entry for entry in index_folder(folder, cache=cache)}
        assert found["film.h5"].trouble.endswith("cannot be read: Permission denied")
    found = {entry.path: entry for entry in index_folder(folder, cache=cache)}
    assert found["film.h5"].title == "pull"


def test_a_folder_that_cannot_be_read_is_one_line(
    shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "shelf"
    shutil.copytree(shelf, folder)
    (folder / "other").mkdir()
    real = os.scandir

    def refuse(path: Path) -> object:
        if Path(path).name == "other":
            raise PermissionError(13, "Permission denied")
        return real(path)

    monkeypatch.setattr(os, "scandir", refuse)
    answer = dearig("index", folder)
    assert answer.code == 0
    assert len(answer.out.splitlines()) == 5
    assert f"other/: {folder / 'other'} cannot be read: Permission denied" in answer.out
    with pytest.raises(InputError, match="other cannot be read"):
        index_folder(folder / "other", cache=tmp_path / "c.json")


@pytest.mark.parametrize("key", ["samples", "duration_s", "title", "complete"])
def test_a_cache_of_another_kind_is_not_believed(shelf: Path, tmp_path: Path, key: str) -> None:
    cache = tmp_path / "c.json"
    first = index_folder(shelf, cache=cache)
    kept = json.loads(cache.read_text("utf-8"))
    kept["files"][1][3][key] = ["wrong"]
    cache.write_text(json.dumps(kept), "utf-8")
    assert lines(index_folder(shelf, cache=cache)) == lines(first)
