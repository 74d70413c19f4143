"""The command that writes measured results into dated files."""

from __future__ import annotations

import datetime
import sys
from pathlib import Path

import pytest

from tests.benchmarks.results import __main__ as results


def test_a_results_file_has_date_machine_versions_command_and_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = "tests.docs.printing 3"
    measured = results.Measurement("Speed of printing", (command,))
    monkeypatch.setitem(results.MEASUREMENTS, "kernel", measured)
    monkeypatch.setattr(sys, "argv", ["results", "kernel", "--out", str(tmp_path)])
    results.main()
    (file,) = tmp_path.iterdir()
    text = file.read_text(encoding="utf-8")
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    assert file.name == f"{today}-kernel.md"
    assert text.startswith("# Speed of printing\n")
    for part in (f"date: {today}", "revision: ", "machine: ", "Python ", f"python -m {command}"):
        assert part in text
    assert "```text\nthree lines\n```\n\n| a | b |\n|---|---|\n| 1 | 3 |" in text


def test_every_measurement_is_a_module_that_exists() -> None:
    for measurement in results.MEASUREMENTS.values():
        for command in measurement.commands:
            name = command.split()[0].replace(".", "/")
            assert (results.ROOT / f"{name}.py").is_file() or (
                results.ROOT / name / "__main__.py"
            ).is_file(), command
