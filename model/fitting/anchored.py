"""Descents on sketches of the records, held to the whole records wherever they end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dearig.model.fitting.levenberg import LocalFit
from dearig.model.fitting.problem import Problem

__all__ = ["by_sketches"]

#: From a fit on, with so many iterations at most.
Descent = Callable[[Problem, LocalFit, int], LocalFit]


def by_sketches(
    descent: Descent,
    problem: Problem,
    here: LocalFit,
    free: np.ndarray,
    iterations: int,
    gain: float,
) -> LocalFit:
    """Where a ``descent`` from ``here`` comes on sketches, as far as these lead; or ``here``.

    What they miss is taken from the whole records at every place it sets out from, so it ends
    where a descent on these would (space mapping; Bandler et al., IEEE Trans. Microw. Theory Tech.
    42, 2536 (1994)). Cost and residuals are those of the whole records. It has not converged where
    sketches do not tell what the ``free`` (d,) numbers do, or lead astray: whoever asks goes on
    from there without.
    """
    done = 0
    while done < iterations:
        sketch = problem.anchored(here.x, here.residuals, free)
        if sketch is None:
            return replace(here, converged=False)
        fit = descent(sketch, here, iterations - done)
        done += max(fit.iterations, 1)
        if np.array_equal(fit.x, here.x):
            return replace(here, jacobian=fit.jacobian, iterations=done, converged=fit.converged)
        costs, residuals = problem.evaluate(fit.x[None])
        cost = float(costs[0])
        if not cost < here.cost:
            return replace(here, iterations=done, converged=False)
        gained = (here.cost - cost) * problem.samples
        missed = abs(cost - fit.cost) * problem.samples
        here = LocalFit(fit.x, cost, residuals[0], fit.jacobian, done, fit.converged)
        if fit.converged and min(gained, missed) < gain:
            break
    return here
