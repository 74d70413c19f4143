"""Who gets the processor's cores while models are fitted."""

from __future__ import annotations

from threadpoolctl import threadpool_limits

__all__ = ["for_simulations"]


def for_simulations() -> threadpool_limits:
    """A context in which linear algebra keeps to one thread, and the cores go to simulations.

    BLAS's threads wait by spinning, which takes a core from those that simulate.
    """
    return threadpool_limits(limits=1, user_api="blas")
