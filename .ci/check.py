"""Run every check that a change has to pass: tests, the deep ones of this day, and .ci/static.py.

``--venv DIR`` names another environment than .venv; other arguments go to pytest.
"""

import argparse
import sys

import static
from bootstrap import ROOT, VENV, run
from test import prepare_all, test

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--venv", default=VENV)
    options, others = parser.parse_known_args()
    python, code = prepare_all(ROOT / options.venv)
    sys.exit(
        code
        or test(python, *others)
        or run([str(python), "-m", "tests.deep", "--today"])
        or static.check(python)
    )
