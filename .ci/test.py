"""Run all tests from a fresh checkout; installs what they need first."""

import sys
from pathlib import Path

from bootstrap import VENV, prepare, prepare_screen, run, start, wait
from kernels import start_compiling


def prepare_all(venv: Path) -> tuple[Path, int]:
    """Install what the tests need and compile the kernels; return the Python and an exit code."""
    python = prepare("test", venv)
    compiling = start_compiling(python)
    collecting = []
    try:
        prepare_screen(python)
        if compiling:
            # a process that only collects leaves compiled modules to those that run
            collect = [str(python), "-m", "pytest", "--collect-only", "-qq"]
            collecting.append(start(collect, quiet=True))
        code = wait(*compiling)
        wait(*collecting)  # what it could not collect, the tests report
    except BaseException:
        for command in [*compiling, *collecting]:
            command.kill()
        raise
    return python, code


def test(python: Path, *arguments: str) -> int:
    """Run pytest with ``python``, and return its exit code."""
    return run(
        # The tests of a file run in one process, so that fixtures are made once. Tests wait for
        # rigs and windows about a third of the time, so a third process keeps two cores busy.
        [str(python), "-m", "pytest", "-n", "3", "--dist", "loadfile", *arguments],
        # threads of linear algebra would wait for each other
        OPENBLAS_NUM_THREADS="1",
    )


if __name__ == "__main__":
    python, code = prepare_all(VENV)
    sys.exit(code or test(python, *sys.argv[1:]))
