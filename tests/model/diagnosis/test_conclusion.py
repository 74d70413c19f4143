"""What a conclusion says of an effect that no family has."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from dearig.model.diagnosis.conclusion import _why_none, unnamed_of
from dearig.model.diagnosis.fits import DRIFT
from dearig.model.diagnosis.results import Stage, Step
from dearig.model.effects import EFFECTS
from dearig.model.fitting import Estimate
from dearig.model.residual import signatures
from tests.tools.engine import PLAIN, made_fit, record_of, thesis_drive


def test_a_step_of_the_unknown_family_is_told_by_its_own_numbers():
    name = "stress beyond a displacement"
    step = Step(
        name, "unknown", "load", Stage(PLAIN, 1.0, 1e-6, 1e-6, 4e-6, 0.0),
        (Estimate("stiffness", "Pa", 21234.0, 2e4, 2.2e4, True),
         Estimate("onset", "m", 1.05e-3, 1e-3, 1.1e-3, True)), (), (),
    )  # fmt: skip
    record = record_of(PLAIN, thesis_drive(100.0, 2))
    noise = record.displacement - PLAIN.simulate(record.drive).displacement
    after = signatures([record], made_fit([record], PLAIN, noise))
    unnamed = unnamed_of([step], [], after)
    assert unnamed.expression == f"{name} (stiffness = 2.123e+04 Pa, onset = 0.00105 m)"
    assert unnamed.acts_on == "load"
    assert EFFECTS[name].summary in unnamed.signature
    assert "only noise is left" in unnamed.signature
    assert unnamed_of([], [], after) is None


def fit_with(*members, criterion):
    return SimpleNamespace(members=frozenset(members), criterion=criterion, unseen="", cost=1.0)


@pytest.mark.parametrize(
    ("best", "raced", "why"),
    [
        (fit_with(criterion=0.0), 2.0, "no effect gains more than its parameters cost"),
        (fit_with(criterion=0.0), -900.0, "load inertia would explain too little of what is left"),
        (fit_with(DRIFT, criterion=-4e3), -900.0, "slow drift of the reading is more probable"),
        (fit_with("thermal softening", criterion=-4e3), -900.0, "thermal softening is more prob"),
    ],
)
def test_a_race_that_adds_nothing_says_what_its_gains_say(best, raced, why):
    judge = SimpleNamespace(
        settings=SimpleNamespace(odds=10.0),
        gain=lambda over, fit: over.criterion - fit.criterion,
        ranked=lambda fits: sorted(fits, key=lambda fit: fit.criterion),
    )
    race = SimpleNamespace(
        parent=fit_with(criterion=0.0), fits=(fit_with("load inertia", criterion=raced),)
    )
    assert _why_none(race, SimpleNamespace(judge=judge, best=best)).startswith(why)
