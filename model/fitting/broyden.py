"""Least squares with few simulations: Broyden's secant update of the Jacobian.

A comparison of dozens of effects needs the lowest cost of each, not its exact place. A Jacobian
known nearby (of the model without the effect) is a good start. Each step corrects it along the
direction of the step. It is computed again only where it predicted a gain that did not come, or
where no gain is left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import lsq_linear

from dearig.model.fitting.levenberg import LocalFit
from dearig.model.fitting.problem import Problem

__all__ = ["boxed_step", "descend_broyden"]

_DAMPINGS = np.array([3e-3, 1.0])  # tried at once, relative to the current damping
_DAMPING_MAX = 1e7
_FLAT = 1e-9  # of the scaled curvature: the data do not determine flatter directions
_SECANT_STEPS_MAX = 5  # then the Jacobian is computed again
_PATIENCE = 3  # Jacobians that together must lower chi-square by the gain asked for
_GAIN_SHARE_MIN = 0.25  # of the predicted gain: below, the Jacobian is computed again


def boxed_step(
    normal: np.ndarray, gradient: np.ndarray, damping: float, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the best damped least-squares step (f,) within a box about 0.

    It minimises 2 gradient.s + s.(normal + damping I).s for low <= s <= high, all (f,). A step that
    is clipped afterwards would leave a narrow valley of the cost.
    """
    root = cholesky(normal + damping * np.eye(gradient.size))
    step = -cho_solve((root, False), gradient)
    if np.all((low <= step) & (step <= high)):
        return np.asarray(step)
    # a coordinate without room between its bounds is not an unknown
    open_ = high - low > 1e-12 * (1.0 + np.abs(low) + np.abs(high))
    step = np.where(open_, 0.0, np.clip(0.0, low, high))
    if open_.any():
        # |root step - aim|^2 is the quadratic model, but for a constant
        aim = -solve_triangular(root, gradient, trans="T") - root @ step
        found = lsq_linear(root[:, open_], aim, (low[open_], high[open_]), method="bvls")
        step[open_] = np.clip(found.x, low[open_], high[open_])
    return step


def descend_broyden(
    problem: Problem,
    start: np.ndarray,
    fixed: np.ndarray,
    jacobian: np.ndarray | None = None,
    iterations: int = 30,
    gain: float = 1.0,
    sure: bool = True,
) -> LocalFit:
    """Descend from ``start`` (d,) inside the layout's bounds; parameters ``fixed`` (d,) are held.

    The descent runs under the records' coarse drives as far as they lower the cost, then on the
    full records. ``jacobian`` (N, f) is one known near the start, or None; columns that are not
    finite are computed. The fit has converged where the quadratic model predicts a gain of less
    than ``gain`` in chi-square, with ``sure`` only by a Jacobian computed at that place. It ends
    unconverged where several Jacobians together gain no more.
    """
    free = ~fixed
    x = np.clip(start, problem.layout.lower, problem.layout.upper)
    costs, residuals = problem.evaluate(x[None])
    unknown = np.full((residuals.shape[1], int(free.sum())), np.nan)
    here = LocalFit(
        x, float(costs[0]), residuals[0], unknown if jacobian is None else jacobian, 0, False
    )

    def on_coarse_drives(coarse_problem: Problem, here: LocalFit, iterations: int) -> LocalFit:
        return _broyden(coarse_problem, here, free, iterations, gain, sure, coarse=False)

    reached = _descend_coarsely(on_coarse_drives, problem, here, free, iterations, gain)
    if reached.iterations >= iterations or (reached.converged and not sure):
        return reached
    # a coarse descent needs every column; a Jacobian of the full problem uses those there are
    columns = (
        np.zeros(1, dtype=bool) if problem.coarse_columns is None else problem.coarse_columns[free]
    )
    some = bool(columns.any()) and not columns.all()
    coarse = some and problem.coarse_residuals(x, here.residuals) is not None
    rest = _broyden(problem, reached, free, iterations - reached.iterations, gain, sure, coarse)
    return replace(rest, iterations=reached.iterations + rest.iterations)


