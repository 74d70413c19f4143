"""Run simulations on several threads; the compiled kernels release the interpreter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import cache
from threading import Lock, current_thread
from typing import TypeVar

__all__ = ["Job", "Result", "parallel_map"]

Job = TypeVar("Job")
Result = TypeVar("Result")


@cache
def _pool(workers: int, name: str) -> ThreadPoolExecutor:
    # kept between calls: starting threads costs a tenth of a short simulation
    return ThreadPoolExecutor(workers, thread_name_prefix=name)


_at_work: Counter[str] = Counter()  # running jobs by name
_counting = Lock()


def parallel_map(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    workers: int,
    name: str = "simulation",
) -> list[Result]:
    """Return ``work(job)`` for each of ``jobs``, in their order, computed by ``workers`` threads.

    When one raises, the others have ended before the exception leaves this function. A nested call
    under the same ``name`` runs its jobs one by one, since threads of one pool would wait for each
    other. So does a nested call from another pool all of whose threads are busy.
    """
    mine = current_thread().name.rpartition("_")[0]
    if workers <= 1 or len(jobs) <= 1 or mine == name or _at_work[mine] >= workers:
        return [work(job) for job in jobs]

    def counted(job: Job) -> Result:
        with _counting:
            _at_work[name] += 1
        try:
            return work(job)
        finally:
            with _counting:
                _at_work[name] -= 1

    pool = _pool(workers, name)
    futures = [pool.submit(counted, job) for job in jobs]
    wait(futures, return_when=FIRST_EXCEPTION)
    wait([f for f in futures if not f.cancel()])
    # results are taken in order: jobs before the one that raised had started, so all have ended
    return [f.result() for f in futures]
