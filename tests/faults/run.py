"""The short run into which faults are injected, in a process that ``fail.c`` is preloaded into.

It is forked from a process that has imported and compiled everything, so that a fault meets the run
and not the start of Python.
"""

from __future__ import annotations

import ctypes
import faulthandler
import json
import os
import sys
import time
import traceback
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import dearig.cli.main as command
import dearig.sim_backend.rig as rigs
from dearig.acquisition.run import record  # noqa: F401  (imported before the faults)
from dearig.config.rigfile import RigFile
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.sim_backend import factory  # noqa: F401  (imported before the faults)

__all__ = ["KINDS", "SEQUENCE", "main"]

#: Kinds of calls: the bit of ``fail.c``; None for the interpreter's own allocations.
KINDS: dict[str, int | None] = {"changes": 1, "allocations": 2, "locks": 4, "objects": None}

SEQUENCE = """\
name = "faults"
lead_in_s = 0.2
tail_s = 0.1
[[segment]]
kind = "half_sine"
amplitude_kV = 5.0
frequency_Hz = 1.0
"""

_ENDS_WITHIN = 120.0  # s; a run takes about one
_COMPILES_WITHIN = 600.0  # s; the run without a fault may be the first one ever


def _run(folder: Path, kind: str, n: int) -> None:
    """Make one run in ``folder``, the ``n``-th call of ``kind`` failing, and write what it did."""
    out = os.open(folder / "terminal", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    os.dup2(out, 1)
    os.dup2(out, 2)
    os.chdir(folder)
    faulthandler.enable(all_threads=True)  # a crash in native code says where
    flushed = [0]
    flush = h5py.File.flush

    def counting_flush(file: h5py.File) -> None:
        flush(file)
        # SWMR mode: what has been flushed is safe
        flushed[0] = max(flushed[0], file["entry/data/displacement_counts"].shape[0])

    made: list[rigs.SimulatedRig] = []
    create = rigs.SimulatedRig.__init__

    def noted(rig: rigs.SimulatedRig, *args: Any, **named: Any) -> None:
        create(rig, *args, **named)
        made.append(rig)

    h5py.File.flush = counting_flush
    rigs.SimulatedRig.__init__ = noted  # type: ignore[method-assign]
    sys.argv = ["dearig", "record", "sequence.toml", "--rig-file", "rig.toml", "--out", "run.h5"]
    code, unexpected = _command(kind, n)
    said = {
        "code": code,
        "unexpected": unexpected,
        "calls": _count(kind),
        "flushed": flushed[0],
        "states": [rig.state.value for rig in made],
    }
    (folder / "outcome.json").write_text(json.dumps(said), encoding="utf-8")


def _command(kind: str, n: int) -> tuple[int, str]:
    try:
        _arm(kind, n)
        command.main()
    except SystemExit as end:
        return (end.code if isinstance(end.code, int) else 1), ""
    except BaseException:  # noqa: BLE001  (what a user would see as a traceback)
        return 1, traceback.format_exc()
    finally:
        _disarm(kind)
    return 0, ""


def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(None)
    library.fault_arm.argtypes = (ctypes.c_int, ctypes.c_long)
    library.fault_count.restype = ctypes.c_long
    return library


def _arm(kind: str, n: int) -> None:
    bit = KINDS[kind]
    if bit is not None:
        _library().fault_arm(bit, n)
    elif n:
        import _testcapi

        _testcapi.set_nomemory(n, n + 1)


def _disarm(kind: str) -> None:
    if KINDS[kind] is None:
        import _testcapi

        _testcapi.remove_mem_hooks()
    else:
        # stops failing, goes on counting from nought: the count was taken before
        global _calls
        _calls = int(_library().fault_count())
        _library().fault_arm(0, 0)


_calls = 0


def _count(kind: str) -> int:
    return _calls if KINDS[kind] is not None else 0


def main() -> None:
    """Read "FOLDER KIND N" from standard input, make that run in a fork, and answer its end."""
    # loads the kernels, and what Numba imports for them: native code that aborts without memory
    rig = RigFile()
    still = Drive(np.linspace(0.0, 0.01, 11), np.zeros(11))
    Actuator(rig.as_film(), rig.as_load(), TABLE_3).simulate(still)
    for line in sys.stdin:
        folder, kind, n = line.rstrip("\n").rsplit(" ", 2)
        child = os.fork()
        if child == 0:
            _run(Path(folder), kind, int(n))
            return  # ends as a program does, with what the libraries do at its end
        print(_wait(child, _ENDS_WITHIN if int(n) else _COMPILES_WITHIN), flush=True)


def _wait(child: int, within: float) -> str:
    end = time.monotonic() + within
    while time.monotonic() < end:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            code = os.waitstatus_to_exitcode(status)
            return "ended" if code == 0 else f"it was ended by signal {-code}"
        time.sleep(0.002)
    os.kill(child, 9)
    os.waitpid(child, 0)
    return f"it did not end within {within:g} s"


if __name__ == "__main__":
    main()
