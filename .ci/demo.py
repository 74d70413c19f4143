"""Run ``dearig demo`` from a fresh checkout; installs what it needs first."""

import sys

from bootstrap import prepare, run, wait
from kernels import start_compiling

if __name__ == "__main__":
    python = prepare()
    code = wait(*start_compiling(python))  # the demo would compile them in one process
    sys.exit(code or run([str(python), "-m", "dearig", "demo", *sys.argv[1:]]))
