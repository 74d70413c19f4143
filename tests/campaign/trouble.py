"""What the campaign does to a run: signals, its disk, its folder, its link, the machine's load."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from tests.campaign.link import MODES, Link

__all__ = ["ACTS", "Load", "Run", "hostile_files", "planted_code_ran", "stalling_disk"]

_SHIM = Path(__file__).with_name("stall.c")
_MARK = "planted-code-ran"


@dataclass
class Run:
    """A run at voltage: its process, its file ``out``, its link, and what can be done to it.

    While the file ``stalled`` exists, writes of the run wait; the disk recovers ``stall`` s after
    the act. ``load`` are processes that stand still until they are let go.
    """

    process: subprocess.Popen[str]
    out: Path
    link: Link
    stalled: Path
    stall: float
    load: Load
    children: list[psutil.Process] = field(default_factory=list)

    @property
    def guardian(self) -> psutil.Process:
        """Its guardian."""
        found = [c for c in self.children if any("guardian_process" in a for a in c.cmdline())]
        if len(found) != 1:
            raise RuntimeError(f"{len(found)} guardians are running")
        return found[0]


class Load:
    """A context in which ``count`` processes compute as fast as they can once ``go`` is called."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._processes: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Load:
        for _ in range(self._count):
            process = subprocess.Popen([sys.executable, "-S", "-c", "while True: pass"])
            process.send_signal(signal.SIGSTOP)
            self._processes.append(process)
        return self

    def go(self) -> None:
        """Let them compute."""
        for process in self._processes:
            process.send_signal(signal.SIGCONT)

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.kill()
            process.wait()


@contextmanager
def stalling_disk(stalled: Path) -> Iterator[dict[str, str]]:
    """Yield the environment of a run whose writes wait while the file ``stalled`` exists."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, "stall.so")
        build = ["cc", "-shared", "-fPIC", "-O1", "-o", str(library), str(_SHIM), "-ldl"]
        subprocess.run(build, check=True)
        yield {**os.environ, "LD_PRELOAD": str(library), "STALL_WHILE": str(stalled)}


def hostile_files(folder: Path) -> None:
    """Fill ``folder`` with modules that leave a mark when one of them is imported."""
    code = f"import pathlib\npathlib.Path({str(folder / _MARK)!r}).touch()\n"
    for name in (
        "queue.py", "json.py", "numbers.py", "signal.py", "threading.py", "numpy.py", "grpc.py",
        "nidaqmx.py", "sitecustomize.py", "usercustomize.py", "dearig/__init__.py",
        "dearig/drivers/__init__.py", "dearig/drivers/daqmx/guardian_process.py",
        "drivers/__init__.py", "drivers/daqmx/__init__.py", "drivers/daqmx/guardian_process.py",
    ):  # fmt: skip
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(code, encoding="utf-8")


def planted_code_ran(folder: Path) -> bool:
    """Return True if a module of ``hostile_files`` was imported."""
    return (folder / _MARK).exists()


def _kill_run(run: Run) -> None:
    os.kill(run.process.pid, signal.SIGKILL)


def _freeze_run(run: Run) -> None:
    os.kill(run.process.pid, signal.SIGSTOP)


def _kill_guardian(run: Run) -> None:
    run.guardian.kill()


def _freeze_guardian(run: Run) -> None:
    run.guardian.suspend()


def _freeze_guardian_kill_run(run: Run) -> None:
    _freeze_guardian(run)
    _kill_run(run)


def _kill_both(run: Run) -> None:
    guardian = run.guardian
    guardian.kill()
    _kill_run(run)


def _under_load(act: Callable[[Run], None]) -> Callable[[Run], None]:
    def loaded(run: Run) -> None:
        run.load.go()
        act(run)

    return loaded


def _fill_disk(run: Run) -> None:
    """From now on the file cannot grow, as on a full disk."""
    import resource

    size = run.out.stat().st_size
    resource.prlimit(run.process.pid, resource.RLIMIT_FSIZE, (size, size))


def _stall_disk(run: Run) -> None:
    run.stalled.touch()
    threading.Timer(run.stall, run.stalled.unlink).start()


def _replace_file(run: Run) -> None:
    other = run.out.with_name("other")
    other.write_bytes(b"something else")
    other.replace(run.out)


def _rename_folder(run: Run) -> None:
    run.out.parent.rename(run.out.parent.with_name(f"{run.out.parent.name}-renamed"))


def _link(mode: str) -> Callable[[Run], None]:
    return lambda run: run.link.set_mode(mode)


#: Trouble -> what is done at its moment; the troubles that are missing here are simulated faults.
ACTS: dict[str, Callable[[Run], None]] = {
    "client-killed": _kill_run,
    "client-killed-loaded": _under_load(_kill_run),
    "client-killed-hostile-folder": _kill_run,
    "client-frozen": _freeze_run,
    "client-frozen-loaded": _under_load(_freeze_run),
    "guardian-killed": _kill_guardian,
    "guardian-killed-loaded": _under_load(_kill_guardian),
    "guardian-frozen": _freeze_guardian,
    "guardian-frozen-client-killed": _freeze_guardian_kill_run,
    "both-killed": _kill_both,
    "both-killed-no-watchdog": _kill_both,
    "disk-full": _fill_disk,
    "disk-stalled": _stall_disk,
    "file-deleted": lambda run: run.out.unlink(),
    "file-replaced": _replace_file,
    "folder-renamed": _rename_folder,
    # as ctrl-C, which a program started in the background may have been told to ignore
    "operator-stops": lambda run: os.kill(run.process.pid, signal.SIGTERM),
    **{f"link-{mode}": _link(mode) for mode in MODES if mode != "whole"},
}
