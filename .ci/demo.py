"""Run ``dearig demo`` from a fresh checkout; installs what it needs first."""

import sys

from bootstrap import prepare, run

if __name__ == "__main__":
    python = prepare()
    sys.exit(run([str(python), "-m", "dearig", "demo", *sys.argv[1:]]))
