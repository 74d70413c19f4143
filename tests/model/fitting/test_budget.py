"""The uncertainty budget agrees with refits at plus and minus one standard uncertainty."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from dearig.model.fitting import GivenValue, Identification, identify, with_budget
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import Estimate
from dearig.model.readings.records import counted
from dearig.report.as_json import outcome_json
from dearig.report.text.tables import parameter_table
from tests.tools.engine import PLAIN, posed, record_of, thesis_drive
from tests.tools.reports import fit as paper_fit
from tests.tools.reports import identify_outcome

MADE = record_of(PLAIN, thesis_drive(rate=50.0))
RECORD = replace(MADE, displacement=counted(MADE.displacement, 100), lead_in=100)
GIVEN = [
    GivenValue("thickness", 0.01),
    GivenValue("displacement", 0.005),
    GivenValue("mass", 0.01),
    GivenValue("permittivity", 0.01),
]


@functools.cache
def fitted() -> Identification:
    found = identify([RECORD], PLAIN, intervals=False)
    return with_budget([RECORD], found, GIVEN)


def shifts(name: str) -> dict[str, float]:
    (one,) = (c for c in fitted().budget if c.given.name == name)
    return dict(zip(one.names, one.shifts, strict=True))


@pytest.mark.parametrize("name", ["thickness", "displacement"])
def test_contributions_agree_with_refits(name: str) -> None:
    found = []
    for sign in (-1.0, 1.0):
        model, record = fitted().model, RECORD
        if name == "thickness":
            film = replace(model.film, thickness=model.film.thickness * (1.0 + 0.01 * sign))
            model = replace(model, film=film)
        else:
            record = replace(record, displacement=record.displacement * (1.0 + 0.005 * sign))
        problem, x, free = posed(model, record)
        found.append(problem.layout.values(descend(problem, x, ~free, gain=1e-4).x))
    for j, parameter in enumerate(problem.layout.names):
        if not parameter.startswith("J"):
            expected = 0.5 * (found[1][j] - found[0][j])
            assert shifts(name)[parameter] == pytest.approx(expected, rel=0.03), parameter


def test_force_and_permittivity_together_scale_the_moduli() -> None:
    for parameter in ("mu_0", "mu_1"):
        value = next(e.value for e in fitted().estimates if e.name == parameter)
        both = shifts("mass")[parameter] + shifts("permittivity")[parameter]
        assert both == pytest.approx(0.01 * value, rel=0.03)


def test_contributions_add_up_as_squares() -> None:
    for e in fitted().estimates:
        parts = [shifts(one.name)[e.name] for one in GIVEN]
        assert e.systematic == pytest.approx(float(np.linalg.norm(parts)))


def test_the_combined_interval_has_both_parts_and_keeps_open_ends() -> None:
    low, high = Estimate("mu_0", "Pa", 50.0, 47.0, 53.0, True, systematic=4.0 / 1.96).combined
    assert (low, high) == pytest.approx((45.0, 55.0), abs=0.01)
    assert Estimate("T_1", "s", 1.0, 0.5, 9.0, False, systematic=2.0).combined[0] == 0.0
    assert Estimate("J_0", "", 5.0, 0.0, np.inf, False, systematic=1.0).combined == (0.0, np.inf)


def test_table_and_json_have_statistical_and_combined_intervals() -> None:
    estimate = Estimate("mu_0", "Pa", 45e3, 44e3, 46e3, True, systematic=1e3)
    fit = paper_fit(estimates=(estimate,), budget=fitted().budget[:1])
    table = parameter_table(fit)
    at = [name for name, _ in table.head].index("Combined")
    assert "42.8 to 47.2" in table.rows[0].cells[at]
    assert "thickness 1.0 %" in table.note
    found = outcome_json(identify_outcome(fit=fit))
    assert found["parameters"][0]["ci95"] == [44e3, 46e3]
    assert found["parameters"][0]["ci95_combined"] == pytest.approx([42.8e3, 47.2e3], rel=1e-3)
    assert found["uncertainty_budget"][0]["given"] == "thickness"
