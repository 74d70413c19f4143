"""Whole diagnoses by regression, race and evidence, of records that a model made."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from dearig.model.diagnosis import diagnose, engine
from dearig.model.diagnosis.fits import Fitter
from dearig.model.diagnosis.preparation import has_line_at_rest
from dearig.model.diagnosis.race import race
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.effects import EFFECTS
from dearig.model.film.material import Network
from dearig.model.fitting import identify
from dearig.model.readings.noise import noise_at_rest
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Drive
from tests.tools.diagnoses import plant
from tests.tools.engine import (
    PLAIN,
    STRIP,
    effect,
    film_record_of,
    pink_noise,
    record_of,
    thesis_drive,
)


def test_nothing_is_missing_where_nothing_is_hidden() -> None:
    found = diagnose([record_of(PLAIN)], PLAIN, workers=1)
    assert found.verdict == "nothing_missing"
    assert found.steps == ()
    # a small effect of any family may still hide there
    assert found.families[0][0] == "none"
    assert 0.5 < found.families[0][1] < 1.0
    assert len(found.families) > 10


def test_the_baseline_is_as_good_as_that_of_an_identification() -> None:
    # a drag is a branch that relaxes at once, which the search does not allow
    record = record_of(replace(PLAIN, effects=effect("linear drag", drag=3000.0)))
    two = replace(PLAIN, network=Network.gent((45e3, 60e3, 20e3), (1e4, 1e4, 1e4), (0.4, 2.0)))
    fitter = Fitter([record], two, DiagnosisSettings(), workers=1)
    searched = fitter.baseline(lambda *_: None)
    fitted = identify([record], two, intervals=False, workers=1)
    assert fitter.identified(searched, 8).cost < 1.002 * fitted.cost < 0.9 * searched.cost


def test_the_baseline_follows_the_valley_of_two_branches_of_nearly_equal_times() -> None:
    network = Network.gent((37e3, 43e3, 64e3, 9e3), (1e4,) * 4, (1.0, 0.6, 5.0))
    truth = replace(PLAIN, network=network)
    start = replace(PLAIN, network=Network.gent((45e3,) * 4, (1e4,) * 4, (0.3, 1.0, 4.0)))
    fitter = Fitter([record_of(truth)], start, DiagnosisSettings(), workers=1)
    searched = fitter.baseline(lambda *_: None)
    problem = fitter.problem(truth)
    costs, _ = problem.evaluate(problem.layout.coordinates(problem.layout.initial())[None])
    # odds of a further effect are not to be had from springs that are not fitted
    assert (searched.cost - costs[0]) * problem.samples < 2.0


#: A reading that gains 24 um at two places of the travel.
NO_NAMED_FORM = effect(
    "general sensor curve",
    **{f"error_{i}": 24e-6 if i in (2, 5) else 0.0 for i in range(1, 9)},
    travel=4e-4,
)


def of_no_named_form() -> ActuatorRecord:
    hidden = replace(PLAIN, effects=NO_NAMED_FORM)
    return record_of(hidden, replace(thesis_drive(), hold=True))


@pytest.mark.deep
def test_a_form_that_no_law_with_a_name_has_is_found_by_the_general_law() -> None:
    record = of_no_named_form()
    found = diagnose([record], PLAIN, workers=1)
    assert found.verdict == "explained"
    assert not found.held  # where it is known, there is nothing to recognise
    (step,) = found.steps
    assert (step.effect, step.family) == ("general sensor curve", "sensor_nonlinearity")
    assert EFFECTS[step.nearest].family == "sensor_nonlinearity"
    assert any(f"{step.nearest} comes nearest" in said for said in step.evidence)
    (truth,) = (EFFECTS[name].curve(dict(values)) for name, values in NO_NAMED_FORM)
    reached = truth.axis < 1e3 * record.displacement.max()
    there = np.interp(truth.axis, step.curve.axis, step.curve.values)
    # but for a slope, which is the film's as well
    apart = np.polynomial.Polynomial.fit(truth.axis[reached], (there - truth.values)[reached], 1)
    left = (there - truth.values)[reached] - apart(truth.axis[reached])
    assert np.max(np.abs(left)) < 0.05 * np.ptp(truth.values)


@pytest.mark.deep
def test_a_film_driven_by_stretch_is_diagnosed_alike() -> None:
    hidden = effect("Mullins softening", softening=0.1, width=0.4)
    found = diagnose([film_record_of(replace(STRIP, effects=hidden))], STRIP, workers=1)
    assert [s.family for s in found.steps] == ["softening"]
    assert found.verdict == "explained"


def test_a_search_that_is_stopped_says_so_and_never_that_nothing_is_missing() -> None:
    found = diagnose([record_of(plant("sensor curvature"))], PLAIN, workers=1, stop=lambda: True)
    assert (found.status, found.interrupted) == ("stopped", True)
    assert found.verdict == "unexplained"


@pytest.mark.deep
def test_a_search_without_work_left_ends_with_what_it_has() -> None:
    settings = DiagnosisSettings(effort=2e6)
    found = diagnose([record_of(plant("sensor curvature"))], PLAIN, workers=1, settings=settings)
    assert found.status == "budget"


@pytest.mark.deep
def test_a_search_keeps_what_it_has_fitted_when_its_work_ends(monkeypatch) -> None:
    races = []

    def race_once(*given):
        if races:
            raise engine.BudgetExhausted
        races.append(given)
        return race(*given)

    monkeypatch.setattr(engine, "race", race_once)
    found = diagnose([of_no_named_form()], PLAIN, workers=1)
    assert found.status == "budget"
    assert [step.family for step in found.steps] == ["sensor_nonlinearity"]


def test_a_fit_in_which_the_work_ended_is_made_again(monkeypatch) -> None:
    fitter = Fitter([record_of(plant("sensor curvature"))], PLAIN, DiagnosisSettings(), 1)
    search = engine.Search(fitter, lambda *_: None, lambda: False)
    problem = fitter.problem(plant("sensor curvature"))
    fit = fitter.descend(problem, problem.layout.coordinates(problem.layout.initial()), 3)
    with monkeypatch.context() as ended:
        ended.setattr(fitter, "watched", Mock(side_effect=engine.BudgetExhausted))
        with pytest.raises(engine.BudgetExhausted):
            search.without(fit, "sensor curvature")
    assert search.without(fit, "sensor curvature").effects == ()


@pytest.mark.deep
def test_a_lag_that_may_be_the_sensors_own_is_said_to() -> None:
    late = record_of(replace(PLAIN, effects=effect("sensor delay", delay=4e-3)))
    found = diagnose([replace(late, lag_error=5e-3)], PLAIN, workers=1)
    assert [step.family for step in found.steps] == ["sensor_lag"]
    (said,) = (note for note in found.notes if "sensor's own" in note)
    assert "late by 4" in said or "late by 3.9" in said
    known = diagnose([replace(late, lag_error=1e-3)], PLAIN, workers=1)
    assert not any("sensor's own" in note for note in known.notes)


def after_rest(way: np.ndarray) -> ActuatorRecord:
    """The plain film after 4 s at 0 V, its reading off by ``way`` (N,) m."""
    drive = thesis_drive()
    time = np.arange(way.size) / 100.0
    voltage = np.concatenate((np.zeros(way.size - drive.time.size), drive.voltage))
    plain = record_of(PLAIN, Drive(time, voltage, hold=True))
    reading = plain.displacement + way - way[:400].mean()
    noise = noise_at_rest(time[:400], reading[:400])
    return replace(plain, displacement=reading, noise=noise, lead_in=400)


@pytest.mark.deep
def test_a_load_that_swings_at_rest_is_not_taken_for_noise() -> None:
    time = np.arange(400 + thesis_drive().time.size) / 100.0
    swing = 2e-5 * 2.0 ** (-time / 4.0) * np.sin(2.0 * np.pi * 3.4 * time)
    found = diagnose([after_rest(swing)], PLAIN, workers=1)
    assert found.verdict != "nothing_missing"
    assert found.baseline.cost > 2.0


def test_a_bench_that_vibrates_is_told_by_its_line() -> None:
    time = np.arange(400 + thesis_drive().time.size) / 100.0
    turn = 2.0 * np.pi * 23.7 * time
    found = diagnose([after_rest(3e-6 * np.sin(turn) + 1e-6 * np.cos(2.0 * turn))], PLAIN)
    assert [step.effect for step in found.steps] == ["vibration"]
    assert found.verdict == "explained"


@pytest.mark.deep
def test_what_the_readings_at_rest_show_is_fitted_first() -> None:
    time = np.arange(400 + thesis_drive().time.size) / 100.0
    hums = after_rest(2e-5 * np.sin(2.0 * np.pi * 23.7 * time))
    assert has_line_at_rest(hums)
    assert not has_line_at_rest(after_rest(np.zeros(time.size)))
    curved = plant("sensor curvature")
    bent = curved.simulate(hums.drive).displacement - PLAIN.simulate(hums.drive).displacement
    found = diagnose([replace(hums, displacement=hums.displacement + bent)], PLAIN)
    assert {step.effect for step in found.steps} == {"sensor curvature", "vibration"}
    first = found.rounds[0]
    # a load that swings is seen at rest too
    assert {candidate.family for candidate in first.candidates} == {"interference", "unknown"}
    assert first.chosen == "vibration"


def test_slow_noise_of_a_sensor_is_noise_and_a_drift_is_a_drift() -> None:
    count = 400 + thesis_drive().time.size
    pink = pink_noise(np.random.default_rng(8), count, 4e-13)
    assert diagnose([after_rest(pink)], PLAIN, workers=1).verdict == "nothing_missing"
    # at rest, a reading that drifts is not white either
    time = np.arange(count) / 100.0
    drifting = diagnose([after_rest(8e-6 * np.log1p(time / 0.8))], PLAIN, workers=1)
    assert [step.family for step in drifting.steps] == ["drift"]
