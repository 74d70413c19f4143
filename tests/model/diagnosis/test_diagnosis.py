"""Whole diagnoses of made data: a hidden effect is found, and nothing where nothing is hidden."""

from __future__ import annotations

import builtins
import functools
import io
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from dearig.model.diagnosis import Diagnosis, diagnose
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.effects import EFFECTS
from dearig.model.errors import ModelError
from dearig.model.film.material import TABLE_3, Network
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Sequence
from dearig.model.verdict import (
    EXPLAINED,
    NOTHING_MISSING,
    PARTLY_EXPLAINED,
    UNEXPLAINED,
)
from tests.deep import mostly_deep
from tests.tools.diagnoses import HIDDEN, of_hidden, plant
from tests.tools.engine import (
    NOISE,
    PLAIN,
    STRIP,
    effect,
    film_record_of,
    masked,
    record_of,
    thesis_drive,
)


@functools.cache
def of_clean() -> Diagnosis:
    return diagnose([record_of(PLAIN)], PLAIN, workers=1)


@functools.cache
def of_slack() -> Diagnosis:
    strip = replace(STRIP, effects=effect("slack", looseness=1.0))
    return diagnose([film_record_of(strip)], STRIP, workers=1)


def require_nothing(found: Diagnosis) -> None:
    assert found.verdict == NOTHING_MISSING
    assert found.steps == ()
    assert found.unnamed is None
    assert found.rivals == ()
    assert found.final.model.effects == ()
    assert found.final.cost == pytest.approx(1.0, abs=0.1)
    assert all(s.is_noise for s in found.after)
    assert not found.interrupted
    assert all(r.chosen is None for r in found.rounds)


def require_consistent(found: Diagnosis) -> None:
    """What holds of every diagnosis."""
    assert found.verdict in (NOTHING_MISSING, EXPLAINED, PARTLY_EXPLAINED, UNEXPLAINED)
    assert found.simulations > 0
    assert found.baseline.model.effects == ()
    # drift is a part of the noise, not of the model
    laws = {s.effect for s in found.steps if s.family != "drift"}
    assert {n for n, _ in found.final.model.effects} == laws
    assert found.final.cost <= found.baseline.cost * (1.0 + 1e-6)
    costs = [found.baseline.cost, *(s.stage.cost for s in found.steps)]
    assert all(b < a for a, b in pairwise(costs))
    assert {f for f, _ in found.rivals} == {
        f for s in found.steps for f in s.indistinguishable_from
    }
    for step in found.steps:
        e = EFFECTS[step.effect]
        if step.family == "drift":
            continue
        assert (step.family, step.acts_on) == (e.family, e.acts_on)
        assert [x.name for x in step.estimates] == [p.name for p in e.parameters]
        values = dict(dict(found.final.model.effects)[step.effect])
        for x in step.estimates:
            assert x.low <= x.value <= x.high
            assert x.value == pytest.approx(values[x.name])
        assert step.family not in step.indistinguishable_from
        assert step.evidence
    for one in found.rounds:
        behind = [c.behind for c in one.candidates]
        assert behind == sorted(behind)
        chosen = [c.effect for c in one.candidates if c.verdict == "chosen"]
        assert chosen == ([one.chosen] if one.chosen else [])
        assert one.reason


def test_nothing_is_missing_in_clean_data():
    found = of_clean()
    require_nothing(found)
    require_consistent(found)
    assert not found.held
    assert found.final.train_rms == pytest.approx(NOISE, rel=0.05)
    (moduli,) = ([e for e in found.final.estimates if e.name == f"mu_{i}"] for i in (1,))
    assert moduli[0].value == pytest.approx(60e3, rel=0.01)


@pytest.mark.deep
def test_nothing_is_missing_in_clean_data_of_the_thesis_network():
    thesis = replace(PLAIN, network=TABLE_3)
    require_nothing(diagnose([record_of(thesis)], thesis, workers=1))


