"""Thinning: as few means as say what all samples do, whatever was played."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.diagnosis.fits import Fitter
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.fitting.thinning import thinned
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Drive, reading_of
from dearig.model.simulation.excitation import Chirp, Lobes, Ramp, Sequence, Steps
from tests.tools.engine import NOISE, PLAIN, masked

RATE = 1000.0  # a rig file's own


def dense(*segments, model=PLAIN, rate=RATE, noise=0.0):
    """What ``model`` shows, with or without the noise that is told of it."""
    drive = replace(Drive(*Sequence("dense", segments).sample(rate)), hold=True)
    response = model.simulate(drive)
    assert response.ok
    added = noise * np.random.default_rng(1).standard_normal(drive.time.size)
    return ActuatorRecord("dense", drive, response.displacement + added, NOISE)


def cost(thin, model=PLAIN):
    """Of the truth: 1 and what thinning adds to the noise."""
    shown, status = reading_of(model.coefficients(), model.film.length, thin.drive)
    assert status == kernel.OK
    return 1.0 + np.mean(((thin.seen(shown) - thin.displacement) / thin.noise) ** 2)


SLOW = (Lobes(periods=1),)
CHIRP = (Ramp(4e3, 1.0), Chirp(3.5e3, 0.5, 15.0, 10.0), Ramp(0.0, 1.0))
FAST = (Ramp(4e3, 1.0), Chirp(3.5e3, 5.0, 60.0, 10.0), Ramp(0.0, 1.0))
STEPS = (Steps((8e3, 2e3, 6e3, 0.0), 1.0, 0.02),)


@pytest.mark.parametrize(
    ("segments", "rates"),
    [(SLOW, (190, 210)), (CHIRP, (190, 510)), (STEPS, (300, 1000)), (FAST, (450, 1000))],
)
@pytest.mark.parametrize("rate", [1000.0, 3000.0])
def test_the_truth_costs_no_more_than_the_noise(segments, rates, rate):
    record = dense(*segments, rate=rate)
    thin = thinned(record, 200.0, PLAIN)
    assert cost(thin) < 1.02
    kept = 1.0 / np.median(np.diff(thin.time))
    assert rates[0] < kept < (rate if segments is FAST else rates[1]) + 1.0


def test_steps_at_the_rate_that_was_asked_for_would_have_misled():
    assert cost(dense(*STEPS).coarse(200.0)) > 2.0
    assert cost(dense(*FAST).coarse(200.0)) > 10.0


def test_what_the_readings_show_beyond_the_model_is_kept():
    # a ringing that the model which is asked knows nothing of
    record = dense(*SLOW)
    ringing = 30e-6 * np.sin(2.0 * np.pi * 80.0 * record.time)
    assert thinned(record, 200.0, PLAIN).means_of == 5
    rings = replace(record, displacement=record.displacement + ringing)
    thin = thinned(rings, 200.0, PLAIN)
    assert thin.means_of < 5
    shown = thin.seen(30e-6 * np.sin(2.0 * np.pi * 80.0 * thin.time))
    left = thin.displacement - shown - thinned(record, 1e3 / thin.means_of, PLAIN).displacement
    assert np.sqrt(np.mean(left[2:-2] ** 2)) < 0.3 * thin.noise


def test_noise_alone_keeps_no_sample_and_rubbish_none():
    record = dense(*SLOW, noise=NOISE)
    assert thinned(record, 200.0, PLAIN).means_of == 5
    bad = np.zeros(record.time.size, dtype=bool)
    bad[3000:3100] = True
    assert thinned(masked(record, bad), 200.0, PLAIN).means_of == 5


def test_a_model_that_cannot_follow_is_not_asked():
    record = dense(*SLOW)
    pulled_in = replace(record, drive=replace(record.drive, voltage=60.0 * record.drive.voltage))
    assert reading_of(PLAIN.coefficients(), PLAIN.film.length, pulled_in.drive)[1] != kernel.OK
    assert thinned(pulled_in, 200.0, PLAIN).means_of == 5


def test_what_is_fitted_as_the_baseline_is_asked_again():
    # the model that is asked first would stand any thinning: it hardly moves
    record = dense(*STEPS, noise=NOISE)
    stiff = replace(PLAIN, film=replace(PLAIN.film, permittivity=0.01))
    fitter = Fitter([record], stiff, DiagnosisSettings(), workers=1)
    before = fitter.records[0].means_of
    wanted = thinned(record, 200.0, PLAIN).means_of
    assert before > wanted
    fitter.base = PLAIN
    fit = fitter.baseline(lambda *_: None)
    assert fitter.records[0].means_of == fit.problem.records[0].means_of == wanted
    assert fit.cost == pytest.approx(1.0, abs=0.1)
    assert fit.is_flat
