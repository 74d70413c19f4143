"""The bench: thinning, prediction of time left out, intervals, and readings that must not count."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.actuator import Drive
from dearig.model.diagnosis import bench as diagnosis_bench
from dearig.model.diagnosis.bench import Bench, information, merged, relieved
from dearig.model.diagnosis.preparation import FILM_MODEL_ERROR
from dearig.model.diagnosis.screening import Screen
from dearig.model.effects import EFFECTS
from dearig.model.excitation import Chirp, Ramp, Sequence
from dearig.model.fitting import identify
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import Layout
from dearig.model.material import TABLE_3, Branch, Network, Spring
from dearig.model.records import ActuatorRecord
from tests.tools.engine import (
    NOISE,
    PLAIN,
    STRIP,
    effect,
    film_record_of,
    fitted,
    made_trial,
    masked,
    record_of,
    thesis_drive,
)

DRAGGED = replace(PLAIN, effects=effect("linear drag", drag=400.0))
SEEDS = 60


def bench_of(*records):
    return Bench(records, PLAIN if isinstance(records[0], ActuatorRecord) else STRIP, workers=1)


# --- fidelity


def aged(softening):
    """A trial of a film that ages, from its own numbers, on a record of one that ages the more."""
    model = replace(PLAIN, effects=effect("ageing", softening=softening, path=0.01))
    bench = bench_of(record_of(replace(PLAIN, effects=effect("ageing", softening=0.02, path=0.01))))
    layout = bench.problem(model).layout
    start = layout.coordinates(layout.initial())
    held = np.ones(layout.size, dtype=bool)
    held[-2] = False  # its size
    return bench, model, start, held


def test_rough_simulations_serve_far_from_the_noise():
    bench, model, start, held = aged(0.015)
    # all held: it stays as far away as it is
    far = bench.fit(model, [(start, None)], np.ones_like(held))
    assert far.cost > 100.0
    assert far.problem.fidelity == kernel.ROUGH
    # what comes near it is carefully told from it
    near = bench.ended(replace(far, fixed=held))
    assert near.cost < 1.2
    assert near.problem.fidelity == kernel.QUICK
    again = bench.problem(model).residuals(near.x)
    assert np.array_equal(again, near.residuals)
    # and what is near from the beginning
    assert bench.fit(model, [(near.x, None)], held).problem.fidelity == kernel.QUICK


def test_models_without_hysteresis_use_one_fidelity():
    bench = bench_of(record_of(replace(PLAIN, effects=effect("linear drag", drag=4e3))))
    layout = bench.problem(PLAIN).layout
    start = layout.coordinates(layout.initial())
    far = bench.fit(PLAIN, [(start, None)], np.ones(layout.size, dtype=bool))
    assert far.cost > 100.0
    assert far.problem.fidelity == kernel.QUICK


# --- no further than it takes


def test_a_candidate_is_refined_while_it_may_reach_the_leader():
    # a lag, and no lag in the model: branches make up for some of it, slowly
    records = record_of(replace(PLAIN, effects=effect("sensor lag", time_constant=0.02)))
    bench = bench_of(records)
    layout = bench.problem(PLAIN).layout
    start = layout.coordinates(layout.initial())
    free = np.zeros(layout.size, dtype=bool)
    trial = bench.fit(PLAIN, [(start, None)], ~free)
    trial = replace(trial, fixed=free)

    def followed(leader):
        before = bench.simulations
        ended = bench.ended(trial, leader)
        return ended, bench.simulations - before

    to_the_end, work = followed(math.inf)
    beside, less = followed(1.0)
    assert to_the_end.cost > 1.5
    assert to_the_end.cost <= beside.cost < trial.cost
    assert less < work
    # what it gave up is no more than a part of what it lies behind
    assert beside.cost - to_the_end.cost < 0.5 * (to_the_end.cost - 1.0)
    # the leader itself is held back by none
    leads, _ = followed(2.0 * trial.cost)
    assert leads.cost == to_the_end.cost


# --- thinning


@pytest.mark.parametrize("rate", [100.0, 200.0, 1000.0, 2000.0])
def test_thinning_keeps_the_noise(rate):
    drive = thesis_drive(rate)
    record = record_of(PLAIN, drive)
    (thin,) = bench_of(record).records
    step = float(np.median(np.diff(thin.time)))
    # fast enough for mains and a load's ringing, and no faster than was measured
    assert 150.0 < 1.0 / step < 450.0 or 1.0 / step == pytest.approx(rate)
    left = thin.displacement - thin.seen(PLAIN.simulate(thin.drive).displacement)
    assert np.sqrt(np.mean(left**2)) == pytest.approx(thin.noise, rel=0.05)
    # as many means of so many readings: what is known in all stays what it was
    assert thin.noise / math.sqrt(thin.time.size) == pytest.approx(
        record.noise / math.sqrt(record.time.size), rel=0.01
    )


def test_thinning_reads_the_noise_of_a_sensor_that_averages():
    # each reading is the mean of the last eight: neighbours share most of their noise
    drive = thesis_drive(1000.0)
    white = NOISE * math.sqrt(8.0) * np.random.default_rng(0).standard_normal(drive.time.size + 7)
    smooth = np.convolve(white, np.full(8, 1.0 / 8.0), "valid")
    made = record_of(PLAIN, drive)
    record = replace(made, displacement=PLAIN.simulate(drive).displacement + smooth)
    (thin,) = bench_of(record).records
    left = thin.displacement - thin.seen(PLAIN.simulate(thin.drive).displacement)
    assert thin.noise > 1.5 * bench_of(made).records[0].noise
    assert thin.noise == pytest.approx(np.std(left), rel=0.1)


def test_reported_errors_are_of_all_readings():
    record = record_of(DRAGGED, thesis_drive(1000.0))
    bench = bench_of(record)
    trial = fitted(bench, DRAGGED)
    rough = bench.stage(trial, 1.0)
    full = bench.stage(bench.polished(trial), 1.0)
    assert rough.train_rms == pytest.approx(NOISE, rel=0.04)
    assert rough.train_rms == pytest.approx(full.train_rms, rel=0.04)
    assert rough.selection_rms == pytest.approx(full.selection_rms, rel=0.04)


@pytest.mark.parametrize(("most", "iterations"), [(0.0, 0), (1.0, 1), (math.inf, 8), (1e12, 8)])
def test_the_final_fit_is_bounded_by_its_budget(monkeypatch, most, iterations):
    bench = bench_of(record_of(DRAGGED))
    trial = fitted(bench, DRAGGED)
    asked: list[int] = []

    def counted(problem, start, fixed, iterations, *rest, **more):
        asked.append(iterations)
        return descend(problem, start, fixed, 0)

    monkeypatch.setattr(diagnosis_bench, "descend", counted)
    bench.polished(trial, most)
    assert asked == [iterations]


# --- branches that have nothing to do


@pytest.mark.parametrize(
    ("moduli", "times"),
    [
        # what it was made with; one of two went to the end of the times; both are where one was
        ((35e3, 47e3, 35e3, 224.0), (0.21, 0.30, 6.9)),
        ((35e3, 72e3, 12e3, 231.0), (0.27, 0.1, 6.7)),
        ((35e3, 41e3, 41e3, 300.0), (0.25, 0.25, 5.0)),
    ],
)
def test_a_spare_branch_finds_its_work(moduli, times):
    limits = (1e4,) * 4
    truth = replace(
        PLAIN, network=Network.gent((35e3, 47e3, 35e3, 224.0), limits, (0.21, 0.3, 6.9))
    )
    bench = bench_of(record_of(truth, thesis_drive(200.0, periods=2)))
    trial = fitted(bench, replace(PLAIN, network=Network.gent(moduli, limits, times)))
    ended = bench.ended(trial)
    made = fitted(bench, truth)
    # three standard deviations of one number above the optimum next to the truth, at most; what
    # leaves but noise is not followed so far
    most = 0.01 * ended.problem.samples if trial.is_white else 9.0
    assert (ended.cost - made.cost) * ended.problem.samples < most


# --- branches that stand in for an effect


def test_a_branch_that_imitates_creep_is_replaced():
    truth = replace(
        PLAIN,
        network=Network.gent((45e3, 45e3, 45e3), (1e4,) * 3, (0.25, 0.5)),
        effects=effect("slow branch", modulus=1e4, relaxation_time=9.0),
    )
    bench = bench_of(record_of(truth, thesis_drive(200.0, periods=2)))
    # without the creep one of the two branches plays it, and the other stands for both
    plain = Network.gent((46e3, 85e3, 7e3), (1e4,) * 3, (0.36, 7.0))
    base = bench.ended(fitted(bench, replace(PLAIN, network=plain)))
    assert base.cost > 1.3
    (start,) = relieved(base)
    springs, modulus, time = start
    values = base.problem.layout.values(base.x)
    there = base.problem.layout.values(springs)
    mu, tau = base.problem.layout.column("mu"), base.problem.layout.column("T")
    slow = int(np.argmax(values[tau]))
    assert (modulus, time) == (values[mu[1:]][slow], values[tau[slow]])
    assert there[mu].sum() + modulus == pytest.approx(values[mu].sum())
    assert np.all(there[tau] < 2.0 * values[tau].min())
    # from there the fit with the creep finds what was made
    creeping = replace(
        base.model, effects=effect("slow branch", modulus=modulus, relaxation_time=time)
    )
    layout = bench.problem(creeping).layout
    begin = np.concatenate([springs, layout.coordinates(layout.initial())[springs.size :]])
    held = np.concatenate([base.fixed, np.zeros(2, dtype=bool)])
    found = bench.ended(bench.fit(creeping, [], held, anew=[begin]))
    made = fitted(bench, truth)
    assert (found.cost - made.cost) * found.problem.samples < 9.0
    # one branch alone has nothing to be relieved of
    assert relieved(fitted(bench, PLAIN)) == []


def test_the_last_steps_lead_on_where_quick_ones_have_ended():
    # branches stand where they had imitated the creep, and nothing of it shows in what is left
    imitating = zip((60e3, 15e3, 550.0), (0.33, 0.69, 61.0), strict=True)
    branches = tuple(Branch(Spring(mu, 9e3), t) for mu, t in imitating)
    thesis = replace(PLAIN, network=TABLE_3)
    creep = effect("broad creep", modulus=4000.0, relaxation_time=1.3, exponent=0.1)
    bench = Bench([record_of(replace(thesis, effects=creep))], thesis, workers=1)
    start = replace(thesis, network=replace(TABLE_3, branches=branches), effects=creep)
    ended = bench.ended(fitted(bench, start))
    assert ended.is_white
    last = bench.to_the_last(ended)
    # of chi-square: as much as tells two laws apart
    assert (ended.cost - last.cost) * bench.samples > 2.0
    again = bench.to_the_last(last)
    assert (last.cost - again.cost) * bench.samples < 0.5


def test_one_branch_more_is_made_one_with_its_neighbour():
    network = Network.gent((42e3, 40e3, 17e3, 41e3), (1e4,) * 4, (0.58, 0.43, 0.39))
    layout = Layout(replace(PLAIN, network=network))
    start = layout.coordinates(layout.initial())
    found = [layout.values(x) for x in merged(layout, start, 700.0, 3.2)]
    mu, tau = layout.column("mu"), layout.column("T")
    # next to each other on the axis of time; what is made one lies nearer to the stiffer
    ones = [(0.402, 0.58, 3.2), (0.39, 0.5305, 3.2), (0.39, 0.43, 0.597)]
    shares = [(58e3, 40e3, 700.0), (41e3, 57e3, 700.0), (41e3, 17e3, 40.7e3)]
    assert len(found) == 3
    for values, times, moduli in zip(found, ones, shares, strict=True):
        assert values[mu] == pytest.approx([42e3, *moduli])
        assert values[tau] == pytest.approx(times, rel=2e-3)


# --- branches that stand in the way of an effect


LIMITS = (1e4,) * 4
TAU = 0.05
LATE = replace(
    PLAIN,
    network=Network.gent((35e3, 25e3, 12e3, 6e3), LIMITS, (0.25, 1.1, 7.0)),
    effects=effect("sensor double lag", time_constant=TAU),
)


def test_branch_misfit_shows_effects_that_branches_imitate():
    bench = bench_of(record_of(LATE, thesis_drive(200.0)))
    bare = bench.baseline(replace(LATE, effects=()), lambda *_: None)
    # a lag is not seen while branches do its work
    assert bare.cost > 10.0
    with_lag = replace(bare.model, effects=effect("sensor double lag", time_constant=0.0))
    problem = bench.problem(with_lag)

    def at(tau):
        return np.append(bare.x, tau)

    taus = (0.0, 0.01, 0.03, TAU, 0.15)
    found = bench.unaccounted(problem, np.array([at(tau) for tau in taus]))
    left = dict(zip(taus, found, strict=True))
    assert left[0.0] == pytest.approx(bench.unaccounted(bare.problem, bare.x[None])[0])
    # as the branches have it that are there: near, and that is near enough
    near = min(left, key=lambda tau: left[tau])
    assert 0.5 * TAU < near < 2.0 * TAU
    assert left[near] < 0.5 * left[0.0]

    fixed = np.append(bare.fixed, False)
    stuck = bench.fit(with_lag, [(at(0.0), None)], fixed)
    sought = bench.sought(stuck, np.array([at(near), at(1.5 * near)]))
    # not yet at the noise, but in the valley that leads there
    assert stuck.cost > 3.0
    assert sought.cost < 1.2
    assert sought.x[-1] == pytest.approx(TAU, rel=0.2)

    # who comes back to where it was is not followed on from there
    def down(*_):
        raise AssertionError

    bench._down = down
    assert bench.sought(sought, sought.x[None]).cost == pytest.approx(sought.cost, rel=0.02)


def test_a_moving_mass_is_found_from_the_measured_stretch():
    mass = 0.2
    chirp = Chirp(1500.0, 0.2, 12.0, 20.0)
    swept = Sequence("swept", (Ramp(3500.0, 2.0), chirp, Ramp(0.0, 2.0)))
    drive = Drive(*swept.sample(200.0))
    loaded = replace(PLAIN, effects=effect("load inertia", moving_mass=mass))
    bench = bench_of(record_of(loaded, drive))
    bare = bench.ended(bench.baseline(PLAIN, lambda *_: None))
    assert bare.cost > 1000.0
    promises = Screen(bench, bare).promises(EFFECTS["load inertia"])
    # what was fitted without it cannot ring as it does, whatever the mass
    assert all(p.share < 0.5 for p in promises)
    ((springs, told),) = bench.moving(bare)[:1]
    assert told == pytest.approx(mass, rel=0.1)

    with_mass = replace(bare.model, effects=effect("load inertia", moving_mass=0.0))
    fixed = np.append(bare.fixed, False)
    found = bench.settled(bench.fit(with_mass, [], fixed, anew=[np.append(springs, told)]))
    assert found.cost < 1.2
    assert found.x[-1] == pytest.approx(mass, rel=0.01)


def test_what_holds_the_film_still_is_not_taken_off_the_records():
    rubbing = replace(
        PLAIN, effects=effect("dry friction", friction=50.0, presliding=1e-4, damping=1e-3)
    )
    bench = bench_of(record_of(rubbing, thesis_drive(200.0)))
    trial = fitted(bench, rubbing)
    size = trial.problem.layout.names.index("dry friction: friction")
    places = np.tile(trial.x, (2, 1))
    places[1, size] = 5e3  # more than the field can pull: twice the motion would be left
    told, untold = bench.unaccounted(trial.problem, places)
    assert told < 0.01
    assert untold == math.inf


def test_what_a_model_of_a_film_may_be_off_is_not_averaged_away():
    record = film_record_of(STRIP)
    time = np.linspace(0.0, 40.0, 16001)
    stretch = np.interp(time, record.time, record.stretch)
    stress = np.interp(time, record.time, record.stress)
    dense = replace(record, time=time, stretch=stretch, stress=stress)
    bench = bench_of(dense)
    assert bench.records[0].stress.size < 2000
    error = FILM_MODEL_ERROR * stress.max()
    assert bench.records[0].noise == pytest.approx(
        math.hypot(error, record.noise / 10**0.5), rel=0.01
    )
    assert bench.full[0].noise == pytest.approx(math.hypot(error, record.noise))


@pytest.mark.parametrize(("limit", "held"), [(1e4, True), (3.0, False)])
def test_limits_of_a_film_are_free_where_its_springs_are_seen_to_stiffen(limit, held):
    strip = replace(STRIP, network=Network.gent((40e3, 30e3), (limit, 1e4), (2.0,)))
    trial = bench_of(film_record_of(strip)).baseline(strip, lambda *_: None)
    assert trial.fixed[trial.problem.layout.column("J")].all() == held
    assert trial.cost < 0.01  # of what a model of a film may be off


def test_branch_misfit_needs_a_voltage():
    bench = bench_of(film_record_of(STRIP))
    trial = fitted(bench, STRIP)
    assert bench.unaccounted(trial.problem, trial.x[None]) == [math.inf]
    assert bench.sought(trial, trial.x[None]) is trial


# --- time that is left out


@pytest.mark.parametrize(
    "effects",
    [(), effect("linear drift", drift=2e-7), effect("sensor curvature", quadratic=15.0)],
    ids=["nothing", "drift", "curvature"],
)
def test_segments_are_predicted_as_by_a_fit_to_the_others(effects):
    record = record_of(replace(PLAIN, effects=effects))
    bench = bench_of(record)
    stage = bench.stage(fitted(bench, PLAIN), 1.0)
    n = record.time.size
    left_out = np.empty(n)
    for low, high in pairwise(np.linspace(0, n, 11).astype(int)):
        valid = np.ones(n, dtype=bool)
        valid[low:high] = False
        others = fitted(bench_of(replace(record, valid=valid)), PLAIN)
        answer = others.model.simulate(record.drive).displacement
        left_out[low:high] = (answer - record.displacement)[low:high]
    assert stage.selection_rms == pytest.approx(np.sqrt(np.mean(left_out**2)), rel=2e-3)
    cost = bench.left_out_cost(fitted(bench, PLAIN))
    assert math.sqrt(cost) * NOISE == pytest.approx(stage.selection_rms, rel=2e-3)
    assert stage.selection_max == pytest.approx(np.abs(left_out).max(), rel=1e-2)
    # worse than what was fitted, the more the model is wrong
    assert stage.selection_rms > (1.06 if effects else 1.002) * stage.train_rms


# --- intervals


def test_the_costs_of_records_are_those_of_each_alone():
    quiet = record_of(PLAIN)
    bad = np.arange(quiet.measured.size) % 3 == 0
    trial = made_trial([masked(quiet, bad), quiet], PLAIN, np.repeat([2e-6, 3e-6], bad.size))
    assert trial.record_costs == pytest.approx([4.0, 9.0])


def test_a_parameter_at_the_end_of_its_range_is_reported():
    # pushed along instead of held back: no drag does that
    record = record_of(PLAIN)
    rate = PLAIN.simulate(record.drive).rate
    bench = bench_of(replace(record, displacement=record.displacement + 3e-5 * rate))
    trial = fitted(bench, DRAGGED)
    notes = {e.name: e.note for e in bench.estimates(trial, trial.jacobian())}
    assert trial.x[-1] == pytest.approx(trial.problem.layout.lower[-1], abs=1e-9)
    assert "end of its search range" in notes["linear drag: drag"]
    assert "end of the range" not in notes["mu_0"]


@functools.cache
def many():
    """Estimates of the same truth under other noise."""
    found = []
    for seed in range(SEEDS):
        bench = bench_of(record_of(DRAGGED, seed=seed))
        trial = fitted(bench, DRAGGED)
        found.append(bench.estimates(trial, trial.jacobian()))
    return found


def test_intervals_are_as_wide_as_estimates_spread():
    truth = dict(zip(Layout(DRAGGED).names, Layout(DRAGGED).initial(), strict=True))
    for several in zip(*many(), strict=True):
        name = several[0].name
        if name.startswith("J"):
            assert all((e.determined, e.note) == (False, "held") for e in several)
            continue
        assert all(e.determined for e in several)
        spread = np.std([e.value for e in several], ddof=1)
        width = np.mean([e.high - e.low for e in several]) / (2.0 * 1.96)
        # a spread of sixty is known to 9 %
        assert width == pytest.approx(spread, rel=0.25), name
        inside = sum(e.low <= truth[name] <= e.high for e in several)
        # 57 of them should be; fewer than 52 in one of a hundred
        assert inside >= 52, name


def test_intervals_agree_with_those_of_the_fit():
    record = record_of(PLAIN)
    bench = bench_of(record)
    trial = fitted(bench, PLAIN)
    here = {e.name: e for e in bench.estimates(trial, trial.jacobian())}
    # there by profiles of the likelihood
    for there in identify([record], PLAIN, workers=1).estimates:
        if not there.name.startswith("J"):
            e = here[there.name]
            assert e.value == pytest.approx(there.value, rel=1e-3)
            assert e.low == pytest.approx(there.low, rel=1e-2)
            assert e.high == pytest.approx(there.high, rel=1e-2)
            assert e.high - e.low == pytest.approx(there.high - there.low, rel=0.2)


def test_unexplained_residuals_widen_intervals():
    noisy = record_of(DRAGGED, noise=3e-6)
    said = replace(noisy, noise=NOISE)
    widths = []
    for record in (noisy, said):
        bench = bench_of(record)
        trial = fitted(bench, DRAGGED)
        widths.append([e.high - e.low for e in bench.estimates(trial, trial.jacobian())])
    finite = np.isfinite(widths[0])
    np.testing.assert_allclose(
        np.array(widths[1])[finite], np.array(widths[0])[finite], rtol=0.1
    )  # fmt: skip


# --- readings that must not be used


def bad_readings(record, *spans):
    bad = np.zeros(record.time.size, dtype=bool)
    for start, end in spans:
        bad[(record.time >= start) & (record.time < end)] = True
    return bad


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_masked_readings_change_no_fit(rate):
    record = record_of(DRAGGED, thesis_drive(rate))
    bad = bad_readings(record, (5.0, 5.3), (9.0, 9.1))
    spoilt = bench_of(masked(record, bad))
    marked = bench_of(replace(record, valid=~bad))
    assert spoilt.samples == marked.samples < bench_of(record).samples
    trials = [fitted(b, DRAGGED) for b in (spoilt, marked)]
    np.testing.assert_allclose(trials[0].x, trials[1].x, rtol=1e-9)
    assert trials[0].cost == pytest.approx(trials[1].cost, rel=1e-9)
    assert trials[0].cost == pytest.approx(1.0, abs=0.12)
    stages = [b.stage(t, 1.0) for b, t in zip((spoilt, marked), trials, strict=True)]
    for name in ("train_rms", "selection_rms", "selection_max", "criterion"):
        assert getattr(stages[0], name) == pytest.approx(getattr(stages[1], name), rel=1e-6)
    assert stages[0].selection_max < 6e-6


def test_masked_readings_in_the_lead_in_do_not_count_as_noise():
    record = record_of(PLAIN, thesis_drive(1000.0))
    bad = bad_readings(record, (0.5, 0.51))
    (thin,) = bench_of(masked(record, bad)).records
    (clean,) = bench_of(record).records
    assert thin.noise == pytest.approx(clean.noise, rel=0.1)


def test_masked_readings_do_not_count_in_the_stress_of_a_film():
    record = film_record_of(STRIP)
    valid = np.ones(record.time.size, dtype=bool)
    valid[300:310] = False
    spoilt = replace(record, stress=np.where(valid, record.stress, -1e6), valid=valid)
    (found,) = bench_of(spoilt).records
    (clean,) = bench_of(record).records
    assert found.noise == pytest.approx(clean.noise, rel=0.02)


# --- what models are compared by


def test_the_criterion_asks_what_an_effect_explains():
    # a number that explains nothing costs log N; one that halves what is left gains N log 2
    n = 1000.0
    assert information(1.0, 5, n) - information(1.0, 4, n) == pytest.approx(math.log(n))
    gain = information(1.0, 4, n) - information(0.5, 5, n)
    assert gain == pytest.approx(n * math.log(2.0) - math.log(n))
    assert information(2.0, 4, n) - information(1.0, 5, n) == pytest.approx(gain)


def test_the_criterion_counts_correlated_residuals_as_fewer():
    bench = bench_of(record_of(PLAIN))
    trial = fitted(bench, PLAIN)
    one, ten = (bench.stage(trial, c).criterion for c in (1.0, 10.0))
    assert one == pytest.approx(information(trial.cost, trial.free, bench.samples))
    assert ten == pytest.approx(information(trial.cost, trial.free, bench.samples / 10.0))


def test_records_are_fitted_together():
    a, b = record_of(PLAIN), record_of(PLAIN, seed=1, noise=3e-6)
    trial = fitted(bench_of(a, b), PLAIN)
    assert trial.cost == pytest.approx(1.0, abs=0.1)
    assert trial.residuals.size == a.time.size + b.time.size
    assert trial.effects == ()
    stage = bench_of(a, b).stage(trial, 1.0)
    assert stage.train_rms == pytest.approx(math.sqrt(5.0) * 1e-6, rel=0.05)


# --- the age of a reading


@pytest.mark.parametrize(("late", "suits"), [(8e-6, True), (-8e-6, True), (30e-6, False)])
def test_readings_are_as_old_as_suits_as_far_as_that_is_not_known(late, suits):
    time, voltage = Sequence(
        "fast", (Ramp(4e3, 1.0), Chirp(3.5e3, 5.0, 40.0, 10.0), Ramp(0.0, 1.0))
    ).sample(1000.0)
    drive = Drive(time, voltage, hold=True)
    shown = PLAIN.simulate(drive, 1e-4 + late).displacement
    rng = np.random.default_rng(3)
    record = ActuatorRecord(
        "late", drive, shown + 1e-7 * rng.standard_normal(time.size), 1e-7, lag=1e-4, lag_error=1e-5
    )
    bench = bench_of(record)
    layout = bench.problem(PLAIN).layout
    start = layout.coordinates(layout.initial())
    trial = bench.fit(PLAIN, [(start, None)], np.ones(layout.size, dtype=bool))
    assert trial.cost > 1.3
    there = bench.cost_at_any_age(trial)
    assert (there == pytest.approx(1.0, abs=0.05)) is suits
    assert there < trial.cost
    # where it is known, it is as it is
    known = bench_of(replace(record, lag_error=0.0))
    trial = known.fit(PLAIN, [(start, None)], np.ones(layout.size, dtype=bool))
    assert known.cost_at_any_age(trial) == trial.cost
