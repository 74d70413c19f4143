"""The excitation that separates rivals: what the gate admits, and what tells them apart."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.plan import plan
from dearig.analysis import experiment
from dearig.analysis.experiment import (
    SEPARATES,
    averaging,
    candidates,
    experiment_of,
    separating_experiment,
)
from dearig.analysis.readings.compatibility import of_rig
from dearig.analysis.readings.rig_channels import RigChannels
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.interlocks import would_trip
from dearig.drivers.settings import CardSettings
from dearig.errors import InputError
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Film, Load
from dearig.model.readings.channels import ChannelRecord
from dearig.model.simulation.actuator import Actuator, Drive
from tests.deep import mostly_deep
from tests.tools.diagnosis import RIVAL, finding

NOISE = 1e-6


def with_effect(name: str, **values: float) -> Actuator:
    return Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, ((name, tuple(values.items())),))


PLAIN = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
LAG = with_effect("sensor lag", time_constant=5e-3)
DRAG = with_effect("linear drag", drag=300.0)
SLOW = RigFile(card=CardSettings(sample_rate_Hz=200.0))
RIVALS = [("sensor lag", "sensor_lag", LAG), ("linear drag", "drag", DRAG)]


def predicted(model: Actuator, sequence: str) -> np.ndarray:
    waveform = plan(parse_sequence(sequence, "x", Path()), SLOW).admitted()
    time = np.arange(waveform.samples) / waveform.rate
    return model.simulate(Drive(time, waveform.window(), hold=True)).displacement


def test_it_separates_as_much_as_it_says():
    found, words = separating_experiment(RIVALS, SLOW, NOISE)
    assert found.separates == ("sensor_lag", "drag")
    apart = predicted(LAG, found.sequence) - predicted(DRAG, found.sequence)
    assert found.separation == pytest.approx(np.sqrt(np.mean(apart**2)) / NOISE, rel=1e-9)
    assert found.separation > SEPARATES
    assert found.name in words
    assert f"{found.separation:.2g} times the noise" in words


def test_no_other_separates_much_more():
    found, _ = separating_experiment(RIVALS, SLOW, NOISE)
    best = max(found.tried, key=lambda t: t[1])
    assert found.separation >= 0.9 * best[1]
    assert [t[1] for t in found.tried] == sorted((t[1] for t in found.tried), reverse=True)
    mine = next(t for t in found.tried if t[0] == found.name)
    nearly = [t for t in found.tried if t[1] >= 0.9 * best[1]]
    assert mine[1] / mine[2] == max(t[1] / t[2] for t in nearly)


def test_of_three_the_nearest_two_count():
    three = [*RIVALS, ("nothing", "none", PLAIN)]
    found, _ = separating_experiment(three, SLOW, NOISE)
    curves = {label: predicted(model, found.sequence) for label, _, model in three}
    apart = {
        pair: np.sqrt(np.mean((curves[pair[0]] - curves[pair[1]]) ** 2)) / NOISE
        for pair in combinations(curves, 2)
    }
    assert found.separation == pytest.approx(min(apart.values()), rel=1e-9)
    assert found.closest == min(apart, key=lambda pair: apart[pair])


def test_identical_rivals_have_no_separating_experiment():
    twins = [("one", "drag", DRAG), ("other", "creep", DRAG)]
    found, words = separating_experiment(twins, SLOW, NOISE)
    assert found is None
    assert "separates one and other: at best" in words
    assert "0 times the noise" in words


def test_identical_rivals_are_left_out_of_the_score():
    twin = ("twin", "amplifier", LAG)
    found, words = separating_experiment([*RIVALS, twin], SLOW, NOISE)
    alone, _ = separating_experiment(RIVALS, SLOW, NOISE)
    assert (found.name, found.separation) == (alone.name, alone.separation)
    assert "No excitation separates sensor lag and twin" in words
    assert "any two that can be separated differ" in words


def test_no_average_is_proposed_that_the_card_cannot_record():
    with pytest.raises(InputError, match=r"rows of 100 conversions: .* is more than 50"):
        averaging(SLOW, 100)
    assert averaging(SLOW, 50).card.average == 50
    assert averaging(SLOW, 50).film == SLOW.film
    sequence = parse_sequence(candidates(8.0)["quick steps"], "quick steps", Path())
    assert experiment._averages(RigChannels((CURRENT,)), sequence, SLOW) == (1, 50)


def test_limits_lower_every_candidate():
    low = SLOW.model_copy(update={"limits": SLOW.limits.model_copy(update={"voltage_max_kV": 3.0})})
    found, _ = separating_experiment(RIVALS, low, NOISE)
    assert len(found.tried) == len(candidates(3.0))
    waveform = plan(parse_sequence(found.sequence, "x", Path()), low).admitted()
    assert 2e3 < waveform.window().max() <= 3e3


def test_every_candidate_passes_the_gate_of_the_thesis_rig():
    for name, text in candidates(8.0).items():
        waveform = plan(parse_sequence(text, name, Path()), SLOW).admitted()
        assert waveform.window().max() > 5e3, name


def played(found, settings: RigFile) -> tuple[np.ndarray, float, list[np.ndarray]]:
    """Voltage, its rate, and what each of the two predicts of the film."""
    waveform = plan(parse_sequence(found.sequence, "x", Path()), settings).admitted()
    time = np.arange(waveform.samples) / waveform.rate
    drive = Drive(time, waveform.window(), hold=True)
    moved = [model.simulate(drive).displacement for model in (LAG, DRAG)]
    return waveform.window(), waveform.rate, moved


def with_interlocks(**changes: float) -> RigFile:
    locks = RigFile().interlocks.model_copy(update=changes)
    return RigFile().model_copy(update={"interlocks": locks})


@pytest.mark.parametrize("most", mostly_deep([3.0, 0.5], [3.0]))
def test_it_trips_no_interlock_of_its_own(most):
    settings = with_interlocks(displacement_max_mm=most)
    found, _ = separating_experiment(RIVALS, settings, NOISE)
    voltage, rate, moved = played(found, settings)
    for each in moved:
        # with a margin for a film that moves further than any of them predicts
        assert would_trip(settings, rate, voltage, each / 0.75) == ()
    assert max(each.max() for each in moved) < 0.75e-3 * most


@pytest.mark.deep
def test_where_interlocks_would_end_everything_it_says_so():
    found, words = separating_experiment(RIVALS, with_interlocks(displacement_max_mm=1e-3), NOISE)
    assert found is None
    assert "can be played: each would break a limit or trip" in words


@pytest.mark.deep
def test_it_is_no_faster_than_the_laser_can_tell():
    # a laser that looks every 0.2 ms, whenever that is
    laser = RigFile().laser.model_copy(update={"sampling_us": 200.0})
    settings = RigFile().model_copy(update={"laser": laser})
    found, _ = separating_experiment(RIVALS, settings, NOISE)
    _, rate, moved = played(found, settings)
    fastest = max(np.abs(np.diff(each)).max() for each in moved) * rate
    assert fastest * 100e-6 < NOISE
    quick, _ = separating_experiment(RIVALS, RigFile(), NOISE)
    _, rate, moved = played(quick, RigFile())
    assert max(np.abs(np.diff(each)).max() for each in moved) * rate > fastest


def test_the_rig_file_takes_on_the_film_that_was_measured():
    film, load = Film(0.05, 0.04, 5e-4, 3.1, 970.0, "uniaxial"), Load(0.1, 0.0555)
    settings = of_rig(SLOW, film, load)
    assert settings.card == SLOW.card
    for name in ("length", "width", "thickness", "permittivity", "density", "kinematics"):
        assert getattr(settings.as_film(), name) == pytest.approx(getattr(film, name)) or (
            name == "kinematics" and settings.as_film().kinematics == "uniaxial"
        )
    assert settings.as_load() == load


@pytest.mark.parametrize(
    ("share", "rejected", "against"),
    [(0.01, False, ()), (0.2, False, ("amplifier",)), (0.01, True, ("amplifier",))],
)
def test_an_experiment_is_sought_where_families_share_or_the_model_is_rejected(
    monkeypatch, share, rejected, against
):
    asked = []
    monkeypatch.setattr(
        experiment, "separating_experiment", lambda rivals, *_: (asked.append(rivals), "")
    )
    found = replace(
        finding(rivals=()), runners_up=(("amplifier", RIVAL),), marginals=(("amplifier", share),)
    )
    _, words = experiment_of(found, NOISE, RigFile(), rejected)
    families = [family for rivals in asked for _, family, _ in rivals]
    assert tuple(families[1:]) == against
    assert ("nothing to separate" in words) == (not against)


def test_there_is_never_nothing_to_separate_under_a_rejected_model():
    for outcome in (finding(rivals=()), finding(rivals=(), steps=())):
        proposed, words = experiment_of(outcome, NOISE, RigFile(), rejected=True)
        assert proposed is None
        assert "nothing to separate" not in words
        assert "record other amplitudes" in words


#: Of the amplifier's current monitor: noise of one conversion in A.
CURRENT = ChannelRecord("current", "A", np.zeros(0), 4e-6, skew=2e-6)
LEAK = with_effect("leakage", loss=0.02, growth=2.0, exponent=1.0)


@pytest.mark.parametrize("usual", [1, 100])
def test_the_current_separates_what_a_poor_laser_does_not(usual, monkeypatch):
    some = {name: candidates(8.0)[name] for name in ("a long hold", "quick steps")}
    monkeypatch.setattr(experiment, "candidates", lambda _: some)
    saturated = with_effect("amplifier saturation", loss=0.02, exponent=3.0)
    rivals = [("leakage", "leakage", LEAK), ("saturation", "amplifier", saturated)]
    quick = CardSettings(sample_rate_Hz=200.0, first_convert_us=5.0, convert_interval_us=10.0)
    rig, noise = averaging(RigFile(card=quick), usual), 100.0 * NOISE
    alone, why = separating_experiment(rivals, rig, noise)
    assert alone is None, "the displacement alone does not separate them"
    assert "times the noise" in why
    found, words = separating_experiment(rivals, rig, noise, RigChannels((CURRENT,)))
    told = dict(found.by_channel)
    assert found.separation > SEPARATES > told["displacement"]
    assert told["current"] > 5.0
    # an instant sees nothing of how a film charges: a wire that is off would read the same
    assert found.average == 100
    assert ("if every row is the mean of 100 conversions" in words) == (usual == 1)
    seen = f"Means of the current at 200 Hz differ by {told['current']:.2g} times their noise"
    assert seen in words


def test_channels_change_nothing_where_there_are_none(monkeypatch):
    monkeypatch.setattr(experiment, "candidates", lambda top: {"steps": candidates(top)["steps"]})
    with_none = separating_experiment(RIVALS, SLOW, NOISE, RigChannels(()))
    assert with_none == separating_experiment(RIVALS, SLOW, NOISE)
    assert with_none[0].by_channel == (("displacement", with_none[0].separation),)
