"""A distribution that is made in a folder, and a program that runs with it installed."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from collections.abc import Mapping
from pathlib import Path

__all__ = ["run_with_distribution"]


def run_with_distribution(
    folder: Path, files: Mapping[str, str], entry_points: Mapping[str, Mapping[str, str]], code: str
) -> str:
    """Return what ``code`` prints where a distribution ``made`` is installed.

    ``files`` are its modules, ``entry_points`` its entry points: group, name, object.
    """
    site = folder / "site"
    described = site / "made-1.0.dist-info"
    described.mkdir(parents=True)
    for name, text in files.items():
        (site / name).write_text(text, encoding="utf-8")
    (described / "METADATA").write_text("Metadata-Version: 2.1\nName: made\nVersion: 1.0\n")
    lines = []
    for group, points in entry_points.items():
        lines += [f"[{group}]", *(f"{name} = {value}" for name, value in points.items())]
    (described / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    path = os.pathsep.join((str(site), os.environ.get("PYTHONPATH", ""))).rstrip(os.pathsep)
    run = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        env=os.environ | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"},
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if run.returncode:
        raise AssertionError(f"the program ended with {run.returncode}:\n{run.stderr}")
    return run.stdout
