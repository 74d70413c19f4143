"""Every kind of noise: its size, its tails, its spectrum, and the same in chunks of any length."""

import numpy as np
import pytest
from scipy import signal, stats

from dearig.drivers.errors import AddressError
from dearig.drivers.settings import RigSettings
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD
from dearig.sim_backend.factory import open_simulated_rig, plant_of
from dearig.sim_backend.laser_noise import NOISES, LaserNoise

RATE, CHUNK = 1000.0, 4096


def made(kind, chunks=40, cut=None):
    noise = LaserNoise(kind, 1.0 / RATE)
    state, parts = noise.start(np.random.default_rng((0, 99))), []
    for i in range(chunks):
        white = np.random.default_rng((1, i)).standard_normal(CHUNK)
        generator = np.random.default_rng((2, i))
        part, state = noise.shape(white[: cut or CHUNK], CHUNK, generator, state)
        parts.append(part)
        if cut:
            break
    return np.concatenate(parts)


@pytest.mark.parametrize("kind", NOISES)
def test_the_first_samples_do_not_depend_on_how_many_are_read(kind):
    np.testing.assert_allclose(made(kind, cut=100), made(kind, 1)[:100], rtol=1e-12)


def test_sizes():
    rms = {kind: made(kind).std() for kind in NOISES}
    for kind in ("white", "student", "averaged", "coarse"):
        assert rms[kind] == pytest.approx(1.0, rel=0.05)
    assert rms["pink"] == pytest.approx(np.sqrt(2.0), rel=0.1)


def test_tails():
    assert abs(stats.kurtosis(made("white"))) < 0.1
    assert stats.kurtosis(made("student")) > 2.0
    spikes = np.abs(made("spikes")) > 7.0
    assert 0.7e-3 < spikes.mean() < 1.3e-3


def test_spectra():
    frequency, power = signal.welch(made("pink"), RATE, nperseg=16384)
    slow = (frequency > 0.2) & (frequency < 5.0)
    slope = np.polyfit(np.log(frequency[slow]), np.log(power[slow]), 1)[0]
    assert slope == pytest.approx(-1.0, abs=0.2)
    averaged = made("averaged")
    lags = [np.mean(averaged[k:] * averaged[:-k]) for k in (10, 20)]
    np.testing.assert_allclose(lags, [0.5, 0.0], atol=0.05)


def test_a_coarse_laser_reads_in_steps():
    assert LaserNoise("coarse", 1e-3).step == 6e-6
    assert LaserNoise("pink", 1e-3).step == 0.0


def test_a_noise_that_is_none():
    with pytest.raises(ValueError, match="no noise 'brown'"):
        LaserNoise("brown", 1e-3)


def test_an_address_with_a_hand_and_a_noise_opens_that_rig():
    rig = open_simulated_rig("sim:7:second:spikes", RigSettings(), THESIS_FILM, THESIS_LOAD)
    identity = rig.identify()
    assert (identity.address, identity.seed) == ("sim:7:second:spikes", 7)
    second, _ = plant_of("sim:7:second", THESIS_FILM, THESIS_LOAD)
    first, _ = plant_of("sim:7", THESIS_FILM, THESIS_LOAD)
    assert second.plain == first.plain
    assert second.effects != first.effects
    for wrong in ("sim:7:third", "sim:7:", "sim:second", "sim:7:second:spikes:pink"):
        with pytest.raises(AddressError, match="is not a simulated rig"):
            plant_of(wrong, THESIS_FILM, THESIS_LOAD)
    with pytest.raises(AddressError, match=r"pink noise.* write sim:7:second"):
        plant_of("sim:7:second:pink", THESIS_FILM, THESIS_LOAD)


@pytest.mark.parametrize("kind", ["student", "spikes"])
@pytest.mark.parametrize("cut", [CHUNK, 333])
def test_a_fast_clock_samples_each_reading_several_times(kind, cut):
    # 32 samples in the sensor's average
    noise = LaserNoise(kind, 1e-5, 32e-5)
    state, parts = noise.start(np.random.default_rng(0)), []
    for i in range(40):
        generator = np.random.default_rng((3, i))
        part, state = noise.shape(np.zeros(cut), CHUNK, generator, state)
        parts.append(part)
    values = np.concatenate(parts)
    readings = values[: values.size // 32 * 32].reshape(-1, 32)
    assert (readings == readings[:, :1]).all()
    if kind == "student" and cut == CHUNK:
        assert np.count_nonzero(np.diff(readings[:, 0])) == len(readings) - 1
        assert readings[:, 0].std() == pytest.approx(1.0, rel=0.1)
