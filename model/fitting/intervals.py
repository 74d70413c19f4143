"""How far each number could be from its estimate: covariance and profile likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from model.fitting.levenberg import descend
from model.fitting.problem import Problem

__all__ = ["CHI2_95", "correlation_time", "covariance", "profile"]

CHI2_95 = 3.841458820694124  #: 95 % of chi-square with one degree of freedom
_POINTS_MAX = 7  # on one side of a profile
_NEAR = 0.06  # of the threshold's root: close enough to call it crossed


def correlation_time(residuals: np.ndarray) -> float:
    """Integrated autocorrelation time of ``residuals`` (N,) in samples, 1 for white noise.

    N correlated residuals say no more than N over this number of independent ones. Summed until
    the first lag whose correlation is lost in the noise (Sokal's window would need a model).
    """
    n = residuals.size
    centred = residuals - residuals.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[: n // 2]
    if correlation[0] <= 0.0:
        return 1.0
    correlation /= correlation[0]
    lost = np.flatnonzero(correlation < 2.0 / math.sqrt(n))
    end = int(lost[0]) if lost.size else correlation.size
    return float(1.0 + 2.0 * correlation[1:end].sum())


def covariance(normal: np.ndarray, inflation: float) -> np.ndarray:
    """Covariance (f, f) of the coordinates from J^T J, times ``inflation``.

    Directions that the data do not see at all get a huge variance rather than an exception.
    """
    if normal.size == 0:
        return normal
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    w, q = np.linalg.eigh(normal / np.outer(scale, scale))
    inverse = (q / np.maximum(w, 1e-14)) @ q.T
    return inflation * inverse / np.outer(scale, scale)


def profile(
    problem: Problem,
    best: np.ndarray,
    chi2: float,
    index: int,
    cov: np.ndarray,
    inflation: float,
    held: np.ndarray,
    tick: Callable[[], None],
    sides: tuple[float, ...] = (-1.0, 1.0),
) -> tuple[float, float]:
    """95 % interval of coordinate ``index``: where refitting all others no longer keeps up.

    ``best`` (d,) with chi-square ``chi2`` is the optimum, ``cov`` (d, d) the covariance, which
    says how far to step and where the others will go, ``inflation`` the factor by which chi-square
    counts less than its white-noise value, ``held`` (d,) bool the numbers that are not refitted.
    An end that the data leave open, or that is not among the ``sides`` sought, is -inf or inf.
    ``tick`` is called at each point.
    """
    layout = problem.layout
    fixed = held.copy()
    fixed[index] = True
    threshold = CHI2_95 * inflation
    sigma = math.sqrt(cov[index, index])
    tangent = cov[:, index] / cov[index, index]
    ends = {-1.0: -math.inf, 1.0: math.inf}
    for sign in sides:
        bound = layout.lower[index] if sign < 0 else layout.upper[index]
        reach = layout.reach(best)
        step = min(1.96 * sigma * math.sqrt(inflation), reach[index])
        inside, z_inside, here = best[index], 0.0, best
        ahead = tangent  # how the others move with this one
        outside, z_outside = math.inf, math.inf
        end = sign * math.inf
        for _ in range(_POINTS_MAX):
            tick()
            step_before = step
            at_bound = sign * (inside + sign * step - bound) >= 0.0
            point = bound if at_bound else inside + sign * step
            # the others move no further at once than this one may: a tangent is no map
            shift = np.clip(ahead * (point - inside), -reach, reach)
            warm = np.where(held, here, here + shift)
            warm[index] = point
            # the gain asked of the refit is a fraction of what decides
            fit = descend(problem, warm, fixed, iterations=8, gain=0.03 * threshold, damping=1e-5)
            z = math.sqrt(max(fit.cost * problem.samples - chi2, 0.0) / threshold)
            if abs(z - 1.0) < _NEAR:
                end = point
                break
            if z < 1.0:
                if at_bound:
                    break
                slope = (z - z_inside) / max(abs(point - inside), 1e-300)
                if point != inside:
                    ahead = (fit.x - here) / (point - inside)
                inside, z_inside, here = point, z, fit.x
                step = (1.0 - z) / slope if slope > 0.0 else reach[index]
                step = min(step, 4.0 * step_before, reach[index])
            else:
                outside, z_outside = point, z
            if math.isfinite(outside):
                # the root of chi-square is nearly straight near the threshold, and nowhere else
                part = 0.4
                if z_outside < 4.0:
                    part = min(max((1.0 - z_inside) / (z_outside - z_inside), 0.15), 0.85)
                step = abs(outside - inside) * part
                end = inside + sign * step
        ends[sign] = end
    return ends[-1.0], ends[1.0]
