"""Single readings far outside of the noise at rest are masked; what lasts longer is not."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.model.readings.spikes import spikes

N, QUIET, STEP = 4000, 400, 5e-3
TIME = STEP * np.arange(N)
PULL = np.where(np.arange(N) < QUIET, 0.0, np.sin(2.0 * np.pi * 0.5 * (TIME - 2.0)) ** 2)
MOTION = 1e-3 * PULL


def noise(seed: int) -> np.ndarray:
    return 1e-6 * np.random.default_rng(seed).standard_normal(N)


def found(signal: np.ndarray) -> list[int]:
    return np.flatnonzero(spikes(TIME, signal, PULL, QUIET)).tolist()


def test_isolated_spikes_are_found_in_motion_and_at_rest() -> None:
    signal = MOTION + noise(0)
    places = [100, 391, 900, 1707, 2600, 3999 - 10]
    signal[places] += 1e-6 * np.array([60.0, -10.0, 12.0, -25.0, 10.0, -60.0])
    assert found(signal) == places


@pytest.mark.parametrize("apart", [2, 3, 5, 8])
@pytest.mark.parametrize("sizes", [(30.0, 40.0), (-20.0, 35.0), (15.0, -60.0)])
def test_two_spikes_near_each_other_are_found(apart, sizes) -> None:
    signal = MOTION + noise(9)
    for place in (200, 1234, 2611):
        signal[[place, place + apart]] += 1e-6 * np.array(sizes)
    wanted = [at for place in (200, 1234, 2611) for at in (place, place + apart)]
    assert found(signal) == wanted


@pytest.mark.deep
def test_good_readings_are_masked_as_seldom_as_is_said() -> None:
    # 0.01 a recording: of 30 recordings, more than 2 once in 300 times
    assert sum(len(found(MOTION + noise(seed))) for seed in range(30)) <= 2


@pytest.mark.parametrize(
    "shape",
    [
        lambda k: 30.0 * (k >= 0),
        lambda k: 20.0 * np.maximum(k, 0),
        lambda k: np.where(k >= 0, 30.0 * np.cos(2.2 * k) * np.exp(-np.maximum(k, 0) / 10.0), 0.0),
        lambda k: 20.0 * ((k == 0) | (k == 1)),
        lambda k: np.where(k >= 0, 30.0 * np.cos(np.pi * k / 2.0) * np.exp(-k / 60.0), 0.0),
        lambda k: 40.0 * (k >= 0) * np.exp(-np.maximum(k, 0) / 3.0),
    ],
    ids=["jump", "kink", "ringing", "two readings", "ringing of four readings", "decay"],
)
def test_what_a_model_could_explain_stays(shape) -> None:
    for place in (1000, 2345):
        signal = MOTION + noise(place) + 1e-6 * shape(np.arange(N) - place)
        assert found(signal) == []


def test_what_the_drive_does_is_no_spike() -> None:
    pull, signal = PULL.copy(), MOTION + noise(3)
    pull[1500] += 0.05
    signal[1500] += 20e-6
    assert not spikes(TIME, signal, pull, QUIET).any()


def test_noise_with_heavy_tails_or_coarse_steps_is_no_spike() -> None:
    rng = np.random.default_rng(4)
    heavy = MOTION + 0.7e-6 * rng.standard_t(3.0, N)
    # far fewer than the tails hold: 1 % of them are beyond 5.8
    assert len(found(heavy)) < 0.004 * N
    coarse = 6e-6 * np.round((MOTION + noise(5)) / 6e-6)
    assert found(coarse) == []


def test_noise_that_grows_with_the_motion_is_hardly_masked() -> None:
    rng = np.random.default_rng(6)
    grown = noise(6) + np.where(np.arange(N) < QUIET, 0.0, 4e-6 * rng.standard_normal(N))
    assert len(found(MOTION + grown)) < 0.002 * N


def test_without_a_lead_in_nothing_is_masked() -> None:
    signal = MOTION + noise(7)
    signal[1000] += 60e-6
    assert not spikes(TIME, signal, PULL, 50).any()
