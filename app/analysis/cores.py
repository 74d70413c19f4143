"""Who gets the processor's cores while models are fitted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

__all__ = ["for_simulations"]


@contextmanager
def for_simulations() -> Iterator[None]:
    """A context or a decorator: linear algebra keeps to one thread, the cores go to simulations.

    BLAS's threads wait by spinning, which takes a core from those that simulate.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield
