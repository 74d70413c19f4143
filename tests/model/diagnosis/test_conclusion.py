"""What a conclusion says of an effect that no family has."""

from __future__ import annotations

from dearig.model.diagnosis.conclusion import unnamed_of
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
