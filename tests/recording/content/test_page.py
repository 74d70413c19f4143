"""The page on the format is true: its reader runs with h5py alone."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from dearig.recording import open_recording
from dearig.recording.verify import verify
from tests.make_samples import LARGEST, SAMPLES
from tests.tools.recordings import write_run

PAGE = Path(__file__).parents[3] / "recordings" / "README.md"


def code() -> list[str]:
    return re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)


def ran(block: str, folder: Path) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [sys.executable, "-c", block], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.parametrize("long", [False, True])
def test_the_ten_lines_on_the_page_read_a_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, long: bool
) -> None:
    if long:
        monkeypatch.setattr("dearig.recording.writing.finish.PHYSICAL_MAX", 1000)
    (block,) = [block for block in code() if "import h5py" in block]
    assert len(block.strip().splitlines()) <= 10
    write_run(tmp_path / "run.h5")
    done = ran(block, tmp_path)
    run = open_recording(tmp_path / "run.h5")
    assert run.displacement is not None
    assert "actuator" in done.stdout
    assert f"{run.displacement.max() * 1e6:.1f} um" in done.stdout
    said = re.findall(r"[\d.]+ um", done.stdout)
    # from the counts, and the same as it is stored
    assert len(said) == (1 if long else 2)
    assert len(set(said)) == 1


def test_the_lines_for_xarray_read_a_recording(tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    (block,) = [block for block in code() if "import xarray" in block]
    write_run(tmp_path / "run.h5")
    assert "time" in ran(block, tmp_path).stdout


def test_the_samples_are_what_the_page_says() -> None:
    plain, hidden = (open_recording(PAGE.parent / name) for name, *_ in SAMPLES)
    for sample, (name, rig, seed) in zip((plain, hidden), SAMPLES, strict=True):
        assert name in PAGE.read_text("utf-8")
        assert verify(sample.path).faults == []
        assert sample.path.stat().st_size <= LARGEST
        assert (sample.provenance["rig"], sample.provenance["seed"]) == (rig, int(seed))
        assert sample.provenance["host"] == "sample"


def test_importing_the_package_leaves_the_heavy_libraries_out() -> None:
    look = (
        "import sys, dearig.recording; "
        "print([m for m in ('pyarrow', 'scipy.io', 'nptdms') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", look],
        cwd=PAGE.parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "[]"
