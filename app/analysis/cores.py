"""Limit of linear algebra to one thread while models are fitted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

__all__ = ["for_simulations"]


@contextmanager
def for_simulations() -> Iterator[None]:
    """Context or decorator in which linear algebra uses one thread, and simulations the others.

    BLAS's threads wait by spinning, which takes cores from the simulations.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield
