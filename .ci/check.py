"""Run every check that a change has to pass: tests, linter, formatter, types, layers.

``--venv DIR`` names another environment than .venv; other arguments go to pytest.
"""

import argparse
import sys
from pathlib import Path

from bootstrap import ROOT, VENV, prepare, run
from links import make
from test import test

#: lint-imports as a module call, which is the same on every system.
LAYERS = "from importlinter.cli import lint_imports_command; lint_imports_command()"


def check(venv: Path, *arguments: str) -> int:
    """Run all checks in ``venv``; return the exit code of the first that fails, or 0."""
    python = prepare("test", venv)
    if code := test(python, *arguments):
        return code
    links = make()
    for command in (
        ["-m", "ruff", "check", "."],
        ["-m", "ruff", "format", "--check", "."],
        ["-m", "mypy"],
        ["-c", LAYERS],
    ):
        if code := run([str(python), *command], PYTHONPATH=str(links)):
            return code
    return 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--venv", type=Path, default=VENV)
    options, others = parser.parse_known_args()
    sys.exit(check(ROOT / options.venv, *others))
