"""Check the code without running it: linter, formatter, types, layers.

The Python that runs this is used. The links of .ci/links.py are made again first: on Windows they
are hard links where the system allows no symbolic ones, and a program that saves a file by
replacing it leaves them stale.
"""

import sys
from pathlib import Path

from bootstrap import start, wait
from links import make

# Two processes check types in half the time. On a busy machine they may not find each other, which
# mypy reports by its code 2, as it does its own mistakes: one process then has the last word.
TYPES = """
import subprocess, sys
mypy = [sys.executable, "-m", "mypy"]
code = subprocess.call([*mypy, "--num-workers", "2"])
sys.exit(subprocess.call(mypy) if code == 2 else code)
"""
#: The commands, each with its name.
CHECKS = {
    "linter": ["-m", "ruff", "check", "."],
    "formatter": ["-m", "ruff", "format", "--check", "."],
    "types": ["-c", TYPES],
    # lint-imports as a call, which is the same on every system
    "layers": ["-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"],
}


def check(python: Path, *names: str) -> int:
    """Run the checks of these ``names``, or all, at once; return the first exit code but 0."""
    links = str(make())
    return wait(*(start([str(python), *CHECKS[n]], PYTHONPATH=links) for n in names or CHECKS))


if __name__ == "__main__":
    sys.exit(check(Path(sys.executable), *sys.argv[1:]))
