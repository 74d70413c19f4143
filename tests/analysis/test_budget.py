"""The uncertainties of a rig file in a diagnosis: its parameters, tables, JSON and text."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from dearig.analysis.budget import diagnosis_with_budget
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.fitting import Estimate, GivenValue
from dearig.model.fitting.parameters import FitLayout
from dearig.model.readings.records import counted
from dearig.report.as_json import diagnosis_json
from dearig.report.text.diagnosis import summary
from dearig.report.text.estimates import effect_table, estimate_table
from tests.tools.diagnosis import STEP, diagnose_outcome, finding, stage
from tests.tools.engine import PLAIN, record_of, thesis_drive

LAGGED = replace(PLAIN, effects=(("sensor lag", (("time_constant", 9.5e-3),)),))
MADE = record_of(LAGGED, thesis_drive(rate=50.0))
RECORD = replace(MADE, displacement=counted(MADE.displacement, 100), lead_in=100)
GIVEN = [GivenValue("mass", 0.05), GivenValue("permittivity", 0.05)]


def estimate(name: str, value: float, unit: str = "Pa", determined: bool = True) -> Estimate:
    return Estimate(name, unit, value, 0.99 * value, 1.01 * value, determined)


def found(**changes) -> Diagnosis:
    layout = FitLayout(LAGGED)
    names = tuple(n for n in layout.names if not n.startswith("J"))
    estimates = tuple(
        estimate(q.name, float(v), q.unit)
        for q, v in zip(layout.quantities, layout.initial(), strict=True)
    )
    final = replace(
        stage(LAGGED, 1e-6, estimates=estimates),
        covariance_names=names,
        covariance=np.eye(len(names)),
    )
    return finding(final=final, steps=(STEP,), **changes)


@functools.cache
def budgeted() -> Diagnosis:
    return diagnosis_with_budget(found(), [RECORD], GIVEN, lambda *_: None, lambda: False)


def test_force_and_permittivity_together_scale_the_moduli_and_leave_a_lag() -> None:
    shifts = [dict(zip(c.names, c.shifts, strict=True)) for c in budgeted().final.budget]
    for name in ("mu_0", "mu_1"):
        value = next(e.value for e in budgeted().final.estimates if e.name == name)
        assert sum(s[name] for s in shifts) == pytest.approx(0.05 * value, rel=0.03)
    (lag,) = budgeted().steps[0].estimates
    whole = next(e for e in budgeted().final.estimates if e.name == "sensor lag: time_constant")
    assert lag.systematic == whole.systematic < 0.05 * lag.value


def test_every_table_and_the_json_have_the_combined_interval() -> None:
    outcome = diagnose_outcome(finding=budgeted())
    json = diagnosis_json(outcome)
    one = next(p for p in json["parameters"] if p["name"] == "mu_0")
    low, high = one["ci95_combined"]
    assert low < one["ci95"][0] < one["ci95"][1] < high
    assert one["systematic"] > 0.0
    assert [c["given"] for c in json["uncertainty_budget"]] == ["mass", "permittivity"]
    assert json["steps"][0]["parameters"][0]["systematic"] > 0.0
    for table in (estimate_table(budgeted().final), effect_table(outcome)):
        assert [name for name, _ in table.head][-2:] == ["Given values", "Combined"]
        assert "mass 5.0 %" in table.note


def test_a_stop_leaves_a_diagnosis_without_a_budget_and_says_so() -> None:
    stopped = diagnosis_with_budget(found(), [RECORD], GIVEN, lambda *_: None, lambda: True)
    assert stopped.final.budget == ()
    assert "stopped before the uncertainties" in stopped.notes[-1]


def test_what_is_not_determined_is_so_in_table_json_and_text() -> None:
    weak, firm = estimate("mu_1", 2e4, determined=False), estimate("mu_2", 4e4)
    final = stage(PLAIN, 1e-6, estimates=(weak, firm))
    outcome = diagnose_outcome(finding=finding(final=final))
    rows = estimate_table(final).rows
    assert [row.cells[1][0] == "(" for row in rows] == [True, False]
    assert "not determined" in estimate_table(final).note
    assert [p["determined"] for p in diagnosis_json(outcome)["parameters"]] == [False, True]
    (said,) = (s for s in summary(outcome) if "do not determine" in s)
    assert "\N{GREEK SMALL LETTER MU}\N{SUBSCRIPT ONE}" in said
    assert "\N{SUBSCRIPT TWO}" not in said
