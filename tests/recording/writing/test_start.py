"""Commands on recordings start without the packages of computations and of extras."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dearig.recording import open_recording
from tests.tools.recordings import run_counts, write_run

WITHOUT = """
import sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"scipy", "pyarrow", "xarray", "matplotlib"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Refuse())
from dearig.cli.main import main
main()
"""


@pytest.mark.deep
def test_info_export_and_import_work_without_scipy_and_pyarrow(tmp_path: Path) -> None:
    run = tmp_path / "run.h5"
    write_run(run, run_counts(300, quiet=100))
    for arguments in (
        ("info", "run.h5"),
        ("export", "run.h5", "--to", "csv"),
        ("import", "run.csv", "--out", "again.h5"),
    ):
        done = subprocess.run(
            [sys.executable, "-c", WITHOUT, *arguments],
            cwd=tmp_path, capture_output=True, text=True, check=False,
            env=os.environ | {"PYTHONUTF8": "1"},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    again = open_recording(tmp_path / "again.h5")
    np.testing.assert_array_equal(again.voltage_command, open_recording(run).voltage_command)
