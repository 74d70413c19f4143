"""Several simulations at once: the kernels release the interpreter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import cache
from threading import current_thread
from typing import TypeVar

__all__ = ["Job", "Result", "together"]

Job = TypeVar("Job")
Result = TypeVar("Result")


@cache
def _pool(workers: int, name: str) -> ThreadPoolExecutor:
    # kept: starting threads anew costs a tenth of a short simulation
    return ThreadPoolExecutor(workers, thread_name_prefix=name)


def together(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    workers: int,
    name: str = "simulation",
) -> list[Result]:
    """``work(job)`` of each of ``jobs``, in their order, done by ``workers`` threads.

    When one raises, no other is left running when that is raised here. Work that itself asks for
    this under the same ``name`` does its own one by one: threads would wait for each other.
    """
    within = current_thread().name.startswith(f"{name}_")
    if workers <= 1 or len(jobs) <= 1 or within:
        return [work(job) for job in jobs]
    pool = _pool(workers, name)
    futures = [pool.submit(work, job) for job in jobs]
    wait(futures, return_when=FIRST_EXCEPTION)
    wait([f for f in futures if not f.cancel()])
    # those before the one that raised were begun before it: no result is asked of what was not
    return [f.result() for f in futures]
