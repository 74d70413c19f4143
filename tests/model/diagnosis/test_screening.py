"""The score test: what an effect promises before anything is fitted is what it would bring."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.diagnosis.bench import Bench
from dearig.model.diagnosis.screening import Screen, is_of, with_effect
from dearig.model.effects import EFFECTS
from dearig.model.material import Network
from tests.tools.engine import (
    NOISE,
    PLAIN,
    STRIP,
    effect,
    film_record_of,
    fitted,
    masked,
    record_of,
    thesis_drive,
)

STICKING = {"friction": 50.0, "presliding": 1e-4, "damping": 1e-3}


@functools.cache
def screened(truth, rate=100.0, quiet=True, base=PLAIN):
    """Bench, fitted baseline and screen of data in which ``truth`` is hidden.

    ``quiet`` data have a hundredth of the noise that they are said to have: what is promised is
    then that of the effect alone.
    """
    record = record_of(truth, thesis_drive(rate), noise=0.01 * NOISE if quiet else NOISE)
    bench = Bench([replace(record, noise=NOISE)], PLAIN, workers=1)
    trial = fitted(bench, base)
    return bench, trial, Screen(bench, trial)


def promised(name, rate=100.0, quiet=True, **numbers):
    """The best promise of an effect on data made with it, and its numbers."""
    bench, _, screen = screened(replace(PLAIN, effects=effect(name, **numbers)), rate, quiet)
    best = screen.promises(EFFECTS[name])[0]
    layout = bench.problem(best.model).layout
    values = layout.values(best.start)[-len(numbers) :]
    return best, dict(zip(numbers, values, strict=True))


# (effect, its size, how far first order may be off in size, and in share)
SIZES = [
    ("linear drift", {"drift": 2e-7}, 0.01, 0.005),
    ("amplifier offset", {"offset": 20.0}, 0.02, 0.005),
    ("linear drag", {"drag": 200.0}, 0.05, 0.02),
    ("sensor curvature", {"quadratic": 3.0}, 0.02, 0.005),
    # what rings is never small
    ("load inertia", {"moving_mass": 0.05}, 0.15, 0.2),
]


@pytest.mark.parametrize(("name", "numbers", "off", "missed"), SIZES, ids=[s[0] for s in SIZES])
def test_predicted_amplitudes_and_gains_are_those_of_a_refit(name, numbers, off, missed):
    best, found = promised(name, **numbers)
    for number, value in numbers.items():
        assert found[number] == pytest.approx(value, rel=off)
    assert 1.0 - missed < best.share <= 1.0


@pytest.mark.parametrize(("name", "numbers", "off", "missed"), SIZES, ids=[s[0] for s in SIZES])
def test_the_predicted_gain_is_that_of_a_refit(name, numbers, off, missed):
    # with the noise in, which nothing explains
    truth = replace(PLAIN, effects=effect(name, **numbers))
    bench, trial, screen = screened(truth, quiet=False)
    best = screen.promises(EFFECTS[name])[0]
    refitted = fitted(bench, best.model)
    assert best.share == pytest.approx(1.0 - refitted.cost / trial.cost, abs=missed + 0.01)


def test_the_sensitivities_are_those_of_the_model():
    _, trial, screen = screened(replace(PLAIN, effects=effect("linear drag", drag=200.0)))
    (best,) = screen.promises(EFFECTS["linear drag"])
    drive = trial.problem.records[0].drive
    without = trial.model.simulate(drive).displacement
    small = with_effect(trial.model, "linear drag", (100.0,))
    slope = (small.simulate(drive).displacement - without) / 100.0 / NOISE
    np.testing.assert_allclose(
        best.columns[:, 0], slope, rtol=0.0, atol=0.1 * np.abs(slope).max()
    )  # fmt: skip
    assert best.model.effects[0][0] == "linear drag"
    # the springs follow: what is promised is there when it is simulated
    there = screen.bench.problem(best.model).costs(best.start[None])[0]
    assert best.share > 0.9
    assert there < 0.1 * trial.cost


def test_branches_of_equal_times_do_not_displace_a_start():
    # one relaxation, and two branches for it
    one = Network.gent((45e3, 60e3), (1e4, 1e4), (4.0,))
    two = Network.gent((45e3, 40e3, 20e3), (1e4,) * 3, (4.0, 4.0001))
    truth = replace(PLAIN, network=one, effects=effect("amplifier slew", inverse_slew=5e-5))
    bench, _, _ = screened(truth, base=replace(PLAIN, network=one))
    layout = bench.problem(replace(PLAIN, network=two)).layout
    held = np.zeros(layout.size, dtype=bool)
    held[layout.column("J")] = True
    alike = held.copy()
    alike[layout.column("T")] = True
    start = layout.coordinates(layout.initial())
    trial = bench.fit(layout.base, [(start, None)], alike)
    best = Screen(bench, replace(trial, fixed=held)).promises(EFFECTS["amplifier slew"])[0]
    assert best.share > 0.9
    there = bench.problem(best.model).costs(best.start[None])[0]
    assert there < 0.1 * trial.cost


def test_little_gain_is_predicted_on_noise():
    _, trial, screen = screened(PLAIN, quiet=False)
    readings = trial.residuals.size
    for e in EFFECTS.values():
        if "voltage" in e.drives and e.name != "temperature":
            promises = screen.promises(e)
            assert promises, e.name
            # by chance a size takes one of the readings; the best of so many shapes takes more
            least = 25.0 if e.shape_parameters else 12.0
            assert promises[0].share < least * len(e.amplitudes) / readings, e.name


def test_no_gain_is_predicted_for_what_the_baseline_imitates():
    # a branch as slow as one that the network has
    base = replace(PLAIN, network=Network.gent((45e3, 60e3), (1e4, 1e4), (4.0,)))
    truth = replace(base, effects=effect("slow branch", modulus=8e2, relaxation_time=4.0))
    bench, trial, screen = screened(truth, quiet=False, base=base)
    problem = bench.problem(base)
    start = problem.layout.coordinates(problem.layout.initial())
    # it is there, and the springs take it over
    assert problem.costs(start[None])[0] > 2.5
    assert trial.cost == pytest.approx(1.0, abs=0.1)
    assert screen.promises(EFFECTS["slow branch"])[0].share < 0.03


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("sudden change of force", {"stress": 5.0, "moment": 6.3}),
        ("sudden change of reading", {"jump": 5e-6, "moment": 9.13}),
        ("sudden loss of field", {"loss": 2e-3, "moment": 7.77}),
    ],
)
def test_instants_are_found(name, numbers):
    best, found = promised(name, **numbers)
    assert found["moment"] == pytest.approx(numbers["moment"], abs=0.03)
    size = next(iter(numbers))
    assert found[size] == pytest.approx(numbers[size], rel=0.05)
    assert best.share > 0.95


@pytest.mark.parametrize("part", [0.6, 0.9, 0.97])
def test_a_limit_that_only_the_steepest_edges_meet_is_found(part):
    drive = thesis_drive(100.0)
    steepest = np.max(np.abs(np.diff(drive.voltage)) / np.diff(drive.time))
    limit = 1.0 / (part * steepest)
    best, found = promised("amplifier slew", inverse_slew=limit)
    assert found["inverse_slew"] == pytest.approx(limit, rel=0.15)
    assert best.share > 0.3


@pytest.mark.parametrize("frequency", [49.97, 59.94])
@pytest.mark.parametrize("rate", [200.0, 1000.0])
def test_the_line_of_the_mains_is_found(frequency, rate):
    numbers = {
        "cosine": 3e-6, "sine": 2e-6, "third_cosine": 0.0, "third_sine": 0.0,
        "frequency": frequency,
    }  # fmt: skip
    best, found = promised("mains interference", rate, quiet=False, **numbers)
    line, part = found["frequency"], np.hypot(found["cosine"], found["sine"])
    if abs(line - frequency) > 0.02:
        # at 200 Hz a third harmonic that folds there is the same line
        line, part = 200.0 - 3.0 * line, np.hypot(found["third_cosine"], found["third_sine"])
    # half a line of a record of 14 s
    assert line == pytest.approx(frequency, abs=0.02)
    # means of five readings at 1 kHz see 0.9 of 50 Hz, 0.86 of 60 Hz
    assert 0.75 < part / np.hypot(3e-6, 2e-6) < 1.1
    assert best.share > 0.7


def test_the_mains_are_told_from_their_third_harmonic_that_folds_beside_them():
    # at 200 Hz, three times 49.99 Hz shows at 50.03: between the two lines a descent stays
    numbers = {
        "cosine": -3e-5, "sine": 6e-6, "third_cosine": 5e-6, "third_sine": -6e-6,
        "frequency": 49.992,
    }  # fmt: skip
    best, found = promised("mains interference", 200.0, quiet=False, **numbers)
    assert best.share > 0.99
    for name, number in numbers.items():
        assert found[name] == pytest.approx(number, rel=1e-4, abs=3e-6)


def test_a_line_and_its_alias_are_both_screened():
    # at 200 Hz, three times 50.0073 Hz shows at 49.978, and plays a line there
    numbers = {
        "cosine": -3e-6, "sine": 8e-6, "third_cosine": -9e-7, "third_sine": -2e-7,
        "frequency": 49.978,
    }  # fmt: skip
    record = record_of(
        replace(PLAIN, effects=effect("mains interference", **numbers)), thesis_drive(200.0, 3)
    )
    bench = Bench([record], PLAIN, workers=1)
    trial = fitted(bench, PLAIN)
    line, image = Screen(bench, trial).promises(EFFECTS["mains interference"])[:2]
    assert [p.model.effects[-1][1][-1][1] for p in (line, image)] == [
        pytest.approx(49.978, abs=3e-3),
        pytest.approx(50.0073, abs=3e-3),
    ]
    assert line.share > image.share > 0.9


def test_the_true_effect_has_the_largest_predicted_gain():
    # of those that have no shape to be searched for
    for name, numbers, *_ in SIZES[:4]:
        _, _, screen = screened(replace(PLAIN, effects=effect(name, **numbers)))
        shares = {
            e.name: screen.promises(e)[0].share
            for e in EFFECTS.values()
            if "voltage" in e.drives and not e.shape_parameters
        }
        # a drift that wanders may also go straight
        assert EFFECTS[max(shares, key=shares.get)].family == EFFECTS[name].family


def test_sizes_stay_within_their_bounds():
    # pushed along instead of held back: no drag does that
    record = record_of(PLAIN)
    rate = PLAIN.simulate(record.drive).rate
    helped = replace(record, displacement=record.displacement + 3e-5 * rate)
    bench = Bench([helped], PLAIN, workers=1)
    trial = fitted(bench, PLAIN)
    best = Screen(bench, trial).promises(EFFECTS["linear drag"])[0]
    assert best.start[-1] == 0.0


def test_masked_readings_do_not_influence_shape_parameters():
    record = record_of(PLAIN)
    bad = (record.time > 5.0) & (record.time < 5.1)
    onsets = []
    for one in (record, masked(record, bad)):
        bench = Bench([one], PLAIN, workers=1)
        screen = Screen(bench, fitted(bench, PLAIN))
        promises = screen.promises(EFFECTS["stress beyond a displacement"])
        onsets.append(sorted(float(np.exp(p.start[-3])) for p in promises))
    np.testing.assert_allclose(onsets[1], onsets[0], rtol=0.01)


def test_only_applicable_effects_are_screened():
    drive = thesis_drive()
    cold = Bench([record_of(PLAIN)], PLAIN, workers=1)
    warm = Bench([record_of(PLAIN, replace(drive, warmth=0.01 * drive.time))], PLAIN, workers=1)
    film = Bench([film_record_of(STRIP)], STRIP, workers=1)
    assert not is_of(EFFECTS["temperature"], cold)
    assert is_of(EFFECTS["temperature"], warm)
    assert is_of(EFFECTS["slack"], film)
    assert not is_of(EFFECTS["slack"], cold)
    assert is_of(EFFECTS["linear drag"], film)
    assert is_of(EFFECTS["linear drag"], cold)
    assert not is_of(EFFECTS["sensor lag"], film)


def test_unloading_effects_are_not_screened_without_unloading():
    let_go = film_record_of(STRIP)
    held = np.maximum.accumulate(let_go.stretch)
    only_held = Bench([replace(let_go, stretch=held)], STRIP, workers=1)
    both = Bench([replace(let_go, stretch=held), let_go], STRIP, workers=1)
    for name in ("slack", "ageing", "Mullins softening", "distributed hysteresis"):
        assert not is_of(EFFECTS[name], only_held)
        assert is_of(EFFECTS[name], both)
    for name in ("slow branch", "power-law creep", "linear drag"):
        assert is_of(EFFECTS[name], only_held)


def test_no_film_grows_stiffer_by_use():
    softening = (e for e in EFFECTS.values() if e.family == "softening" and not e.is_general)
    for effect_of_use in softening:
        # by a fit: a model may
        assert all(size.fit_bounds[0] == 0.0 > size.bounds[0] for size in effect_of_use.amplitudes)


def test_far_from_the_noise_a_film_that_sticks_is_screened_in_rough_simulations():
    sticking = replace(PLAIN, effects=effect("dry friction", **STICKING))
    truth = replace(sticking, effects=sticking.effects + effect("sensor curvature", quadratic=40.0))
    records = [record_of(truth, seed=seed) for seed in (0, 1)]
    found = []
    for some in (records, records[:1]):
        bench = Bench(some, PLAIN, workers=1)
        trial = fitted(bench, sticking)
        assert trial.cost > 25.0
        screen = Screen(bench, trial)
        # by what is there without it in the same simulation: the effect alone is left
        found.append(screen.promises(EFFECTS["sensor curvature"])[0])
        small = with_effect(trial.model, "sensor curvature", (1e-9,))
        problem = bench.problem(small, screen._fidelity)
        values = problem.layout.values(problem.layout.coordinates(problem.layout.initial()))
        moved, _ = screen._moved_by(problem, values[None], np.zeros(1, dtype=bool))
        assert np.max(np.abs(moved)) < 1e-3
        rough = screen._fidelity == kernel.ROUGH
        assert rough == (len(some) > 1)
    assert found[0].share == pytest.approx(found[1].share, abs=0.05)
    assert found[0].share > 0.5
