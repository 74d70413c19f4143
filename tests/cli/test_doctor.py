"""``dearig doctor``: what is installed, where files go, what is missing."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

import pytest

from tests.tools.command import dearig, done, strict_json, write


def items(section: str) -> dict[str, dict[str, str]]:
    found = done("doctor", "--json", "-").json
    assert found["format"] == "dearig-doctor/1"
    return {i["name"]: i for i in found["items"] if i["section"] == section}


def test_versions_and_packages() -> None:
    programs = items("programs")
    assert programs["dearig"]["found"].startswith(metadata.version("dearig"))
    assert sys.version.split()[0] in programs["Python"]["found"]
    packages = items("packages")
    assert packages["h5py"] == {
        "section": "packages", "name": "h5py", "found": metadata.version("h5py"),
        "verdict": "ok", "advice": "",
    }  # fmt: skip
    assert "nidaqmx" not in packages  # belongs to an extra


def hide(monkeypatch: pytest.MonkeyPatch, *, version: Callable[[str], str]) -> None:
    monkeypatch.setattr(metadata, "version", version)


def test_a_missing_extra_comes_with_the_command_that_installs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of = metadata.version

    def version(package: str) -> str:
        if package == "pyqtgraph":
            raise metadata.PackageNotFoundError(package)
        return of(package)

    hide(monkeypatch, version=version)
    gui = items("extras")["gui"]
    assert (gui["verdict"], gui["advice"]) == ("missing", 'pip install "dearig[gui]"')
    assert gui["found"] == "pyqtgraph is not installed"
    assert done("doctor", "--json", "-").json["ok"] is True


def test_a_package_that_is_too_old_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    of = metadata.version
    hide(monkeypatch, version=lambda package: "2.0" if package == "h5py" else of(package))
    h5py = items("packages")["h5py"]
    assert h5py["verdict"] == "wrong"
    assert h5py["found"].startswith("h5py is 2.0, and >=")
    assert 'pip install "h5py>=' in h5py["advice"]
    assert done("doctor", "--json", "-").json["ok"] is False


def test_folders_are_named_and_a_locked_one_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DEARIG_LOG_DIR", str(tmp_path / "log" / "deep"))
    folders = items("folders")
    assert str(tmp_path / "log" / "deep") in folders["log"]["found"]
    assert folders["log"]["verdict"] == "ok"
    assert folders["disk"]["found"].split()[1] == "GB"
    allowed = os.access
    monkeypatch.setattr(
        "dearig.cli.doctor.os.access",
        lambda path, mode: Path(path) != tmp_path and allowed(path, mode),
    )
    monkeypatch.chdir(tmp_path)
    here = items("folders")["current folder"]
    assert here["verdict"] == "wrong"
    assert f"{tmp_path} cannot be written" in here["found"]


def test_the_kernel_cache_is_named() -> None:
    from dearig.model.compiled.jit import cache_folder

    assert str(cache_folder()) in items("kernels")["compiled kernels"]["found"]


@pytest.mark.deep
def test_a_plug_in_that_fails_is_told_with_the_reason(tmp_path: Path) -> None:
    """Of another distribution, as pip would have installed it; seen by a process of its own."""
    about = tmp_path / "other-1.2.dist-info"
    about.mkdir()
    write(about / "METADATA", "Metadata-Version: 2.1\nName: other\nVersion: 1.2\n")
    write(
        about / "entry_points.txt",
        "[dearig.exporters]\ntxt = other_good:EXPORTER\n"
        "[dearig.segments]\nwobble = other_broken:SEGMENT\n",
    )
    write(tmp_path / "other_good.py", "from dearig.recording.exporters.csv_file import EXPORTER\n")
    write(tmp_path / "other_broken.py", "raise RuntimeError('no such wobble')\n")
    ended = subprocess.run(
        [sys.executable, "-m", "dearig", "doctor", "--json", "-"],
        capture_output=True, text=True, check=False, timeout=200,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    found = {item["name"]: item for item in strict_json(ended.stdout)["items"]}
    good, bad = found["exporters: txt"], found["segments: wobble"]
    assert (good["verdict"], good["found"]) == ("ok", "other_good:EXPORTER of other 1.2")
    assert bad["verdict"] == "wrong"
    assert "of other is left out: no such wobble" in bad["found"]


def test_what_is_broken_does_not_end_the_examination(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> Path:
        raise RuntimeError("numba is damaged")

    monkeypatch.setattr("dearig.model.compiled.jit.cache_folder", broken)
    answer = done("doctor")
    assert "numba is damaged" in answer.out
    assert "plug-ins" in answer.out or "card" in answer.out


def test_without_json_it_is_a_table_for_people() -> None:
    answer = dearig("doctor")
    assert answer.code == 0
    for heading in ("programs", "extras", "folders", "kernels", "card", "window"):
        assert f"{heading} " in answer.out
