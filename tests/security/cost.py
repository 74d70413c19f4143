"""What commands cost in time and memory, each in a process of its own, which may crash or hang.

``python -m tests.security.cost`` imports the commands once and forks for each line of JSON on its
standard input. Linux only: elsewhere a process cannot limit its memory.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import io
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Cost", "Measured", "measuring"]

#: s after which a command counts as one that hangs: far more than any takes on a busy machine.
PATIENCE = 120
#: Bytes of address space that a command gets besides what the interpreter has.
MEMORY = 2**31


@dataclass(frozen=True)
class Cost:
    """Exit code (negative: the signal that ended it), texts, s, and bytes more than an idle one."""

    code: int
    out: bytes
    err: bytes
    seconds: float
    bytes: int


class Measured:
    """Runs commands in forks of one process; ``idle`` is the memory of a command with no work."""

    def __init__(self, server: subprocess.Popen[str]) -> None:
        self._server = server
        self._idle = 0
        self._idle = self.run(["presets"]).bytes

    def run(self, argv: Sequence[str], cwd: Path | None = None) -> Cost:
        """Return what ``dearig`` costs with ``argv``."""
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        with tempfile.TemporaryDirectory() as made:
            asked = {"argv": list(argv), "cwd": str(cwd or made), "texts": made}
            self._server.stdin.write(json.dumps(asked) + "\n")
            self._server.stdin.flush()
            answer = json.loads(self._server.stdout.readline())
            out, err = ((Path(made) / name).read_bytes() for name in ("out", "err"))
        used = max(answer["bytes"] - self._idle, 0)
        return Cost(answer["code"], out, err, answer["seconds"], used)


@contextlib.contextmanager
def measuring() -> Iterator[Measured]:
    """Give a runner of commands while the body runs."""
    server = subprocess.Popen(
        [sys.executable, "-m", "tests.security.cost"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[2],
    )  # fmt: skip
    try:
        yield Measured(server)
    finally:
        assert server.stdin is not None
        server.stdin.close()
        assert server.stdout is not None
        server.stdout.close()
        server.wait()


def _serve() -> None:
    _import_commands()
    for line in sys.stdin:
        asked = json.loads(line)
        began = time.monotonic()
        child = os.fork()
        if not child:
            _run(asked)
        _, status, usage = os.wait4(child, 0)
        print(
            json.dumps(
                {
                    "code": os.waitstatus_to_exitcode(status),
                    "seconds": time.monotonic() - began,
                    "bytes": usage.ru_maxrss * 1024,
                }
            ),
            flush=True,
        )


def _import_commands() -> None:
    """Load what commands load when they run, so that a fork costs only its own work."""
    for name in (
        "dearig.acquisition.check", "dearig.acquisition.replay", "dearig.acquisition.run",
        "dearig.analysis.diagnose", "dearig.analysis.identify", "dearig.analysis.simulate",
        "dearig.analysis.validate", "dearig.api", "dearig.batch.notify",
        "dearig.config.campaignfile", "dearig.recording.importers.formats.mat_file",
        "dearig.recording.importers.formats.tdms_file",
        "dearig.recording.importers.formats.text_file",
        "dearig.recording.verify", "dearig.report.as_json", "dearig.report.pages.diagnosis",
        "dearig.report.pages.html", "dearig.window.main", "openpyxl", "pyqtgraph", "rich.progress",
        "rich.table",
    ):  # fmt: skip
        importlib.import_module(name)
    import typer.main

    from dearig.cli.main import app
    from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
    from dearig.model.simulation.actuator import Actuator

    Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3).rest()  # loads the compiler and its kernels
    typer.main.get_command = functools.cache(typer.main.get_command)  # builds the commands once
    with contextlib.redirect_stdout(io.StringIO()):
        app(["presets"], prog_name="dearig", standalone_mode=False)


def _run(asked: dict[str, str]) -> None:
    """Run one command in this fork, which does not return."""
    os.chdir(asked["cwd"])
    for name, number in (("out", 1), ("err", 2)):
        file = os.open(f"{asked['texts']}/{name}", os.O_WRONLY | os.O_CREAT, 0o600)
        os.dup2(file, number)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    signal.alarm(PATIENCE)
    sys.argv = ["dearig", *asked["argv"]]
    from dearig.cli.main import main

    code = 99  # no command ends with it
    try:
        main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 98
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    _serve()
