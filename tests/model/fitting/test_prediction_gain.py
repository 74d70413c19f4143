"""How much more probable one model makes a recording that no fit used."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.model.fitting.prediction import prediction_gain
from dearig.model.verdict import CONFIRMING

NOISE = 1e-6


def white(seed: int, size: int = 4000) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal(size)


def test_white_residuals_give_the_likelihood_ratio():
    after = white(1)
    before = 1.1 * white(2)
    expected = 4000 * np.log(np.mean(before**2) / max(np.mean(after**2), NOISE**2))
    # the correlation time of white noise is found within a few per cent
    assert prediction_gain(before, after, NOISE) == pytest.approx(expected, rel=0.1)


def test_a_correlated_error_counts_as_few_readings():
    slow = 6.0 * NOISE * np.sin(np.linspace(0.0, 9.0, 4000))
    # 2 % less of the same slow error is 160 for independent readings, and nothing for this
    assert abs(prediction_gain(slow, 0.98 * slow, NOISE)) < CONFIRMING
    assert prediction_gain(slow + white(1), white(1), NOISE) > 100.0


def test_what_is_below_the_noise_is_no_gain():
    assert prediction_gain(0.9 * white(1), 0.5 * white(2), NOISE) == 0.0


def test_masked_readings_do_not_count():
    before, after = 3.0 * white(1), white(2)
    masked = np.where(np.arange(4000) < 500, np.nan, before)
    part = prediction_gain(before[500:], after[500:], NOISE)
    assert prediction_gain(masked, after, NOISE) == pytest.approx(part)
