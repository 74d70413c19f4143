"""Run all tests from a fresh checkout; installs what they need first."""

import subprocess
import sys
from pathlib import Path

from bootstrap import VENV, prepare, prepare_screen, run, start, wait
from links import make

# ctrl-C ends this process, which ends those that it has started
DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
# the search for garbage takes a seventh of a compilation; without it memory grows to 1.4 GB
QUICK = "import gc; gc.disable()\n"
# Two processes that find no kernels would compile them twice: each compiles half of what both need,
# in the order in which these imports made them, and then its own.
HALF = """
import sys
sys.path.append("tests/tools")  # the package of the tests needs pytest
from fit_kernels import compile_fit_kernels, compile_some
compile_some({}, 2)
"""
RUNS = HALF.format(0) + "from dearig.acquisition.warm_up import compile_kernels; compile_kernels()"
FITS = HALF.format(1) + "compile_fit_kernels()"
COLD = "import sys; from dearig.acquisition.warm_up import is_warm; sys.exit(not is_warm())"


def start_compiling(python: Path) -> list[subprocess.Popen[bytes]]:
    """Start two processes that compile the kernels of runs and of fits, where there are none."""
    # the project itself may still have to be installed
    found = {"PYTHONPATH": str(make())}
    if not run([str(python), "-c", COLD], **found):
        return []
    print("Compiling the numerical kernels, once for these sources ...", flush=True)
    # numba colours each message of an overload that it tries, though nobody reads them
    found["NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING"] = "1"
    commands = ([str(python), "-c", DEAF + QUICK + code] for code in (RUNS, FITS))
    return [start(command, quiet=True, **found) for command in commands]


def prepare_all(venv: Path) -> tuple[Path, int]:
    """Install what the tests need and compile the kernels; return the Python and an exit code."""
    compiling: list[subprocess.Popen[bytes]] = []
    try:
        python = prepare("test", venv, lambda python: compiling.extend(start_compiling(python)))
        prepare_screen(python)
        if compiling:
            # a process that only collects leaves compiled modules to those that run
            collect = [str(python), "-m", "pytest", "--collect-only", "-qq"]
            compiling.append(start(collect, quiet=True))
        return python, wait(*compiling)
    except BaseException:
        for command in compiling:
            command.kill()
        raise


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
