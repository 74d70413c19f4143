"""Trend of one number of many recordings: the effects of columns, and the jumps of single films."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.batch.film_effects import Explained
from dearig.batch.mixed_model import LinearFit
from dearig.batch.trend_columns import Covariate, Design

__all__ = ["VERDICTS", "ChangePoint", "FilmSlope", "Trend", "TrendCurve", "TrendSlope"]

#: Verdicts on an effect as a table shows them, by their keys.
VERDICTS = {
    "common": "common",
    "one_film": "one film's own",
    "differs": "films differ",
    "doubtful": "doubtful",
    "none": "not seen",
    "untold": "one film only",
}


@dataclass(frozen=True)
class FilmSlope:
    """Slope of one film that differs from the others': its value and 95 % interval."""

    film: str
    slope: float
    low: float
    high: float


@dataclass(frozen=True)
class TrendSlope:
    """Effect of a column on a number: ``slope`` per unit of the column, with its 95 % interval.

    ``simultaneous`` is the interval that holds the truth together with those of all other effects
    of the table with 95 %. Of a number on a logarithmic scale the slope is in percent per unit.
    ``p`` is the probability of one as large if there were none, ``p_equal`` that of slopes as
    unequal if all films had one (None where that cannot be asked). ``verdict`` is a key of
    ``VERDICTS``; with "one_film" the slope is that of the other films.
    """

    column: Covariate
    slope: float
    low: float
    high: float
    simultaneous: tuple[float, float]
    p: float
    p_equal: float | None
    verdict: str
    own: tuple[FilmSlope, ...] = ()


@dataclass(frozen=True)
class ChangePoint:
    """Jump of a number of one film: between the recordings ``last`` and ``first``.

    ``size`` is in percent on a logarithmic scale, else in the number's unit, after the effects of
    the columns were taken off.
    """

    film: str
    last: str
    first: str
    started: str
    size: float
    low: float
    high: float
    row: int


@dataclass(frozen=True)
class TrendCurve:
    """Number (m,) over ``x`` (m,) of one column, the others at their means, with its 95 % band."""

    x: np.ndarray
    y: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class Trend:
    """Trend of the number ``name`` over the ``rows`` (n,) of the table that have it.

    ``values`` (n,) with errors as 95 % intervals ``low``, ``high`` (n,). Where all are positive
    their logarithm is modelled.
    """

    name: str
    rows: np.ndarray
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    design: Design
    model: Explained
    effects: tuple[TrendSlope, ...]
    changes: tuple[ChangePoint, ...]

    @property
    def relative(self) -> bool:
        """Whether the logarithm of the number is modelled."""
        return self.model.relative

    @property
    def fit(self) -> LinearFit:
        """The fitted model."""
        return self.model.fit

    def spread(self, deviation: float) -> float:
        """Return a standard deviation of the model in percent, or in the number's unit."""
        return 100.0 * math.expm1(deviation) if self.relative else deviation

    def natural(self, y: np.ndarray) -> np.ndarray:
        """Return modelled values in the number's unit."""
        return np.exp(y) if self.relative else y

    @property
    def at_means(self) -> float:
        """The number where all columns are at their means, in its unit."""
        return float(self.natural(np.array(self.fit.intercept)))

    def curve(self, i: int, points: int = 60) -> TrendCurve:
        """Return the number over column ``i``, the others at their means."""
        x = np.linspace(*self.design.columns[i].range, points)
        shifted = x - self.fit.centre[i]
        y = self.fit.intercept + self.fit.slopes[i] * shifted
        c = self.fit.covariance
        variance = c[0, 0] + 2.0 * shifted * c[0, 1 + i] + shifted**2 * c[1 + i, 1 + i]
        half = self.fit.quantile(i) * np.sqrt(np.maximum(variance, 0.0))
        return TrendCurve(x, self.natural(y), self.natural(y - half), self.natural(y + half))

    def adjusted(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Return column ``i`` (n,) and the number (n,) less film and the other columns' effects."""
        sample, fit = self.model.sample, self.fit
        # a film's own slope of this column is to be seen
        kept = [i, *self.model.slopes_of(i)]
        others = np.delete((sample.x - fit.centre) * fit.slopes, kept, axis=1).sum(axis=1)
        away = fit.film_intercepts[sample.film] + others
        return sample.x[:, i], self.natural(sample.y - away)
