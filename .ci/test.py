"""Run all tests from a fresh checkout; installs what they need first."""

import sys
from pathlib import Path

from bootstrap import prepare, prepare_screen, run


def test(python: Path, *arguments: str) -> int:
    """Run pytest with ``python`` on two processes, and return its exit code."""
    prepare_screen(python)
    return run(
        [str(python), "-m", "pytest", "-n", "2", *arguments],
        # two processes have two cores: threads of linear algebra would wait for each other
        OPENBLAS_NUM_THREADS="1",
    )


if __name__ == "__main__":
    sys.exit(test(prepare("test"), *sys.argv[1:]))
