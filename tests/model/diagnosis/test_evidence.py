"""The criterion against Schwarz's, and probabilities of families."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dearig.model.diagnosis.evidence import Judge
from dearig.model.diagnosis.fits import Fit
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.slow_noise import Drift, DriftSpace, WhitenedProblem, drift_modes
from dearig.model.simulation.actuator import Actuator
from tests.tools.engine import PLAIN, record_of, typical

SETTINGS = DiagnosisSettings()
DRAG, CURVED = (replace(PLAIN, effects=(typical(n),)) for n in ("linear drag", "sensor curvature"))


def fit(model: Actuator, cost: float, seed: int = 0, drift: float = 0.0, lead_in: int = 0) -> Fit:
    """A fit of ``model`` that leaves white noise of this mean square."""
    record = replace(record_of(PLAIN), lead_in=lead_in)
    noise = Drift(DriftSpace([drift_modes(record, 4)]), drift) if drift else None
    problem = WhitenedProblem([record], FitLayout(model), noise, workers=1)
    r = np.random.default_rng(seed).standard_normal(problem.samples)
    r *= math.sqrt(cost / float(np.mean(r**2)))
    x = problem.layout.coordinates(problem.layout.initial())
    held = np.zeros(x.size, dtype=bool)
    held[problem.layout.column("J")] = True
    return Fit(problem, x, held, cost, r, np.zeros((r.size, int((~held).sum()))))


def test_the_criterion_is_schwarzs_but_for_the_form_error() -> None:
    baseline, better = fit(PLAIN, 4.0), fit(DRAG, 1.0)
    judge = Judge(SETTINGS, baseline)
    n, delta2 = judge.samples, SETTINGS.form_error**2
    expected = n * math.log(4.0 / (1.0 + 3.0 * delta2)) - math.log(n)
    assert judge.gain(baseline, better) == pytest.approx(expected)


def test_below_the_form_error_laws_are_not_told_apart() -> None:
    baseline = fit(PLAIN, 1e6)
    judge = Judge(SETTINGS, baseline)
    near, nearer = fit(DRAG, 3.0), fit(CURVED, 1.0)
    unlimited = judge.samples * math.log(3.0)
    assert 0.0 < judge.gain(near, nearer) < 0.05 * unlimited


def test_drift_pays_for_the_volume_of_its_prior() -> None:
    baseline = fit(PLAIN, 2.0)
    judge = Judge(SETTINGS, baseline)
    drifting = fit(PLAIN, 2.0, drift=100.0)
    assert drifting.problem.noise_drift is not None
    expected = drifting.problem.noise_drift.log_det + math.log(judge.samples)
    assert judge.criterion(drifting) - judge.criterion(baseline) == pytest.approx(expected)


def test_correlated_residuals_count_as_fewer_samples_until_a_fit_is_white() -> None:
    smooth = fit(PLAIN, 4.0)
    slow = np.convolve(smooth.residuals, np.ones(20) / 20, "same")
    baseline = replace(smooth, residuals=slow)
    judge = Judge(SETTINGS, baseline)
    before = judge.samples
    judge.see([fit(DRAG, 1.0)])
    assert before < 0.3 * judge.samples


def test_a_residual_as_coloured_as_the_reading_at_rest_is_noise() -> None:
    # a laser that averages over four samples, and a slow wave of half its noise
    white = fit(PLAIN, 1.0, lead_in=400)
    walk = np.cumsum(np.random.default_rng(3).standard_normal(white.residuals.size + 4))
    averaged = (walk[4:] - walk[:-4]) / 2.0
    coloured = replace(white, residuals=averaged)
    wave = 0.7 * np.sin(2.0 * math.pi * 0.4 * white.problem.records[0].time)
    wave[:400] = 0.0
    judge = Judge(SETTINGS, coloured)
    assert judge.is_settled(coloured)
    assert not judge.is_settled(replace(coloured, residuals=averaged + wave))
    # where the reading at rest is white, it is not noise
    assert not Judge(SETTINGS, white).is_settled(coloured)


def test_probabilities_add_up_to_one_and_follow_the_evidence() -> None:
    baseline = fit(PLAIN, 1.1)
    judge = Judge(SETTINGS, baseline)
    one, other = fit(DRAG, 1.000), fit(CURVED, 1.004)
    found = judge.probabilities([baseline, one, other])
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["drag"] > found["sensor_nonlinearity"] > found["none"]
    ratio = found["drag"] / found["sensor_nonlinearity"]
    expected = math.exp(0.5 * judge.gain(other, one) / SETTINGS.tempering)
    assert ratio == pytest.approx(expected)


def test_families_that_are_both_certain_share_a_probability_but_not_a_marginal() -> None:
    both = replace(DRAG, effects=(*DRAG.effects, *CURVED.effects))
    fits = [fit(PLAIN, 3.0), fit(DRAG, 2.0), fit(both, 1.0)]
    judge = Judge(SETTINGS, fits[0])
    shares, marginals = judge.probabilities(fits), judge.marginals(fits)
    for family in ("drag", "sensor_nonlinearity"):
        assert shares[family] == pytest.approx(0.5, abs=1e-3)
        assert marginals[family] == pytest.approx(1.0, abs=1e-3)


def test_a_family_without_a_fit_is_taken_to_explain_nothing() -> None:
    baseline = fit(PLAIN, 1.0)
    judge = Judge(SETTINGS, baseline)
    found = judge.probabilities([baseline, fit(DRAG, 1.0)], ["drag", "friction", "creep"])
    assert sum(found.values()) == pytest.approx(1.0)
    # a drag that was fitted, and explains nothing either, is as probable
    assert found["friction"] == pytest.approx(found["creep"])
    assert found["friction"] == pytest.approx(found["drag"])
    assert 0.0 < found["friction"] < found["none"]
    # where something explains decisively more, they have no weight
    clear = judge.probabilities([fit(PLAIN, 2.0), fit(DRAG, 1.0)], ["friction"])
    assert clear["friction"] < 1e-6


def test_a_second_effect_must_explain_half_of_the_rest() -> None:
    baseline = fit(PLAIN, 100.0)
    judge = Judge(SETTINGS, baseline)
    first = fit(DRAG, 3.0)
    both = replace(DRAG, effects=(*DRAG.effects, *CURVED.effects))
    assert judge.justifies(baseline, first)
    assert not judge.justifies(first, fit(both, 2.5))
    assert judge.justifies(first, fit(both, 1.2))
