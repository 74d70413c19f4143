"""Run all tests from a fresh checkout; installs what they need first."""

import sys
from pathlib import Path

from bootstrap import prepare, prepare_screen, run

COMPILE = """
from dearig.acquisition.warm_up import compile_kernels, is_warm
if not is_warm():
    print("Compiling the numerical kernels, once for these sources ...", flush=True)
    compile_kernels()
"""


def test(python: Path, *arguments: str) -> int:
    """Run pytest with ``python`` on two processes, and return its exit code."""
    prepare_screen(python)
    # two processes that find no kernels would compile them twice
    if code := run([str(python), "-c", COMPILE]):
        return code
    return run(
        # the tests of a file stay together: what they share is made once
        [str(python), "-m", "pytest", "-n", "2", "--dist", "loadfile", *arguments],
        # two processes have two cores: threads of linear algebra would wait for each other
        OPENBLAS_NUM_THREADS="1",
    )


if __name__ == "__main__":
    sys.exit(test(prepare("test"), *sys.argv[1:]))
