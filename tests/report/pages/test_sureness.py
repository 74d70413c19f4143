"""How sure a diagnosis is of each family: the same in JSON and text."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dearig.model.fitting.parameters import Constraint, Estimate
from dearig.report.as_json import diagnosis_json
from dearig.report.text.diagnosis import summary
from dearig.report.text.estimates import (
    CONDITIONAL_TEXT,
    condition_text,
    effect_table,
    estimate_table,
)
from tests.tools.diagnosis import STEP, diagnose_outcome, finding


def test_two_families_that_are_both_certain_are_said_to_be_certain() -> None:
    both = finding(
        families=(("sensor_lag", 0.5), ("drag", 0.49), ("none", 0.01)),
        marginals=(("sensor_lag", 0.99), ("drag", 0.98), ("none", 0.01)),
    )
    outcome = diagnose_outcome(finding=both)
    listed = diagnosis_json(outcome)["families"]
    assert sum(f["probability"] for f in listed) == 1.0
    assert [f["probability_missing"] for f in listed] == [0.99, 0.98, 0.01]
    said = " ".join(summary(outcome))
    assert "that sensor lag is among what is missing is 0.99" in said


def test_a_name_stands_next_to_its_small_probability() -> None:
    doubtful = finding(marginals=(("drag", 0.9), ("sensor_lag", 0.004)))
    said = " ".join(summary(diagnose_outcome(finding=doubtful)))
    assert "that sensor lag is among what is missing is 0.00" in said


def test_a_name_that_validation_makes_improbable_says_so_and_what_is_probable_instead() -> None:
    certain = diagnose_outcome(finding=finding(marginals=(("sensor_lag", 1.0),)))
    no_better = replace(certain.after, validation=certain.before.validation)
    outcome = replace(certain, stands=(certain.before, no_better))
    assert outcome.marginals["sensor_lag"] < 0.01
    said = " ".join(summary(outcome))
    assert "that sensor lag is among what is missing is 0.00" in said
    assert "Validation recordings, which do not confirm what was found, count in this." in said
    assert "that an effect of no known family is missing is 1.00" in said
    assert "no known family" not in " ".join(summary(certain))


def test_what_the_search_did_not_say_is_null_and_not_said() -> None:
    outcome = diagnose_outcome(finding=finding(families=(("sensor_lag", 1.0),)))
    assert diagnosis_json(outcome)["families"][0]["probability_missing"] is None
    assert "among what is missing" not in " ".join(summary(outcome))


@pytest.mark.parametrize(
    ("verdict", "rejected"),
    [("explained", False), ("partly_explained", True), ("unexplained", True)],
)
def test_intervals_under_a_model_that_the_data_reject_are_marked(verdict, rejected) -> None:
    outcome = diagnose_outcome(finding=finding(verdict=verdict))
    assert outcome.verdict == verdict
    assert diagnosis_json(outcome)["intervals_conditional"] is rejected
    for table in (
        effect_table(outcome),
        estimate_table(outcome.finding.final, condition_text(outcome)),
    ):
        assert (CONDITIONAL_TEXT in table.note) is rejected
        assert (("95 % interval", "if right") in table.head) is rejected


@pytest.mark.parametrize(("verdict", "told"), [("explained", False), ("unexplained", True)])
def test_what_was_stated_may_be_why_a_model_is_rejected(verdict, told) -> None:
    made = finding(verdict=verdict)
    first, *others = made.final.estimates
    fixed = replace(first, constraint=Constraint(first.name, fixed=first.value))
    made = replace(made, final=replace(made.final, estimates=(fixed, *others)))
    said = " ".join(summary(diagnose_outcome(finding=made)))
    assert ("a wrong value leaves more than noise too" in said) is told


def test_the_size_of_a_drift_is_defined_where_it_stands() -> None:
    size = Estimate("rms in thesis", "m", 4e-6, 3e-6, 5e-6, True)
    drift = replace(STEP, effect="fitful drift", family="drift", estimates=(size,))
    (row,) = effect_table(diagnose_outcome(finding=finding(steps=(drift,)))).rows
    assert row.cells[0] == "rms in thesis"
    assert row.detail == "root mean square of what the law adds to that recording"
