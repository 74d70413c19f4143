"""Run all tests from a fresh checkout; installs what they need first."""

import sys
from pathlib import Path

from bootstrap import prepare, prepare_screen, run, start, wait

# ctrl-C ends this process, which ends those that it has started
DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
# the search for garbage takes a seventh of a compilation; without it memory grows to 1.4 GB
QUICK = "import gc; gc.disable()\n"
# Two processes that find no kernels would compile them twice: each compiles half of what both need,
# in the order in which these imports made them, and then its own.
HALF = "from tests.tools.fit_kernels import compile_fit_kernels, compile_half; compile_half({})\n"
RUNS = HALF.format(0) + "from dearig.acquisition.warm_up import compile_kernels; compile_kernels()"
# and a process that only collects leaves compiled modules to those that run
FITS = (
    HALF.format(1)
    + """
compile_fit_kernels()
import pytest
pytest.main(["--collect-only", "-qq"])
"""
)
COLD = "import sys; from dearig.acquisition.warm_up import is_warm; sys.exit(not is_warm())"


def compile_all(python: Path) -> int:
    """Compile the kernels of runs and of fits in two processes; return an exit code."""
    if not run([str(python), "-c", COLD]):
        return 0
    print("Compiling the numerical kernels, once for these sources ...", flush=True)
    # numba colours each message of an overload that it tries, though nobody reads them
    plain = {"NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING": "1"}
    commands = ([str(python), "-c", DEAF + QUICK + code] for code in (RUNS, FITS))
    return wait(*(start(command, quiet=True, **plain) for command in commands))


def test(python: Path, *arguments: str) -> int:
    """Run pytest with ``python``, and return its exit code."""
    prepare_screen(python)
    if code := compile_all(python):
        return code
    return run(
        # The tests of a file run in one process, so that fixtures are made once. Tests wait for
        # rigs and windows about a third of the time, so a third process keeps two cores busy.
        [str(python), "-m", "pytest", "-n", "3", "--dist", "loadfile", *arguments],
        # threads of linear algebra would wait for each other
        OPENBLAS_NUM_THREADS="1",
    )


if __name__ == "__main__":
    sys.exit(test(prepare("test"), *sys.argv[1:]))
