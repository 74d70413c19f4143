"""Levenberg-Marquardt least squares in scaled coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from dearig.model.fitting.problem import Problem

__all__ = ["LocalFit", "descend", "gain_that_counts"]

# tried at once, relative to the current one: a step ten times too long leaves a narrow valley
_DAMPINGS = np.array([0.03, 0.3, 3.0, 30.0])
_DAMPING_MIN, _DAMPING_MAX = 1e-12, 1e8
_GAIN_MIN = 0.1  # of chi-square: a third of a standard deviation of any parameter
_GAIN_LEFT = 0.01  # of the gain asked for: the step to so little is not taken
_PROBE = 0.1  # of a step: length of the finite difference along it
_BEND_MAX = 0.4  # of a step: a larger second-order part is left out
_GAIN_MISFIT = 0.01  # of chi-square over the number of samples, where residuals exceed the noise
_PATIENCE = 5  # iterations that together must lower chi-square by the gain asked for
_FLAT = 1e-9  # of the scaled curvature: the data do not determine flatter directions


@dataclass(frozen=True)
class LocalFit:
    """End of a descent: coordinates ``x`` (d,), mean-square cost, residuals (N,).

    ``jacobian`` (N, f) over the free coordinates is that of the last iteration, at ``x`` or one
    step before. ``to_gain`` is what the quadratic model at ``x`` would still take off chi-square, 0
    where there is none at ``x``. ``also_columns`` (N, b) are the columns of other parameters where
    ``jacobian`` is, as far as they were asked for. ``starts`` are those of the global search that
    led here, best first: the cost that each reached, and whether it was followed to its end.
    """

    x: np.ndarray
    cost: float
    residuals: np.ndarray
    jacobian: np.ndarray
    iterations: int
    converged: bool
    to_gain: float = 0.0
    also_columns: np.ndarray | None = None
    starts: tuple[tuple[float, bool], ...] = ()


def descend(
    problem: Problem,
    start: np.ndarray,
    fixed: np.ndarray | None = None,
    iterations: int = 60,
    gain: float | None = None,
    damping: float = 1e-2,
    patience: int = _PATIENCE,
    quick: bool = False,
    straight: bool = False,
    known: np.ndarray | None = None,
    also: np.ndarray | None = None,
) -> LocalFit:
    """Minimise least squares from ``start`` (d,), inside the layout's bounds: one loop, one state.

    ``fixed`` (d,) bool holds parameters. Marquardt's scaling (each coordinate by the length of its
    Jacobian column) keeps parameters with little influence, such as J at small stretch, from
    distorting the steps of the others. Each iteration tries several dampings at once, as one
    population on all cores, each with its geodesic acceleration: the valleys of relaxation spectra
    are long, narrow and curved.

    It ends with the step for which the quadratic model predicts a gain in chi-square of less than
    ``gain`` (not taken by a ``straight`` one: see ``LocalFit.to_gain``), or when
    ``patience`` iterations together gained less. Without a ``gain`` it is a tenth, or more where
    the residuals are far above the noise. ``damping`` is the first one, relative to the
    scaled curvature; near an optimum it may be small. ``quick`` takes one-sided differences at
    half the cost; they blur only the difference of two branches of nearly equal relaxation times.
    ``straight`` is for a start next to the optimum: steps have no second order, and the Jacobian of
    a step tells how much gain the step left. ``known`` are the residuals (N,) at ``start``, None
    where they are to be computed. ``also`` (d,) bool are ``fixed`` parameters whose derivatives
    are asked for with the others.
    """
    layout = problem.layout
    free = np.ones(layout.size, dtype=bool) if fixed is None else ~fixed
    x = np.clip(start, layout.lower, layout.upper)
    r = problem.residuals(x) if known is None else known
    chi2 = float(r @ r)
    asked = free if also is None else free | also
    whole = np.zeros((r.size, int(asked.sum())))
    scale = np.zeros(int(free.sum()))
    jac = np.zeros((r.size, scale.size))
    history = [chi2]
    converged = not free.any()
    done, to_gain = 0, 0.0
    while done < iterations and not converged:
        done += 1
        whole = problem.jacobian(x, asked, r if quick else None)
        jac = whole if also is None else whole[:, free[asked]]
        normal, gradient = jac.T @ jac, jac.T @ r
        scale = np.maximum(np.sqrt(np.diag(normal)), 1e-3 * scale)
        safe = np.where(scale > 0.0, scale, 1.0)
        # a parameter at a bound whose gradient points outwards stays there
        part, reach = x[free], layout.reach(x)[free]
        stuck = ((part <= layout.lower[free]) & (gradient > 0.0)) | (
            (part >= layout.upper[free]) & (gradient < 0.0)
        )
        move = ~stuck & (scale > 0.0)
        if not move.any():
            converged = True
            break
        w, q = eigh((normal / np.outer(safe, safe))[np.ix_(move, move)])
        target = q.T @ (gradient / safe)[move]
        enough = gain_that_counts(chi2, problem.samples) if gain is None else gain
        # gain that the quadratic model predicts, flat directions excepted
        predicted = float(np.sum(target**2 / np.maximum(w, _FLAT)))
        last = predicted < enough
        if last and (straight or predicted < _GAIN_LEFT * enough):
            converged, to_gain = True, predicted
            break
        improved = False
        while not improved and damping <= _DAMPING_MAX:
            dampings = damping * _DAMPINGS
            # rows: one first-order step for each damping, by the eigenvectors of the scaled J^T J
            inverse = 1.0 / (np.maximum(w, 0.0) + dampings[:, None])
            steps = np.zeros((dampings.size, part.size))
            steps[:, move] = -((inverse * target) @ q.T) / safe[move]
            steps /= np.maximum(1.0, np.max(np.abs(steps) / reach, axis=1))[:, None]
            if not (straight or last):
                steps += _bend(problem, x, free, r, jac, steps, move, safe, q, inverse)
            trials = np.tile(x, (dampings.size, 1))
            trials[:, free] = np.clip(part + steps, layout.lower[free], layout.upper[free])
            means, residuals = problem.evaluate(trials)
            costs = means * problem.samples
            best = int(np.argmin(costs))
            if costs[best] < chi2:
                improved = True
                x, chi2, r = trials[best], float(costs[best]), residuals[best]
                damping = max(dampings[best], _DAMPING_MIN)
            else:
                damping *= 1e3
            if last:
                break
        if last or not improved:
            converged = True
            break
        history.append(chi2)
        if straight:
            target = q.T @ ((jac.T @ r) / safe)[move]
            left = float(np.sum(target**2 / np.maximum(w, _FLAT)))
            if left < enough:
                converged, to_gain = True, left
                break
        converged = len(history) > patience and history[-1 - patience] - chi2 < enough
    also_columns = None if also is None else whole[:, also[asked]]
    return LocalFit(x, chi2 / problem.samples, r, jac, done, converged, to_gain, also_columns)


def gain_that_counts(chi2: float, samples: int) -> float:
    """Return the least gain in ``chi2`` for which a descent goes on.

    It is a tenth, or more where the residuals are far above the noise.
    """
    return max(_GAIN_MIN, _GAIN_MISFIT * chi2 / samples)


def _bend(
    problem: Problem,
    x: np.ndarray,
    free: np.ndarray,
    r: np.ndarray,
    jac: np.ndarray,
    steps: np.ndarray,
    move: np.ndarray,
    safe: np.ndarray,
    q: np.ndarray,
    inverse: np.ndarray,
) -> np.ndarray:
    """Second-order part (D, f) of ``steps`` (D, f): geodesic acceleration.

    Transtrum and Sethna (2012): half the step that cancels the second derivative of the residuals
    along the first-order step. It is zero where it is not small against that step.
    """
    layout = problem.layout
    probes = np.tile(x, (steps.shape[0], 1))
    probes[:, free] += _PROBE * steps
    inside = np.all((probes >= layout.lower) & (probes <= layout.upper), axis=1)
    probes = np.clip(probes, layout.lower, layout.upper)
    _, shifted = problem.evaluate(probes)
    second = 2.0 / _PROBE * ((shifted - r) / _PROBE - steps @ jac.T)
    push = (second @ jac)[:, move] / safe[move]
    bend = np.zeros_like(steps)
    bend[:, move] = -0.5 * (((push @ q) * inverse) @ q.T) / safe[move]
    small = np.linalg.norm(bend * safe, axis=1) <= _BEND_MAX * np.linalg.norm(steps * safe, axis=1)
    return np.where((small & inside)[:, None], bend, 0.0)
