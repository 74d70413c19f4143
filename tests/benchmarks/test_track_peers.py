"""The ways to follow a path without a model, on a linear plant whose answer is known."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest

from dearig.model.control import VoltageLimits
from dearig.sim_backend.plant import Electricity, Motion
from tests.benchmarks.track_peers import (
    FACTORS,
    LEARNED,
    TRIALS,
    Gains,
    Learning,
    Loop,
    Path,
    Response,
    Rig,
    simc,
    tuned,
)

RATE = 200.0  # Hz
GAIN, LAG, DELAY = 2e-11, 0.1, 0.02  # m/V^2, s, s
LIMITS = VoltageLimits(8e3)


@dataclass(frozen=True)
class Linear:
    """First-order lag with dead time of the displacement behind the voltage squared."""

    moved: float = 0.0
    waiting: tuple[float, ...] = (0.0,) * round(DELAY * RATE)

    def renewed(self, _generator):
        return Linear()

    def advance(self, _time, voltage, hold):
        assert hold
        moved, waiting, rows = self.moved, list(self.waiting), [self.moved]
        for volts in voltage[:-1]:
            waiting.append(GAIN * volts**2)
            there = waiting.pop(0)
            moved = there + (moved - there) * math.exp(-1.0 / (RATE * LAG))
            rows.append(moved)
        rows = np.array(rows)
        none = np.zeros((2, rows.size - 1))
        circuit = Electricity(none, none, none, none[0], none, none)
        motion = Motion(rows, np.zeros(rows.size), circuit, np.zeros(rows.size))
        return motion, replace(self, moved=moved, waiting=tuple(waiting))


def rig():
    return Rig(Linear(), 1e-9, GAIN, np.random.default_rng(0))


def path(seconds=8.0):
    time = np.arange(round(seconds * RATE)) / RATE
    moved = 400e-6 * np.sin(np.pi * time / seconds) ** 2
    moved += 50e-6 * np.sin(2.0 * np.pi * time) * np.sin(np.pi * time / seconds) ** 2
    inside = np.ones(time.size, dtype=bool)
    # at its end the lag is above the path, which no voltage changes
    return Path(moved, time < seconds - 1.0, inside, RATE, LIMITS)


@pytest.fixture(scope="module")
def loop():
    return Loop(rig(), LIMITS, RATE)


def test_a_step_shows_gain_lag_and_dead_time_of_the_loop(loop):
    found = loop.identify(path())
    assert found.gain == pytest.approx(GAIN, rel=1e-3)
    assert found.lag == pytest.approx(LAG, rel=0.05)
    assert found.dead_time == pytest.approx(DELAY + loop.latency, abs=0.2 * loop.period)


def test_simc_gives_its_closed_loop_time():
    slow, fast = simc(Response(2.0, 0.3, 0.1)), simc(Response(2.0, 0.0, 0.1))
    assert slow == Gains(0.3 / (2.0 * 0.2), 1.0 / (2.0 * 0.2))
    assert fast == Gains(0.0, 1.0 / (2.0 * 0.2))


def test_a_loop_with_the_gains_of_simc_answers_a_step_in_its_closed_loop_time(loop):
    gains = simc(Response(GAIN, LAG, DELAY + loop.latency + 0.5 * loop.period))
    at, n = round(RATE), round(3.0 * RATE)
    wanted = np.where(np.arange(n) >= at, 200e-6, 0.0)
    always = np.ones(n, dtype=bool)
    answer = loop.follow(Path(wanted, always, always, RATE, LIMITS), gains) / 200e-6
    dead_time = DELAY + loop.latency + 0.5 * loop.period
    reached = (np.flatnonzero(answer > 1.0 - math.exp(-1.0))[0] - at) / RATE
    assert reached == pytest.approx(2.0 * dead_time, abs=loop.period)
    assert answer.max() < 1.1
    assert answer[-1] == pytest.approx(1.0, abs=1e-3)


def test_tuning_on_the_path_is_no_worse_than_the_rule(loop):
    wanted = path(3.0)
    by_rule = wanted.error(loop.follow(wanted, simc(loop.identify(wanted))))
    alone, runs = tuned(loop, wanted)
    helped, _ = tuned(loop, wanted, replace(alone, ahead=1.0 / GAIN))
    assert runs <= TRIALS + len(FACTORS) * 3
    assert wanted.error(loop.follow(wanted, alone)) < 1.01 * by_rule
    # the static voltage is late by the lag, which the loop takes off in part
    static = wanted.error(loop.follow(wanted, Gains(0.0, 0.0, 0.0, 1.0 / GAIN)))
    assert wanted.error(loop.follow(wanted, helped)) < static


def test_the_measured_response_is_that_of_the_plant():
    lines, response = Learning(rig(), path()).measure()
    pole = math.exp(-1.0 / (RATE * LAG))
    z = np.exp(2j * np.pi * lines / RATE)
    known = GAIN * (1.0 - pole) / (z - pole) * z ** -round(DELAY * RATE)
    # what is left of the start decays with the lag: nothing after 10 s
    np.testing.assert_allclose(response, known, rtol=2e-3)


def test_learning_takes_the_same_part_off_the_error_in_every_run():
    wanted = path()
    runs = Learning(rig(), wanted).runs(3, start=np.full(wanted.reference.size, 1e6))
    errors = [wanted.error(run) for run in runs]
    for before, after in pairwise(errors):
        assert after == pytest.approx((1.0 - LEARNED) * before, rel=0.2)
    assert wanted.error(Learning(rig(), wanted).runs(3)[-1]) < 0.1e-6
