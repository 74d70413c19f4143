"""Jobs in a process of their own, with progress, time left and cancel."""

from __future__ import annotations

import logging
import multiprocessing
import threading
import time
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal, Slot

from dearig.drivers.processes.children import isolated_spawn
from dearig.window.jobs.program_errors import ErrorInProcess
from dearig.window.jobs.worker_process import (
    CURRENT,
    Request,
    StopRequest,
    WorkerMessage,
    broken,
    serve,
)

__all__ = ["Job", "TimeLeft", "Worker"]

log = logging.getLogger(__name__)


class TimeLeft:
    """Time that a stage still needs, estimated from the time it has taken."""

    #: No estimate is made before this part of the stage is done and this many s have passed.
    PART_MIN, SECONDS_MIN = 0.02, 1.0

    def __init__(self) -> None:
        self._stage: str | None = None
        self._began = 0.0
        self._first = 0.0

    def left(self, stage: str, fraction: float, now: float) -> float | None:
        """Return the seconds to the end of ``stage``, None without an estimate; ``now`` in s."""
        if stage != self._stage:
            self._stage, self._began, self._first = stage, now, fraction
            return None
        done, took = fraction - self._first, now - self._began
        if done < self.PART_MIN or took < self.SECONDS_MIN:
            return None
        return took * (1.0 - fraction) / done


class Job(QObject):
    """One job. Exactly one of ``finished``, ``failed`` and ``cancelled`` ends it."""

    #: stage, its fraction, and s left (NaN if unknown)
    progressed = Signal(str, float, float)
    finished = Signal(object)
    failed = Signal(str)
    cancelled = Signal()

    def __init__(self, worker: Worker, request: Request, whole: bool) -> None:
        super().__init__()  # no parent: it lives as long as it is referred to
        self._worker = worker
        self.request = request
        self.whole = whole
        self.asked_to_stop = False
        self.failure = ""  #: why it failed: what ``failed`` carries, as a ``Note`` with its hints

    @Slot()
    def cancel(self) -> None:
        """Interrupt the job; the second call ends its process at once."""
        self._worker.cancel(self)


class Worker(QObject):
    """Does jobs one after another, in a process that starts with the first job."""

    _arrived = Signal(int, object)

    def __init__(
        self,
        parent: QObject | None = None,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(parent)
        self._clock = clock
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None
        self._reader: threading.Thread | None = None
        self._life = 0  # number of the process; late messages of an earlier one are dropped
        self._number = 0
        self._current: Job | None = None
        self._urgent: deque[Job] = deque()
        self._waiting: deque[Job] = deque()
        self._estimate = TimeLeft()
        self._arrived.connect(self._take, Qt.ConnectionType.QueuedConnection)

    def submit(
        self, function: Callable[..., Any], *given: Any, first: bool = False, whole: bool = False
    ) -> Job:
        """Call ``function(*given, progress=...)`` in the process; ``first`` jobs go before others.

        ``whole``: progress is the fraction of the whole job and not of each stage. The function is
        defined at the top of a module; its arguments and its result can be pickled. A
        ``DearigError`` becomes ``failed`` with its message.
        """
        self._number += 1
        job = Job(self, Request(self._number, function, given), whole)
        (self._urgent if first else self._waiting).append(job)
        self._next()
        return job

    @property
    def busy(self) -> bool:
        """True while a job runs or waits."""
        return self._current is not None or bool(self._urgent or self._waiting)

    def cancel(self, job: Job) -> None:
        """End ``job``, whether it waits or runs."""
        for queue in (self._urgent, self._waiting):
            if job in queue:
                queue.remove(job)
                self._end(job, "stopped", None)
        if job is self._current:
            if job.asked_to_stop:
                self._kill()
                self._current = None
                self._end(job, "stopped", None)
                self._next()
            else:
                job.asked_to_stop = True
                self._send(StopRequest(job.request.number))

    def clear(self) -> None:
        """Cancel all waiting jobs that were not submitted as ``first``."""
        while self._waiting:
            self._end(self._waiting.popleft(), "stopped", None)

    def close(self) -> None:
        """End the process and wait for it; no signal follows."""
        self._urgent.clear()
        self._waiting.clear()
        self._current = None
        self._kill()

    # process

    def _next(self) -> None:
        queue = self._urgent or self._waiting
        if self._current is not None or not queue:
            return
        self._current = queue.popleft()
        self._estimate = TimeLeft()
        if self._process is None:
            self._start()
        self._send(self._current.request)

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        self._process = context.Process(
            target=serve, args=(theirs,), name="dearig worker", daemon=True
        )
        with isolated_spawn():
            self._process.start()
        theirs.close()  # so that the connection ends with the process
        self._connection = ours
        self._reader = threading.Thread(
            target=self._read, args=(ours, self._life), name="dearig worker messages", daemon=True
        )
        self._reader.start()

    def _send(self, message: Request | StopRequest) -> None:
        if self._connection is None:
            return
        try:
            self._connection.send(message)
        except OSError:
            return  # the process is gone; the reader reports it

    def _read(self, connection: Connection, life: int) -> None:
        """Receive messages in a thread: unpickling a large result takes time."""
        while True:
            try:
                message = connection.recv()
            except (EOFError, OSError):
                self._arrived.emit(life, None)
                return
            except Exception as error:  # noqa: BLE001  (a result that cannot be unpickled)
                message = broken(CURRENT, error)
            self._arrived.emit(life, message)

    def _kill(self) -> None:
        self._life += 1
        process, self._process = self._process, None
        connection, self._connection = self._connection, None
        reader, self._reader = self._reader, None
        if process is None or connection is None or reader is None:
            return
        process.kill()
        process.join()
        reader.join()  # the process is dead, so that the reader returns
        connection.close()
        process.close()

    # messages of the process

    @Slot(int, object)
    def _take(self, life: int, answer: WorkerMessage | None) -> None:
        if life != self._life:
            return
        job = self._current
        if answer is None:
            code = self._process.exitcode if self._process is not None else None
            self._kill()
            self._current = None
            if job is not None:
                words = f"this work ended unexpectedly (exit code {code}) and nothing was saved"
                doing = getattr(job.request.function, "__name__", "")
                log.error("%s", words, exc_info=ErrorInProcess(f"{words} in {doing}"))
                self._end(
                    job,
                    "failed",
                    f"{words}; start it again, with fewer recordings if memory is short",
                )
            self._next()
            return
        if job is None or answer.number not in (CURRENT, job.request.number):
            return
        if answer.kind == "progress":
            stage, fraction = answer.value
            # progress of a whole job has one estimate for all stages
            left = self._estimate.left("" if job.whole else stage, fraction, self._clock())
            job.progressed.emit(stage, fraction, float("nan") if left is None else left)
            return
        self._current = None
        if answer.kind == "broken":
            words, trace = answer.value
            log.error("%s", words, exc_info=ErrorInProcess(trace))
            self._end(job, "failed", f"{words}; the log has the details")
        else:
            self._end(job, answer.kind, answer.value)
        self._next()

    def _end(self, job: Job, kind: str, value: Any) -> None:
        if kind == "done":
            job.finished.emit(value)
        elif kind == "stopped":
            job.cancelled.emit()
        else:
            job.failure = value
            job.failed.emit(str(value))
