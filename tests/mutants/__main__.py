"""Change the code in small ways and see whether its mirrored tests notice.

``python -m tests.mutants --seed 0 --count 10`` changes each of the modules that safety, results and
recordings rest on ten times, one change at a time, runs the module's tests of the suite against
each changed copy, and against those that survive the deep tests too. It prints for each module how
many changes the suite notices, how many the deep tests notice besides, and which none of them does.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.deep.share import VARIABLE
from tests.mutants.changes import Mutant, mutants_of

ROOT = Path(__file__).parents[2]
#: What is changed (a file, or all files of a folder), and the tests that stand for it.
MODULES = {
    "drivers/gate.py": (
        "tests/drivers/test_gate.py", "tests/drivers/test_gate_windows.py",
        "tests/drivers/test_block_gate.py",
    ),
    "drivers/interlocks.py": (
        "tests/drivers/test_interlocks.py", "tests/drivers/test_interlock_blocks.py",
    ),
    "model/diagnosis": ("tests/model/diagnosis",),
    "app/recording/writing/writer.py": ("tests/recording/writing",),
}  # fmt: skip
#: s after which a changed copy counts as noticed: it has no end.
PATIENCE = 1800


def copied(folder: Path) -> Path:
    """Copy the packages into ``folder`` under their import name; return the package's folder."""
    left = shutil.ignore_patterns("__pycache__")
    package = folder / "dearig"
    shutil.copytree(ROOT / "app", package, ignore=left)
    for name in ("drivers", "model", "sim_backend"):
        shutil.copytree(ROOT / name, package / name, ignore=left)
    return package


def place_of(path: Path, package: Path) -> Path:
    """Return where the file ``path`` of the project stands in its copy."""
    return package / (path.relative_to("app") if path.parts[0] == "app" else path)


def passes(folder: Path, tests: tuple[str, ...], deep: bool) -> bool:
    """Return whether ``tests`` pass with the copy in ``folder``: of the suite, or the deep ones."""
    environment = {
        **{k: v for k, v in os.environ.items() if k != VARIABLE},
        "PYTHONPATH": str(folder),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    if deep:
        environment[VARIABLE] = ""
    command = [
        sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider",
        "-m", "deep or more_examples" if deep else "not deep", *tests,
    ]  # fmt: skip
    try:
        code = subprocess.run(
            command, cwd=ROOT, env=environment, check=False, capture_output=True, timeout=PATIENCE
        ).returncode
    except subprocess.TimeoutExpired:
        return False
    return code in (0, 5)  # 5: there is no such test


def sample(module: str, count: int, seed: int) -> list[tuple[Path, Mutant]]:
    """Return ``count`` changes of ``module``, drawn by ``seed``, each with the file it is of."""
    given = Path(module)
    files = sorted((ROOT / given).rglob("*.py")) if not given.suffix else [ROOT / given]
    every = [
        (file.relative_to(ROOT), mutant)
        for file in files
        for mutant in mutants_of(file.read_text(encoding="utf-8"))
    ]
    return random.Random(seed).sample(every, min(count, len(every)))  # noqa: S311


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=10, help="changes of each module")
    parser.add_argument("--module", choices=MODULES, action="append", help="only this one")
    options = parser.parse_args()
    print(f"seed {options.seed}, {options.count} changes of each module")
    print("| module | changes | noticed by the suite | by the deep tests besides | by none |")
    print("|---|---|---|---|---|")
    left = []
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        package = copied(folder)
        for module in options.module or MODULES:
            tests = MODULES[module]
            if not passes(folder, tests, deep=False):
                print(f"the tests of {module} fail without a change", file=sys.stderr)
                return 1
            found = {"suite": 0, "deep": 0, "none": 0}
            drawn = sample(module, options.count, options.seed)
            for path, mutant in drawn:
                place = place_of(path, package)
                before = place.read_text(encoding="utf-8")
                place.write_text(mutant.source, encoding="utf-8")
                if not passes(folder, tests, deep=False):
                    found["suite"] += 1
                else:
                    by = "none" if passes(folder, tests, deep=True) else "deep"
                    found[by] += 1
                    left.append(f"{by}: {path}:{mutant.line}: {mutant.change}")
                place.write_text(before, encoding="utf-8")
            numbers = " | ".join(str(found[by]) for by in ("suite", "deep", "none"))
            print(f"| {module} | {len(drawn)} | {numbers} |", flush=True)
    print("\nNot noticed by the suite (noticed by):", *left, sep="\n- ")
    return 0


if __name__ == "__main__":
    sys.exit(main())
