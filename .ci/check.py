"""Run every check that a change has to pass: tests, linter, formatter, types, layers.

``--venv DIR`` names another environment than .venv; other arguments go to pytest.
"""

import argparse
import sys

import static
from bootstrap import ROOT, VENV, prepare
from test import test

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--venv", default=VENV)
    options, others = parser.parse_known_args()
    python = prepare("test", ROOT / options.venv)
    sys.exit(test(python, *others) or static.check(python))
