"""Commands in forked processes: started, stopped, continued and killed at random moments.

The parent has imported everything and compiled the kernels; a fork of it starts in milliseconds.
"""

from __future__ import annotations

import faulthandler
import gc
import heapq
import json
import os
import random
import select
import signal
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dearig.cli.main import main
from dearig.recording.writing import writer as writing
from dearig.recording.writing.writer import RecordingWriter
from tests.tools.command import dearig, write

__all__ = ["Command", "Ended", "plan", "play", "prepare"]

SEQUENCE = """\
name = "short"
lead_in_s = 0.1
tail_s = 0.1
[[segment]]
kind = "half_sine"
amplitude_kV = 3.0
frequency_Hz = 2.0
"""
RIG = "[card]\nsample_rate_Hz = 500.0\n"
#: The two recordings of a case, and how often a command takes the first.
NAMES, FIRST = ("a.h5", "b.h5"), 0.7
#: Two of each command in every case.
KINDS = ("record", "recover", "export", "import", "index", "verify", "force")
#: Mean time in s between two starts; parts of the commands that are killed or stopped, and when.
GAP, KILLED, STOPPED, WITHIN = 0.04, 0.25, 0.25, 0.5
#: s without processor time, or of it, after which a command counts as hung. On a busy computer a
#: command that works may take minutes.
HUNG = 120.0


@dataclass(frozen=True)
class Command:
    """``arguments`` of a command of some ``kind`` on the recording ``name``.

    It starts ``start`` s after the case does. ``signals`` are (s after its own start, signal).
    """

    kind: str
    name: str
    arguments: tuple[str, ...]
    start: float
    signals: tuple[tuple[float, int], ...] = ()


@dataclass
class Ended:
    """How a command ended: exit code (negative: killed by that signal), output, moments in s.

    ``runs`` are the samples that a run said to be flushed, and whether it was closed, by the
    identifier of its recording.
    """

    command: Command
    code: int = 0
    said: str = ""
    began: float = 0.0
    ended: float = 0.0
    runs: dict[str, tuple[int, bool]] = field(default_factory=dict)


def prepare(folder: Path) -> None:
    """Write what the commands of every case read, run each once, and import what it needs."""
    write(folder / "short.toml", SEQUENCE)
    write(folder / "rig.toml", RIG)
    run = ("--rig", "sim", "--rig-file", folder / "rig.toml", "--force")
    whole, table = folder / "whole.h5", folder / "table.csv"
    for arguments in (
        ("record", folder / "short.toml", *run, "--out", whole),
        ("export", whole, "--to", "csv", "--out", table, "--force"),
        ("import", table, "--out", folder / "imported.h5", "--force"),
        ("index", folder),
        ("info", whole, "--verify"),
        ("recover", whole),
    ):
        answer = dearig(*arguments)
        if answer.code:
            raise RuntimeError(answer.err)
    # a collection in a fork would copy every page of the parent
    gc.freeze()


def plan(rng: random.Random, given: Path, paced: bool) -> list[Command]:
    """Two of each command, in random order, at random moments, some of them disturbed."""
    kinds = [kind for kind in KINDS for _ in range(2)]
    rng.shuffle(kinds)
    start, commands = 0.0, []
    for n, kind in enumerate(kinds):
        start += rng.expovariate(1.0 / GAP)
        name = NAMES[rng.random() > FIRST]
        commands.append(
            Command(
                kind,
                name,
                _arguments(rng, kind, name, given, paced, n),
                start,
                _signals(rng),
            )
        )
    return commands


def _arguments(
    rng: random.Random, kind: str, name: str, given: Path, paced: bool, n: int
) -> tuple[str, ...]:
    force = rng.random() < 0.5
    run = (
        "record", str(given / "short.toml"), "--rig", "sim", "--rig-file", str(given / "rig.toml"),
        "--seed", str(n + 1), "--out", name, *(["--paced"] if paced and rng.random() < 0.7 else []),
    )  # fmt: skip
    wanted = {
        "record": run,
        "force": (*run, "--force"),
        "recover": ("recover", name),
        "export": ("export", name, "--to", "csv", "--out", "out.csv"),
        "import": ("import", str(given / "table.csv"), "--out", name),
        "index": ("index", "."),
        "verify": ("info", name, "--verify"),
    }[kind]
    return (*wanted, "--force") if force and kind in ("export", "import") else wanted


