"""Where the tasks of a study are computed: processes of this computer, or a Dask cluster.

An engine yields a row for each task, in the order in which they end. A worker that dies costs time,
not rows.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Future,
    ProcessPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from typing import TYPE_CHECKING, Any, Protocol

from dearig.drivers.processes.children import isolated_spawn
from dearig.errors import InputError
from dearig.extras import import_extra
from dearig.recording.files import journal_of, one_line, system_text

# a worker process imports this module before it knows its task
if TYPE_CHECKING:
    from dearig.batch.fits import FitTask, Row

__all__ = ["ClusterLost", "DaskEngine", "Engine", "LocalEngine", "engine_at"]

log = logging.getLogger(__name__)

#: Times that a task is tried alone whose worker died, before it counts as the cause.
_TRIES_ALONE = 2
_DASK_TIMEOUT = "10 s"  # to find the scheduler
#: Times that Dask gives a task to another worker after its worker died; then it may be the cause.
_RETRIES = 3
_LOOK_S = 5.0  # between two looks at whether there are workers
_NO_WORKER_S = 30.0  # without a worker after which no one waits for one
_ANSWER_S = 30.0  # for a row that is computed to come from its worker
#: Errors by which Dask reports that scheduler, workers or network are lost.
_LOST_BY = (OSError, RuntimeError, TimeoutError, CancelledError, asyncio.CancelledError)


class ClusterLost(Exception):  # noqa: N818  (what happened)
    """The cluster does not answer any more; the rows so far are there."""


class Engine(Protocol):
    """A place where tasks are computed."""

    def run(self, tasks: Sequence[FitTask]) -> Iterator[tuple[FitTask, Row]]:
        """Yield each task with its row, in the order in which they end."""


def engine_at(
    where: str, workers: int | None = None, work: Callable[[FitTask], Row] | None = None
) -> Engine:
    """Return the engine that ``where`` names: local, or dask:ADDRESS. Raises ``InputError``.

    ``work`` computes a task; by default it is ``fit_task``.
    """
    if where == "local":
        return LocalEngine(workers, work)
    scheme, colon, address = where.partition(":")
    if scheme == "dask" and colon and address:
        return DaskEngine(address, work)
    raise InputError(
        f"{where!r} is not a place to compute at: write local, or dask:ADDRESS with the address of "
        f"a Dask scheduler, such as dask:tcp://10.0.0.5:8786",
        option="on",
    )


class LocalEngine:
    """So many processes of this computer, by default one for each core.

    With one worker the tasks are computed in this process.
    """

    def __init__(
        self, workers: int | None = None, work: Callable[[FitTask], Row] | None = None
    ) -> None:
        self.workers = workers or os.cpu_count() or 1
        self._work = work or _fit_task()

    def run(self, tasks: Sequence[FitTask]) -> Iterator[tuple[FitTask, Row]]:
        """Yield each task with its row, in the order in which they end."""
        if self.workers == 1 or len(tasks) == 1:
            for task in tasks:
                yield task, self._work(task)
            return
        waiting = deque(tasks)
        while waiting:
            suspects = yield from self._pool(waiting, self.workers)
            for task in suspects:
                yield task, self._alone(task)

    def _alone(self, task: FitTask) -> Row:
        """Compute a task that was under way when a worker died: it may be the cause."""
        found: list[tuple[FitTask, Row]] = []
        for _ in range(_TRIES_ALONE):
            found += self._pool(deque([task]), 1)
            if found:
                return found[0][1]
        return _lost(task)

    def _pool(
        self, waiting: deque[FitTask], workers: int
    ) -> Generator[tuple[FitTask, Row], None, list[FitTask]]:
        """Compute tasks of ``waiting`` until there are none, or a worker dies.

        Returns the tasks that were under way then. A task is handed over when a worker is free for
        it, so that these are few.
        """
        before = set(multiprocessing.active_children())
        pool = ProcessPoolExecutor(
            workers, multiprocessing.get_context("spawn"), initializer=_begin_worker
        )
        running: dict[Future[Row], FitTask] = {}
        try:
            while waiting or running:
                while waiting and len(running) < workers:
                    with isolated_spawn():  # the first of them starts the workers
                        future = pool.submit(self._work, waiting[0])
                    running[future] = waiting.popleft()
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    row = future.result()
                    yield running.pop(future), row
        except BrokenProcessPool:
            log.warning("a worker process has died; its recording is computed again")
            return list(running.values())
        except BaseException:
            # the operator has ended the study, or its reader has: no one waits for these
            for child in set(multiprocessing.active_children()) - before:
                child.terminate()
            raise
        finally:
            pool.shutdown(cancel_futures=True)
        return []


def _words(error: BaseException) -> str:
    return (
        one_line(error, 120)
        if isinstance(error, Exception) and str(error)
        else type(error).__name__
    )


def _fit_task() -> Callable[[FitTask], Row]:
    from dearig.batch.fits import fit_task

    return fit_task


def _begin_worker() -> None:
    """Leave ctrl-C to the process that reads the rows, and end with it, also when it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # without this, workers whose parent was killed wait for a task for ever
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _lost(task: FitTask) -> Row:
    return {
        "recording": task.name,
        "state": "failed",
        "reason": f"{task.name}: the process that computed it ended without a word, "
        f"{_TRIES_ALONE + 1} times; it may need more memory than there is",
    }


