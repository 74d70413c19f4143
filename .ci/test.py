"""Run all tests from a fresh checkout; installs what they need first."""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from bootstrap import prepare, prepare_screen, run

# two processes that find no kernels would compile them twice
RUNS = "from dearig.acquisition.warm_up import compile_kernels; compile_kernels()"
# and a process that only collects leaves compiled modules to those that run
FITS = """
import pytest
from tests.tools.fit_kernels import compile_fit_kernels

compile_fit_kernels()
pytest.main(["--collect-only", "-qq"])
"""
COLD = "import sys; from dearig.acquisition.warm_up import is_warm; sys.exit(not is_warm())"


def compile_all(python: Path) -> int:
    """Compile the kernels, those of runs beside those of fits; return the first exit code."""
    if not run([str(python), "-c", COLD]):
        return 0
    print("Compiling the numerical kernels, once for these sources ...", flush=True)
    with ThreadPoolExecutor() as both:
        return max(both.map(lambda code: run([str(python), "-c", code], quiet=True), (RUNS, FITS)))


def test(python: Path, *arguments: str) -> int:
    """Run pytest with ``python``, and return its exit code."""
    prepare_screen(python)
    if code := compile_all(python):
        return code
    return run(
        # The tests of a file stay together: what they share is made once. A third of their time is
        # spent waiting for rigs, windows and clocks: three processes keep two cores at work.
        [str(python), "-m", "pytest", "-n", "3", "--dist", "loadfile", *arguments],
        # threads of linear algebra would wait for each other
        OPENBLAS_NUM_THREADS="1",
    )


if __name__ == "__main__":
    sys.exit(test(prepare("test"), *sys.argv[1:]))
