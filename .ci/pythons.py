"""Run every check on each installed Python from 3.11 to 3.14, each in its own environment.

The environments are .venv-3.11 and so on. A Python that is not installed is named and left out.
Arguments go to pytest: ``python3 .ci/pythons.py tests/recording``.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from bootstrap import run

VERSIONS = ("3.11", "3.12", "3.13", "3.14")


def commands(version: str) -> Iterator[list[str]]:
    """Give the commands that may start Python ``version`` here."""
    yield [sys.executable]
    yield [f"python{version}"]
    yield ["py", f"-{version}"]  # the launcher of Windows
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    for folder in sorted((root / "versions").glob(f"{version}.*"), reverse=True):
        yield [str(folder / "bin" / "python")]


def find(version: str) -> str | None:
    """Return the path of an interpreter of ``version``, or None."""
    ask = "import sys; print(sys.version_info[:2] == (%s), sys.executable)"
    for command in commands(version):
        if shutil.which(command[0]) is None:
            continue
        answer = subprocess.run(
            [*command, "-c", ask % version.replace(".", ", ")],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        same, _, path = answer.stdout.strip().partition(" ")
        if same == "True":
            return path
    return None


def main() -> int:
    """Check every version; return 0 if all that are installed pass."""
    found = {version: find(version) for version in VERSIONS}
    codes: dict[str, int] = {}
    for version, python in found.items():
        if python is not None:
            print(f"== Python {version}: {python}", flush=True)
            check = [python, ".ci/check.py", "--venv", f".venv-{version}", *sys.argv[1:]]
            codes[version] = run(check)
    for version in VERSIONS:
        if version not in codes:
            print(f"Python {version}: not installed here, not checked")
        else:
            word = f"failed (exit code {codes[version]})" if codes[version] else "passed"
            print(f"Python {version}: {word}")
    return max(codes.values(), default=0)


if __name__ == "__main__":
    sys.exit(main())
