"""Run every check that a change has to pass: tests, the deep ones of this day, and .ci/static.py.

``--venv DIR`` names another environment than .venv; other arguments go to pytest. The static checks
run while tests wait, and are printed after them.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from bootstrap import ROOT, VENV, prepare, run
from test import test


def check(python: Path, *others: str) -> int:
    """Run all checks with ``python``, and return the first exit code that is not 0.

    ``others`` go to pytest.
    """
    static = [str(python), str(ROOT / ".ci" / "static.py")]
    if sys.platform != "win32":
        static = ["nice", "-n", "15", *static]
    with tempfile.TemporaryFile("w+", encoding="utf-8") as said:
        with subprocess.Popen(static, cwd=ROOT, stdout=said, stderr=subprocess.STDOUT) as checks:
            code = test(python, *others) or run([str(python), "-m", "tests.deep", "--today"])
            print("static checks ...", flush=True)
        said.seek(0)
        print(said.read(), flush=True)
    return code or checks.returncode


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--venv", default=VENV)
    options, others = parser.parse_known_args()
    sys.exit(check(prepare("test", ROOT / options.venv), *others))