def test_nothing_is_missing_in_clean_film_data_and_progress_rises_from_0_to_1():
    shown = []
    found = diagnose(
        [film_record_of(STRIP)], STRIP, workers=1, progress=lambda *step: shown.append(step)
    )  # fmt: skip
    require_consistent(found)
    assert found.verdict == NOTHING_MISSING
    assert found.steps == ()
    stages, fractions = zip(*shown, strict=True)
    assert fractions[0] == 0.0
    assert fractions[-1] == 1.0
    assert all(0.0 <= f <= 1.0 for f in fractions)
    assert list(fractions) == sorted(fractions)
    assert all(stages)


@pytest.mark.deep
def test_an_effect_that_branches_imitate_is_found():
    # the drag of a resistor's 5 ms is a fast branch's: fitted from there, it ends at 0 ohm
    thesis = replace(PLAIN, network=TABLE_3)
    hidden = replace(thesis, effects=effect("electrode resistance", resistance=2e7))
    # known to be held: otherwise half a sample of delay would explain it
    record = record_of(hidden, replace(thesis_drive(), hold=True))
    found = diagnose([record], thesis, workers=2)
    (step,) = found.steps
    assert "electrode_resistance" in (step.family, *step.indistinguishable_from)
    assert found.final.cost == pytest.approx(1.0, abs=0.05)
    require_consistent(found)


@pytest.mark.parametrize("name", mostly_deep(HIDDEN, ["load inertia"]))
def test_a_hidden_effect_is_found(name):
    found = of_hidden(name)
    require_consistent(found)
    assert found.verdict == EXPLAINED
    (step,) = found.steps
    assert step.family == EFFECTS[name].family
    assert step.effect == name
    assert found.rounds[0].chosen == name
    assert found.rounds[0].candidates[0].effect == name
    # the springs alone leave more than noise, with it nothing is left but noise
    assert not found.before[0].is_noise
    assert found.after[0].is_noise
    assert found.baseline.cost > 4.0
    assert found.final.cost == pytest.approx(1.0, abs=0.1)
    assert found.unnamed is None
    assert (found.status, found.interrupted) == ("complete", False)
    assert found.final.cost < 1.05
    assert found.final.selection_rms < 1.05 * NOISE
    values = {e.name: e for e in step.estimates}
    # at 100 Hz only an alias of the mains is known
    for number, truth in HIDDEN[name].items():
        if name != "mains interference":
            assert values[number].low < truth < values[number].high


@pytest.mark.parametrize("name", mostly_deep(HIDDEN, ["load inertia"]))
def test_the_families_and_the_race_of_a_report(name):
    found = of_hidden(name)
    assert sum(dict(found.families).values()) == pytest.approx(1.0)
    round_ = found.rounds[0]
    assert round_.chosen == name
    assert round_.candidates[0].effect == name
    assert round_.candidates[0].promised > 0.6


@pytest.mark.parametrize("name", mostly_deep(HIDDEN, ["load inertia"]))
def test_the_extended_model_predicts_an_unseen_recording(name):
    # the thesis's own validation, another noise, at the same rate: mains keep their phase
    drive = Drive(*Sequence.thesis(frequencies=(0.6,) * 5, periods=1).sample(100.0))
    other = record_of(plant(name), drive, seed=99)
    errors = [
        np.sqrt(np.mean((s.model.simulate(drive).displacement - other.displacement) ** 2))
        for s in (of_hidden(name).baseline, of_hidden(name).final)
    ]
    assert errors[0] > 1.8 * NOISE
    assert errors[1] < 1.1 * NOISE


@pytest.mark.parametrize("name", mostly_deep(HIDDEN, ["load inertia"]))
def test_no_other_family_explains_as_much(name):
    first = of_hidden(name).rounds[0]
    assert first.base == ()
    chosen = first.candidates[0]
    assert chosen.gained > 0.7
    assert chosen.gain > 100.0
    assert of_hidden(name).final.predicting == of_hidden(name).final.model
    # laws that can do all that the chosen one does may do as well
    for c in first.candidates[1:]:
        other = c.family != chosen.family
        assert not other or c.verdict != "indistinguishable"
        assert c.stage.cost >= chosen.stage.cost * (0.999 if other else 0.99)
    ((family, probability), *_) = of_hidden(name).families
    assert family == chosen.family
    assert probability > 0.99


