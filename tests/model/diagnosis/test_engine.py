"""Whole diagnoses by regression, race and evidence, of records that a model made."""

from __future__ import annotations

import functools
from dataclasses import replace

import pytest

from dearig.model.diagnosis import Diagnosis, diagnose
from dearig.model.diagnosis.settings import DiagnosisSettings
from tests.tools.diagnoses import HIDDEN, plant
from tests.tools.engine import PLAIN, STRIP, effect, film_record_of, record_of


@functools.cache
def of_hidden(name: str) -> Diagnosis:
    return diagnose([record_of(plant(name))], PLAIN, workers=1)


def test_a_hidden_effect_is_named_with_its_parameters() -> None:
    found = of_hidden("sensor curvature")
    assert (found.verdict, found.status) == ("explained", "complete")
    (step,) = found.steps
    assert (step.effect, step.family) == ("sensor curvature", "sensor_nonlinearity")
    (quadratic,) = step.estimates
    assert quadratic.low < HIDDEN["sensor curvature"]["quadratic"] < quadratic.high
    assert found.final.cost < 1.05
    assert found.final.selection_rms < 1.05 * record_of(PLAIN).noise


def test_probabilities_of_families_add_up_to_one() -> None:
    found = dict(of_hidden("sensor curvature").families)
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["sensor_nonlinearity"] > 0.9


def test_the_race_is_a_round_of_the_report() -> None:
    (round_,) = of_hidden("sensor curvature").rounds
    assert round_.chosen == "sensor curvature"
    assert round_.candidates[0].effect == "sensor curvature"
    assert round_.candidates[0].promised > 0.6


def test_nothing_is_missing_where_nothing_is_hidden() -> None:
    found = diagnose([record_of(PLAIN)], PLAIN, workers=1)
    assert found.verdict == "nothing_missing"
    assert found.steps == ()
    assert dict(found.families) == {"none": 1.0}


def test_a_film_driven_by_stretch_is_diagnosed_alike() -> None:
    hidden = effect("Mullins softening", softening=0.1, width=0.4)
    found = diagnose([film_record_of(replace(STRIP, effects=hidden))], STRIP, workers=1)
    assert [s.family for s in found.steps] == ["softening"]
    assert found.verdict == "explained"


def test_a_search_that_is_stopped_says_so_and_never_that_nothing_is_missing() -> None:
    found = diagnose([record_of(plant("sensor curvature"))], PLAIN, workers=1, stop=lambda: True)
    assert (found.status, found.interrupted) == ("stopped", True)
    assert found.verdict == "unexplained"


def test_a_search_without_work_left_ends_with_what_it_has() -> None:
    settings = DiagnosisSettings(effort=2e6)
    found = diagnose([record_of(plant("sensor curvature"))], PLAIN, workers=1, settings=settings)
    assert found.status == "budget"
    assert any("computing budget" in note for note in found.notes)
