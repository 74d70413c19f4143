"""Sketches of a drive: fewer and longer steps, and the same answer to what a number does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.film.material import Branch, Network, Spring
from dearig.model.fitting.broyden import descend_broyden
from dearig.model.fitting.coarse_drive import coarse_drive_of
from dearig.model.fitting.levenberg import descend
from dearig.model.simulation.actuator import Drive, reading_of
from dearig.model.simulation.excitation import Chirp, Lobes, Ramp, Sequence, Steps
from tests.tools.engine import NOISE, PLAIN, effect, posed, record_of, typical

RATE = 200.0
SLOW = (Lobes(periods=1),)
CHIRP = (Ramp(4e3, 1.0), Chirp(3.5e3, 0.2, 1.0, 12.0), Ramp(0.0, 1.0))
STEPS = (Steps((3e3, 7e3, 2e3, 0.0), 8.0, 0.02),)


def played(*segments, hold=True, rate=RATE):
    return replace(Drive(*Sequence("played", segments).sample(rate)), hold=hold)


def record(*segments, model=PLAIN, hold=True, rate=RATE):
    return record_of(model, played(*segments, hold=hold, rate=rate))


def seen(record, model, drive=None, fidelity=kernel.CAREFUL):
    found, status = reading_of(
        model.coefficients(), model.film.length, drive or record.drive, record.lag, fidelity,
        record.time,
    )  # fmt: skip
    assert status == kernel.OK
    return found


def with_coarse_drive(record, model=PLAIN):
    coarse = coarse_drive_of(record, model)
    assert coarse is not None
    return replace(record, coarse_drive=coarse)


@pytest.mark.parametrize("lag", [0.0, 9e-5, 3e-3])
@pytest.mark.parametrize("hold", [True, False])
@pytest.mark.parametrize(("segments", "part"), [(SLOW, 0.3), (CHIRP, 0.4), (STEPS, 0.5)])
def test_a_coarse_drive_is_shorter_and_reads_the_same(segments, part, hold, lag):
    one = replace(record(*segments, hold=hold), lag=lag)
    coarse = coarse_drive_of(one, PLAIN)
    assert coarse is not None
    assert coarse.time.size < part * one.time.size
    off = seen(one, PLAIN, coarse, kernel.COARSE) - seen(one, PLAIN)
    assert np.sqrt(np.mean(off**2)) < 0.5 * NOISE


def test_slow_and_fast_are_cut_as_they_ask():
    one = record(*SLOW, *STEPS)
    coarse = coarse_drive_of(one, PLAIN)
    begins = Sequence("played", SLOW).duration
    steps = np.diff(coarse.time)
    assert np.median(steps[coarse.time[:-1] < begins]) == pytest.approx(0.02)
    edge = np.abs(coarse.time[:-1] - begins - 0.01) < 0.01  # the first rise
    np.testing.assert_allclose(steps[edge], 1.0 / RATE)
    np.testing.assert_array_equal(np.isin(coarse.time, one.time), True)


@pytest.mark.parametrize("hold", [True, False])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_it_pulls_as_much(hold, sign):
    drive = played(*SLOW, hold=hold)
    one = record_of(PLAIN, replace(drive, voltage=sign * drive.voltage))
    coarse = coarse_drive_of(one, PLAIN)

    def pull(d):
        a, b = d.voltage[:-1], d.ends[:-1]
        return np.sum(np.diff(d.time) * (a * a + a * b + b * b)) / 3.0

    assert pull(coarse) == pytest.approx(pull(one.drive), rel=1e-4)
    assert (sign * coarse.voltage >= 0.0).all()
    # where it goes on from where it came to, nothing rings
    jumps = np.abs(coarse.voltage[1:-1] - coarse.to[:-2])
    assert np.median(jumps) < 0.01 * np.max(np.abs(coarse.voltage))


def test_the_temperature_is_that_of_the_step():
    drive = played(*SLOW)
    warm = replace(drive, warmth=0.2 * drive.time)
    coarse = coarse_drive_of(record_of(PLAIN, warm), PLAIN)
    middle = 0.5 * (coarse.time[1:-1] + coarse.time[:-2])
    # the samples of a step are the first half and more of it
    np.testing.assert_allclose(coarse.warmth[:-2], 0.2 * middle, atol=0.2 * 0.5 / RATE)


def test_records_without_a_coarse_drive():
    slow = record(*SLOW)
    held = replace(PLAIN, film=replace(PLAIN.film, kinematics="uniaxial"))
    assert coarse_drive_of(slow, held) is None  # its swinging is not in closed form
    branches = tuple(Branch(Spring(10e3, 1e4), t) for t in (0.2, 0.4, 1.0, 4.0))
    many = replace(PLAIN, network=Network(PLAIN.network.springs[0], branches))
    assert coarse_drive_of(slow, many) is None
    strong = replace(slow, drive=replace(slow.drive, voltage=60.0 * slow.drive.voltage))
    assert coarse_drive_of(strong, PLAIN) is None  # it pulls in
    assert coarse_drive_of(record(Chirp(3.5e3, 20.0, 60.0, 5.0)), PLAIN) is None
    assert coarse_drive_of(record(*SLOW, rate=60.0), PLAIN) is None  # as long as a step may be


def test_which_numbers_are_told():
    slow = with_coarse_drive(record(*SLOW))
    for effects in (effect("linear drag", drag=300.0), effect("linear drift", drift=1e-6)):
        problem, x, free = posed(replace(PLAIN, effects=effects), slow)
        np.testing.assert_array_equal(problem.find_coarse_columns(x, free), free)
    # a moment within a step is not seen, nor bristles that slip within one
    late = effect("sudden change of force", stress=30.0, moment=4.003)
    problem, x, free = posed(replace(PLAIN, effects=late), slow)
    moment = problem.layout.names.index("sudden change of force: moment")
    assert not problem.find_coarse_columns(x, free)[moment]
    bristles = replace(PLAIN, effects=(typical("easing friction"),))
    problem, x, free = posed(bristles, slow)
    assert not problem.find_coarse_columns(x, free).any()
    problem, x, free = posed(PLAIN, record(*SLOW))
    assert not problem.find_coarse_columns(x, free).any()


def test_what_is_known_is_not_asked_again():
    slow = with_coarse_drive(record(*SLOW))
    plain, x, free = posed(PLAIN, slow)
    springs = plain.find_coarse_columns(x, free)
    problem, x, free = posed(replace(PLAIN, effects=effect("linear drag", drag=300.0)), slow)
    told = problem.find_coarse_columns(x, free)
    asked = problem.simulations
    problem.simulations = 0
    np.testing.assert_array_equal(problem.find_coarse_columns(x, free, springs), told)
    # the place itself twice, and twice again next to the one number
    assert problem.simulations == 6 < asked
    # who was not told is not
    doubted = springs.copy()
    doubted[0] = False
    assert not problem.find_coarse_columns(x, free, doubted)[0]


def test_coarse_derivatives_equal_those_of_the_full_record():
    model = replace(PLAIN, effects=effect("linear drag", drag=300.0))
    problem, x, free = posed(model, with_coarse_drive(record(*SLOW, model=model)))
    residuals = problem.residuals(x)
    whole = problem.jacobian(x, free, residuals)
    problem.coarse_columns = problem.find_coarse_columns(x, free)
    np.testing.assert_array_equal(problem.jacobian(x, free, residuals), whole)
    coarse = problem.jacobian(x, free, residuals, coarse=True)
    assert not np.array_equal(coarse, whole)
    off = np.linalg.norm(coarse - whole, axis=0) / np.linalg.norm(whole, axis=0)
    assert off.max() < 0.05
    # of one number not told, the whole itself
    problem.coarse_columns[0] = False
    some = problem.jacobian(x, free, residuals, coarse=True)
    np.testing.assert_allclose(some[:, 0], whole[:, 0], rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(some[:, 1:], coarse[:, 1:])


AWAY = replace(
    PLAIN,
    network=Network.gent((50e3, 54e3), (1e4, 1e4), (0.5,)),
    effects=effect("linear drag", drag=100.0),
)


@pytest.mark.parametrize("off", [1.0, 0.9997, 0.98, 0.6], ids=["good", "near", "off", "useless"])
def test_a_coarse_descent_ends_at_the_optimum_of_the_full_record(off):
    truth = replace(PLAIN, effects=effect("linear drag", drag=400.0))
    one = with_coarse_drive(record(*SLOW, model=truth))
    coarse = replace(
        one.coarse_drive, voltage=off * one.coarse_drive.voltage, to=off * one.coarse_drive.to
    )
    problem, x, free = posed(AWAY, replace(one, coarse_drive=coarse))
    wanted = descend(problem, x, ~free, gain=0.01)
    problem.coarse_columns = free
    fit = descend_broyden(problem, x, ~free, gain=0.01)
    assert fit.cost == pytest.approx(wanted.cost, abs=0.1 / problem.samples)
    assert fit.cost == pytest.approx(problem.costs(fit.x[None])[0], rel=1e-12)
    np.testing.assert_allclose(fit.residuals, problem.residuals(fit.x))
