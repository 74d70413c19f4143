"""Read many damaged files with every reader: ``python -m tests.fuzz --inputs N --seconds S``.

Each reader runs in a process of its own, with a limit to its memory, and to its time for one
input. What raises anything but its own error, crashes, hangs or takes too much is kept in --folder
with what happened, and goes, made small, to ``corpus/``, which the tests read.
"""

from __future__ import annotations

import argparse
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path

from tests.fuzz.targets import TARGETS

ROOT = Path(__file__).parents[2]
#: s that one input may take.
PATIENCE = 20.0


def run(name: str, seed: int, count: int, deadline: float, folder: Path) -> tuple[int, int]:
    """Inputs that were read, and crashes and hangs among them."""
    at = failures = 0
    while at < count and time.monotonic() < deadline:
        command = [sys.executable, "-m", "tests.fuzz.worker", name, str(seed), str(at), str(count)]
        errors = (folder / "errors.txt").open("w+", encoding="utf-8")
        worker = subprocess.Popen(
            [*command, str(folder)], cwd=ROOT, stdout=subprocess.PIPE, stderr=errors, text=True
        )
        lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        pump = threading.Thread(target=_pump, args=(worker, lines))
        pump.start()
        why = ""
        while True:
            try:
                line = lines.get(timeout=PATIENCE if at else 60.0)
            except queue.Empty:
                why = f"no answer for {PATIENCE:g} s"
                break
            if not line:
                break
            at = int(line) + 1
            if time.monotonic() > deadline:
                break
        worker.kill()
        code = worker.wait()
        pump.join()
        errors.seek(0)
        said = errors.read()
        errors.close()
        if not why and at < count and time.monotonic() < deadline:
            why = f"ended with {code}: {said[-2000:]}"
        if why:
            failures += 1
            suffix = TARGETS[name].suffix
            stem = folder / f"{name.replace(' ', '-')}-crash-{seed}-{at - 1}"
            current = folder / f"current{suffix}"
            stem.with_suffix(suffix).write_bytes(current.read_bytes())
            stem.with_suffix(".txt").write_text(f"{name} {seed} {at - 1}\n{why}", "utf-8")
            if not at:
                raise SystemExit(f"{name}: {why}")
    return at, failures


def _pump(worker: subprocess.Popen[str], lines: queue.SimpleQueue[str]) -> None:
    assert worker.stdout is not None
    with worker.stdout:
        for line in worker.stdout:
            lines.put(line)
    lines.put("")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=20_000)
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--target", choices=list(TARGETS), action="append")
    parser.add_argument("--folder", type=Path, default=Path("fuzz-findings"))
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    names = asked.target or list(TARGETS)
    shares = sum(TARGETS[name].share for name in names)
    deadline = time.monotonic() + asked.seconds
    total = 0
    for name in names:
        count = max(int(asked.inputs * TARGETS[name].share / shares), 1)
        began = time.monotonic()
        folder = asked.folder / name.replace(" ", "-")
        folder.mkdir(exist_ok=True)
        done, failures = run(name, asked.seed, count, deadline, folder)
        total += done
        kept = folder.glob(f"*{TARGETS[name].suffix}")
        found = sum(not path.name.startswith("current.") for path in kept)
        print(
            f"{name}: {done} inputs in {time.monotonic() - began:.0f} s, "
            f"{failures} crashes or hangs, {found} findings in {folder}",
            flush=True,
        )
    print(f"{total} inputs in all", flush=True)


if __name__ == "__main__":
    main()