def test_missing_stress_vanishes_with_the_effect():
    found = of_hidden("load inertia")
    before, after = (
        np.sqrt(np.mean(m[0].stress ** 2)) for m in (found.missing_before, found.missing_after)
    )
    # what is left is the noise of the reading, twice differentiated
    assert before > 10.0
    assert after < 0.5 * before


@pytest.mark.deep
def test_a_single_event_is_left_out_of_predictions():
    # a load that slips by a tenth: whatever is found next to it has taken a part of it over
    slipped = replace(PLAIN, effects=effect("sudden change of force", stress=-200.0, moment=4.3))
    found = diagnose([record_of(slipped)], PLAIN, workers=1)
    assert found.steps[0].effect == "sudden change of force"
    assert found.verdict == EXPLAINED
    # no law explains half of it: the springs stay as they are next to it
    assert found.final.predicting == replace(found.final.model, effects=())
    assert any("other recordings are predicted without it" in note for note in found.notes)


@functools.cache
def of_walking() -> Diagnosis:
    """A laser's stand that warms and cools more than twice in half a minute."""
    record = record_of(PLAIN)
    way = 2e-5 * np.sin(0.55 * record.drive.time) + 1e-5 * np.sin(0.23 * record.drive.time)
    walking = replace(record, displacement=record.displacement + way)
    return diagnose([walking], PLAIN, workers=1)


@pytest.mark.deep  # the engine's tests have a recording whose reading drifts
def test_a_walk_of_the_reading_is_drift():
    found = of_walking()
    require_consistent(found)
    (step,) = found.steps
    assert step.family == "drift"
    assert found.verdict == EXPLAINED
    assert found.final.cost == pytest.approx(1.0, abs=0.1)


@functools.cache
def of_two_walks() -> Diagnosis:
    """Two recordings in which the reading wanders, in each in another way."""
    drifts = (
        {"linear": 2e-5, "quadratic": -8e-6, "cubic": 3e-6, "quartic": 1e-6, "quintic": -2e-6},
        {"linear": -1e-5, "quadratic": 6e-6, "cubic": -5e-6, "quartic": 2e-6, "quintic": 1e-6},
    )
    no_drift = {p.name: 0.0 for p in EFFECTS["fitful drift"].parameters}
    walking = [
        record_of(
            replace(PLAIN, effects=effect("fitful drift", **no_drift | drift)),
            seed=seed,
        )
        for seed, drift in enumerate(drifts)
    ]
    return diagnose([replace(r, name=f"run {i}") for i, r in enumerate(walking)], PLAIN, workers=1)


@pytest.mark.deep
def test_each_recording_has_its_own_drift():
    found = of_two_walks()
    require_consistent(found)
    (step,) = found.steps
    assert step.family == "drift"
    assert found.verdict == EXPLAINED
    assert found.baseline.cost > 5.0
    # one set of numbers for the rig, and a size of the walk of each recording
    assert [e.name for e in step.estimates] == ["rms in run 0", "rms in run 1"]
    assert [e.unit for e in step.estimates] == ["m", "m"]
    assert all(3e-6 < e.value < 5e-5 for e in step.estimates)


@pytest.mark.deep
def test_missing_stress_uses_the_drift_of_its_own_recording():
    found = of_two_walks()
    assert all(s.is_noise for s in found.after)
    for before, after in zip(found.missing_before, found.missing_after, strict=True):
        assert np.sqrt(np.mean(after.stress**2)) < 0.5 * np.sqrt(np.mean(before.stress**2))


@pytest.mark.deep
def test_drift_of_single_recordings_is_left_out_of_predictions():
    found = of_two_walks()
    assert found.final.predicting.effects == ()
    assert any("predicted without it" in note for note in found.notes)


@pytest.mark.deep
def test_springs_fitted_beside_certain_drift_predict_other_recordings():
    found = of_walking()
    assert found.final.predicting.effects == ()
    assert any("predicted without it" in note for note in found.notes)
    # an excitation that it has not seen
    drive = Drive(*Sequence.thesis(frequencies=(0.6,) * 5, periods=1).sample(100.0))
    truth = PLAIN.simulate(drive).displacement

    def off(model: Actuator) -> float:
        return float(np.sqrt(np.mean((model.simulate(drive).displacement - truth) ** 2)))

    assert off(found.baseline.model) > 3e-6
    assert off(found.final.predicting) < 0.3 * off(found.baseline.model)


