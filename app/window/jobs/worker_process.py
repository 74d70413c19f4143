"""Process of a worker: it does one job after another, without Qt."""

from __future__ import annotations

import os
import queue
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from dearig.drivers.processes.priority import lower_priority
from dearig.errors import DearigError, noted

__all__ = ["CURRENT", "Request", "StopRequest", "WorkerMessage", "broken", "serve"]

#: Number in a response to a request that could not be read.
CURRENT = -1

#: Smallest progress of a stage that is reported.
_STEP = 1.0 / 256.0


@dataclass(frozen=True)
class Request:
    """Request to call ``function(*given, progress=...)``; all of it can be pickled."""

    number: int
    function: Callable[..., Any]
    given: tuple[Any, ...]


@dataclass(frozen=True)
class StopRequest:
    """Request to interrupt the job ``number``, as ctrl-C does."""

    number: int


@dataclass(frozen=True)
class WorkerMessage:
    """Message about the job ``number``.

    ``kind`` is progress (``value`` is a stage and its fraction), done (``value`` is the result),
    refused (a ``Note``), broken (a sentence on an error in the program, and its traceback) or
    stopped.
    """

    number: int
    kind: str
    value: Any


def serve(connection: Connection) -> None:
    """Do the jobs that come through ``connection`` until its other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    lower_priority()  # STOP and a run in the window come first
    lost = threading.Event()  # an interrupt that a callback could not raise
    sys.unraisablehook = lambda found: _unraisable(found, lost)
    work: queue.SimpleQueue[Request] = queue.SimpleQueue()
    current: list[int] = []
    listener = threading.Thread(target=_listen, args=(connection, work, current), daemon=True)
    listener.start()
    while True:
        request = work.get()
        current[:] = [request.number]
        answer = _done(connection, request, lost)
        current.clear()
        try:
            connection.send(answer)
        except (BrokenPipeError, ConnectionError):
            return  # the window is gone
        except Exception as error:  # noqa: BLE001  (a result that cannot be pickled)
            connection.send(broken(request.number, error))


def _listen(connection: Connection, work: queue.SimpleQueue[Request], current: list[int]) -> None:
    """Receive messages while the main thread works."""
    while True:
        try:
            message = connection.recv()
        except (EOFError, OSError):
            # the window is gone; unfinished jobs leave no partial files
            os._exit(0)
        except Exception as error:  # noqa: BLE001  (a request that cannot be unpickled)
            # no job runs: the window sends the next one after the answer to the last
            connection.send(broken(CURRENT, error))
            continue
        if isinstance(message, Request):
            work.put(message)
        elif message.number in current:
            _interrupt()


def _interrupt() -> None:
    """Interrupt the main thread as ctrl-C does; every job can end early in this way."""
    if sys.platform == "win32":
        signal.raise_signal(signal.SIGINT)
    else:
        # to the main thread itself, which may be blocked in a call
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)


def _unraisable(found: Any, lost: threading.Event) -> None:
    """Report an error of a callback, which cannot raise it.

    An interrupt is raised by the next report of progress: here it would be lost again.
    """
    if isinstance(found.exc_value, KeyboardInterrupt):
        lost.set()
    else:
        sys.__unraisablehook__(found)


def _done(connection: Connection, request: Request, lost: threading.Event) -> WorkerMessage:
    last = ("", -1.0)
    lost.clear()

    def report(stage: str, fraction: float) -> None:
        nonlocal last
        if lost.is_set():
            lost.clear()
            raise KeyboardInterrupt
        if stage != last[0] or fraction - last[1] >= _STEP:
            last = (stage, fraction)
            connection.send(WorkerMessage(request.number, "progress", last))

    try:
        try:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            value = request.function(*request.given, progress=report)
        finally:
            # a late interrupt must not cut the next message
            signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:
        return WorkerMessage(request.number, "stopped", None)
    except DearigError as error:
        return WorkerMessage(request.number, "refused", noted(error))
    except Exception as error:  # noqa: BLE001  (an error must reach the person who waits)
        return broken(request.number, error)
    return WorkerMessage(request.number, "done", value)


def broken(number: int, error: Exception) -> WorkerMessage:
    """Return the response for an error in the program; the window logs its traceback."""
    text = f"an error in the program ended this work ({type(error).__name__}: {error})"
    trace = "".join(traceback.format_exception(error))
    return WorkerMessage(number, "broken", (text, trace))
