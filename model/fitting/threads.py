"""Several simulations at once: the kernels release the interpreter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
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

    Work that itself asks for this needs another ``name``, or all threads would wait for each other.
    """
    if workers <= 1 or len(jobs) <= 1:
        return [work(job) for job in jobs]
    return list(_pool(workers, name).map(work, jobs))
