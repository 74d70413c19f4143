"""A residual that noise as that at rest does not leave rejects the model, and only such a one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from dearig.model.fitting.rejection import misfit_p
from dearig.model.verdict import REJECTED_BELOW, is_rejected, smallest_p

NOISES = {
    "white": lambda rng, n: rng.standard_normal(n),
    "averaged": lambda rng, n: np.convolve(rng.standard_normal(n + 7), np.ones(8) / 8.0, "valid"),
    "of heavy tails": lambda rng, n: rng.standard_t(5, n),
    "coloured": lambda rng, n: lfilter([1.0], [1.0, -0.8], rng.standard_normal(n + 50))[50:],
}


@pytest.mark.parametrize("noise", NOISES.values(), ids=NOISES)
def test_noise_as_that_at_rest_is_rarely_rejected(noise):
    rng = np.random.default_rng(3)
    # 200 cases: of a level of 5 %, as few as 3 and as many as 19 are by chance
    found = [misfit_p(noise(rng, 4600), noise(rng, 400)) for _ in range(200)]
    assert sum(p < 0.05 for p in found) < 20
    assert sum(map(is_rejected, found)) <= 2


def test_a_faint_colour_of_means_that_the_rest_does_not_show_is_no_misfit():
    # means over 1 ms of a sensor that averages over 0.32 ms: neighbours correlate by 0.06
    rng = np.random.default_rng(7)

    def means(n):
        return lfilter([1.0, 0.06], [1.0], rng.standard_normal(n + 1))[1:]

    cases = [(means(25_000), means(2000)) for _ in range(50)]
    assert sum(is_rejected(misfit_p(*case, averaged=True)) for case in cases) <= 1
    assert sum(is_rejected(misfit_p(*case)) for case in cases) > 10  # as if it had to be white
    wave = 2.0 * np.sin(np.linspace(0.0, 300.0, 25_000))
    assert is_rejected(misfit_p(cases[0][0] + wave, cases[0][1], averaged=True))


@pytest.mark.parametrize(
    ("kind", "over"), [*((kind, 3.0) for kind in NOISES), ("white", 1.14), ("of heavy tails", 1.28)]
)
def test_a_slow_misfit_rejects_the_model(kind, over):
    rng, noise = np.random.default_rng(4), NOISES[kind]
    still, left = noise(rng, 400), noise(rng, 4600)
    wave = np.sqrt(2.0 * (over**2 - 1.0)) * still.std() * np.sin(np.linspace(0.0, 90.0, 4600))
    assert is_rejected(misfit_p(left + wave, still))


def test_masked_readings_do_not_count():
    rng = np.random.default_rng(5)
    still, left = rng.standard_normal(400), rng.standard_normal(4600)
    masked = np.where(np.arange(4600) % 9 == 0, np.nan, left)
    assert misfit_p(masked, still) == pytest.approx(misfit_p(left[~np.isnan(masked)], still))


def test_too_few_readings_at_rest_tell_nothing():
    rng = np.random.default_rng(6)
    assert misfit_p(9.0 * rng.standard_normal(500), rng.standard_normal(60)) is None
    assert misfit_p(rng.standard_normal(500), np.zeros(400)) is None
    assert not is_rejected(None)


def test_the_least_of_several_counts_for_as_many():
    assert smallest_p([0.4, None, 0.01]) == pytest.approx(0.02)
    assert smallest_p([0.9, 0.8]) == 1.0
    assert smallest_p([None]) is None
    assert is_rejected(0.9 * REJECTED_BELOW)
    assert not is_rejected(REJECTED_BELOW)
