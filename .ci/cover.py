"""Run the tests and print which lines of the package they reach; takes longer than .ci/run.

Compiled kernels are left out (pyproject.toml, [tool.coverage.run]). Arguments go to pytest.
"""

import sys

from bootstrap import prepare
from test import test

if __name__ == "__main__":
    python = prepare("test")
    sys.exit(test(python, "--cov=dearig", "--cov-report=term", *sys.argv[1:]))
