"""The stress that a model lacks, read off made measurements: it is the stress that was put in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.film.material import THESIS_FILM, Network
from dearig.model.residual.missing_stress import missing_stress
from tests.tools.engine import (
    NOISE,
    PLAIN,
    STRIP,
    effect,
    film_record_of,
    masked,
    record_of,
    thesis_drive,
)

SECTION = THESIS_FILM.width * THESIS_FILM.thickness
STOP, DRAG, STEP, MASS = 2e4, 2e3, 100.0, 0.2
ONSET, MOMENT = 1e-3, 6.3


def beyond(drive, answer):
    place = (answer.stretch - answer.rest_stretch) * THESIS_FILM.length
    return STOP * np.maximum(place - ONSET, 0.0) / THESIS_FILM.length


def dragged(drive, answer):
    return DRAG * answer.rate


def stepped(drive, answer):
    return STEP * np.clip((drive.time - MOMENT) / 0.02 + 0.5, 0.0, 1.0)


def accelerated(drive, answer):
    return MASS * THESIS_FILM.length / SECTION * np.gradient(answer.rate, drive.time)


# (effect, its stress against the motion, Pa at any sample and RMS: as measured, rounded up)
CASES = {
    "end stop": (
        effect(
            "stress beyond a displacement", stiffness=STOP, onset=ONSET, exponent=1.0, damping=0.0
        ), beyond, 8.0, 0.5,
    ),
    "drag": (effect("linear drag", drag=DRAG), dragged, 2.5, 0.3),
    "load step": (effect("sudden change of force", stress=STEP, moment=MOMENT), stepped, 3.0, 0.3),
    "load inertia": (effect("load inertia", moving_mass=MASS), accelerated, 8.0, 0.8),
}  # fmt: skip


def without_noise(model, drive):
    return replace(record_of(model, drive), displacement=model.simulate(drive).displacement)


@pytest.mark.parametrize("noisy", [False, True], ids=["exact", "noisy"])
@pytest.mark.parametrize("rate", [100.0, 1000.0])
@pytest.mark.parametrize("case", CASES)
def test_what_was_put_in_is_read_off(case, rate, noisy):
    effects, stress, most, rms = CASES[case]
    model, drive = replace(PLAIN, effects=effects), thesis_drive(rate)
    record = record_of(model, drive) if noisy else without_noise(model, drive)
    (found,) = missing_stress([record], PLAIN)
    answer = model.simulate(drive)
    # what the film lacks pulls; all of these hold it back
    true = -stress(drive, answer)
    assert np.ptp(true) >= 100.0
    # a corner is rounded over the window of 15 ms
    clear = np.abs(drive.time - MOMENT) > 0.06 if case == "load step" else np.full(true.size, True)
    error = (found.stress - true)[clear]
    # a reading's micrometre is 1.4 Pa at 100 Hz, 0.5 Pa at 1 kHz
    extra = (1.8 if rate == 100.0 else 0.7) if noisy else 0.0
    assert np.abs(error).max() < most + 4.0 * extra
    assert np.sqrt(np.mean(error**2)) < rms + extra
    # against the effect's own range: it has the right size, not only the right look
    assert true @ found.stress / (true @ true) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("rate", "floor"), [(100.0, 1.45), (200.0, 1.0), (1000.0, 0.5)])
def test_of_clean_data_nothing_is_missing_but_the_noise(rate, floor):
    drive = thesis_drive(rate)
    (found,) = missing_stress([without_noise(PLAIN, drive)], PLAIN)
    assert np.abs(found.stress).max() < 1e-6
    (found,) = missing_stress([record_of(PLAIN, drive)], PLAIN)
    rms = float(np.sqrt(np.mean(found.stress**2)))
    assert rms == pytest.approx(floor, rel=0.15)
    # a thousandth of the stress that drives the film
    assert rms < 2e-3 * found.scale


def test_the_rest_of_what_is_told():
    drive = thesis_drive(1000.0)
    record = record_of(PLAIN, drive)
    (found,) = missing_stress([record], PLAIN)
    answer = PLAIN.simulate(drive)
    assert found.record == record.name
    np.testing.assert_array_equal(found.time, record.time)
    np.testing.assert_array_equal(found.voltage, drive.voltage)
    # smoothed: the foot of a lobe is rounded
    np.testing.assert_allclose(found.stretch, answer.stretch, atol=6e-5)
    moving = np.abs(answer.rate) > 0.2 * np.abs(answer.rate).max()
    np.testing.assert_allclose(found.rate[moving], answer.rate[moving], rtol=0.2)
    # permittivity (V/Z)^2 lam at the top of a lobe of 8 kV is 2.9 kPa
    assert 500.0 < found.scale < 3e3
    assert found.band == 10.0


def test_effects_that_are_in_the_model_are_not_missing():
    effects = CASES["drag"][0]
    both = replace(PLAIN, effects=(*effects, *CASES["end stop"][0]))
    drive = thesis_drive()
    (found,) = missing_stress([without_noise(both, drive)], replace(PLAIN, effects=effects))
    true = -beyond(drive, both.simulate(drive))
    # the drag cancels but for what it makes of the way that the two motions differ
    assert np.sqrt(np.mean((found.stress - true) ** 2)) < 2.5
    assert true @ found.stress / (true @ true) == pytest.approx(1.0, abs=0.04)
    (found,) = missing_stress([without_noise(both, drive)], both)
    assert np.abs(found.stress).max() < 1e-6


def test_a_known_lag_is_not_missing():
    drive, lag = thesis_drive(1000.0), 7e-3
    late = replace(record_of(PLAIN, drive), displacement=PLAIN.simulate(drive, lag).displacement)
    (found,) = missing_stress([replace(late, lag=lag)], PLAIN)
    assert np.abs(found.stress).max() < 1e-6
    (unknown,) = missing_stress([late], PLAIN)
    assert np.sqrt(np.mean(unknown.stress**2)) > 5.0


def test_rubbish_that_is_masked_is_bridged():
    record = record_of(PLAIN, thesis_drive(200.0))
    bad = np.zeros(record.time.size, dtype=bool)
    bad[700:712] = bad[1500:1520] = True
    (clean,) = missing_stress([record], PLAIN)
    (found,) = missing_stress([masked(record, bad)], PLAIN)
    assert np.abs(found.stress - clean.stress).max() < 4.0
    np.testing.assert_allclose(found.stretch, clean.stretch, atol=4.0 * NOISE / THESIS_FILM.length)


def test_films_are_exact():
    slow = replace(STRIP, effects=effect("slow branch", modulus=3e3, relaxation_time=9.0))
    record = film_record_of(slow)
    (found,) = missing_stress([record], STRIP)
    model = STRIP.simulate(record.time, record.stretch).stress
    np.testing.assert_array_equal(found.stress, record.stress - model)
    noise = record.stress - slow.simulate(record.time, record.stretch).stress
    extra = slow.simulate(record.time, record.stretch).stress - model
    np.testing.assert_allclose(found.stress - noise, extra, atol=1e-9)
    assert found.scale == pytest.approx(np.sqrt(np.mean(record.stress**2)))
    assert not found.voltage.any()
    valid = np.ones(record.time.size, dtype=bool)
    valid[300:310] = False
    spoilt = np.where(valid, record.stress, -1e6)
    (found,) = missing_stress([replace(record, stress=spoilt, valid=valid)], STRIP)
    assert np.abs(found.stress).max() < 2.0 * np.abs(extra).max()


def test_what_the_model_cannot_follow_is_left_out():
    soft = replace(PLAIN, network=Network.gent((2e3, 60.0), (1e9, 1e9), (0.4,)))
    good = record_of(PLAIN)
    assert not soft.simulate(good.drive).ok
    assert missing_stress([good], soft) == ()
    assert len(missing_stress([good, good], PLAIN)) == 2
    assert missing_stress([good], STRIP) == ()
