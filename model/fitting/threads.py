"""Several simulations at once: the kernels release the interpreter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import cache
from threading import Lock, current_thread
from typing import TypeVar

__all__ = ["Job", "Result", "together"]

Job = TypeVar("Job")
Result = TypeVar("Result")


@cache
def _pool(workers: int, name: str) -> ThreadPoolExecutor:
    # kept: starting threads anew costs a tenth of a short simulation
    return ThreadPoolExecutor(workers, thread_name_prefix=name)


_at_work: Counter[str] = Counter()  # jobs of each name that are being done
_counting = Lock()


def together(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    workers: int,
    name: str = "simulation",
) -> list[Result]:
    """``work(job)`` of each of ``jobs``, in their order, done by ``workers`` threads.

    When one raises, no other is left running when that is raised here. Work that itself asks for
    this under the same ``name`` does its own one by one: threads would wait for each other. So does
    work of another name while all of its kind's threads have something to do.
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
    # those before the one that raised were begun before it: no result is asked of what was not
    return [f.result() for f in futures]
