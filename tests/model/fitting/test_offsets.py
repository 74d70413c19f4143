"""The offset of each recording: its zero is known as well as the lead-in is read, not better."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.fitting.intervals import covariance
from dearig.model.fitting.offsets import Offsets, centred
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.readings.records import counted
from tests.tools.engine import PLAIN, masked, posed, record_of

LEAD_IN = 150
MADE = record_of(PLAIN)
RECORD = replace(MADE, displacement=counted(MADE.displacement, LEAD_IN), lead_in=LEAD_IN)


def test_the_sum_of_squares_is_that_of_the_marginal_likelihood() -> None:
    n = RECORD.time.size - LEAD_IN
    r = np.random.default_rng(1).standard_normal(RECORD.time.size)
    r[:LEAD_IN] = 0.0
    # readings after the lead-in share its mean's error, whose variance is 1/LEAD_IN
    dense = np.eye(n) + np.full((n, n), 1.0 / LEAD_IN)
    left = r - Offsets([RECORD]).nearest(r)
    assert left @ left == pytest.approx(r[LEAD_IN:] @ np.linalg.solve(dense, r[LEAD_IN:]))


def test_without_a_lead_in_the_zero_is_known_to_one_reading() -> None:
    n = RECORD.time.size
    r = np.random.default_rng(2).standard_normal(n) + 3.0
    left = r - Offsets([MADE]).nearest(r)
    assert left @ left == pytest.approx(r @ np.linalg.solve(np.eye(n) + 1.0, r))
    means = MADE.in_means(4)
    r = r[: means.time.size]
    left = r - Offsets([means]).nearest(r)
    # in units of the noise of a mean of four
    assert left @ left == pytest.approx(r @ np.linalg.solve(np.eye(r.size) + 4.0, r))


def test_a_shifted_recording_gives_the_same_residuals() -> None:
    bad = np.zeros(RECORD.time.size, dtype=bool)
    bad[300:320] = True
    for record in (RECORD, masked(RECORD, bad)):
        problem, x, _ = posed(PLAIN, record)
        shifted, _, _ = posed(PLAIN, replace(record, displacement=record.displacement + 5e-5))
        assert shifted.residuals(x) == pytest.approx(problem.residuals(x), abs=1e-6)


def test_each_record_has_its_own_offset() -> None:
    layout = FitLayout(PLAIN)
    x = layout.coordinates(layout.initial())
    moved = [replace(RECORD, displacement=RECORD.displacement + s) for s in (3e-5, -2e-5)]
    both = Problem(moved, layout, workers=1).residuals(x)
    assert np.split(both, 2)[0] == pytest.approx(np.split(both, 2)[1], abs=1e-6)
    assert np.std(both) == pytest.approx(1.0, rel=0.1)


def test_the_equilibrium_modulus_is_known_no_better_than_the_zero() -> None:
    problem, x, free = posed(PLAIN, RECORD)
    exact = Problem([RECORD], problem.layout, workers=1, exact_zero=True)
    sigmas = [
        np.sqrt(np.diag(covariance(j.T @ j, 1.0)))[0]
        for j in (p.jacobian(x, free) for p in (exact, problem))
    ]
    assert sigmas[1] > 1.2 * sigmas[0]


def test_what_an_offset_absorbs_is_taken_off_columns() -> None:
    columns = np.column_stack([np.ones(RECORD.time.size), RECORD.time])
    left = centred(RECORD, columns)
    assert left[:, 0] == pytest.approx(0.0, abs=1e-12)
    assert left[:, 1] == pytest.approx(RECORD.time - RECORD.time.mean())
