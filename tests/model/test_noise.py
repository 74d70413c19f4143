"""The noise of readings: drift, mains and an averaging sensor are told from it."""

import numpy as np
import pytest

from dearig.model.errors import ModelError
from dearig.model.noise import noise_at_rest, noise_of


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


def test_noise_that_a_sensor_has_averaged_is_noise():
    rng = np.random.default_rng(4)
    time = np.arange(400) / 200.0
    for _ in range(20):
        noise = np.convolve(rng.standard_normal(410), np.ones(11) / 11.0, "valid")
        assert noise_at_rest(time, noise) > 0.85 * noise.std(ddof=2)


def test_noise_of_nothing():
    with pytest.raises(ModelError, match="3 samples are too few to read a noise from"):
        noise_of(np.zeros(3))
