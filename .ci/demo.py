"""The main job, from a fresh checkout: installs what it needs and runs ``dearig demo``."""

import sys

from bootstrap import prepare, run

if __name__ == "__main__":
    python = prepare()
    sys.exit(run([str(python), "-m", "dearig", "demo", *sys.argv[1:]]))
