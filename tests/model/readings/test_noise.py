"""The noise of readings: drift, mains and an averaging sensor are told from it."""

import math

import numpy as np
import pytest

from dearig.model.errors import ModelError
from dearig.model.readings.noise import (
    Tails,
    coarse_noise,
    noise_at_rest,
    noise_of,
    rest_of_rounded,
    rounding,
    tails_of,
)


@pytest.mark.parametrize("slope", [0.0, 1.0, -300.0])
def test_noise_of_a_ramp(slope):
    rng = np.random.default_rng(2)
    values = slope * np.arange(20000) + rng.normal(0.0, 1e-3, 20000)
    assert noise_of(values) == pytest.approx(1e-3, rel=0.02)


@pytest.mark.parametrize(("rate", "samples"), [(200.0, 400), (1000.0, 2000)])
def test_mains_is_no_noise(rate, samples):
    rng = np.random.default_rng(3)
    time = np.arange(samples) / rate
    for phase in np.arange(0.0, 6.0, 0.5):
        noise = 1e-6 * rng.standard_normal(samples)
        # 60 times the noise, and at 200 Hz the third harmonic comes back at 20 Hz
        mains = 6e-5 * np.sin(2.0 * np.pi * 59.95 * time + phase)
        third = 2e-5 * np.sin(2.0 * np.pi * 179.85 * time)
        read = noise_at_rest(time, noise + mains + third + 1e-6 * time)
        assert read == pytest.approx(1e-6, rel=0.2)
        assert noise_at_rest(time, noise) == pytest.approx(noise.std(ddof=2), rel=0.01)


@pytest.mark.parametrize(("size", "hertz", "half_life"), [(16.0, 3.6, 4.2), (3.0, 6.0, 1.0)])
def test_a_load_that_swings_at_rest_is_no_noise(size, hertz, half_life):
    rng = np.random.default_rng(5)
    time = np.arange(400) / 200.0
    for phase in np.arange(0.0, 6.0, 0.5):
        swing = size * 2.0 ** (-time / half_life) * np.sin(2.0 * np.pi * hertz * time + phase)
        assert noise_at_rest(time, rng.standard_normal(400) + swing) < 1.6


def test_slow_noise_is_noise():
    rng = np.random.default_rng(6)
    time = np.arange(400) / 200.0
    for _ in range(20):
        walk = rng.standard_normal(400) + 0.5 * np.cumsum(rng.standard_normal(400))
        straight = walk - np.polyval(np.polyfit(time, walk, 1), time)
        assert noise_at_rest(time, walk) == pytest.approx(straight.std(ddof=2), rel=1e-6)


def test_noise_that_a_sensor_has_averaged_is_noise():
    rng = np.random.default_rng(4)
    time = np.arange(400) / 200.0
    for _ in range(20):
        noise = np.convolve(rng.standard_normal(410), np.ones(11) / 11.0, "valid")
        assert noise_at_rest(time, noise) > 0.85 * noise.std(ddof=2)


def test_noise_of_nothing():
    with pytest.raises(ModelError, match="3 samples are too few to read a noise from"):
        noise_of(np.zeros(3))


def test_normal_noise_has_no_heavy_tails():
    rng = np.random.default_rng(1)
    for step in (0.0, 1.2):
        found = []
        for _ in range(8):
            values = rng.standard_normal(400)
            found.append(tails_of(step * np.round(values / step) if step else values, step))
        assert all(tails.is_normal for tails in found)
        assert np.mean([tails.scale for tails in found]) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("step", [0.0, 1.0])
def test_heavy_tails_are_found_with_their_scale(step):
    rng = np.random.default_rng(2)
    values = rng.standard_t(4.0, (10, 400))
    found = [tails_of(step * np.round(v / step) if step else v, step) for v in values]
    heavy = [tails for tails in found if not tails.is_normal]
    # of 400 readings that are rounded to their scale, a few do not show it
    assert len(heavy) >= 8
    assert np.median([tails.freedom for tails in heavy]) == pytest.approx(4.0, abs=1.0)
    assert np.median([tails.scale for tails in heavy]) == pytest.approx(1.0, rel=0.1)