def _broyden(
    problem: Problem,
    here: LocalFit,
    free: np.ndarray,
    iterations: int,
    gain: float,
    sure: bool,
    coarse: bool,
) -> LocalFit:
    """Descend from ``here``: one loop, whose branches share one state.

    Its Jacobian is one known nearby, or not finite where unknown.

    Further Jacobians are ``coarse`` while they lower the cost: in a narrow valley columns nearly
    cancel, and the coarse drives do not resolve the difference.
    """
    layout = problem.layout
    x, r, chi2 = here.x, here.residuals, here.cost * problem.samples
    jac = None if np.isnan(here.jacobian).all() else here.jacobian
    fresh = False
    if jac is not None and not np.isfinite(jac).all():
        unknown = ~np.isfinite(jac).all(axis=0)
        which = free.copy()
        which[free] = unknown
        jac = jac.copy()
        jac[:, unknown] = problem.jacobian(x, which, r, coarse)
    damping, done, converged, secant_steps = 1e-2, 0, False, 0
    marks: list[float] = []
    while done < iterations:
        if jac is None:
            # repeated Jacobians without gain: the valley curves, and secants do not follow it
            marks.append(chi2)
            if len(marks) > _PATIENCE and marks[-1 - _PATIENCE] - chi2 < gain:
                break
            jac, fresh, secant_steps = problem.jacobian(x, free, r, coarse), True, 0
        done += 1
        scale = np.linalg.norm(jac, axis=0)
        scale = np.where(scale > 0.0, scale, np.inf)  # a parameter without influence does not move
        normal, gradient = (jac / scale).T @ (jac / scale), (jac / scale).T @ r
        part, reach = x[free], layout.reach(x)[free]
        finite = np.where(np.isfinite(scale), scale, 0.0)
        low = np.maximum(layout.lower[free] - part, -reach) * finite
        high = np.minimum(layout.upper[free] - part, reach) * finite
        best_step = boxed_step(normal, gradient, _FLAT, low, high)
        if -float(best_step @ (2.0 * gradient + normal @ best_step)) < gain:
            if not sure or (fresh and not coarse):
                converged = True
                break
            if fresh:
                coarse = False
                marks.clear()
            jac = None
            continue
        dampings = damping * _DAMPINGS
        steps = np.array([boxed_step(normal, gradient, d, low, high) for d in dampings]) / scale
        trials = np.tile(x, (dampings.size, 1))
        trials[:, free] = np.clip(part + steps, layout.lower[free], layout.upper[free])
        costs, residuals = problem.evaluate(trials)
        best = int(np.argmin(costs))
        better = float(costs[best]) * problem.samples
        if not better < chi2:
            if not fresh:
                jac = None
                continue
            if coarse:
                jac, coarse = None, False
                marks.clear()
                continue
            damping *= 1e2
            if damping > _DAMPING_MAX:
                converged = True
                break
            continue
        step = trials[best][free] - part
        bent = residuals[best] - r - jac @ step
        straight = r + jac @ step
        predicted = chi2 - float(straight @ straight)
        length2 = float(np.sum((step * finite) ** 2))
        poor = chi2 - better < _GAIN_SHARE_MIN * predicted
        x, r, chi2 = trials[best], residuals[best], better
        damping = max(dampings[best], 1e-9)
        secant_steps += 1
        if (poor and not fresh) or secant_steps > _SECANT_STEPS_MAX:
            jac = None
            continue
        # Broyden's update: the observed change, along the direction of the step
        jac = jac + np.outer(bent, step * finite**2 / max(length2, 1e-300))
        fresh = False
    if jac is None:
        # ended just after a poor prediction: the next descent computes the Jacobian
        jac = np.full((r.size, int(free.sum())), np.nan)
    return LocalFit(x, chi2 / problem.samples, r, jac, done, converged)


#: Descent of a problem from a fit, with at most so many iterations.
Descent = Callable[[Problem, LocalFit, int], LocalFit]


def _descend_coarsely(
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
