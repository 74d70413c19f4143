"""Readings whose noise has heavy tails, as the fits of a diagnosis use them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dearig.model.diagnosis.preparation import without_spikes, without_tails
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Drive

N, QUIET = 4000, 400
TIME = 5e-3 * np.arange(N)
DRIVE = Drive(TIME, np.where(np.arange(N) < QUIET, 0.0, 1e3))


def record_with(noise: np.ndarray) -> ActuatorRecord:
    return ActuatorRecord("made", DRIVE, noise, float(np.std(noise)), lead_in=QUIET)


def test_normal_noise_stays_as_it_is() -> None:
    record = record_with(1e-6 * np.random.default_rng(0).standard_normal(N))
    assert without_tails(record, record.displacement) is record


def test_a_level_is_known_better_beside_heavy_tails() -> None:
    levels, plain = [], []
    for seed in range(20):
        noise = 1e-6 * np.random.default_rng(seed).standard_t(3.0, N)
        found = without_tails(record_with(noise), noise)
        assert found.noise < 0.9 * float(np.std(noise))
        levels.append(found.displacement[QUIET:].mean() - found.displacement[:QUIET].mean())
        plain.append(noise[QUIET:].mean() - noise[:QUIET].mean())
    assert np.std(levels) < 0.9 * np.std(plain)


def test_what_a_model_could_explain_stays() -> None:
    noise = 1e-6 * np.random.default_rng(1).standard_t(4.0, N)
    index = np.arange(N)
    missing = 40e-6 * (index >= 1500) + 15e-6 * np.sin(2.0 * np.pi * TIME)
    found = without_tails(record_with(noise), noise + missing)
    left = found.displacement - noise
    # about the jump of 40 um the readings are as they were
    assert np.max(np.abs((left - np.median(left))[1496:1504])) < 2e-6
    # where the misfit is not a smooth curve, all of them are
    mains = noise + 15e-6 * np.sin(2.0 * np.pi * 50.0 * TIME + 0.3)
    record = record_with(noise)
    assert without_tails(record, mains) is record


def test_a_spike_in_ringing_is_told_by_the_model() -> None:
    index = np.arange(N)
    rings = np.where(index < QUIET, 0.0, 40e-6 * np.sin(2.0 * np.pi * 70.0 * TIME))
    noise = 1e-6 * np.random.default_rng(2).standard_normal(N)
    spiky = noise.copy()
    places = [1000, 2350, 3500]
    spiky[places] += [30e-6, -50e-6, 12e-6]
    record = record_with(rings + spiky)
    assert without_spikes(record, rings + spiky) is record  # no model, no spike
    found = without_spikes(record, spiky)
    assert found.valid is not None
    assert np.flatnonzero(~found.valid).tolist() == places
    # interpolated along the model
    assert np.max(np.abs((found.displacement - rings)[places])) < 3e-6
    assert np.array_equal(found.displacement[found.valid], record.displacement[found.valid])
    assert without_spikes(record_with(rings + noise), noise).valid is None


def test_coarse_readings_at_rest_tell_no_spikes() -> None:
    noise = 1e-6 * np.random.default_rng(3).standard_normal(N)
    noise[2000] += 60e-6
    record = replace(record_with(noise), valid=np.arange(N) >= QUIET)
    assert without_spikes(record, noise) is record
