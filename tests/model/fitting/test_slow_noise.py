"""Drift as noise: whitening and its variance against dense linear algebra and SciPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import sqrtm
from scipy.stats import multivariate_normal

from dearig.model.diagnosis.fits import Fitter
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.slow_noise import (
    Drift,
    DriftSpace,
    WhitenedProblem,
    drift_modes,
    late_basis,
    pink_density,
)
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Drive
from tests.tools.engine import PLAIN, masked, pink_noise, record_of, thesis_drive

MODES = 6


def bases(*sizes: int) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    return [rng.standard_normal((n, MODES)) for n in sizes]


def dense(some: list[np.ndarray], amplitude: float) -> np.ndarray:
    """The covariance of all records, written out."""
    n = sum(len(b) for b in some)
    found, at = np.eye(n), 0
    for b in some:
        part = slice(at, at + len(b))
        found[part, part] += amplitude * b @ b.T
        at = part.stop
    return found


def test_whitening_is_the_inverse_root_of_the_dense_covariance() -> None:
    some = bases(30, 20)
    drift = Drift(DriftSpace(some), 2.5)
    rows = np.random.default_rng(2).standard_normal((3, 50))
    expected = rows @ np.linalg.inv(sqrtm(dense(some, 2.5)).real)
    assert drift.whitened(rows) == pytest.approx(expected, abs=1e-9)
    assert drift.log_det == pytest.approx(np.linalg.slogdet(dense(some, 2.5))[1])


def test_the_mean_drift_is_that_of_the_conditional_normal_distribution() -> None:
    some = bases(40)
    drift = Drift(DriftSpace(some), 0.7)
    r = np.random.default_rng(3).standard_normal(40)
    prior = 0.7 * some[0] @ some[0].T
    assert drift.mean(r) == pytest.approx(prior @ np.linalg.solve(dense(some, 0.7), r))


def test_the_most_probable_variance_is_that_of_scipys_densities() -> None:
    some = bases(60)
    rng = np.random.default_rng(4)
    r = rng.multivariate_normal(np.zeros(60), dense(some, 300.0))
    found = DriftSpace(some).most_probable(r)
    around = [found / 10**0.5, found, found * 10**0.5]
    logs = [multivariate_normal(np.zeros(60), dense(some, a)).logpdf(r) for a in around]
    assert np.argmax(logs) == 1


def test_white_noise_has_no_drift() -> None:
    r = np.random.default_rng(5).standard_normal(400)
    smooth = np.cos(np.pi * np.arange(1, 7) * np.linspace(0.0, 1.0, 400)[:, None])
    assert DriftSpace([smooth]).most_probable(r) == 0.0


def test_modes_are_counted_from_the_lead_in_and_absent_where_masked() -> None:
    bad = np.zeros(thesis_drive().time.size, dtype=bool)
    bad[300:320] = True
    record = masked(record_of(PLAIN), bad)
    modes = drift_modes(record, 4)
    assert not modes[bad].any()
    lead_in = max(record.lead_in, 1)
    assert modes[:lead_in].mean(axis=0) == pytest.approx(np.zeros(4), abs=1e-12)


def test_a_whitened_problem_has_whitened_residuals() -> None:
    record = record_of(PLAIN)
    layout = FitLayout(PLAIN)
    x = layout.coordinates(layout.initial())
    plain = WhitenedProblem([record], layout, workers=1).residuals(x)
    drift = Drift(DriftSpace([drift_modes(record, 8)]), 50.0)
    problem = WhitenedProblem([record], layout, drift, workers=1)
    assert problem.residuals(x) == pytest.approx(drift.whitened(plain), abs=1e-6)


def test_whitening_takes_out_1_over_f_noise_beside_a_drift() -> None:
    some, pink = bases(30, 20), [np.arange(1.0, 7.0), np.arange(2.0, 8.0)]
    drift = DriftSpace(some, pink).drift(1.5)
    assert drift is not None
    wide = [b * np.sqrt(1.5 + p) for b, p in zip(some, pink, strict=True)]
    rows = np.random.default_rng(2).standard_normal((3, 50))
    expected = rows @ np.linalg.inv(sqrtm(dense(wide, 1.0)).real)
    assert drift.whitened(rows) == pytest.approx(expected, abs=1e-9)
    assert DriftSpace(some).drift(0.0) is None


def at_rest(noise: np.ndarray) -> ActuatorRecord:
    """A record of a film that hangs still for all of it but its last sample."""
    time = 0.01 * np.arange(noise.size)
    voltage = np.zeros(noise.size)
    voltage[-1] = 1.0
    return ActuatorRecord("rest", Drive(time, voltage), noise, 1e-6, lead_in=noise.size - 1)


def test_the_density_of_1_over_f_noise_is_read_at_rest() -> None:
    rng = np.random.default_rng(6)
    found = []
    for _ in range(40):
        white = 1e-6 * rng.standard_normal(400)
        assert pink_density([at_rest(white)], 12.0, 10.0) == 0.0
        found.append(pink_density([at_rest(0.3 * white + pink_noise(rng, 400, 2e-13))], 12.0, 10.0))
    assert np.median(found) == pytest.approx(2e-13, rel=0.15)
    assert np.mean([p > 0.0 for p in found]) > 0.9
    # a walk is no such noise
    walks = [np.cumsum(3e-7 * rng.standard_normal(400)) for _ in range(20)]
    assert np.mean([pink_density([at_rest(w)], 12.0, 10.0) == 0.0 for w in walks]) > 0.9
    # of several records at once it is known better
    both = pink_density([at_rest(pink_noise(rng, 400, 2e-13)) for _ in range(10)], 12.0, 10.0)
    assert both == pytest.approx(2e-13, rel=0.2)


def test_others_tell_the_colour_by_their_readings_at_rest_alone() -> None:
    rng, thesis = np.random.default_rng(7), thesis_drive()
    rest = 0.01 * np.arange(200)
    still = Drive(
        np.concatenate([rest, 2.0 + thesis.time]),
        np.concatenate([np.zeros(rest.size), thesis.voltage]),
    )

    def noisy(density: float) -> ActuatorRecord:
        record = replace(record_of(PLAIN, still), lead_in=rest.size)
        slow = pink_noise(rng, record.displacement.size, density) if density else 0.0
        return replace(record, displacement=record.displacement + slow)

    def amplitudes(*others: ActuatorRecord) -> np.ndarray:
        fitter = Fitter([record], PLAIN, DiagnosisSettings(), workers=1, others=others)
        fitter.read_colour()
        drift = fitter.space().drift(0.0)
        return np.zeros(1) if drift is None else drift.space.parts(0.0)[0][1]

    record = noisy(0.0)
    assert amplitudes().max() == 0.0  # white
    others = [noisy(4e-13) for _ in range(3)]
    coloured = amplitudes(*others)
    assert coloured.max() > 1.0

    def elsewhere(other: ActuatorRecord) -> ActuatorRecord:
        moved = other.displacement.copy()
        moved[other.lead_in :] = rng.standard_normal(moved.size - other.lead_in)
        return replace(other, displacement=moved)

    assert amplitudes(*map(elsewhere, others)) == pytest.approx(coloured)


def test_what_begins_with_the_voltage_begins_at_0_whatever_is_masked() -> None:
    record = replace(at_rest(np.zeros(300)), lead_in=100)
    late = late_basis(record, 4)
    assert np.ptp(late[:100], axis=0) == pytest.approx(0.0, abs=1e-12)
    valid = np.ones(300, dtype=bool)
    valid[99] = False  # the last reading at rest
    steps = np.abs(np.diff(late_basis(replace(record, valid=valid), 4)[100:], axis=0))
    assert steps == pytest.approx(np.abs(np.diff(late[100:], axis=0)))
    first = late_basis(replace(record, valid=valid), 4)
    assert np.abs(first[100] - first[98]) == pytest.approx(np.abs(late[100] - late[98]))