class DaskEngine:
    """The workers of the Dask scheduler at ``address``, each with this version of the program.

    The recordings of a task are sent to the worker that computes it, so that the workers need no
    common disk.
    Raises ``InputError`` where Dask is not installed, or no scheduler answers.
    """

    def __init__(self, address: str, work: Callable[[FitTask], Row] | None = None) -> None:
        self._work = work or _fit_task()
        self._dask = import_extra("distributed", "cluster", "a study at dask:ADDRESS")
        self._address = address
        self._client = self._connect()

    def _connect(self) -> Any:
        try:
            return self._dask.Client(self._address, timeout=_DASK_TIMEOUT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(
                f"no Dask scheduler answers at {self._address}: {system_text(error)}"
            ) from error

    def run(self, tasks: Sequence[FitTask]) -> Iterator[tuple[FitTask, Row]]:
        """Yield each task with its row, in the order in which they end.

        Raises ``ClusterLost`` where the scheduler, all workers or the network are lost.
        """
        with self._client as client:
            try:
                client.wait_for_workers(1, timeout=_NO_WORKER_S)
            except TimeoutError as error:
                raise InputError(
                    f"the Dask scheduler at {self._address} has no workers: start some with dask "
                    f"worker {self._address}"
                ) from error
            threads = sum(client.nthreads().values())
            # two for each thread: one is computed while the next one is on its way
            yield from self._run(client, deque(tasks), 2 * threads)

    def _run(
        self, client: Any, waiting: deque[FitTask], most: int
    ) -> Iterator[tuple[FitTask, Row]]:
        from dearig.batch.fits import OtherVersion

        running: dict[Any, FitTask] = {}
        while waiting or running:
            while waiting and len(running) < most:
                task = waiting.popleft()
                running[self._submit(client, task)] = task
            for future in self._next(client, list(running)):
                task = running.pop(future)
                try:
                    row = future.result(timeout=_ANSWER_S)
                except OtherVersion as error:
                    raise InputError(f"{error}: install the same ones") from error
                except self._dask.KilledWorker:
                    row = _lost(task)
                except _LOST_BY as error:
                    raise ClusterLost(_words(error)) from error
                yield task, row

    def _next(self, client: Any, running: list[Any]) -> set[Any]:
        """Return futures that have ended. Raises ``ClusterLost`` if no worker is left."""
        alone = 0.0
        while alone < _NO_WORKER_S:
            try:
                with client.as_current():
                    ended: set[Any] = self._dask.wait(
                        running, timeout=_LOOK_S, return_when="FIRST_COMPLETED"
                    ).done
            except TimeoutError:
                try:
                    alone = 0.0 if client.nthreads() else alone + _LOOK_S
                except _LOST_BY as error:
                    raise ClusterLost(_words(error)) from error
            except _LOST_BY as error:
                raise ClusterLost(_words(error)) from error
            else:
                return ended
        raise ClusterLost(f"it has had no worker for {_NO_WORKER_S:g} s")

    def _submit(self, client: Any, task: FitTask) -> Any:
        from dearig.batch.fits import code_digest, fit_sent

        sent = [
            (name, [(p.name, p.read_bytes()) for p in (path, journal_of(path)) if p.is_file()])
            for name, path in task.recordings
        ]
        return client.submit(
            fit_sent, self._work, (task.name, task.key, task.options), sent, code_digest(),
            key=f"dearig-{task.key}", pure=False, retries=_RETRIES,
        )  # fmt: skip
