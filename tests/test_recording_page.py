"""The page on the format is true: its reader runs with h5py alone."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from app.recording import open_recording
from tests.recording_tools import write_run

PAGE = Path(__file__).parents[1] / "recordings" / "README.md"


def test_the_ten_lines_on_the_page_read_a_recording(tmp_path: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert len(blocks) == 1
    assert len(blocks[0].strip().splitlines()) <= 10
    write_run(tmp_path / "run.h5")
    done = subprocess.run(
        [sys.executable, "-c", blocks[0]], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    run = open_recording(tmp_path / "run.h5")
    assert run.displacement is not None
    assert "actuator" in done.stdout
    assert f"{run.displacement.max() * 1e6:.1f} um" in done.stdout
    # the same from the counts
    assert len(set(re.findall(r"[\d.]+ um", done.stdout))) == 1


def test_importing_the_package_leaves_the_heavy_libraries_out() -> None:
    look = (
        "import sys, app.recording; "
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
