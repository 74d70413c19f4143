"""Descend under coarse drives, corrected to the full records (space mapping)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dearig.model.fitting.levenberg import LocalFit
from dearig.model.fitting.problem import Problem

__all__ = ["descend_coarsely"]

#: Descent of a problem from a fit, with at most so many iterations.
Descent = Callable[[Problem, LocalFit, int], LocalFit]


def descend_coarsely(
    descent: Descent,
    problem: Problem,
    here: LocalFit,
    free: np.ndarray,
    iterations: int,
    gain: float,
) -> LocalFit:
    """Return the fit that ``descent`` reaches from ``here`` under the coarse drives, or ``here``.

    At the start of each descent the difference between full and coarse readings is added as a
    correction, so the sequence ends where a descent on the full records ends (space mapping;
    Bandler et al., IEEE Trans. Microw. Theory Tech. 42, 2536 (1994)). Cost and residuals are those
    of the full records. The fit has not converged where the coarse drives give no derivative of a
    ``free`` (d,) parameter, or where they do not lower the full cost: the caller then continues on
    the full records.
    """
    done = 0
    while done < iterations:
        coarse = problem.space_mapped(here.x, here.residuals, free)
        if coarse is None:
            return replace(here, converged=False)
        fit = descent(coarse, here, iterations - done)
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
