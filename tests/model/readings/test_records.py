"""Records as a fit sees them, and the measures of error."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dearig.model.errors import ModelError
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.film.sensor import at_sensor
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.measures import errors
from dearig.model.readings.records import ActuatorRecord, FilmRecord, counted
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Sequence

THESIS = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)


def record(rate=1000.0, hold=True, sigma=1e-9):
    time, voltage = Sequence.thesis(periods=1).sample(rate)
    drive = Drive(time, voltage, hold)
    x = THESIS.simulate(drive).displacement
    return ActuatorRecord("made", drive, x, sigma)


def test_measures_by_hand():
    measured = np.array([0.0, 1e-3, 2e-3, 1e-3])
    model = np.array([0.0, 1.1e-3, 1.7e-3, 1e-3])
    e = errors(measured, model)
    rms = math.sqrt((0.1e-3**2 + 0.3e-3**2) / 4.0)
    assert e.rms == pytest.approx(rms)
    assert e.max == pytest.approx(0.3e-3)
    assert e.nrmse_pct == pytest.approx(100.0 * rms / 2e-3)
    assert e.peak_pct == pytest.approx(100.0 * rms / 2e-3)
    # eq. 50 as printed: millimetres times 100 %, and the model's range
    assert e.e_rms_thesis_pct == pytest.approx(100.0 * rms * 1e3)
    assert e.e_m_thesis_pct == pytest.approx(100.0 * 0.3 / 1.7)
    assert e.samples == 4


@pytest.mark.parametrize("seed", range(5))
def test_measures_agree_with_one_another(seed):
    rng = np.random.default_rng(seed)
    e = errors(rng.normal(size=100), rng.normal(size=100))
    assert e.rms <= e.max
    assert e.nrmse_pct <= 100.0 * e.max
    assert e.nrmse_pct <= 2.0 * e.peak_pct


@pytest.mark.parametrize(("model", "pct"), [(1.0, 0.0), (2.0, math.inf)])
def test_a_range_of_zero(model, pct):
    e = errors(np.ones(3), np.full(3, model))
    assert (e.nrmse_pct, e.e_m_thesis_pct) == (pct, pct)


@pytest.mark.parametrize("lag", [0.0, 2.5e-4, 1e-3, 0.0123, -4e-4])
def test_at_sensor_is_the_value_of_a_little_earlier(lag):
    time = np.cumsum(np.random.default_rng(3).uniform(0.5e-3, 1.5e-3, 2000))
    w = 2.0 * math.pi * 3.0
    shown, rate = np.zeros(time.size), np.zeros(time.size)
    at_sensor(time, np.sin(w * time), w * np.cos(w * time), time - lag, shown, rate)
    inside = (time - lag > time[0]) & (time - lag < time[-1])
    np.testing.assert_allclose(shown[inside], np.sin(w * (time - lag))[inside], atol=1e-9)
    np.testing.assert_allclose(rate[inside], w * np.cos(w * (time - lag))[inside], atol=1e-5)
    assert (shown[time - lag <= time[0]] == np.sin(w * time[0])).all()


@pytest.mark.parametrize(
    ("rate", "bent", "shifted"), [(125.0, 0.15e-6, 2e-6), (40.0, 0.4e-6, 2e-5)]
)
@pytest.mark.parametrize("hold", [True, False])
def test_a_coarse_record_still_fits_its_model(rate, bent, shifted, hold):
    fine = record(hold=hold)
    coarse = fine.coarse(rate)
    assert rate / 1.3 < 1.0 / np.diff(coarse.time).max() < 1.3 * rate
    assert coarse.noise < fine.noise
    assert not coarse.drive.hold
    model = coarse.seen(THESIS.simulate(coarse.drive).displacement)
    assert np.abs(model - coarse.displacement).max() < bent
    # shifted by less than a thousandth of a sample
    speed = np.gradient(model, coarse.time)
    late = np.sum((model - coarse.displacement) * speed) / np.sum(speed**2)
    assert abs(late) < shifted


@pytest.mark.parametrize("every", [2, 3, 5])
def test_what_coarse_takes_the_mean_of(every):
    time = np.arange(100) * 1e-3
    fine = ActuatorRecord("x", Drive(time, 1e3 * time, True), 2.0 * time, 1e-3, lag=0.01)
    coarse = fine.in_means(every)
    np.testing.assert_allclose(coarse.time, time[: 100 // every * every].reshape(-1, every).mean(1))
    np.testing.assert_allclose(coarse.displacement, 2.0 * coarse.time)
    # a held voltage is half a sample late, and steps pull by no more than their mean square
    inside = slice(5, -5)
    expected = 1e3 * (coarse.time - 0.5e-3)
    np.testing.assert_allclose(coarse.drive.voltage[inside], expected[inside], rtol=1e-3)
    assert coarse.noise == pytest.approx(1e-3 / math.sqrt(every))
    assert coarse.lag == 0.01
    assert coarse.means_of == every
    assert fine.in_means(1) is fine
    assert fine.coarse(1000.0) is fine
    assert fine.coarse(200.0).means_of == 5
    assert fine.coarse(200.0).in_means(3).means_of == 15


def test_means_of_coarse_readings_keep_their_rounding():
    fine = record(sigma=2e-6)
    assert fine.in_means(4).noise == pytest.approx(1e-6)
    coarse = replace(fine, rounding=1.6e-6)
    assert coarse.in_means(4).noise == pytest.approx(math.hypot(0.5 * 1.2e-6, 1.6e-6))
    # the noise that was read may be less than the step alone makes
    assert replace(fine, rounding=3e-6).in_means(4).noise == pytest.approx(2e-6)


@pytest.mark.parametrize("every", [2, 3, 5, 40])
@pytest.mark.parametrize("turn", [0.2, 0.5, 1.0])
def test_means_of_a_wave_are_known_from_their_neighbours(every, turn):
    time = np.arange(4000) * 1e-3
    # turns by so much from one mean to the next
    wave = np.sin(turn * time / (every * 1e-3))
    coarse = ActuatorRecord("x", Drive(time, time), wave, 1e-3).in_means(every)
    about = coarse.seen(np.sin(turn * coarse.time / (every * 1e-3)))[2:-2]
    # the series ends with the sixth power
    assert np.abs(about - coarse.displacement[2:-2]).max() < 5e-4 * turn**6
    assert np.abs(about - coarse.displacement[2:-2]).max() < 0.02 * turn**2


@pytest.mark.parametrize("hold", [True, False])
def test_a_coarse_voltage_pulls_as_much_between_any_two_of_its_samples(hold):
    time = np.arange(3000) * 1e-3
    voltage = 4e3 * (1.0 - np.cos(2.0 * np.pi * 7.0 * time)) * (time < 2.0) - 3e3 * (time > 2.5)
    fine = ActuatorRecord("x", Drive(time, voltage, hold), np.zeros(3000), 1e-6)
    coarse = fine.in_means(10)

    def pull(drive, edges):  # in MV^2 s, by many small pieces
        at = np.linspace(edges[0], edges[1], 401)
        at = 0.5 * (at[:-1] + at[1:])
        if drive.hold:
            there = drive.voltage[np.searchsorted(drive.time, at, side="right") - 1]
        else:
            there = np.interp(at, drive.time, drive.voltage)
        return float(np.mean(there**2)) * 1e-12

    for k in (3, 50, 100, 198, 251, 270):
        edges = coarse.time[k] - 5e-3, coarse.time[k] + 5e-3
        assert pull(coarse.drive, edges) == pytest.approx(pull(fine.drive, edges), abs=2e-3)
    assert coarse.drive.voltage[280] == pytest.approx(-3e3)


def test_a_coarse_film_record_keeps_its_ends():
    time = np.arange(1001.0)
    fine = FilmRecord("x", time, 1.0 + 1e-3 * time, 5.0 * time, 2.0)
    coarse = fine.coarse(100)
    assert coarse.time[0] == 0.0
    assert coarse.time.size == 101
    np.testing.assert_allclose(coarse.stress, 5.0 * coarse.time)
    assert coarse.noise == pytest.approx(2.0 / math.sqrt(10.0))
    assert fine.coarse(900) is fine


@pytest.mark.parametrize(
    ("time", "values", "noise", "message"),
    [
        ([0.0, 1.0, 2.0], [0.0, 1.0], 1.0, "x: 2 readings at 3 times"),
        ([0.0, 1.0, 2.0], [0.0, math.nan, 1.0], 1.0, "x: sample 1 is not a finite number"),
        ([0.0, 2.0, 1.0], [0.0] * 3, 1.0, r"does not increase from sample 1 \(2 s\)"),
        ([0.0, 1.0, 2.0], [0.0] * 3, 0.0, "x: noise = 0.0 must be a finite number above 0"),
    ],
)
def test_refusals(time, values, noise, message):
    with pytest.raises(ModelError, match=message):
        ActuatorRecord("x", Drive(np.array(time), np.zeros(3)), np.array(values), noise)
    with pytest.raises(ModelError, match=message):
        FilmRecord("x", np.array(time), np.ones(3), np.array(values), noise)


def test_what_moves_before_it_is_driven_is_counted_from_there():
    drive = Drive(*Sequence.thesis(periods=1).sample(100.0))
    drifting = replace(THESIS, effects=(("linear drift", (("drift", 1e-5),)),))
    response = drifting.simulate(drive)
    lead_in = int(np.flatnonzero(drive.voltage)[0])
    assert lead_in > 50
    shown = response.displacement - response.displacement[:lead_in].mean()
    record = ActuatorRecord("drifting", drive, shown, 1e-6, lead_in=lead_in)
    problem = Problem([record], FitLayout(drifting))
    residuals = problem.residuals(problem.layout.coordinates(problem.layout.initial()))
    np.testing.assert_allclose(residuals, 0.0, atol=1e-6)
    assert record.coarse(20.0).lead_in == pytest.approx(lead_in / 5, abs=1)
    assert np.all(counted(shown, 0) == shown)
