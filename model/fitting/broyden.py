"""Least squares with few simulations: the Jacobian is carried along by secants (Broyden).

Trying dozens of effects needs to know how low each can get, not where exactly: a Jacobian that is
known nearby (that of the model without the effect) is a good start, each step taken corrects it for
the direction gone, and it is computed anew only where it has led astray or nothing is left to gain.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import lsq_linear

from dearig.model.fitting.anchored import by_sketches
from dearig.model.fitting.levenberg import LocalFit
from dearig.model.fitting.problem import Problem

__all__ = ["boxed_step", "descend_by_secants"]

_DAMPINGS = np.array([3e-3, 1.0])  # tried at once, times the present damping
_DAMPING_MAX = 1e7
_FLAT = 1e-9  # of the scaled curvature: flatter directions are not seen by the data
_CARRIED = 5  # steps by secants, then the Jacobian is computed anew
_PATIENCE = 3  # Jacobians that together must gain something
_ASTRAY = 0.25  # of the gain that was promised: less, and the Jacobian is computed anew


def boxed_step(
    normal: np.ndarray, gradient: np.ndarray, damping: float, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Damped least-squares step (f,) within a box about 0, the best one there.

    It minimises 2 gradient.s + s.(normal + damping I).s for low <= s <= high, all (f,). Clipped
    afterwards, a step along a narrow valley would leave the valley.
    """
    root = cholesky(normal + damping * np.eye(gradient.size))
    step = -cho_solve((root, False), gradient)
    if np.all((low <= step) & (step <= high)):
        return np.asarray(step)
    # where a bound leaves no room at all there is nothing to solve for
    open_ = high - low > 1e-12 * (1.0 + np.abs(low) + np.abs(high))
    step = np.where(open_, 0.0, np.clip(0.0, low, high))
    if open_.any():
        # |root step - aim|^2 is the quadratic model, but for a constant
        aim = -solve_triangular(root, gradient, trans="T") - root @ step
        found = lsq_linear(root[:, open_], aim, (low[open_], high[open_]), method="bvls")
        step[open_] = np.clip(found.x, low[open_], high[open_])
    return step


def descend_by_secants(
    problem: Problem,
    start: np.ndarray,
    fixed: np.ndarray,
    jacobian: np.ndarray | None = None,
    iterations: int = 30,
    gain: float = 1.0,
    sure: bool = True,
) -> LocalFit:
    """From ``start`` (d,) down, the numbers ``fixed`` (d,) held, inside the layout's bounds.

    On the records' sketches, as far as these lead, then on the whole records.

    ``jacobian`` (N, f) is one known near the start, None to compute it; columns of it that are not
    finite are computed. Has converged where the quadratic model promises less than ``gain`` in
    chi-square, with ``sure`` only by a Jacobian of that place; gives up where several Jacobians
    together have gained no more.
    """
    free = ~fixed
    x = np.clip(start, problem.layout.lower, problem.layout.upper)
    costs, residuals = problem.evaluate(x[None])
    unknown = np.full((residuals.shape[1], int(free.sum())), np.nan)
    here = LocalFit(
        x, float(costs[0]), residuals[0], unknown if jacobian is None else jacobian, 0, False
    )

    def on_sketches(sketch: Problem, here: LocalFit, iterations: int) -> LocalFit:
        return _by_secants(sketch, here, free, iterations, gain, sure, by_sketch=False)

    reached = by_sketches(on_sketches, problem, here, free, iterations, gain)
    if reached.iterations >= iterations or (reached.converged and not sure):
        return reached
    # a descent on sketches needs all numbers told, a Jacobian takes what columns there are
    told = np.zeros(1, dtype=bool) if problem.sketched is None else problem.sketched[free]
    some = bool(told.any()) and not told.all()
    by_sketch = some and problem.sketch(x, here.residuals) is not None
    rest = _by_secants(
        problem, reached, free, iterations - reached.iterations, gain, sure, by_sketch
    )
    return replace(rest, iterations=reached.iterations + rest.iterations)


def _by_secants(
    problem: Problem,
    here: LocalFit,
    free: np.ndarray,
    iterations: int,
    gain: float,
    sure: bool,
    by_sketch: bool,
) -> LocalFit:
    """From ``here`` down; its Jacobian is one known nearby, or not finite where it is not known.

    Others are ``by_sketch`` as far as they lead: along a valley numbers nearly cancel, and what is
    left there sketches do not tell.
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
        jac[:, unknown] = problem.jacobian(x, which, r, by_sketch)
    damping, done, converged, carried = 1e-2, 0, False, 0
    marks: list[float] = []
    while done < iterations:
        if jac is None:
            # what promises and does not keep it is a valley that curves: secants do not follow it
            marks.append(chi2)
            if len(marks) > _PATIENCE and marks[-1 - _PATIENCE] - chi2 < gain:
                break
            jac, fresh, carried = problem.jacobian(x, free, r, by_sketch), True, 0
        done += 1
        scale = np.linalg.norm(jac, axis=0)
        scale = np.where(scale > 0.0, scale, np.inf)  # what is not seen does not move
        normal, gradient = (jac / scale).T @ (jac / scale), (jac / scale).T @ r
        part, reach = x[free], layout.reach(x)[free]
        finite = np.where(np.isfinite(scale), scale, 0.0)
        low = np.maximum(layout.lower[free] - part, -reach) * finite
        high = np.minimum(layout.upper[free] - part, reach) * finite
        best_step = boxed_step(normal, gradient, _FLAT, low, high)
        if -float(best_step @ (2.0 * gradient + normal @ best_step)) < gain:
            if not sure or (fresh and not by_sketch):
                converged = True
                break
            if fresh:
                by_sketch = False
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
            if by_sketch:
                jac, by_sketch = None, False
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
        promised = chi2 - float(straight @ straight)
        length2 = float(np.sum((step * finite) ** 2))
        astray = chi2 - better < _ASTRAY * promised
        x, r, chi2 = trials[best], residuals[best], better
        damping = max(dampings[best], 1e-9)
        carried += 1
        if (astray and not fresh) or carried > _CARRIED:
            jac = None
            continue
        # the secant: what the step showed, in the direction gone
        jac = jac + np.outer(bent, step * finite**2 / max(length2, 1e-300))
        fresh = False
    if jac is None:
        # given up just after it led astray: whoever goes on from here computes it
        jac = np.full((r.size, int(free.sum())), np.nan)
    return LocalFit(x, chi2 / problem.samples, r, jac, done, converged)
