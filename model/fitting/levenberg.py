"""Levenberg-Marquardt least squares in scaled coordinates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem

__all__ = [
    "LocalFit",
    "box_of",
    "boxed_step",
    "descend",
    "gain_that_counts",
    "gain_within",
    "straight_and_scaled",
]

# tried at once, relative to the current one: a step ten times too long leaves a narrow valley
_DAMPINGS = np.array([0.03, 0.3, 3.0, 30.0])
_DAMPING_MIN, _DAMPING_MAX = 1e-12, 1e8
_GAIN_MIN = 0.1  # of chi-square: a third of a standard deviation of any parameter
_GAIN_LEFT = 0.01  # of the gain asked for: the step to so little is not taken
_STRAIGHT_MIN = 0.5  # of the predicted gain: where less comes, the valley bends
_PROBE = 0.1  # of a step: length of the finite difference along it
_BEND_MAX = 0.4  # of a step: a larger second-order part is left out
_SAME = 1e-3  # of a modulus: a step so short is one with either
_FACTOR_MAX = 3.0  # logarithm of the factor by which a modulus moves at most in a step
_TURNS_MAX = 4  # of each coordinate of a step between the inside and an end of its box
_NO_ROOM = 1e-12  # relative: such an interval is a point
_NO_PULL = 1e-9  # of the largest gradient: rounding
_GAIN_MISFIT = 0.01  # of chi-square over the number of samples, where residuals exceed the noise
_PATIENCE = 5  # iterations that together must lower chi-square by the gain asked for
_FLAT = 1e-9  # of the scaled curvature: the data do not determine flatter directions


@dataclass(frozen=True)
class LocalFit:
    """End of a descent: coordinates ``x`` (d,), mean-square cost, residuals (N,).

    ``jacobian`` (N, f) over the free coordinates is that of the last iteration, at ``x`` or one
    step before. ``to_gain`` is what the quadratic model at ``x`` would still take off chi-square, 0
    where there is none at ``x``. ``beside`` (N, b) are the columns of other parameters where
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
    beside: np.ndarray | None = None
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
    beside: np.ndarray | None = None,
) -> LocalFit:
    """Minimise least squares from ``start`` (d,), inside the layout's bounds: one loop, one state.

    ``fixed`` (d,) bool holds parameters. Marquardt's scaling (each coordinate by the length of its
    Jacobian column) keeps parameters with little influence, such as J at small stretch, from
    distorting the steps of the others. Each iteration tries several dampings at once, as one
    population on all cores, within a box of the bounds and of what derivatives hold for, along a
    straight line and along a curve on which moduli move by factors. Where a step gains less than
    its quadratic model predicts, the next ones are tried with their geodesic acceleration too: the
    valleys of relaxation spectra are long, narrow and curved.

    It ends with the step for which the quadratic model predicts a gain in chi-square of less than
    ``gain`` (not taken by a ``straight`` one: see ``LocalFit.to_gain``), or when
    ``patience`` iterations together gained less. Without a ``gain`` it is a tenth, or more where
    the residuals are far above the noise. ``damping`` is the first one, relative to the
    scaled curvature; near an optimum it may be small. ``quick`` takes one-sided differences at
    half the cost; they blur only the difference of two branches of nearly equal relaxation times.
    ``straight`` is for a start next to the optimum: steps are along straight lines, and the
    Jacobian of a step tells how much gain it left. ``known`` are the residuals (N,) at ``start``,
    None where they are to be computed. ``beside`` (d,) bool are ``fixed`` parameters whose
    derivatives are asked for with the others.
    """
    layout = problem.layout
    free = np.ones(layout.size, dtype=bool) if fixed is None else ~fixed
    x = np.clip(start, layout.lower, layout.upper)
    r = problem.residuals(x) if known is None else known
    chi2 = float(r @ r)
    asked = free if beside is None else free | beside
    whole = np.zeros((r.size, int(asked.sum())))
    scale = np.zeros(int(free.sum()))
    jac = np.zeros((r.size, scale.size))
    history = [chi2]
    converged = not free.any()
    done, to_gain, bent = 0, 0.0, False
    while done < iterations and not converged:
        done += 1
        whole = problem.jacobian(x, asked, r if quick else None)
        jac = whole if beside is None else whole[:, free[asked]]
        normal, gradient = jac.T @ jac, jac.T @ r
        scale = np.maximum(np.sqrt(np.diag(normal)), 1e-3 * scale)
        safe = np.where(scale > 0.0, scale, 1.0)
        scaled, pull = normal / np.outer(safe, safe), gradient / safe
        # a coordinate without influence does not move
        low, high = (ends * np.where(scale > 0.0, scale, 0.0) for ends in box_of(layout, x, free))
        enough = gain_that_counts(chi2, problem.samples) if gain is None else gain
        predicted = gain_within(scaled, pull, low, high)
        last = predicted < enough
        if last and (straight or predicted < _GAIN_LEFT * enough):
            converged, to_gain = True, predicted
            break
        improved = False
        while not improved and damping <= _DAMPING_MAX:
            dampings = damping * _DAMPINGS
            steps = np.array([boxed_step(scaled, pull, d, low, high) for d in dampings]) / safe
            trials = straight_and_scaled(layout, x, free, steps)
            if straight:
                trials = trials[: len(steps)]
            elif bent and not last:
                damped = [
                    ((low < s) & (s < high), scaled + d * np.eye(s.size))
                    for s, d in zip(steps * safe, dampings, strict=True)
                ]
                turned = np.tile(x, (len(steps), 1))
                turned[:, free] += steps + _bend(problem, x, free, r, jac, steps, damped)
                trials = np.vstack([trials, np.clip(turned, layout.lower, layout.upper)])
            means, residuals = problem.evaluate(trials)
            costs = means * problem.samples
            best = int(np.argmin(costs))
            if costs[best] < chi2:
                improved = True
                x, chi2, r = trials[best], float(costs[best]), residuals[best]
                damping = max(dampings[best % dampings.size], _DAMPING_MIN)
            else:
                damping *= 1e3
            if last:
                break
        if last or not improved:
            converged = True
            break
        bent = history[-1] - chi2 < _STRAIGHT_MIN * predicted
        history.append(chi2)
        if straight:
            left = gain_within(scaled, (jac.T @ r) / safe, low, high)
            if left < enough:
                converged, to_gain = True, left
                break
        converged = len(history) > patience and history[-1 - patience] - chi2 < enough
    others = None if beside is None else whole[:, beside[asked]]
    return LocalFit(x, chi2 / problem.samples, r, jac, done, converged, to_gain, others)


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
    damped: Sequence[tuple[np.ndarray, np.ndarray]],
) -> np.ndarray:
    """Second-order part (D, f) of ``steps`` (D, f): geodesic acceleration.

    Transtrum and Sethna (2012): half the step that cancels the second derivative of the residuals
    ``r`` (N,) along the first-order step. ``damped`` are for each step the coordinates (f,) that
    are inside of its box, and the damped normal matrix (f, f). It is zero where it is not small
    against that step.
    """
    probes = np.tile(x, (len(steps), 1))
    probes[:, free] += _PROBE * steps
    _, shifted = problem.evaluate(probes)
    second = 2.0 / _PROBE * ((shifted - r) / _PROBE - steps @ jac.T)
    push = second @ jac
    bend = np.zeros_like(steps)
    scale = np.linalg.norm(jac, axis=0)
    for row, (inside, matrix) in enumerate(damped):
        part = np.linalg.solve(matrix[np.ix_(inside, inside)], push[row, inside] / scale[inside])
        bend[row, inside] = -0.5 * part / scale[inside]
    small = np.linalg.norm(bend * scale, axis=1) <= _BEND_MAX * np.linalg.norm(
        steps * scale, axis=1
    )
    return np.where(small[:, None], bend, 0.0)


