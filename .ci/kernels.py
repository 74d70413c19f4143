"""Compile the numerical kernels in two processes, once for these sources."""

import subprocess
from pathlib import Path

from bootstrap import run, start

__all__ = ["start_compiling"]

# ctrl-C ends these at once and without a traceback
MORTAL = "import signal; signal.signal(signal.SIGINT, signal.SIG_DFL)\n"
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
    if not run([str(python), "-c", COLD]):
        return []
    print("Compiling the numerical kernels, once for these sources ...", flush=True)
    # numba colours each message of an overload that it tries, though nobody reads them
    plain = {"NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING": "1"}
    commands = ([str(python), "-c", MORTAL + QUICK + code] for code in (RUNS, FITS))
    return [start(command, quiet=True, **plain) for command in commands]