def _signals(rng: random.Random) -> tuple[tuple[float, int], ...]:
    found: list[tuple[float, int]] = []
    if rng.random() < STOPPED:
        at = rng.uniform(0.0, WITHIN)
        found += [(at, signal.SIGSTOP), (at + rng.uniform(0.0, WITHIN), signal.SIGCONT)]
    if rng.random() < KILLED:
        found.append((rng.uniform(0.0, WITHIN), signal.SIGKILL))
    return tuple(sorted(found))


def play(commands: list[Command], folder: Path, notes: Path) -> list[Ended]:
    """Run ``commands`` in ``folder``; how each ended. ``notes`` is a folder for their output."""
    began = time.monotonic()
    due = [(command.start, n, 0) for n, command in enumerate(commands)]  # signal 0: start
    found = [Ended(command) for command in commands]
    hung: set[int] = set()
    alive: dict[int, tuple[int, int]] = {}  # descriptor of a process: its number, its command
    worked: dict[int, tuple[float, float]] = {}  # its processor time in s, and since when
    looked = 0.0
    while due or alive:
        now = time.monotonic() - began
        if now - looked > HUNG / 2.0:  # this process was stopped itself
            worked.clear()
        looked = now
        for pid, n in alive.values():
            used = _processor_time(pid)
            if used != worked.get(pid, (0.0, 0.0))[0]:
                worked[pid] = used, now
            if used > HUNG or now - worked.setdefault(pid, (used, now))[1] > HUNG:
                hung.add(n)
                os.kill(pid, signal.SIGABRT)  # it tells where each of its threads is
        wait = max(due[0][0] - now, 0.0) if due else 1.0
        for fd in select.select(list(alive), [], [], wait)[0]:
            pid, n = alive.pop(fd)
            found[n].code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
            found[n].ended = time.monotonic() - began
            os.close(fd)
        while due and due[0][0] <= time.monotonic() - began:
            _, n, number = heapq.heappop(due)
            if number == 0:
                found[n].began = time.monotonic() - began
                pid = _start(commands[n], folder, notes / f"{n}")
                alive[os.pidfd_open(pid)] = (pid, n)
                for after, signalled in commands[n].signals:
                    heapq.heappush(due, (found[n].began + after, n, signalled))
            for pid, of in alive.values():
                if of == n and number:
                    os.kill(pid, number)
    for n, ended in enumerate(found):
        said = notes / f"{n}.txt"  # missing where it was killed at once
        ended.said = said.read_text("utf-8", "replace") if said.exists() else ""
        ended.runs = _runs(notes / f"{n}.runs")
        if n in hung:
            ended.said += f"\nhung for {HUNG:g} s"
    return found


def _processor_time(pid: int) -> float:
    """Return the processor time of a process in s; it may have ended, and was not waited for."""
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _runs(path: Path) -> dict[str, tuple[int, bool]]:
    lines = path.read_text("ascii").split("\n")[:-1] if path.exists() else []
    return {identifier: (samples, closed) for identifier, samples, closed in map(json.loads, lines)}


def _start(command: Command, folder: Path, note: Path) -> int:
    """Fork a process that runs ``command``; its number."""
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return pid
    code = 70
    try:
        out = os.open(f"{note}.txt", os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        os.dup2(out, 1)
        os.dup2(out, 2)
        faulthandler.enable(out)
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)
        os.chdir(folder)
        os.environ["XDG_CACHE_HOME"] = str(note.parent)  # of the index
        sys.argv = ["dearig", *command.arguments]
        _note_runs(Path(f"{note}.runs"))
        try:
            main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 70
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


def _note_runs(path: Path) -> None:
    """Write to ``path`` how many samples are flushed, whenever a run can know it; flush often."""
    writing.FLUSH_INTERVAL = 0.05
    out = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    append, close = RecordingWriter.append, RecordingWriter.close

    def say(writer: RecordingWriter, closed: bool) -> None:
        flushed = writer.samples if closed else writer.samples_flushed
        if flushed:
            line = json.dumps([writer._identifier, flushed, closed])
            os.write(out, f"{line}\n".encode())

    def appended(writer: RecordingWriter, *given: Any) -> None:
        append(writer, *given)
        say(writer, closed=False)

    def closed(writer: RecordingWriter, *given: Any, **options: Any) -> None:
        close(writer, *given, **options)
        say(writer, closed=True)

    RecordingWriter.append = appended  # type: ignore[method-assign]
    RecordingWriter.close = closed  # type: ignore[method-assign]