def boxed_step(
    normal: np.ndarray, gradient: np.ndarray, damping: float, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the best damped least-squares step (f,) within a box about 0.

    It minimises 2 gradient.s + s.(normal + damping I).s for low <= s <= high, all (f,). A step that
    is clipped afterwards would leave a narrow valley of the cost. Active set: the step goes towards
    the best one of the coordinates that are not at an end, until one of them is; one that the
    gradient pulls inside is let go again (Nocedal and Wright, Numerical Optimization, 16.5).
    """
    matrix = normal + damping * np.eye(gradient.size)
    step = np.clip(np.zeros(gradient.size), low, high)
    # a coordinate without room between its ends is no unknown
    room = high - low > _NO_ROOM * (1.0 + np.abs(low) + np.abs(high))
    inside = room.copy()
    for _ in range(_TURNS_MAX * gradient.size):
        best = step.copy()
        known = -gradient[inside] - matrix[np.ix_(inside, ~inside)] @ step[~inside]
        best[inside] = np.linalg.solve(matrix[np.ix_(inside, inside)], known)
        way = best - step
        ends = np.where(way > 0.0, high, low)
        beyond = inside & ((best < low) | (best > high))
        if beyond.any():
            parts = np.full(step.size, math.inf)
            parts[beyond] = (ends - step)[beyond] / way[beyond]
            first = int(np.argmin(parts))
            step = np.clip(step + parts[first] * way, low, high)
            step[first], inside[first] = ends[first], False
            continue
        step = best
        pull = gradient + matrix @ step
        pull = np.where(room & ~inside, np.where(step <= low, -pull, pull), 0.0)
        if not np.max(pull, initial=0.0) > _NO_PULL * float(np.max(np.abs(gradient), initial=0.0)):
            break
        inside[int(np.argmax(pull))] = True
    return step


def gain_within(
    normal: np.ndarray, gradient: np.ndarray, low: np.ndarray, high: np.ndarray
) -> float:
    """Return the gain that the quadratic model predicts within a box, flat directions excepted.

    The ``normal`` matrix (f, f) has a diagonal of 1.
    """
    best = boxed_step(normal, gradient, _FLAT, low, high)
    return -float(best @ (2.0 * gradient + normal @ best))


def box_of(layout: FitLayout, x: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends (f,) of steps from ``x`` (d,): bounds, and as far as derivatives hold."""
    part, reach = x[free], layout.reach(x)[free]
    return (
        np.maximum(layout.lower[free] - part, -reach),
        np.minimum(layout.upper[free] - part, reach),
    )


def straight_and_scaled(
    layout: FitLayout, x: np.ndarray, free: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Return coordinates (2 D, d) after ``steps`` (D, f) of the ``free`` ones from ``x`` (d,).

    Along straight lines, then with moduli that move by factors; (D, d) where both are the same.
    What two branches of nearly equal times have together is a sum of their moduli, and straight. Of
    a fast branch the data determine modulus times relaxation time: that valley is straight in
    logarithms.
    """
    found = np.tile(x, (2 * len(steps), 1))
    found[:, free] += np.vstack([steps, steps])
    moduli = layout.column("mu")
    moduli = moduli[free[moduli] & (x[moduli] > 0.0)]
    own, scaled = x[moduli], found[len(steps) :]
    with np.errstate(divide="ignore"):
        most = np.log(layout.upper[moduli] / own)
    part = np.clip((scaled[:, moduli] - own) / own, -_FACTOR_MAX, np.minimum(most, _FACTOR_MAX))
    if np.max(np.abs(part), initial=0.0) < _SAME:
        return np.clip(found[: len(steps)], layout.lower, layout.upper)
    scaled[:, moduli] = own * np.exp(part)
    return np.clip(found, layout.lower, layout.upper)
