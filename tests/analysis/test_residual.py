"""Correlations and quantiles of a residual against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.analysis.residual import cross_correlation, quantiles


def test_a_delayed_response_shows_at_its_lag() -> None:
    rng = np.random.default_rng(3)
    drive = rng.normal(size=4000)
    residual = 0.3 + 2.0 * np.roll(drive, 40) + 0.1 * rng.normal(size=drive.size)
    lag, correlation = cross_correlation(0.01, drive, residual)
    top = int(np.argmax(correlation))
    assert lag[top] == pytest.approx(0.4)
    assert correlation[top] > 0.95
    assert np.sort(np.abs(correlation))[-2] < 0.15  # nowhere else
    assert lag[0] == -lag[-1] == pytest.approx(-4.0)


def test_noise_is_correlated_with_no_drive() -> None:
    rng = np.random.default_rng(4)
    noise = rng.normal(size=20_000)
    _, correlation = cross_correlation(1e-3, np.sin(np.arange(20_000) / 50.0), noise)
    assert np.mean(np.abs(correlation) < 2.0 / np.sqrt(noise.size)) > 0.8
    assert np.max(np.abs(correlation)) < 6.0 / np.sqrt(noise.size)
    assert not cross_correlation(1e-3, np.ones(100), noise[:100])[1].any()  # a constant drive


def test_quantiles_of_normal_noise_are_a_line_and_heavy_tails_leave_it() -> None:
    rng = np.random.default_rng(5)
    normal, own = quantiles(2.0 * rng.normal(size=50_000))
    middle = np.abs(normal) < 2.5
    np.testing.assert_allclose(own[middle], 2.0 * normal[middle], atol=0.1)
    normal, heavy = quantiles(rng.standard_t(2, size=50_000))
    assert heavy[-1] > 5.0 * normal[-1]
    few, values = quantiles(np.array([3.0, 1.0, 2.0]))
    assert few.size == 3
    np.testing.assert_allclose(values, [1.0, 2.0, 3.0], atol=1e-9)
