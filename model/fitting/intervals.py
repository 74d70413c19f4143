"""Uncertainty of parameters: covariance and profile likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import kolmogorov

from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import FitLayout, FreeParameter
from dearig.model.fitting.problem import Problem

__all__ = [
    "CHI2_95",
    "OPEN",
    "BetterPoint",
    "correlation_end",
    "correlation_time",
    "covariance",
    "firm_directions",
    "has_spectrum_of",
    "is_determined",
    "is_flat",
    "linear_ends",
    "linear_widths",
    "natural_ends",
    "open_text",
    "profile",
    "spectrum_distance",
    "unevenness",
]

#: Note of a parameter of which nothing is determined.
OPEN = "not determined by these data"

CHI2_95 = 3.841458820694124  #: 95 % of chi-square with one degree of freedom
_NORMAL_95 = math.sqrt(CHI2_95)
#: Least eigenvalue of a normal matrix, in units of its diagonal, of a direction that the data
#: determine. Derivatives by differences are known to some 1e-5; a smaller eigenvalue is the square
#: of their error.
_FIRM = 1e-10
_DETERMINED_RATIO = 5.0  # ratio of the ends of an interval, above which a value is not quoted
_POINTS_MAX = 8  # on one side of a profile
_NEAR = 0.06  # of the threshold's root: tolerance of its crossing
_NEAR_A_LIMIT = 0.3  # the same for an undetermined limit, which is bounded to decades only
_SHORTER = (1.0, 0.5, 0.25, 0.1, 0.03)  # of a step, tried in turn
_BY_CHANCE = 0.01  # significance level: share of white noise that the test rejects
_EXPONENT_MAX = 700.0  # of a number that the machine has
_GUESS_MAX = 1e4  # thresholds above the optimum from which a refit takes a few iterations


def correlation_time(residuals: np.ndarray) -> float:
    """Return the integrated autocorrelation time of ``residuals`` (N,) in samples.

    It is 1 for white noise. N correlated residuals carry as much information as N over this number
    of independent ones. The sum ends at the first lag whose correlation is within the noise
    (Sokal's window needs a model).
    """
    correlation = _correlation(residuals)
    end = _lost_at(correlation, residuals.size)
    return float(1.0 + 2.0 * correlation[1:end].sum())


def correlation_end(residuals: np.ndarray) -> int:
    """Return the first lag in samples at which ``residuals`` (N,) are no longer correlated.

    It is at least 1, and at most a quarter of N.
    """
    return max(1, min(_lost_at(_correlation(residuals), residuals.size), residuals.size // 4))


def _correlation(residuals: np.ndarray) -> np.ndarray:
    """Return the autocorrelation at each lag below half the samples; 0 of what is constant."""
    n = residuals.size
    centred = residuals - residuals.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[: n // 2]
    if correlation.size == 0 or correlation[0] <= 0.0:
        return np.zeros(n // 2)
    return np.asarray(correlation / correlation[0])


def _lost_at(correlation: np.ndarray, samples: int) -> int:
    """Return the first lag at which a ``correlation`` is within the noise of so many samples."""
    lost = np.flatnonzero(correlation < 2.0 / math.sqrt(samples))
    return int(lost[0]) if lost.size else correlation.size


def is_flat(residuals: np.ndarray) -> bool:
    """Whether the spectrum of ``residuals`` (N,) is flat."""
    return unevenness(residuals) == 0.0


def unevenness(residuals: np.ndarray, by_chance: float = _BY_CHANCE) -> float:
    """Return the least share of the power of ``residuals`` (N,) that white noise does not explain.

    0 where white noise shows as much with a probability above ``by_chance``.
    With 5000 samples it detects a twentieth of the power elsewhere.
    """
    away, lines = spectrum_distance(residuals)
    return away if kolmogorov(away * math.sqrt(lines)) <= by_chance else 0.0


def has_spectrum_of(residuals: np.ndarray, noise: np.ndarray) -> bool:
    """Whether ``residuals`` (N,) have the spectrum of a sample of ``noise`` (M,), by chance."""
    away, lines = spectrum_distance(residuals, noise)
    return bool(kolmogorov(away * math.sqrt(lines)) > _BY_CHANCE)


def spectrum_distance(
    residuals: np.ndarray, noise: np.ndarray | None = None
) -> tuple[float, float]:
    """Return how far the summed periodogram of ``residuals`` (N,) is from that of noise.

    The largest distance of the two, each divided by its total, and how many independent lines it
    counts for: times their root it is distributed as Kolmogorov's. White noise, for a ``noise`` of
    None, has a straight line (Bartlett's test; Durbin, Biometrika 56, 1969). Against a sample of
    ``noise`` (M,) it is the test of Kolmogorov and Smirnov; there a line of a periodogram has the
    variance of its mean squared, so that a spectrum of few lines counts as few.
    """
    sums = [np.abs(np.fft.rfft(values - values.mean()))[1:-1] ** 2 for values in (residuals,)]
    if noise is not None:
        sums.append(np.abs(np.fft.rfft(noise - noise.mean()))[1:-1] ** 2)
    if any(power.size < 2 or float(power.sum()) <= 0.0 for power in sums):
        return 0.0, 0.0
    if noise is None:
        summed = np.cumsum(sums[0])
        m = summed.size - 1
        line = np.arange(1, m + 1) / (m + 1.0)
        return float(np.max(np.abs(summed[:-1] / summed[-1] - line))), float(m)
    (place, summed), (other, also) = (
        (np.arange(1, power.size + 1) / power.size, np.cumsum(power) / power.sum())
        for power in sums
    )
    lines = [2.0 * float(power.sum()) ** 2 / float(power @ power) for power in sums]
    away = float(np.max(np.abs(np.interp(other, place, summed) - also)))
    return away, 1.0 / (1.0 / lines[0] + 1.0 / lines[1])


def natural_ends(q: FreeParameter, low: float, high: float) -> tuple[float, float]:
    """Return the natural ends of an interval of the coordinate of ``q``.

    An open end of a spring's parameter is 0 or infinite, of an effect's the end of its range, and
    that of a stated range the bound. A modulus at the lower end of its search range is 0.
    """
    if q.logarithmic:
        # beyond it an exponential is infinite
        low, high = (math.exp(x) if x < _EXPONENT_MAX else math.inf for x in (low, high))
    lowest, highest = q.open_ends
    if q.kind == "mu" and low <= q.search_range[0]:
        low = 0.0
    return max(low, lowest), min(high, highest)


def is_determined(low: float, high: float) -> bool:
    """Whether an interval is narrow enough for its value to be quoted, and excludes 0."""
    near, far = sorted((abs(low), abs(high)))
    return low * high > 0.0 and far < math.inf and far / near <= _DETERMINED_RATIO


def open_text(low: float, high: float) -> str:
    """Return what an interval says of a parameter that it does not determine."""
    if low < 0.0 < high:
        return "not distinguishable from 0 with these data"
    if low == 0.0 and math.isinf(high):
        return OPEN
    if math.isinf(high):
        return "only a lower bound"
    if low == 0.0:
        return "only an upper bound"
    return f"known only within a factor of {high / low:.3g}"


def covariance(normal: np.ndarray, inflation: float) -> np.ndarray:
    """Return the covariance (f, f) of the coordinates from J^T J, times ``inflation``.

    Directions without influence on the data get a huge variance, not an exception.
    """
    return inflation * _inverse(normal, lambda w: 1.0 / np.maximum(w, 1e-14))


def _inverse(normal: np.ndarray, of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the inverse of ``normal`` (f, f); ``of`` inverts its scaled eigenvalues."""
    if normal.size == 0:
        return normal
    seen = np.sqrt(np.diag(normal))
    scale = np.maximum(seen, 1e-12 * (float(seen.max()) or 1.0))
    w, q = np.linalg.eigh(normal / np.outer(scale, scale))
    return np.asarray((q * of(w)) @ q.T / np.outer(scale, scale))


def _pseudo_inverse(normal: np.ndarray) -> np.ndarray:
    """Return the inverse of ``normal`` (f, f), 0 along directions that are not determined."""
    return _inverse(normal, lambda w: np.where(w > _FIRM, 1.0 / np.maximum(w, _FIRM), 0.0))


def firm_directions(
    jacobian: np.ndarray, values: np.ndarray, layout: FitLayout, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return directions (f, m) in which intervals are linear, and which parameters (d,) are not.

    ``jacobian`` (N, f) is that at the natural ``values`` (d,), over the ``free`` (d,) parameters.
    Along the other directions an interval reaches as far as a parameter itself: there chi-square is
    no parabola, and no derivative says how wide the interval is. The parameters (d,) bool are those
    that such a direction moves beyond their own linear interval, though not as far as themselves.
    """
    scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    _, singular, rows = np.linalg.svd(jacobian / scale, full_matrices=False)
    own = np.where([q.logarithmic for q in layout.quantities], 1.0, np.abs(values))[free]
    reach = _NORMAL_95 * np.abs(rows) / np.maximum(singular, 1e-300)[:, None] / scale
    firm = ~(reach >= own).any(axis=1)
    whole = np.sqrt(np.sum(reach[firm] ** 2, axis=0))
    farthest = np.max(reach[~firm], axis=0, initial=0.0)
    bent = np.zeros(free.size, dtype=bool)
    bent[free] = (farthest > whole) & (farthest < own)
    return np.asarray(rows[firm].T / scale[:, None]), bent


def linear_widths(exact: np.ndarray, other: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return widths of linear intervals by the Jacobian ``other``, over those by ``exact``.

    Both Jacobians are (N, f), and intervals are along the ``directions`` (f, m). A width is given
    for each parameter that they move.
    """
    variances = []
    for jacobian in (exact, other):
        moved = jacobian @ directions
        inverse = np.linalg.pinv(moved.T @ moved)
        variances.append(np.einsum("ij,jk,ik->i", directions, inverse, directions))
    seen = variances[0] > 0.0
    return np.asarray(np.sqrt(variances[1][seen] / variances[0][seen]))


def linear_ends(
    layout: FitLayout, x: np.ndarray, free: np.ndarray, jacobian: np.ndarray
) -> np.ndarray:
    """Return both ends (2 f, d) of each parameter's linear interval about ``x`` (d,).

    With the others where the ``jacobian`` (N, f) says that they are refitted to.
    """
    if not free.any():
        return np.empty((0, x.size))
    spread = covariance(jacobian.T @ jacobian, CHI2_95)
    reach = layout.reach(x)[free]
    away = spread / np.sqrt(np.diag(spread))[:, None]
    away /= np.maximum(1.0, np.max(np.abs(away) / reach, axis=1))[:, None]
    found = np.tile(x, (2 * len(away), 1))
    found[:, free] += np.vstack([away, -away])
    return np.clip(found, layout.lower, layout.upper)


class BetterPoint(Exception):  # noqa: N818  (it is not an error)
    """A point ``x`` (d,) whose chi-square is ``gained`` below that of the optimum of intervals."""

    def __init__(self, x: np.ndarray, gained: float) -> None:
        super().__init__("chi-square has a lower minimum")
        self.x, self.gained = x, gained


@dataclass(frozen=True)
class _Path:
    """Path of the refitted parameters while parameter ``index`` moves away from ``start`` (d,).

    ``first`` and ``second`` (d,) are the first two derivatives of the path by that parameter,
    ``sigma`` its standard deviation by these derivatives.
    """

    index: int
    start: np.ndarray
    first: np.ndarray
    second: np.ndarray
    sigma: float

    def ahead(self, point: float) -> np.ndarray:
        """Return the extrapolated parameters (d,) at a ``point`` of the moved parameter."""
        s = point - self.start[self.index]
        return self.start + self.first * s + 0.5 * self.second * s * s


def _path(
    problem: Problem,
    best: np.ndarray,
    residuals: np.ndarray,
    j: np.ndarray,
    slope: np.ndarray,
    others: np.ndarray,
    index: int,
) -> _Path:
    """Return the path of coordinate ``index`` from ``best`` (d,).

    ``residuals`` (N,) are those there, ``j`` (N, f) is the Jacobian of the ``others``
    (d,) bool, ``slope`` (N,) its own column.
    """
    layout = problem.layout
    inverse = _pseudo_inverse(j.T @ j)
    first, second = np.zeros(layout.size), np.zeros(layout.size)
    first[index] = 1.0
    first[others] = -inverse @ (j.T @ slope)
    left = slope + j @ first[others]
    sigma = 1.0 / max(math.sqrt(float(left @ left)), 1e-150)
    # wide enough to resolve the curvature, and still local
    probe = min(0.1 * sigma, *(0.05 * layout.reach(best) / np.maximum(np.abs(first), 1e-300)))
    sides = best + np.outer((-probe, probe), first)
    if others.any() and np.all((sides >= layout.lower) & (sides <= layout.upper)):
        _, (below, above) = problem.evaluate(sides)
        bend = ((above - residuals) - (residuals - below)) / probe**2
        second[others] = -inverse @ (j.T @ bend)
    return _Path(index, best, first, second, sigma)


def _guess(
    problem: Problem, path: _Path, point: float, held: np.ndarray, reach: np.ndarray
) -> tuple[np.ndarray, float, np.ndarray]:
    """Return parameters (d,) from which the refit at ``point`` starts; their cost, residuals."""
    layout = problem.layout
    moved = path.start + np.clip(path.ahead(point) - path.start, -reach, reach)
    moved = np.where(held, path.start, np.clip(moved, layout.lower, layout.upper))
    # where the data hardly determine the others, the path is wrong: try them unmoved too
    both = np.stack([moved, path.start])
    both[:, path.index] = point
    costs, residuals = problem.evaluate(both)
    better = int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))
    return both[better], float(costs[better]), residuals[better]


def profile(
    problem: Problem,
    best: np.ndarray,
    chi2: float,
    index: int,
    jac: np.ndarray,
    inflation: float,
    held: np.ndarray,
    tick: Callable[[], None],
    sides: tuple[float, ...] = (-1.0, 1.0),
    gain: float = math.inf,
) -> tuple[float, float]:
    """Return the 95 % interval of coordinate ``index`` by profile likelihood.

    ``best`` (d,) with chi-square ``chi2`` is the optimum, ``jac`` (N, f) the Jacobian there, which
    gives the step and the path of the others, ``inflation`` the factor by which chi-square
    counts less than its white-noise value, ``held`` (d,) bool the parameters that are not refitted.
    An end that the data do not determine, or that is not among ``sides``, is -inf or inf.
    ``tick`` is called at each point. Raises ``BetterPoint`` where chi-square is lower than at the
    optimum by more than ``gain``.
    """
    layout = problem.layout
    own = np.arange(layout.size) == index
    fixed = held | own
    threshold = CHI2_95 * inflation
    others = ~fixed
    # one that is freed for its own end is not in the Jacobian
    moved = problem.jacobian(best, own) if held[index] else jac[:, ~others[~held]]
    centre = _path(
        problem, best, problem.residuals(best), jac[:, others[~held]], moved[:, 0], others, index
    )
    reach = layout.reach(best)
    ends = {-1.0: -math.inf, 1.0: math.inf}
    for sign in sides:
        bound = layout.lower[index] if sign < 0 else layout.upper[index]
        path = centre
        step = min(1.96 * path.sigma * math.sqrt(inflation), reach[index])
        inside, z_inside = best[index], 0.0
        near = _NEAR_A_LIMIT if held[index] else _NEAR
        outside, z_outside = math.inf, math.inf
        end = sign * math.inf
        for _ in range(_POINTS_MAX):
            tick()
            # the parabola holds only locally: the longest step with a usable extrapolation is taken
            for part in _SHORTER if math.isinf(outside) else _SHORTER[:1]:
                point = float(
                    np.clip(inside + sign * step * part, layout.lower[index], layout.upper[index])
                )
                guess, cost, residuals = _guess(problem, path, point, held, reach)
                if cost * problem.samples - chi2 < _GUESS_MAX * threshold:
                    break
            at_bound = sign * (point - bound) >= 0.0
            step_before = abs(point - inside)
            # as much as moves the crossing by its tolerance: the quadratic model's word is taken
            little = 2.0 * near * threshold
            fit = descend(
                problem,
                guess,
                fixed,
                iterations=8,
                gain=little,
                damping=1e-5,
                patience=2,
                quick=True,
                straight=True,
                known=residuals,
                also=own,
            )
            if chi2 - fit.cost * problem.samples > gain:
                raise BetterPoint(fit.x, chi2 - fit.cost * problem.samples)
            excess = fit.cost * problem.samples - fit.to_gain - chi2
            z = math.sqrt(max(excess, 0.0) / threshold)
            if abs(z - 1.0) < near and z > z_inside:
                # the root of chi-square is nearly linear here
                end = inside + (point - inside) * (1.0 - z_inside) / (z - z_inside)
                end = float(np.clip(end, layout.lower[index], layout.upper[index]))
                break
            if z < 1.0:
                if at_bound or step_before == 0.0:
                    break
                slope = (z - z_inside) / step_before
                inside, z_inside = point, z
                column = (
                    np.zeros(fit.residuals.size)
                    if fit.also_columns is None
                    else fit.also_columns[:, 0]
                )
                path = _path(problem, fit.x, fit.residuals, fit.jacobian, column, others, index)
                step = (1.0 - z) / slope if slope > 0.0 else reach[index]
                step = min(step, 4.0 * step_before, reach[index])
            else:
                outside, z_outside = point, z
            if math.isfinite(outside):
                # the root of chi-square is nearly linear close to the threshold only
                part = 0.4
                if z_outside < 4.0:
                    part = min(max((1.0 - z_inside) / (z_outside - z_inside), 0.15), 0.85)
                step = abs(outside - inside) * part
                end = inside + sign * step
        ends[sign] = end
    return ends[-1.0], ends[1.0]
