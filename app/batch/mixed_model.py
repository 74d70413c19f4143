"""A linear model of one number over many runs: common effects, a random intercept of each film.

``y = b0 + x b + u_film + e``, with ``u`` normal with variance tau^2 and ``e`` normal with variance
sigma^2 + s^2: s is the standard error of each fit, which is known, sigma the scatter beyond it.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import fdtrc, stdtr, stdtrit

from dearig.extras import import_extra

__all__ = ["LinearFit", "Sample", "fit_linear", "slopes_differ", "with_extra", "within_films"]

#: Part of the variance of a column within films below which it varies between films alone.
_BETWEEN_ONLY = 1e-9


@dataclass(frozen=True)
class Sample:
    """Values ``y`` (n,) of a number, columns ``x`` (n, p), films (n,) from 0 on, errors (n,).

    ``error`` is the standard error of each value, 0 where it is not known.
    """

    y: np.ndarray
    x: np.ndarray
    film: np.ndarray
    error: np.ndarray

    @property
    def films(self) -> int:
        """Number of films."""
        return int(self.film.max()) + 1

    def extended(self, column: np.ndarray) -> Sample:
        """Return the sample with one more ``column`` (n,)."""
        return replace(self, x=np.column_stack([self.x, column]))


@dataclass(frozen=True)
class LinearFit:
    """Fitted model: ``intercept`` at the mean ``centre`` (p,) of the columns, ``slopes`` (p,).

    ``errors`` (p,) are standard errors, ``degrees`` (p,) their degrees of freedom, ``p_values``
    (p,) those of no effect. ``covariance`` (1 + p, 1 + p) is that of intercept and slopes.
    ``film_intercepts`` (films,) are differences from the intercept. ``between`` and ``scatter`` are
    the standard deviations tau and sigma, and ``measured`` is the median of the known errors.
    ``mixed``: films are a random intercept; else the model is ordinary least squares, and ``why``
    says why.
    """

    intercept: float
    slopes: np.ndarray
    errors: np.ndarray
    degrees: np.ndarray
    p_values: np.ndarray
    covariance: np.ndarray
    centre: np.ndarray
    film_intercepts: np.ndarray
    between: float
    scatter: float
    measured: float
    variances: np.ndarray
    mixed: bool
    why: str = ""

    def quantile(self, i: int, confidence: float = 0.95) -> float:
        """Return the standard errors from slope ``i`` to the ends of its interval (Student's t)."""
        return float(stdtrit(self.degrees[i], 0.5 + 0.5 * confidence))

    def interval(self, i: int, confidence: float = 0.95) -> tuple[float, float]:
        """Return the interval of slope ``i`` that holds the truth with this ``confidence``."""
        half = self.quantile(i, confidence) * float(self.errors[i])
        return float(self.slopes[i]) - half, float(self.slopes[i]) + half


def fit_linear(sample: Sample, random_slope: int | None = None) -> LinearFit:
    """Fit the mixed model to ``sample`` by restricted maximum likelihood.

    The columns are linearly independent. With ``random_slope`` that column has a random slope of
    each film too: for an effect that differs between films. Where there is one film, or no film
    has more than one run, it is ordinary least squares with the same weights.

    Rows have the weights 1/(sigma^2 + s^2). sigma is estimated from the runs within films by the
    method of Paule and Mandel (J. Res. NBS 87, 1982), as in a meta-regression; the mixed model of
    statsmodels then estimates tau, the slopes, and a common factor of all variances.
    """
    centre = sample.x.mean(axis=0)
    x = sample.x - centre
    variances = _variances(sample)
    weights = 1.0 / np.sqrt(variances)
    design = np.column_stack([np.ones(x.shape[0]), x])
    counts = np.bincount(sample.film)
    if counts.size < 2 or counts.max() < 2 or sample.y.size <= counts.size + x.shape[1]:
        why = (
            "there is one film"
            if counts.size < 2
            else "each film has one run"
            if counts.max() < 2
            else "the runs are too few for the films and columns"
        )
        return _ordinary(sample, design, weights, centre, variances, why)
    mixed = import_extra(
        "statsmodels.regression.mixed_linear_model", "trends", "a mixed model of many runs"
    )
    # statsmodels takes no weights: rows divided by their standard deviations are the same model;
    # it starts from variances of 1, so that everything is brought to that size
    unit = float(np.median(np.sqrt(variances)))
    weights = weights * unit
    spans = np.concatenate([[1.0], np.maximum(x.std(axis=0), 1e-300)])
    columns = [0] if random_slope is None else [0, 1 + random_slope]
    scaled = design * weights[:, None] / spans
    middle = float(np.average(sample.y, weights=weights**2))
    target = (sample.y - middle) * weights / unit
    try:
        with warnings.catch_warnings():
            # a variance of 0 between films is an answer, not a fault
            warnings.simplefilter("ignore")
            start = mixed.MixedLMParams.from_components(
                fe_params=np.zeros(spans.size),
                cov_re=np.eye(len(columns)) * _between(sample, variances) / unit**2,
            )
            found = mixed.MixedLM(
                target, scaled, sample.film, exog_re=np.ascontiguousarray(scaled[:, columns])
            ).fit(start_params=start, reml=True, method=["lbfgs", "powell"])
            psi = np.atleast_2d(np.asarray(found.cov_re)) * unit**2
            psi /= np.outer(spans[columns], spans[columns])
            variances = variances * float(found.scale)
    except (np.linalg.LinAlgError, ValueError):
        psi = np.full((1, 1), np.nan)
    if not (np.isfinite(psi).all() and np.isfinite(variances).all()):
        why = "the mixed model did not converge"
        return _ordinary(sample, design, weights / unit, centre, variances, why)
    solution, covariance = _generalised(sample, design, variances, design[:, columns], psi)
    between = max(float(psi[0, 0]), 0.0)
    left = np.bincount(sample.film, (sample.y - design @ solution) / variances)
    # the best linear unbiased prediction of each film's intercept
    intercepts = left / (np.bincount(sample.film, 1.0 / variances) + 1.0 / max(between, 1e-300))
    degrees = _degrees(sample, random_slope)
    return _made(
        solution, covariance, degrees, centre, intercepts, between=float(np.sqrt(between)),
        variances=variances, sample=sample, mixed=True,
    )  # fmt: skip


def _between(sample: Sample, variances: np.ndarray) -> float:
    """Return the variance between films by their means, from which the likelihood is climbed."""
    weights = 1.0 / variances
    within = _scaled(sample, variances)
    slopes, _ = _solved(within[:, 0], within[:, 1:])
    left = np.bincount(sample.film, weights * (sample.y - sample.x @ slopes))
    total = np.bincount(sample.film, weights)
    means = left / total
    # a start at 0 would be a stationary point
    return max(float(np.var(means, ddof=1) - np.mean(1.0 / total)), 0.01 * float(variances.min()))


def _generalised(
    sample: Sample,
    design: np.ndarray,
    variances: np.ndarray,
    random: np.ndarray,
    psi: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the solution (k,) and covariance (k, k) of generalised least squares.

    By the variances (n,) of the runs and the covariance ``psi`` (q, q) of the films' columns
    ``random`` (n, q); it may be 0, where the derivatives of statsmodels do not exist.
    """
    k = design.shape[1]
    normal, target = np.zeros((k, k)), np.zeros(k)
    for film in range(sample.films):
        mine = sample.film == film
        x, z, y = design[mine], random[mine], sample.y[mine]
        weighted = z / variances[mine][:, None]
        # Woodbury: the inverse of D + Z psi Z'
        inner = psi @ np.linalg.inv(np.eye(psi.shape[0]) + weighted.T @ z @ psi)
        solved = x / variances[mine][:, None] - weighted @ (inner @ (weighted.T @ x))
        normal += solved.T @ x
        target += solved.T @ y
    covariance = np.linalg.pinv(normal, hermitian=True)
    return np.asarray(covariance @ target), np.asarray(covariance)


def _made(
    solution: np.ndarray,
    covariance: np.ndarray,
    degrees: np.ndarray,
    centre: np.ndarray,
    intercepts: np.ndarray,
    *,
    between: float,
    variances: np.ndarray,
    sample: Sample,
    mixed: bool,
    why: str = "",
) -> LinearFit:
    errors = np.sqrt(np.diag(covariance))[1:]
    beyond = np.maximum(variances - sample.error**2, 0.0)
    ratios = np.abs(solution[1:]) / np.maximum(errors, 1e-300)
    return LinearFit(
        intercept=float(solution[0]),
        slopes=solution[1:],
        errors=errors,
        degrees=degrees,
        p_values=2.0 * stdtr(degrees, -ratios),
        covariance=covariance,
        centre=centre,
        film_intercepts=intercepts,
        between=between,
        scatter=float(np.sqrt(np.median(beyond))),
        measured=float(np.median(sample.error)),
        variances=variances,
        mixed=mixed,
        why=why,
    )


def _ordinary(
    sample: Sample,
    design: np.ndarray,
    weights: np.ndarray,
    centre: np.ndarray,
    variances: np.ndarray,
    why: str,
) -> LinearFit:
    scaled, target = design * weights[:, None], sample.y * weights
    solution, *_ = np.linalg.lstsq(scaled, target, rcond=None)
    degrees = max(sample.y.size - design.shape[1], 1)
    left = target - scaled @ solution
    scale = float(left @ left) / degrees
    covariance = scale * np.linalg.pinv(scaled.T @ scaled)
    return _made(
        solution, covariance, np.full(centre.size, float(degrees)), centre,
        np.zeros(sample.films), between=0.0, variances=variances * scale, sample=sample,
        mixed=False, why=why,
    )  # fmt: skip


def _degrees(sample: Sample, random_slope: int | None) -> np.ndarray:
    """Return the degrees of freedom (p,) of each slope.

    The containment rule: a column that varies within films is compared with the runs within
    films, one that varies between films alone, or whose slope is random, with the films.
    """
    x, films = sample.x, sample.films
    within = _within(x, sample.film, np.ones(sample.y.size))
    inside = np.sum(within**2, axis=0) > _BETWEEN_ONLY * np.sum((x - x.mean(axis=0)) ** 2, axis=0)
    outside = int((~inside).sum())
    degrees = np.where(
        inside, sample.y.size - films - int(inside.sum()), films - 1 - outside
    ).astype(float)
    if random_slope is not None:
        degrees[random_slope] = films - 1
    return np.asarray(np.maximum(degrees, 1.0))


def _within(values: np.ndarray, film: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return ``values`` (n, k) less their weighted mean in each film."""
    total = np.bincount(film, weights)
    means = np.column_stack([np.bincount(film, weights * column) / total for column in values.T])
    return np.asarray(values - means[film])


def _misfit(sample: Sample, variances: np.ndarray) -> tuple[float, int]:
    """Return the weighted sum of squares within films about the common slopes, and its freedom.

    With one run a film the films are not told apart: the sum is about the mean of all.
    """
    film = sample.film
    if np.bincount(film).max() < 2:
        film = np.zeros_like(film)
    weights = 1.0 / variances
    both = np.column_stack([sample.y, sample.x])
    within = _within(both, film, weights) * np.sqrt(weights)[:, None]
    squares, rank = _sum_of_squares(within[:, 0], within[:, 1:])
    return squares, max(sample.y.size - int(film.max()) - 1 - rank, 1)


def within_films(sample: Sample) -> tuple[np.ndarray, np.ndarray]:
    """Return variances (n,) of the runs and slopes (p,) by least squares within films.

    Quick: for a choice of columns, before the mixed model is fitted to the chosen ones.
    """
    variances = _variances(sample)
    within = _scaled(sample, variances)
    return variances, _solved(within[:, 0], within[:, 1:])[0]


def _variances(sample: Sample) -> np.ndarray:
    """Return sigma^2 + s^2 (n,), with sigma by which the runs scatter beyond their errors."""
    known = sample.error**2
    # relative, so that no variance is 0 where a value is exact
    floor = 1e-12 * max(float(np.var(sample.y)), 1e-300)

    def excess(beyond: float) -> float:
        misfit, degrees = _misfit(sample, known + beyond)
        return misfit / degrees - 1.0

    misfit, degrees = _misfit(sample, np.ones_like(known))
    upper = max(misfit / degrees, floor) * 4.0
    if excess(floor) <= 0.0:
        return known + floor
    while excess(upper) > 0.0:
        upper *= 4.0
    beyond = np.exp(
        brentq(lambda v: excess(float(np.exp(v))), np.log(floor), np.log(upper), xtol=1e-4)
    )
    return known + float(beyond)


def slopes_differ(sample: Sample, variances: np.ndarray, i: int) -> float | None:
    """Return the probability of slopes of column ``i`` as unequal as these if films had one slope.

    The F test of the analysis of covariance: a slope of each film against one slope. None where
    fewer than two films have a slope.
    """
    within = _scaled(sample, variances)
    column, others = within[:, 1 + i], np.delete(within, 1 + i, axis=1)
    squares = np.bincount(sample.film, column**2, minlength=sample.films)
    seen = squares > _BETWEEN_ONLY * squares.max()
    if seen.sum() < 2:
        return None
    safe = np.where(seen, squares, 1.0)
    # the columns of the films are orthogonal: each film is projected off its own column
    slopes = np.column_stack([np.bincount(sample.film, column * o) / safe for o in others.T])
    free = others - column[:, None] * np.where(seen[:, None], slopes, 0.0)[sample.film]
    full, rank = _sum_of_squares(free[:, 0], free[:, 1:])
    common, fewer = _sum_of_squares(others[:, 0], np.column_stack([others[:, 1:], column]))
    rank += int(seen.sum())
    degrees = sample.y.size - sample.films - rank
    if degrees < 1 or full <= 0.0 or rank <= fewer:
        return None
    ratio = (common - full) / (rank - fewer) / (full / degrees)
    return float(fdtrc(rank - fewer, degrees, ratio))


def _scaled(sample: Sample, variances: np.ndarray) -> np.ndarray:
    """Return y and the columns (n, 1 + p) less their means in each film, over the deviations."""
    weights = 1.0 / variances
    both = np.column_stack([sample.y, sample.x])
    return _within(both, sample.film, weights) * np.sqrt(weights)[:, None]


def _sum_of_squares(y: np.ndarray, x: np.ndarray) -> tuple[float, int]:
    """Return the residual sum of squares of y (n,) by columns (n, p), and their rank."""
    solution, rank = _solved(y, x)
    left = y - x @ solution
    return float(left @ left), rank


def _solved(y: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the least-squares solution (p,) of y (n,) by columns (n, p), and their rank.

    By the normal equations of columns of one size: 100 times as fast as by singular values where
    there are many rows, and accurate for columns that correlate by less than 1 - 1e-9.
    """
    norms = np.linalg.norm(x, axis=0)
    seen = norms > _BETWEEN_ONLY * max(float(norms.max(initial=0.0)), 1e-300)
    solution = np.zeros(x.shape[1])
    if not seen.any():
        return solution, 0
    scaled = x[:, seen] / norms[seen]
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    kept = values > _BETWEEN_ONLY * float(values[-1])
    turned = vectors[:, kept]
    solution[seen] = turned @ ((turned.T @ (scaled.T @ y)) / values[kept]) / norms[seen]
    return solution, int(kept.sum())


def with_extra(
    sample: Sample, variances: np.ndarray, extra: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the t values (k,) and probabilities (k,) of columns ``extra`` (n, k), each alone.

    Each is that of its slope if it were added to the model, within films; 0 and 1 for a column
    that follows from the others.
    """
    within = _scaled(sample, variances)
    y, x = within[:, 0], within[:, 1:]
    root = 1.0 / np.sqrt(variances)
    added = _within(extra, sample.film, root**2) * root[:, None]
    before = np.sum(added**2, axis=0)
    basis = _orthonormal(x)
    added = added - basis @ (basis.T @ added)
    left = y - basis @ (basis.T @ y)
    squares = np.sum(added**2, axis=0)
    known = squares > 1e-6 * np.maximum(before, 1e-300)
    degrees = sample.y.size - sample.films - basis.shape[1] - 1
    if degrees < 1:
        return np.zeros(extra.shape[1]), np.ones(extra.shape[1])
    safe = np.where(known, squares, 1.0)
    gains = np.where(known, (added.T @ left) ** 2 / safe, 0.0)
    t = np.sqrt(gains / np.maximum(float(left @ left) - gains, 1e-300) * degrees)
    return t, 2.0 * stdtr(degrees, -t)


def _orthonormal(x: np.ndarray) -> np.ndarray:
    """Return a basis (n, r) of the columns (n, p)."""
    norms = np.linalg.norm(x, axis=0)
    scaled = x / np.where(norms > 0.0, norms, 1.0)
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    kept = values > _BETWEEN_ONLY * max(float(values.max(initial=0.0)), 1e-300)
    return np.asarray(scaled @ (vectors[:, kept] / np.sqrt(values[kept])))
