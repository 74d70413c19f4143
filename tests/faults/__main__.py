"""Every call of a kind in a short run made to fail, one run for each.

    python -m tests.faults                       each change and lock; 300 allocations of each kind
    python -m tests.faults --kinds locks --most 50

After each run: no traceback, the rig is safe, no exit code 0 without a whole recording, what was
flushed is in the file, and what the terminal says of the file is so.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dearig.errors import DearigError
from dearig.recording import open_recording
from tests.faults.run import KINDS, SEQUENCE

_SHIM = Path(__file__).with_name("fail.c")
_RIG = '[film]\nname = "faults"\n[limits]\nramp_down_s = 0.1\n'
#: Allocations of the interpreter in a run; far more than there are does no harm.
_OBJECTS = 2_000_000


#: What a library in Rust or C++ says before it ends the process.
_ABORTED = re.compile(r"memory allocation of \d+ bytes failed|std::bad_alloc")


@dataclass(frozen=True)
class Outcome:
    """What one run with a fault did: its exit code, words, and what is wrong with them."""

    n: int
    code: int
    said: str
    wrong: tuple[str, ...]


class Runs:
    """A context that makes runs in forks of one process, in a temporary folder."""

    def __enter__(self) -> Runs:
        self._made = tempfile.TemporaryDirectory()
        self.folder = Path(self._made.name)
        library = self.folder / "fail.so"
        build = ["cc", "-shared", "-fPIC", "-O1", "-o", str(library), str(_SHIM), "-ldl"]
        subprocess.run(build, check=True)
        environment = {**os.environ, "LD_PRELOAD": str(library), "OPENBLAS_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.run"], text=True, env=environment,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2],
        )  # fmt: skip
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()
        self._made.cleanup()

    def run(self, kind: str, n: int) -> tuple[Outcome, int]:
        """Make a run in which the ``n``-th call of ``kind`` fails; with how many calls it made."""
        folder = self.folder / f"{kind}-{n}"
        folder.mkdir(exist_ok=True)
        for path in folder.iterdir():
            path.unlink()
        (folder / "sequence.toml").write_text(SEQUENCE, encoding="utf-8")
        (folder / "rig.toml").write_text(_RIG, encoding="utf-8")
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{folder} {kind} {n}\n")
        self._process.stdin.flush()
        ended = self._process.stdout.readline().strip()
        terminal = (folder / "terminal").read_text(encoding="utf-8", errors="replace")
        outcome = folder / "outcome.json"
        # that ends the process where there is no memory, as a kill does
        if _ABORTED.search(terminal):
            return Outcome(n, -1, terminal[-300:], ()), 0
        if ended != "ended" or not outcome.exists():
            return Outcome(n, -1, terminal[-300:], (ended or "the process of the runs died",)), 0
        found = json.loads(outcome.read_text(encoding="utf-8"))
        wrong = tuple(_faults(folder, found, terminal))
        for path in folder.iterdir():
            path.unlink()
        folder.rmdir()
        return Outcome(n, found["code"], terminal[-300:], wrong), found["calls"]


def _faults(folder: Path, found: dict[str, object], terminal: str) -> Iterator[str]:
    code, flushed = found["code"], int(str(found["flushed"]))
    if found["unexpected"] or "Traceback" in terminal:
        yield f"a traceback: {found['unexpected'] or terminal}"
    if "unexpected error" in terminal:
        yield "an error that the program calls its own mistake"
    if not set(found["states"]) <= {"safe", "closed"}:  # type: ignore[call-overload]
        yield f"the rig is left {found['states']}"
    if code != 0 and "dearig: " not in terminal:
        yield f"no sentence for exit code {code}"
    path = folder / "run.h5"
    samples = None
    try:
        recording = open_recording(path)
        samples = recording.samples
    except DearigError as error:
        if flushed:
            yield f"{flushed} samples were flushed, and {error}"
        elif code == 0:
            yield f"exit code 0, and {error}"
    if samples is not None:
        if samples < flushed:
            yield f"{flushed} samples were flushed, {samples} are there"
        if code == 0 and not recording.complete:
            yield "exit code 0, and the recording is not complete"
        said = re.search(r"\((\d+) samples\)|: (\d+) samples,", terminal)
        if said and int(said[1] or said[2]) != samples:
            yield f"it says {said[0]}, and there are {samples}"
    if "nothing was recorded" in terminal and samples:
        yield f"it says that nothing was recorded, and there are {samples} samples"
    left = {p.name for p in folder.iterdir()}
    left -= {"sequence.toml", "rig.toml", "terminal", "outcome.json", "run.h5"}
    if left and code == 0:
        yield f"exit code 0, and {sorted(left)} are left"


def chosen(calls: int, most: int, seed: int) -> list[int]:
    """Return which of ``calls`` calls are made to fail: all, or ``most`` drawn by ``seed``."""
    if calls <= most:
        return list(range(1, calls + 1))
    drawn = np.random.default_rng(seed).choice(calls, most, replace=False) + 1
    return sorted(int(n) for n in drawn)


def main() -> int:
    """Inject the faults that are asked for; 1 if anything is wrong."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--most", type=int, default=300, help="allocations of each kind")
    parser.add_argument("--seed", type=int, default=0, help="draws which allocations")
    options = parser.parse_args()
    failed = 0
    with Runs() as runs:
        for kind in options.kinds:
            runs.run(kind, 0)  # compiles, and fills the caches
            whole, calls = runs.run(kind, 0)
            if whole.wrong or whole.code:
                print(f"{kind}: without a fault: {whole}", flush=True)
                return 1
            calls = calls or _OBJECTS
            most = options.most if kind in ("allocations", "objects") else calls
            outcomes = [runs.run(kind, n)[0] for n in chosen(calls, most, options.seed)]
            for outcome in outcomes:
                if outcome.wrong:
                    print(f"{kind} {outcome.n}: {'; '.join(outcome.wrong)}", flush=True)
            wrong = sum(bool(outcome.wrong) for outcome in outcomes)
            codes = dict(sorted(Counter(outcome.code for outcome in outcomes).items()))
            print(f"{kind}: {calls} calls, {len(outcomes)} failed, {wrong} wrong, exits {codes}")
            failed += wrong
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
