"""Example programs of nidaqmx-python on the simulated card: which run, and which are refused.

Run as ``python -m tests.benchmarks.bench_ni_examples --source FOLDER``; ``FOLDER`` is ``examples``
of a checkout of https://github.com/ni/nidaqmx-python. The programs run unchanged, each in a process
of its own, against the card of a rig at rest in this process. "ran" means that the program came to
its end, and that what it read or wrote is what the card's terminals had.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dearig.config.rigfile import RigFile
from dearig.sim_backend.clock import PacedClock
from dearig.sim_backend.daqmx.opening import open_device
from dearig.sim_backend.daqmx.protocol.server import DaqmxServer
from dearig.sim_backend.daqmx.simulated_card import SimulatedCard
from tests.benchmarks.ni_example_checks import CHECKS, Played

_LONGEST = 60.0  # s for one example
_DEVICE = re.compile(r"[\"']/?([A-Za-z][A-Za-z0-9]*)/(?:ai|ao|port|ctr|power)")


@dataclass
class Row:
    """Line of the table."""

    example: str
    outcome: str
    detail: str
    printed: str = field(default="", repr=False)


def card(name: str) -> SimulatedCard:
    """Return a card called ``name`` in real time, with the rig at rest behind it."""
    settings = RigFile.model_validate({"card": {"device": name}})
    return open_device("sim", settings, settings.as_film(), settings.as_load(), clock=PacedClock())


def watch_lines(device: SimulatedCard) -> list[tuple[str, bool, float]]:
    """Return a list that gets every change of a digital line of ``device``."""
    changes: list[tuple[str, bool, float]] = []
    put = device.wire.set_line

    def put_and_note(line: str, level: bool, now: float) -> None:
        changes.append((line, level, now))
        put(line, level, now)

    device.wire.set_line = put_and_note  # type: ignore[method-assign]
    return changes


@contextmanager
def played(example: Path, seconds: float) -> Iterator[Played]:
    """Run ``example`` against a card of its own, with Enter pressed after ``seconds``.

    The card is served until the result was looked at.
    """
    found = _DEVICE.search(example.read_text(encoding="utf-8-sig"))
    device = card(found[1] if found else "Dev1")
    lines = watch_lines(device)
    with (
        tempfile.TemporaryDirectory() as folder,
        DaqmxServer(device, client_timeout=None) as server,
    ):
        out = Path(folder) / "log.json"
        command = [
            sys.executable, "-m", "tests.benchmarks.ni_example_child",
            str(example), str(server.port), str(out), str(seconds),
        ]  # fmt: skip
        printed, log = "", {"error": "timeout", "text": f"no end in {_LONGEST:g} s"}
        try:
            ended = subprocess.run(
                command, capture_output=True, text=True, timeout=_LONGEST, check=False
            )
        except subprocess.TimeoutExpired:
            yield Played(device, [], printed, log, lines)
            return
        if out.is_file():
            log = json.loads(out.read_text(encoding="utf-8"))
        else:
            log = {"error": "crash", "text": ended.stderr.strip().rpartition("\n")[2]}
        calls: Any = log.pop("calls", [])
        yield Played(device, calls, ended.stdout, log, lines)


def row(example: Path, name: str, seconds: float) -> Row:
    """Return the line of ``example``, called ``name``."""
    with played(example, seconds) as result:
        if result.failure:
            text = " ".join(str(result.failure["text"]).split())
            code = result.failure["error"]
            kind = "refused" if isinstance(code, int) else "failed"
            return Row(name, kind, f"{code}: {text[:140]}", result.printed)
        check = CHECKS.get(name)
        if check is None:
            return Row(name, "ran, not checked", "", result.printed)
        try:
            return Row(name, "ran", check(result), result.printed)
        except (AssertionError, IndexError, ValueError) as wrong:
            return Row(name, "ran, wrong", str(wrong)[:140], result.printed)


def main() -> None:
    """Print the table, and how many ran."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--source", type=Path, required=True)
    parser.add_argument("--only", default="", help="part of the examples' paths")
    parser.add_argument("--seconds", type=float, default=2.5, help="until Enter is pressed")
    parser.add_argument("--output", action="store_true", help="also what each printed")
    options = parser.parse_args()
    rows = []
    print("| example | outcome | what was checked, or why not |\n|---|---|---|")
    for example in sorted(options.source.rglob("*.py")):
        name = example.relative_to(options.source).as_posix()
        if options.only in name:
            rows.append(row(example, name, options.seconds))
            print(f"| {name} | {rows[-1].outcome} | {rows[-1].detail} |", flush=True)
            if options.output:
                print(rows[-1].printed)
    ran = sum(r.outcome == "ran" for r in rows)
    print(f"\n{ran} of {len(rows)} ran.")


if __name__ == "__main__":
    main()
