"""Models of single records with the drift that the noise model found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.diagnosis.fits import Fit
from dearig.model.diagnosis.stages import with_drift
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.slow_noise import Drift, DriftSpace, WhitenedProblem, drift_basis
from dearig.model.simulation.actuator import Actuator
from tests.tools.engine import NOISE, PLAIN, record_of


def test_a_records_model_contains_its_most_probable_drift() -> None:
    record = record_of(PLAIN)
    time = record.time / record.time[-1]
    moved = 2e-5 * (np.cos(3.0 * time) - 1.0 + 0.5 * np.sin(6.0 * time) - 3.0 * time)
    record = replace(record, displacement=record.displacement + moved)
    layout = FitLayout(PLAIN)
    drift = Drift(DriftSpace([drift_basis(record, 24)]), 3e3)
    problem = WhitenedProblem([record], layout, drift, workers=1)
    x = layout.coordinates(layout.initial())
    residuals = problem.residuals(x)
    held = np.ones(x.size, dtype=bool)
    fit = Fit(problem, x, held, float(np.mean(residuals**2)), residuals, np.zeros((x.size, 0)))
    (model,) = with_drift(fit)
    assert isinstance(model, Actuator)
    left = record.seen(model.simulate(record.drive).displacement) - record.displacement
    assert float(np.std(left)) == pytest.approx(NOISE, rel=0.1)