@pytest.mark.deep
def test_indistinguishable_effects_are_reported_as_such():
    truth = replace(PLAIN, effects=effect("linear drag", drag=400.0))
    found = diagnose([record_of(truth)], PLAIN, workers=1)
    require_consistent(found)
    assert found.verdict == EXPLAINED
    (step,) = found.steps
    assert "drag" in (step.family, *step.indistinguishable_from)
    # a slow film under slow lobes: a drag, a sensor and an amplifier that are late are one
    assert {step.family, *step.indistinguishable_from} >= {"drag", "sensor_lag", "amplifier"}
    record = record_of(truth)
    for _, rival in found.rivals:
        left = rival.simulate(record.drive).displacement - record.displacement
        assert np.sqrt(np.mean(left**2)) < 1.1 * NOISE
        assert rival.effects != found.final.model.effects


@pytest.mark.deep
def test_a_residual_of_no_family_is_described():
    truth = replace(PLAIN, effects=effect("sudden change of force", stress=30.0, moment=6.3))
    found = diagnose([record_of(truth)], PLAIN, workers=1)
    require_consistent(found)
    (step,) = found.steps
    assert step.family == "unknown"
    numbers = {e.name: e.value for e in step.estimates}
    assert numbers["moment"] == pytest.approx(6.3, abs=0.02)
    assert numbers["stress"] == pytest.approx(30.0, rel=0.03)
    assert "sudden change of force" in found.unnamed.expression
    assert found.unnamed.acts_on == "load"
    # one recording does not show that it will happen again
    assert found.final.predicting.effects == ()
    assert any("specific to these recordings" in n for n in found.notes)


@pytest.mark.deep
def test_a_slack_strip_is_found():
    found = of_slack()
    require_consistent(found)
    assert found.verdict == EXPLAINED
    (step,) = found.steps
    assert (step.effect, step.family) == ("slack", "slack")
    (looseness,) = step.estimates
    assert looseness.value == pytest.approx(1.0, abs=0.02)
    # as good as a model of a film is asked to be: how its springs stiffen is not
    assert found.final.cost < 1.0 < 0.05 * found.baseline.cost
    springs = found.final.model.network.springs
    assert [s.modulus for s in springs] == pytest.approx([40e3, 30e3], rel=0.03)


@pytest.mark.deep
def test_slack_explains_a_strip_whose_springs_do_not_stiffen():
    soft = replace(STRIP, network=Network.gent((40e3, 30e3), (1e4, 1e4), (2.0,)))
    hidden = replace(soft, effects=effect("slack", looseness=1.0))
    found = diagnose([film_record_of(hidden)], soft, workers=1)
    assert [step.effect for step in found.steps] == ["slack"]
    assert found.final.cost < 0.01 * found.baseline.cost


@pytest.mark.deep
def test_a_held_voltage_is_recognised():
    drive = thesis_drive()
    record = record_of(PLAIN, replace(drive, hold=True))
    found = diagnose([replace(record, drive=drive)], PLAIN, workers=1)
    require_nothing(found)
    assert found.held
    assert any("held between samples" in n for n in found.notes)


@pytest.mark.deep
def test_a_held_voltage_is_recognised_beside_an_effect():
    drive = thesis_drive()
    record = record_of(plant("load inertia"), replace(drive, hold=True))
    found = diagnose([replace(record, drive=drive)], PLAIN, workers=1)
    require_consistent(found)
    assert found.held
    assert [s.effect for s in found.steps] == ["load inertia"]
    assert found.final.cost == pytest.approx(1.0, abs=0.1)


