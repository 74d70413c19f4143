"""The process in which a worker's work is done, one piece after another; knows no screen."""

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

from dearig.errors import DearigError

__all__ = ["Request", "Response", "StopRequest", "serve"]

#: Of a stage: what is less than this is not worth a message.
_STEP = 1.0 / 256.0


@dataclass(frozen=True)
class Request:
    """Call ``function(*given, progress=...)``; all of it can be pickled."""

    number: int
    function: Callable[..., Any]
    given: tuple[Any, ...]


@dataclass(frozen=True)
class StopRequest:
    """End the work ``number`` as ctrl-C would, and keep what it keeps then."""

    number: int


@dataclass(frozen=True)
class Response:
    """What came of the work ``number``.

    ``kind`` is progress (``value`` a stage and its fraction), done (``value`` is the result),
    refused (a sentence), broken (a sentence on a defect) or stopped.
    """

    number: int
    kind: str
    value: Any


def serve(connection: Connection) -> None:
    """Do what comes through ``connection`` until its other end is closed or gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    work: queue.SimpleQueue[Request] = queue.SimpleQueue()
    current: list[int] = []
    listener = threading.Thread(target=_listen, args=(connection, work, current), daemon=True)
    listener.start()
    while True:
        ask = work.get()
        current[:] = [ask.number]
        answer = _done(connection, ask)
        current.clear()
        connection.send(answer)


def _listen(connection: Connection, work: queue.SimpleQueue[Request], current: list[int]) -> None:
    """Take messages while the main thread works."""
    while True:
        try:
            message = connection.recv()
        except (EOFError, OSError):
            # nobody is left to work for; whatever is under way writes its files as a whole
            os._exit(0)
        if isinstance(message, Request):
            work.put(message)
        elif message.number in current:
            _interrupt()


def _interrupt() -> None:
    """As ctrl-C at a keyboard: the way to end early that all work has."""
    if sys.platform == "win32":
        signal.raise_signal(signal.SIGINT)
    else:
        # to the very thread, which may be waiting
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)


def _done(connection: Connection, ask: Request) -> Response:
    last = ("", -1.0)

    def report(stage: str, fraction: float) -> None:
        nonlocal last
        if stage != last[0] or fraction - last[1] >= _STEP:
            last = (stage, fraction)
            connection.send(Response(ask.number, "progress", last))

    try:
        try:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            value = ask.function(*ask.given, progress=report)
        finally:
            # no message is torn by a late one
            signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:
        return Response(ask.number, "stopped", None)
    except DearigError as error:
        return Response(ask.number, "refused", str(error))
    except Exception as error:  # noqa: BLE001  (a defect must reach the person who waits)
        traceback.print_exc(file=sys.stderr)
        words = f"a defect of the program ended this work ({type(error).__name__}: {error})"
        return Response(ask.number, "broken", words)
    return Response(ask.number, "done", value)
