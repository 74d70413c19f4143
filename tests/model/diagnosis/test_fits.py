"""Values of fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dearig.model.diagnosis.fits import Fit, Fitter
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.film.material import Network
from dearig.model.fitting.parameters import Constraint, FitLayout
from dearig.model.fitting.slow_noise import WhitenedProblem
from tests.tools.engine import PLAIN, effect, record_of


def test_sorted_branches_are_the_same_fit_with_its_held_numbers() -> None:
    network = Network.gent((8e4, 2e4, 4e4), (1e4, 50.0, 60.0), (3.0, 0.3))
    layout = FitLayout(replace(PLAIN, network=network))
    problem = WhitenedProblem([record_of(PLAIN)], layout, workers=1)
    x = layout.coordinates(layout.initial())
    held = np.array([name == "J_1" for name in layout.names])
    residuals = problem.residuals(x)
    columns = np.flatnonzero(~held) + np.zeros((residuals.size, 1))
    fit = Fit(problem, x, held, 1.0, residuals, columns)
    ordered = fit.by_relaxation_time()
    assert ordered.model.network.times == pytest.approx((0.3, 3.0))
    assert ordered.model.network.springs[1:] == tuple(reversed(fit.model.network.springs[1:]))
    assert [n for n, h in zip(layout.names, ordered.fixed, strict=True) if h] == ["J_2"]
    assert problem.residuals(ordered.x) == pytest.approx(residuals, abs=1e-6)
    # each column of the Jacobian goes with its parameter
    swapped = layout.order_by_relaxation_time(layout.values(x))[~ordered.fixed]
    assert ordered.jacobian[0] == pytest.approx(swapped)


def test_a_start_that_knows_nothing_of_what_is_stated_ends_at_the_optimum() -> None:
    """A regression's start may be outside of bounds, and have another value of what is fixed."""
    true = PLAIN.network.springs[1].modulus
    stated = (
        Constraint("load inertia: moving_mass", low=0.05, high=0.25),
        Constraint("mu_1", fixed=true),
    )
    plant = replace(PLAIN, effects=effect("load inertia", moving_mass=0.2))
    fitter = Fitter([record_of(plant)], PLAIN, DiagnosisSettings(), workers=1, constraints=stated)
    problem = fitter.problem(plant)
    plain = FitLayout(PLAIN, fitter.times)
    ends = []
    for share, mass in ((1.0, 0.2), (1.3, 4.0)):
        row = plain.initial()
        row[plain.column("mu")] *= share
        start = fitter.start_of(problem, plain.coordinates(row), (mass,))
        ends.append(fitter.refined(fitter.descend(problem, start, 20)))
    near, far = (fit.cost * problem.samples for fit in ends)
    assert abs(far - near) < 1.0
    assert ends[1].model.network.springs[1].modulus == pytest.approx(true)
    (_, ((_, mass),)) = ends[1].model.effects[0]
    assert mass == pytest.approx(0.2, rel=0.02)
