"""The tests, from a fresh checkout: installs what they need and runs them all."""

import sys

from bootstrap import prepare, prepare_screen, run

if __name__ == "__main__":
    python = prepare("test")
    prepare_screen(python)
    sys.exit(run([str(python), "-m", "pytest", "-n", "2", *sys.argv[1:]]))