def test_few_values_at_rest_are_no_heavy_tails():
    # 333 readings at one value and 68 at the next, as normal noise far smaller than a step
    noise = np.repeat([0.0, 6.0], [333, 68]) - 6.0 * 68 / 401
    assert tails_of(noise, 6.0).is_normal
    assert not tails_of(noise, 0.0).is_normal


def test_pseudo_values_know_the_level_as_well_as_any_estimate_can():
    tails = Tails(4.0, 2.0)
    noise = 2.0 * np.random.default_rng(3).standard_t(4.0, (2000, 100))
    levels = tails.pseudo(noise).mean(axis=1)
    # Fisher's information of Student's t is (freedom + 1)/(freedom + 3)
    assert np.std(levels) == pytest.approx(2.0 * math.sqrt(7.0 / 5.0 / 100.0), rel=0.05)
    assert np.std(levels) < 0.87 * np.std(noise.mean(axis=1))


def test_a_limit_is_that_of_the_distribution():
    assert Tails(math.inf, 2.0).limit(0.05) == pytest.approx(2.0 * 1.959964)
    assert Tails(4.0, 1.0).limit(0.01) == pytest.approx(4.604095)


def rounded(values, step, converter=0.0):
    """Values in steps, as a converter of finer steps reads them."""
    read = step * np.round(values / step)
    return converter * np.round(read / converter) if converter else read


@pytest.mark.parametrize("converter", [0.0, 1.22])
@pytest.mark.parametrize("step", [4.0, 6.0, 15.0])
def test_coarse_readings_tell_their_noise_in_motion(step, converter):
    rng = np.random.default_rng(8)
    time = np.arange(5000) / 200.0
    motion = 800.0 * np.sin(2.0 * np.pi * 0.3 * time) ** 2
    motion[2000:2200] += 30.0 * np.sin(2.0 * np.pi * 60.0 * time[2000:2200])  # rings for a second
    values = rounded(motion + rng.standard_normal(5000), step, converter)
    assert rounding(values) == pytest.approx(step, rel=0.02)
    noise, told = coarse_noise(values)
    assert told == rounding(values)
    # neighbours that are rounded one up and one down are less alike than by chance
    assert noise == pytest.approx(math.hypot(1.0, step / math.sqrt(12.0)), rel=0.12)


def test_fine_readings_are_not_coarse():
    rng = np.random.default_rng(9)
    motion = 800.0 * np.sin(np.arange(5000) / 100.0)
    for step in (0.0, 0.1, 1.2, 2.0):
        values = motion + rng.standard_normal(5000)
        assert coarse_noise(rounded(values, step) if step else values) == (0.0, 0.0)
    assert coarse_noise(np.zeros(5000)) == (0.0, 0.0)
    assert rounding(np.zeros(3)) == 0.0


@pytest.mark.parametrize("step", [4.0, 6.0])
def test_the_rest_of_rounded_readings_is_not_their_mean(step):
    rng = np.random.default_rng(10)
    noise = math.hypot(1.0, step / math.sqrt(12.0))
    means, rests = [], []
    for true in np.arange(0.0, step, 0.1):
        values = rounded(true + rng.standard_normal(400), step)
        means.append(values.mean() - true)
        rests.append(rest_of_rounded(values, step, noise) - true)
    # a likelihood of 400 readings in two or three groups: the rest is known to a part of the noise
    assert float(np.sqrt(np.mean(np.square(rests)))) < 0.25
    assert float(np.sqrt(np.mean(np.square(rests)))) < 0.5 * float(np.std(means))


def test_a_rest_that_is_always_rounded_alike_is_in_the_middle():
    assert rest_of_rounded(np.full(400, 12.0), 6.0, 6.0 / math.sqrt(12.0)) == pytest.approx(12.0)
