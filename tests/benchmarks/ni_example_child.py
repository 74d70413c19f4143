"""Run one example program of nidaqmx-python, unchanged, against a simulated card.

Run as ``python -m tests.benchmarks.ni_example_child EXAMPLE PORT LOG SECONDS``. The program opens
its tasks without ``grpc_options``; here they go to the server at ``PORT``. Whoever presses Enter
or ctrl-C does so after ``SECONDS``. What it read and wrote goes into ``LOG`` as JSON.
"""

from __future__ import annotations

import _thread
import builtins
import json
import os
import runpy
import sys
import tempfile
import threading
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import grpc
import matplotlib as mpl
import nidaqmx
import nidaqmx.utils
import numpy as np
from nidaqmx._base_interpreter import BaseInterpreter
from nidaqmx._grpc_interpreter import GrpcStubInterpreter
from nidaqmx.errors import DaqError

_KEPT = 4000  # values of a read or a write that go into the log


def redirect(port: int) -> None:
    """Let what would use the local driver use the server at ``port``."""
    options = [("grpc.max_receive_message_length", -1), ("grpc.enable_http_proxy", 0)]
    channel = grpc.insecure_channel(f"127.0.0.1:{port}", options)
    session = nidaqmx.GrpcSessionOptions(channel, "")

    def select(grpc_options: Any = None, interpreter: BaseInterpreter | None = None) -> Any:
        return interpreter or GrpcStubInterpreter(grpc_options or session)

    nidaqmx.utils._select_interpreter = select


def plain(value: Any) -> Any:
    """Return ``value`` as JSON can hold it."""
    if hasattr(value, "scaled_data"):
        return plain(value.scaled_data)
    if hasattr(value, "signals"):
        return [plain(signal.data) for signal in value.signals]
    if hasattr(value, "_fields"):  # pulse specifications
        return dict(zip(value._fields, plain(list(value)), strict=True))
    if isinstance(value, np.ndarray):
        return plain(value.ravel()[:_KEPT].tolist())
    if isinstance(value, list | tuple):
        return [plain(v) for v in value[:_KEPT]]
    return value.item() if isinstance(value, np.generic) else value


def watched(log: list[Any], of: type, name: str, *, gives: bool) -> None:
    """Note what the method ``name`` returns, or what it takes if it ``gives`` to the card."""
    true: Callable[..., Any] = getattr(of, name)

    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        result = true(self, *args, **kwargs)
        log.append([time.monotonic(), name, plain(args[0] if gives and args else result)])
        return result

    setattr(of, name, call)


def at_the_keyboard(seconds: float, *, ctrl_c: bool) -> Callable[[], None]:
    """Press Enter ``seconds`` after a question, and ``ctrl_c`` where none was asked.

    It is pressed again until the returned function is called, because a library may lose one.
    """
    over = threading.Event()

    def enter(question: str = "") -> str:
        over.set()
        sys.stdout.write(question)
        time.sleep(seconds)
        return ""

    def press() -> None:
        pressed = 0
        while not over.wait(2.0 * seconds if not pressed else 3.0):
            pressed += 1
            _thread.interrupt_main()

    builtins.input = enter
    if ctrl_c:
        threading.Thread(target=press, daemon=True).start()
    return over.set


def main() -> None:
    """Run the example; the exit code is 0, or 1 after an error, which is the log's last entry."""
    example, port, out, seconds = sys.argv[1:]
    log: list[Any] = []
    redirect(int(port))
    mpl.use("Agg")
    watched(log, nidaqmx.Task, "read", gives=False)
    watched(log, nidaqmx.Task, "read_waveform", gives=False)
    watched(log, nidaqmx.Task, "write", gives=True)
    loops = "KeyboardInterrupt" in Path(example).read_text(encoding="utf-8-sig")
    done = at_the_keyboard(float(seconds), ctrl_c=loops)
    failure: dict[str, Any] = {}
    path = Path(example).resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)  # some write files
        try:
            sys.argv = [str(path)]
            runpy.run_path(str(path), run_name="__main__")
        except KeyboardInterrupt:
            failure = {"error": "KeyboardInterrupt", "text": "no handler for ctrl-C"}
        except DaqError as error:
            failure = {"error": error.error_code, "text": str(error)}
        except Exception as error:  # noqa: BLE001  (the program's own fault, which is the result)
            failure = {"error": type(error).__name__, "text": str(error)}
            traceback.print_exc()
        done()
        os.chdir(Path(folder).parent)
    Path(out).write_text(json.dumps({"calls": log, **failure}), encoding="utf-8")
    sys.stdout.flush()
    # a thread of the client may still listen to an event
    os._exit(1 if failure else 0)


if __name__ == "__main__":
    warnings.simplefilter("default")
    main()