@pytest.mark.deep
def test_masked_readings_do_not_influence_a_diagnosis():
    # two effects: the second is refitted only if its sensitivity promises something
    both = (*plant("sensor curvature").effects, *plant("mains interference").effects)
    record = record_of(replace(PLAIN, effects=both))
    bad = (record.time > 5.0) & (record.time < 5.1)
    found = diagnose([masked(record, bad)], PLAIN, workers=1)
    require_consistent(found)
    assert found.verdict == EXPLAINED
    assert {s.effect for s in found.steps} == {"sensor curvature", "mains interference"}
    assert found.final.cost == pytest.approx(1.0, abs=0.1)
    assert found.after[0].is_noise
    kept = {s.effect for s in found.steps}
    assert all(one.candidates[0].promised > 0.4 for one in found.rounds if one.chosen in kept)


@pytest.mark.parametrize("many", mostly_deep([15, 60, 200], [15]))
def test_an_interrupted_search_returns_what_it_has_found(many):
    asked = []

    def stop():
        asked.append(None)
        return len(asked) > many

    found = diagnose([record_of(plant("load inertia"))], PLAIN, workers=1, stop=stop)
    require_consistent(found)
    assert found.interrupted
    assert len(asked) == many + 1
    assert found.simulations < of_hidden("load inertia").simulations
    # what it had no time to explain is not described
    assert found.unnamed is None


def test_a_search_interrupted_at_once_returns_the_baseline_with_all_that_is_told_of_it():
    record = record_of(plant("load inertia"))
    found = diagnose([record], PLAIN, workers=1, stop=lambda: True)
    require_consistent(found)
    assert found.interrupted
    assert found.steps == ()
    assert found.final.cost == pytest.approx(of_hidden("load inertia").baseline.cost, rel=1e-3)
    assert found.before[0].rms == found.after[0].rms > 3.0 * NOISE


@pytest.mark.deep
def test_a_search_stops_at_its_computing_budget():
    record = record_of(plant("load inertia"))
    whole = of_hidden("load inertia")
    small = DiagnosisSettings(effort=4e6)
    found = diagnose([record], PLAIN, workers=1, settings=small)
    require_consistent(found)
    assert not found.interrupted
    assert found.simulations < whole.simulations
    assert found.status == "budget"
    # by what is simulated, not by a clock: the same again, on as many threads as there are
    again = diagnose([record], PLAIN, workers=1, settings=small)
    assert (again.simulations, again.final.cost) == (found.simulations, found.final.cost)
    thorough = diagnose([record], PLAIN, workers=1, thorough=True, settings=small)
    assert (thorough.simulations, thorough.final.cost) == (whole.simulations, whole.final.cost)
    assert thorough.notes == whole.notes


@pytest.mark.deep
def test_the_same_records_give_the_same_answer():
    strip = replace(STRIP, effects=effect("slack", looseness=1.0))
    again = diagnose([film_record_of(strip)], STRIP, workers=2)
    first = of_slack()
    assert again.final.model == first.final.model
    assert again.final.cost == first.final.cost
    assert again.simulations == first.simulations
    assert [r.chosen for r in again.rounds] == [r.chosen for r in first.rounds]


@pytest.mark.deep
def test_a_diagnosis_reads_no_file_and_no_clock(monkeypatch):
    expected = of_slack()
    strip = replace(STRIP, effects=effect("slack", looseness=1.0))
    record = film_record_of(strip)
    kept = [a.copy() for a in (record.time, record.stretch, record.stress)]

    def refused(path, *_, **__):
        raise AssertionError(f"{path} was opened")

    monkeypatch.setattr(builtins, "open", refused)
    monkeypatch.setattr(io, "open", refused)
    found = diagnose([record], STRIP, workers=1)
    monkeypatch.undo()
    assert found.final.model == expected.final.model
    for values, before in zip((record.time, record.stretch, record.stress), kept, strict=True):
        np.testing.assert_array_equal(values, before)


def test_records_of_two_kinds_are_refused():
    with pytest.raises(ModelError, match="one kind"):
        diagnose([record_of(PLAIN)], STRIP, workers=1)
    both: list[ActuatorRecord] = [record_of(PLAIN), film_record_of(STRIP)]
    with pytest.raises(ModelError, match="together"):
        diagnose(both, PLAIN, workers=1)
