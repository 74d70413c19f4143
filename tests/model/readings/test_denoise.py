"""A voltage that was read back: its noise is taken off, its edges stay where they are."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.model.readings.denoise import reading_noise, smoothed
from tests.tools.engine import thesis_drive

NOISES = [1.0, 5.0, 20.0]  # V


def readings(course, noise, seed=0):
    return course + noise * np.random.default_rng(seed).standard_normal(course.size)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


TIME = np.arange(6000) * 1e-3
STEPS = np.select([TIME < 2.0, TIME < 3.0, TIME < 4.0, TIME < 5.0], [0.0, 3e3, 8e3, 1e3], 0.0)
TRIANGLES = np.where(TIME < 2.0, 0.0, 8e3 * (1.0 - np.abs(2.0 * (TIME % 1.0) - 1.0)))


# --- the noise of a reading


@pytest.mark.parametrize("noise", NOISES)
def test_noise_is_read_from_the_lead_in(noise):
    # a lead-in of 2 s at 1 kHz: a standard deviation known to 1.6 %
    course = thesis_drive(1000.0).voltage
    assert reading_noise(readings(course, noise)) == pytest.approx(noise, rel=0.06)
    assert reading_noise(readings(STEPS, noise)) == pytest.approx(noise, rel=0.06)
    assert reading_noise(readings(STEPS, noise) + 40.0) == pytest.approx(noise, rel=0.06)


def test_a_short_lead_in_will_do():
    course = np.concatenate([np.zeros(25), 8e3 * np.sin(np.linspace(0.0, np.pi, 500))])
    assert reading_noise(readings(course, 5.0)) == pytest.approx(5.0, rel=0.4)


def test_where_there_is_no_noise_to_be_read():
    lobes = thesis_drive(1000.0).voltage
    # a command, not a reading
    assert reading_noise(lobes) == 0.0
    # moving from the first sample on
    assert reading_noise(readings(8e3 * np.sin(30.0 * TIME), 5.0)) == 0.0
    # too short to say
    assert reading_noise(readings(np.zeros(19), 5.0)) == 0.0
    # steps of a converter, at rest on one of them
    assert reading_noise(5.0 * np.round(lobes / 5.0)) == 0.0


# --- off with it


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize(("rate", "left"), [(1000.0, 0.25), (2000.0, 0.2), (100.0, 0.45)])
def test_smooth_lobes_are_quieter(rate, left, noise):
    course = thesis_drive(rate).voltage
    found = smoothed(readings(course, noise), noise)
    assert rms(found - course) < left * noise
    # corners between lobes and all
    assert np.abs(found - course).max() < 5.0 * noise


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("course", [STEPS, TRIANGLES], ids=["steps", "triangles"])
def test_edges_stay(course, noise):
    noisy = readings(course, noise)
    found = smoothed(noisy, noise)
    assert np.abs(found - course).max() < 4.5 * noise
    # the reading itself is no nearer to the truth, anywhere about an edge
    edges = np.flatnonzero(np.abs(np.diff(course, 2)) > 10.0) + 1
    about = (edges[:, None] + np.arange(-40, 41)).ravel()
    about = about[about < course.size]
    assert rms((found - course)[about]) < 0.7 * rms((noisy - course)[about])
    assert rms(found - course) < 0.35 * noise


def test_a_ringing_is_not_taken_for_noise():
    # 60 Hz of 30 V on a lobe, at 1 kHz: a film would feel it
    drive = thesis_drive(1000.0)
    course = drive.voltage + 30.0 * np.sin(2.0 * np.pi * 60.0 * drive.time)
    found = smoothed(readings(course, 3.0), 3.0)
    assert rms(found - course) < 3.0
    # what is taken off it is less than the noise
    line = np.exp(-2j * np.pi * 60.0 * drive.time)
    assert abs(line @ found) == pytest.approx(abs(line @ course), rel=0.07)


def test_without_noise_nothing_changes():
    for course in (STEPS, TRIANGLES, thesis_drive(1000.0).voltage, readings(STEPS, 5.0)):
        found = smoothed(course, 0.0)
        np.testing.assert_array_equal(found, course)
        assert found is not course


def test_what_is_shorter_than_a_window_stays():
    short = readings(np.zeros(7), 5.0)
    np.testing.assert_array_equal(smoothed(short, 5.0), short)
    assert np.all(np.isfinite(smoothed(readings(np.zeros(8), 5.0), 5.0)))


def test_the_readings_themselves_are_left_alone():
    noisy = readings(STEPS, 5.0)
    kept = noisy.copy()
    smoothed(noisy, 5.0)
    np.testing.assert_array_equal(noisy, kept)
