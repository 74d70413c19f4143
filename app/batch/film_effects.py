"""Deviations of single films: slopes of their own, and jumps from one run to the next."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from dearig.batch.changes import RUNS_MIN, find_jumps, jump_penalty
from dearig.batch.mixed_model import LinearFit, Sample, fit_linear, with_extra, within_films

__all__ = ["DIFFER", "Explained", "Extra", "explain"]

#: Probability of equal slopes below which films differ: it is asked of every number and column.
DIFFER = 0.01
_CALMER_MIN = 0.3  # of the scatter: neighbours that differ less have drifted together
#: Part of the films that may have a slope of their own; of more it is said that films differ.
_OWN_MAX = 1.0 / 3.0
#: Gain over that of the best one from which others are taken in the same round.
_SHARE_MIN = 0.5
_EXPONENT_MAX = 700.0  # of which a hundredfold exponential is a finite number
_ROUNDS_MAX = 20
_EXTRAS_MAX = 60  # of a number: more say that a column is missing, and make the fit slow


@dataclass(frozen=True)
class Extra:
    """A column of one ``film``: its own slope of ``column``, or a jump before its run ``run``."""

    film: int
    column: int | None = None
    run: int = 0

    def values(self, sample: Sample) -> np.ndarray:
        """Return the column (n,); the runs of a film are in the order of time."""
        mine = sample.film == self.film
        if self.column is not None:
            x = sample.x[:, self.column]
            # about the film's own mean, so that its intercept stays the film's level
            return np.where(mine, x - x[mine].mean(), 0.0)
        return np.asarray(mine & (np.cumsum(mine) > self.run), dtype=float)


@dataclass(frozen=True)
class Explained:
    """The model of a number with the ``extras`` of single films after its common ``columns``.

    ``films`` are their names. With ``relative`` the number's logarithm is modelled.
    """

    sample: Sample
    films: tuple[str, ...]
    columns: int
    extras: tuple[Extra, ...]
    fit: LinearFit
    relative: bool

    def in_unit(self, value: float) -> float:
        """Return a difference of the model in percent, or in the number's unit."""
        # a slope per day of runs within minutes may be beyond all numbers
        return 100.0 * math.expm1(min(value, _EXPONENT_MAX)) if self.relative else value

    def slopes_of(self, i: int) -> list[int]:
        """Return the places of the films' own slopes of column ``i``."""
        return [self.columns + k for k, extra in enumerate(self.extras) if extra.column == i]

    def without_slopes_of(self, i: int) -> Explained:
        """Return the model without the films' own slopes of column ``i``, not fitted again."""
        kept = np.delete(self.sample.x, self.slopes_of(i), axis=1)
        extras = tuple(extra for extra in self.extras if extra.column != i)
        return replace(self, sample=replace(self.sample, x=kept), extras=extras)


def explain(sample: Sample, films: tuple[str, ...], relative: bool) -> Explained:
    """Return the model of ``sample`` with the deviations of single films.

    Own slopes and jumps compete: those that explain most beyond what chance does are taken first,
    since each looks like the other in a few runs, and since one film's own slope moves the common
    one away from the others. Rows are in the order of time.
    """
    columns = sample.x.shape[1]
    extras: list[Extra] = []
    for _ in range(_ROUNDS_MAX):
        variances, slopes = within_films(sample)
        tried = [
            *_slopes(sample, variances, columns, extras),
            *_jumps(sample, variances, slopes, extras),
        ]
        tried.sort(key=lambda each: -each[0])
        taken = _taken(tried, sample.films, extras)
        if not taken:
            break
        for extra in taken:
            extras.append(extra)
            sample = sample.extended(extra.values(sample))
    return Explained(sample, films, columns, tuple(extras), fit_linear(sample), relative)


def _taken(tried: list[tuple[float, Extra]], films: int, extras: list[Extra]) -> list[Extra]:
    """Return those of ``tried``, in falling order of gain, that are added: one a film at most."""
    taken: list[Extra] = []
    for gain, extra in tried:
        if gain <= 0.0 or gain < _SHARE_MIN * tried[0][0]:
            break
        if len(extras) + len(taken) >= _EXTRAS_MAX:
            break
        same = sum(e.column == extra.column for e in (*extras, *taken))
        if extra.column is not None and same >= _own_max(films):
            continue
        if all(extra.film != other.film for other in taken):
            taken.append(extra)
    return taken


def _own_max(films: int) -> float:
    """Return how many films may have a slope of their own of one column."""
    return max(_OWN_MAX * films, 1.0)


def _slopes(
    sample: Sample, variances: np.ndarray, columns: int, extras: list[Extra]
) -> list[tuple[float, Extra]]:
    """Return films' own slopes, with the chi-square that each gains beyond what chance does."""
    most = _own_max(sample.films)
    open_ones = [i for i in range(columns) if sum(e.column == i for e in extras) < most]
    tried = [Extra(film, i) for i in open_ones for film in range(sample.films)]
    if sample.films < 2 or not tried:
        return []
    t, p = with_extra(sample, variances, np.column_stack([e.values(sample) for e in tried]))
    # of so many slopes the largest by chance has about this chi-square
    chance = 2.0 * math.log(len(tried) / DIFFER)
    return [
        (value**2 - chance, extra)
        for value, each, extra in zip(t, p, tried, strict=True)
        if each * len(tried) < DIFFER and extra not in extras
    ]


def _jumps(
    sample: Sample, variances: np.ndarray, slopes: np.ndarray, extras: list[Extra]
) -> list[tuple[float, Extra]]:
    """Return jumps, with the chi-square that each gains beyond what chance does."""
    left = sample.y - sample.x @ slopes
    order = [np.flatnonzero(sample.film == film) for film in range(sample.films)]
    steps = np.concatenate([np.diff(left[mine]) for mine in order])
    if not steps.size:
        return []
    # jumps must not count as scatter, so that it comes from neighbours: the median of |N(0, 1)| is
    # 0.6745, and a difference has twice the variance
    around = float(np.median(np.abs(steps))) / 0.6745 / math.sqrt(2.0)
    errors = np.sqrt(variances)
    calmer = float(np.clip(around / np.median(errors), _CALMER_MIN, 1.0))
    tried = []
    for film, mine in enumerate(order):
        scaled = (left[mine] - left[mine].mean()) / (errors[mine] * calmer)
        known = [e.run for e in extras if e.film == film and e.column is None]
        tried += [
            Extra(film, run=run)
            for run in find_jumps(scaled, jump_penalty(mine.size, sample.films))
            if all(abs(run - other) >= RUNS_MIN for other in known)
        ]
    if not tried:
        return []
    columns = np.column_stack([extra.values(sample) for extra in tried])
    t, _ = with_extra(sample, variances * calmer**2, columns)
    return [
        (value**2 - jump_penalty(order[extra.film].size, sample.films), extra)
        for value, extra in zip(t, tried, strict=True)
    ]
