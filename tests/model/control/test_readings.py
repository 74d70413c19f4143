"""What is taken off the readings of a run before it is learned from."""

import numpy as np
import pytest

from dearig.model.control import lines_at_rest

NOISE, RATE, LEAD_IN = 1e-6, 200.0, 400
TIME = np.arange(6000) / RATE
#: Mains and its third harmonic, which the sample rate folds to nearly the same frequency.
MAINS = 15e-6 * np.sin(2.0 * np.pi * 49.99 * TIME + 0.3) + 7e-6 * np.sin(
    2.0 * np.pi * 149.97 * TIME + 1.0
)


def noise():
    return NOISE * np.random.default_rng(0).standard_normal(TIME.size)


@pytest.mark.parametrize("gap", [False, True])
def test_mains_is_found_by_the_lead_in_and_taken_off_the_whole_run(gap):
    off = MAINS + 3e-6 * np.sin(TIME) * (TIME > 2.0) + noise()
    if gap:
        off[3000:3100] = np.nan
    [(frequency, row)] = lines_at_rest(off, LEAD_IN, NOISE, RATE)
    assert frequency == pytest.approx(50.0, abs=0.5)
    assert np.std(row - MAINS) < 0.3 * NOISE < 0.03 * np.std(MAINS)


def test_what_is_periodic_while_the_film_moves_is_left():
    off = np.where(TIME > LEAD_IN / RATE, 15e-6 * np.sin(2.0 * np.pi * 20.0 * TIME), 0.0) + noise()
    assert lines_at_rest(off, LEAD_IN, NOISE, RATE) == []


@pytest.mark.parametrize("lead_in", [0, 3])
def test_without_readings_at_rest_nothing_is_taken_off(lead_in):
    assert lines_at_rest(MAINS + noise(), lead_in, NOISE, RATE) == []
