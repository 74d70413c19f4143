"""The tests, from a fresh checkout: installs what they need and runs them all."""

import sys

from bootstrap import prepare, run

if __name__ == "__main__":
    python = prepare("test")
    sys.exit(run([str(python), "-m", "pytest", "-n", "2", *sys.argv[1:]]))
