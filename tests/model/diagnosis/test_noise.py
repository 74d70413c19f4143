"""Drift as noise: whitening and its variance against dense linear algebra and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import sqrtm
from scipy.stats import multivariate_normal

from dearig.model.diagnosis.noise import Drift, DriftSpace, WhitenedProblem, drift_modes
from dearig.model.fitting.parameters import Layout
from tests.tools.engine import PLAIN, masked, record_of, thesis_drive

MODES = 6


def bases(*sizes: int) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    return [rng.standard_normal((n, MODES)) for n in sizes]


def dense(some: list[np.ndarray], amplitude: float) -> np.ndarray:
    """The covariance of all records, written out."""
    n = sum(len(b) for b in some)
    found, at = np.eye(n), 0
    for b in some:
        part = slice(at, at + len(b))
        found[part, part] += amplitude * b @ b.T
        at = part.stop
    return found


def test_whitening_is_the_inverse_root_of_the_dense_covariance() -> None:
    some = bases(30, 20)
    drift = Drift(DriftSpace(some), 2.5)
    rows = np.random.default_rng(2).standard_normal((3, 50))
    expected = rows @ np.linalg.inv(sqrtm(dense(some, 2.5)).real)
    assert drift.whitened(rows) == pytest.approx(expected, abs=1e-9)
    assert drift.log_det == pytest.approx(np.linalg.slogdet(dense(some, 2.5))[1])


def test_the_mean_drift_is_that_of_the_conditional_normal_distribution() -> None:
    some = bases(40)
    drift = Drift(DriftSpace(some), 0.7)
    r = np.random.default_rng(3).standard_normal(40)
    prior = 0.7 * some[0] @ some[0].T
    assert drift.mean(r) == pytest.approx(prior @ np.linalg.solve(dense(some, 0.7), r))


def test_the_most_probable_variance_is_that_of_scipys_densities() -> None:
    some = bases(60)
    rng = np.random.default_rng(4)
    r = rng.multivariate_normal(np.zeros(60), dense(some, 300.0))
    found = DriftSpace(some).most_probable(r)
    around = [found / 10**0.5, found, found * 10**0.5]
    logs = [multivariate_normal(np.zeros(60), dense(some, a)).logpdf(r) for a in around]
    assert np.argmax(logs) == 1


def test_white_noise_has_no_drift() -> None:
    r = np.random.default_rng(5).standard_normal(400)
    smooth = np.cos(np.pi * np.arange(1, 7) * np.linspace(0.0, 1.0, 400)[:, None])
    assert DriftSpace([smooth]).most_probable(r) == 0.0


def test_modes_are_counted_from_the_lead_in_and_absent_where_masked() -> None:
    bad = np.zeros(thesis_drive().time.size, dtype=bool)
    bad[300:320] = True
    record = masked(record_of(PLAIN), bad)
    modes = drift_modes(record, 4)
    assert not modes[bad].any()
    lead_in = max(record.lead_in, 1)
    assert modes[:lead_in].mean(axis=0) == pytest.approx(np.zeros(4), abs=1e-12)


def test_a_whitened_problem_has_whitened_residuals() -> None:
    record = record_of(PLAIN)
    layout = Layout(PLAIN)
    x = layout.coordinates(layout.initial())
    plain = WhitenedProblem([record], layout, workers=1).residuals(x)
    drift = Drift(DriftSpace([drift_modes(record, 8)]), 50.0)
    problem = WhitenedProblem([record], layout, drift, workers=1)
    assert problem.residuals(x) == pytest.approx(drift.whitened(plain), abs=1e-6)
