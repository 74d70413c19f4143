"""Identification: known models found again, with intervals that hold the truth."""

import functools
import importlib
import math
import time
from dataclasses import replace
from threading import Barrier, Event, Thread, current_thread

import numpy as np
import pytest

from dearig.model import kernel
from dearig.model.errors import ModelError
from dearig.model.film.material import (
    TABLE_3,
    THESIS_FILM,
    THESIS_LOAD,
    Branch,
    Load,
    Network,
    Spring,
)
from dearig.model.fitting import identify
from dearig.model.fitting.intervals import (
    correlation_time,
    covariance,
    has_spectrum_of,
    is_flat,
    unevenness,
)
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parallel import parallel_map
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.search import Algorithm1, algorithm_1
from dearig.model.readings.records import ActuatorRecord, FilmRecord
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Sequence
from dearig.model.simulation.strip import Strip
from tests.tools.engine import effect, typical

# the package exports the function of the same name
identify_module = importlib.import_module("dearig.model.fitting.identify")

NOISE = 1e-6
SORTED = Network(
    TABLE_3.equilibrium, tuple(sorted(TABLE_3.branches, key=lambda b: b.relaxation_time))
)
ONE = Network.gent((45e3, 60e3), (1e4, 1e4), (0.4,))


def made(network, seed=0, load=THESIS_LOAD, rate=100.0, noise=NOISE):
    """One period of the thesis's record, as a model makes it."""
    time, voltage = Sequence.thesis(periods=1).sample(rate)
    drive = Drive(time, voltage)
    x = Actuator(THESIS_FILM, load, network).simulate(drive).displacement
    x = x + noise * np.random.default_rng(seed).standard_normal(x.size)
    return ActuatorRecord("made", drive, x, noise)


def truths(network):
    numbers = {f"mu_{i}": s.modulus for i, s in enumerate(network.springs)}
    numbers |= {f"J_{i}": s.limit for i, s in enumerate(network.springs)}
    return numbers | {f"T_{i}": t for i, t in enumerate(network.times, 1)}


@functools.cache
def thesis_fit():
    return identify([made(TABLE_3)], Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3))


def test_the_thesis_record_leaves_nothing_but_noise():
    fit = thesis_fit()
    assert fit.cost == pytest.approx(1.0, abs=0.12)
    assert fit.correlation == pytest.approx(1.0, abs=0.5)
    # T_1 and T_2 are 0.34 and 0.40 s
    (said,) = (w.split(",")[0] for w in fit.warnings)
    assert said in ("these data determine mu_1 + mu_2", "these data determine mu_2 (+ mu_1)")
    assert fit.method == "hybrid"
    assert fit.model.network.times == tuple(sorted(fit.model.network.times))


def test_starts_are_kept_best_first():
    starts = thesis_fit().starts
    assert len(starts) > 2
    assert [cost for cost, _ in starts] == sorted(cost for cost, _ in starts)
    assert sum(followed for _, followed in starts) == 2
    assert starts[0][0] == pytest.approx(1.0, abs=0.2)


def test_the_truth_is_in_the_intervals():
    truth = truths(SORTED)
    outside = [e.name for e in thesis_fit().estimates if not e.low <= truth[e.name] <= e.high]
    # eleven intervals of 95 %
    assert len(outside) <= 1
    for e in thesis_fit().estimates:
        assert e.low <= e.value <= e.high


def test_the_limits_are_not_determined():
    undetermined = thesis_fit().undetermined
    assert {"J_0", "J_1", "J_2", "J_3"} <= set(undetermined)
    assert "mu_0" not in undetermined
    for e in thesis_fit().estimates:
        if e.name.startswith("J"):
            assert "lower bound" in e.note or e.note == "not determined by these data"
            assert e.high == math.inf


def test_covariance_belongs_to_its_names():
    fit = thesis_fit()
    count = len(fit.covariance_names)
    assert fit.covariance.shape == (count, count)
    assert np.linalg.eigvalsh(fit.covariance).min() > -1e-6 * np.abs(fit.covariance).max()
    sigma = np.sqrt(fit.covariance[0, 0])
    estimate = fit.estimates[0]
    # the best determined number is nearly linear: its interval is its standard deviation
    assert estimate.high - estimate.low == pytest.approx(2.0 * 1.96 * sigma, rel=0.4)


def test_a_measured_rest_length_fixes_the_equilibrium_modulus():
    load = Load(0.2, rest_length=0.082)
    fit = identify([made(ONE, load=load)], Actuator(THESIS_FILM, load, ONE), intervals=False)
    first = fit.estimates[0]
    assert (first.name, first.free, first.determined) == ("mu_0", False, True)
    assert first.value == pytest.approx(83.0e3, rel=1e-3)
    assert "rest length" in first.note
    assert fit.cost == pytest.approx(1.0, abs=0.12)
    assert [e.name for e in fit.estimates].count("mu_0") == 1
    assert fit.model.network.springs[1].modulus == pytest.approx(60e3, rel=0.01)


def test_two_records_are_fitted_together():
    records = [made(ONE, seed) for seed in (1, 2)]
    fit = identify(records, Actuator(THESIS_FILM, THESIS_LOAD, ONE), intervals=False)
    assert fit.cost == pytest.approx(1.0, abs=0.1)
    assert fit.model.network.times[0] == pytest.approx(0.4, rel=0.01)


def test_a_known_lag_is_not_fitted_away():
    fine = made(ONE, rate=1000.0, noise=1e-9)
    late = np.interp(fine.time - 5e-3, fine.time, fine.displacement)
    record = ActuatorRecord("late", fine.drive, late, 1e-7, lag=5e-3)
    fit = identify([record], Actuator(THESIS_FILM, THESIS_LOAD, ONE), intervals=False)
    assert fit.cost < 1.0
    assert fit.model.network.times[0] == pytest.approx(0.4, rel=1e-3)


def test_more_branches_never_fit_worse():
    record = made(TABLE_3, seed=3)
    fits = [None]
    for branches in (1, 2):
        network = Network(TABLE_3.equilibrium, TABLE_3.branches[:branches])
        base = Actuator(THESIS_FILM, THESIS_LOAD, network)
        nested = fits[-1].model.network if fits[-1] else None
        fits.append(identify([record], base, intervals=False, nested=nested))
    assert fits[2].cost <= fits[1].cost * (1.0 + 1e-9)


def film_record(seed=0, noise=20.0, effects=()):
    network = Network(
        Spring(60e3, 30.0), (Branch(Spring(40e3, 500.0), 0.8), Branch(Spring(25e3, 500.0), 15.0))
    )
    time = np.linspace(0.0, 60.0, 1201)
    # up and down at several speeds, and held in between
    corners = np.array([0.0, 2.0, 10.0, 12.0, 22.0, 30.0, 30.5, 45.0, 60.0])
    stretch = np.interp(time, corners, [1.0, 1.6, 1.6, 1.1, 2.2, 2.2, 1.4, 1.4, 1.0])
    stress = Strip(network, effects=effects).simulate(time, stretch).stress
    stress = stress + noise * np.random.default_rng(seed).standard_normal(time.size)
    return network, FilmRecord("film", time, stretch, stress, noise)


@pytest.mark.deep
def test_what_a_film_lacks_does_not_decide_whether_its_springs_stiffen():
    network, record = film_record(effects=effect("slack", looseness=1.0))
    fits = []
    for branches in (1, 2):
        base = Strip(Network(network.equilibrium, network.branches[:branches]))
        nested = fits[-1].model.network if fits else None
        fits.append(identify([record], base, intervals=False, nested=nested))
    assert fits[0].cost > 100.0
    assert fits[1].cost <= fits[0].cost * (1.0 + 1e-9)
    assert all(fit.held_limits == () for fit in fits)


@pytest.mark.deep
def test_a_film_of_two_branches_is_found_again():
    network, record = film_record()
    fit = identify([record], Strip(network), intervals=False)
    assert fit.cost == pytest.approx(1.0, abs=0.15)
    found = fit.model.network
    assert found.times == pytest.approx(network.times, rel=0.02)
    for a, b in zip(found.springs, network.springs, strict=True):
        assert a.modulus == pytest.approx(b.modulus, rel=0.02)
    assert found.equilibrium.limit == pytest.approx(30.0, rel=0.02)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_population_is_its_members(workers):
    records = [made(ONE), made(TABLE_3, rate=50.0)]
    model = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    layout = FitLayout(model)
    values = np.array([layout.initial() * f for f in (1.0, 0.7, 1.3)])
    values[1, layout.column("mu")] = 0.0  # cannot carry the load
    predicted, status = Problem(records, layout, workers).predict(values)
    assert status.tolist() == [kernel.OK, kernel.NO_REST, kernel.OK]
    for p in (0, 2):
        one = layout.model(values[p])
        alone = [one.simulate(r.drive).displacement for r in records]
        for reading, part in zip(alone, np.split(predicted[p], [alone[0].size]), strict=True):
            # but for the record's offset
            np.testing.assert_allclose(np.diff(part), np.diff(reading), atol=1e-15)


def test_what_does_not_fit_is_said():
    record = made(TABLE_3)
    bent = ActuatorRecord(
        "bent", record.drive, record.displacement + 2e-5 * np.sin(7.0 * record.time), NOISE
    )
    fit = identify([bent], Actuator(THESIS_FILM, THESIS_LOAD, ONE), intervals=False)
    assert fit.cost > 10.0
    assert any("the model lacks something" in w for w in fit.warnings)


def test_algorithm_1_as_printed_improves_with_its_generations(monkeypatch):
    record = made(TABLE_3, rate=50.0)
    problem = Problem([record], FitLayout(Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)))
    seen = []

    def rms(generations):
        settings = Algorithm1(generations=generations, members=40)
        values = algorithm_1(problem, 0, lambda _, part: seen.append(part), settings)
        predicted, _ = problem.predict(values)
        return np.sqrt(np.mean((predicted[0] - record.displacement) ** 2))

    few, more = rms(2), rms(25)
    assert more < few
    assert seen[-1] == 1.0
    assert rms(2) == few

    short = functools.partial(algorithm_1, settings=Algorithm1(generations=3, members=20))
    monkeypatch.setattr(identify_module, "algorithm_1", short)
    fit = identify([record], Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3), method="de", seed=4)
    assert fit.method == "de"
    assert not any(e.determined for e in fit.estimates)
    assert fit.model.network.times == tuple(sorted(fit.model.network.times))


def test_progress_is_told():
    told = []
    identify(
        [made(ONE, rate=50.0)],
        Actuator(THESIS_FILM, THESIS_LOAD, ONE),
        progress=lambda stage, part: told.append((stage, part)),
    )
    assert {stage for stage, _ in told} == {"global search", "descents", "intervals"}
    assert all(0.0 <= part <= 1.0 for _, part in told)
    assert told[-1] == ("intervals", 1.0)
    assert told[0] == ("global search", 0.0)
    for stage in ("global search", "descents", "intervals"):
        parts = [part for name, part in told if name == stage]
        # the time that is left is estimated from these
        assert parts == sorted(parts)
        assert max(np.diff(parts)) < 0.3


@pytest.mark.parametrize(
    ("records", "base", "method", "message"),
    [
        (lambda: [made(ONE)], "actuator", "newton", "'newton' is not one of hybrid, de"),
        (list, "actuator", "hybrid", "at least one record"),
        (lambda: [made(ONE), film_record()[1]], "actuator", "hybrid", "voltage and by stretch"),
        (lambda: [film_record()[1]], "actuator", "hybrid", "not of one kind"),
        (lambda: [made(ONE)], "strip", "hybrid", "not of one kind"),
        (lambda: [short()], "actuator", "hybrid", "4 samples cannot determine 5 parameters"),
    ],
)
def test_refusals(records, base, method, message):
    model = Actuator(THESIS_FILM, THESIS_LOAD, ONE) if base == "actuator" else Strip(ONE)
    with pytest.raises(ModelError, match=message):
        identify(records(), model, method=method)


def short():
    drive = Drive(np.arange(4.0), np.zeros(4))
    return ActuatorRecord("short", drive, np.zeros(4), NOISE)


def test_layout_names_and_order():
    layout = FitLayout(Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3))
    names = "mu_0 mu_1 mu_2 mu_3 J_0 J_1 J_2 J_3 T_1 T_2 T_3"
    assert layout.names == tuple(names.split())
    values = layout.initial()
    np.testing.assert_allclose(values, [truths(TABLE_3)[n] for n in layout.names])
    np.testing.assert_allclose(layout.values(layout.coordinates(values)), values)
    ordered = layout.by_relaxation_time(values)
    np.testing.assert_allclose(ordered, [truths(SORTED)[n] for n in layout.names])
    np.testing.assert_array_equal(layout.by_relaxation_time(ordered), ordered)
    assert layout.build(values).times == pytest.approx(TABLE_3.times)


def test_differences_look_across_kinks_and_turns():
    def springs(*effects):
        base = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, effects)
        layout = FitLayout(base)
        return layout.differences(layout.coordinates(layout.initial()))[:4]

    plain = springs()
    kinked = springs(typical("sensor clipping"))
    turning = springs(typical("dry friction"), typical("sensor clipping"))
    np.testing.assert_allclose(kinked, 10.0 * plain)
    np.testing.assert_allclose(turning, 3.0 * kinked)


@pytest.mark.parametrize("time", [0.0, 0.4])
def test_a_model_of_fewer_branches_is_padded_with_weak_ones(time):
    layout = FitLayout(Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3))
    fewer = Network.gent((45e3, 60e3), (1e4, 1e4), (time,))
    built = layout.build(layout.values(layout.padded(fewer)))
    assert [s.modulus for s in built.springs] == pytest.approx([45e3, 60e3, 60.0, 0.06])
    assert built.times == pytest.approx([max(time, 1e-6)] * 3)


def test_neo_hookean_springs_have_no_limit_to_fit():
    network = Network(Spring(1e4, kind="neo-hookean"), (Branch(Spring(1e4, 9.0), 1.0),))
    assert FitLayout(Strip(network)).names == ("mu_0", "mu_1", "J_1", "T_1")


def test_a_descent_finds_the_bottom_from_nearby():
    problem = Problem([made(ONE)], FitLayout(Actuator(THESIS_FILM, THESIS_LOAD, ONE)))
    truth = problem.layout.coordinates(problem.layout.initial())
    start = truth + np.array([500.0, -8e3, 0.0, 0.0, 0.4])
    fixed = np.array([False, False, True, True, False])
    fit = descend(problem, start, fixed)
    assert fit.converged
    assert fit.cost <= problem.costs(truth[None, :])[0]
    np.testing.assert_array_equal(fit.x[fixed], truth[fixed])


def test_correlation_time():
    rng = np.random.default_rng(5)
    white = rng.standard_normal(20000)
    assert correlation_time(white) == pytest.approx(1.0, abs=0.15)
    red = np.zeros(20000)
    for k in range(1, red.size):
        red[k] = 0.8 * red[k - 1] + white[k]
    # (1 + a)/(1 - a) of an AR(1) process
    assert correlation_time(red) == pytest.approx(9.0, rel=0.25)
    assert correlation_time(np.zeros(100)) == 1.0


def test_two_samples_of_one_noise_have_one_spectrum():
    rng = np.random.default_rng(5)

    def averaged(n, over):
        walk = np.cumsum(rng.standard_normal(n + over))
        return (walk[over:] - walk[:-over]) / math.sqrt(over)

    for over in (1, 4, 8):
        alike = [has_spectrum_of(averaged(3000, over), averaged(400, over)) for _ in range(100)]
        assert sum(alike) >= 95
    assert not any(has_spectrum_of(averaged(3000, 4), averaged(400, 1)) for _ in range(20))
    assert has_spectrum_of(np.zeros(100), np.ones(100))


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_what_is_flat_has_as_much_power_at_any_frequency(size):
    rng = np.random.default_rng(7)
    noise = size * rng.standard_normal((400, 5000))
    # one in a hundred by chance
    assert 388 <= sum(is_flat(n) for n in noise) <= 400
    t = np.linspace(0.0, 25.0, 5000)
    for structure in (
        np.exp(-t / 3.0),
        np.sin(2.0 * math.pi * 50.0 * t),
        np.convolve(rng.standard_normal(5000), np.ones(20), "same"),
    ):
        part = structure / structure.std() * size
        assert not any(is_flat(n + math.sqrt(0.1) * part) for n in noise[:50])
        assert sum(is_flat(n + math.sqrt(0.003) * part) for n in noise[:50]) > 45
    assert is_flat(np.zeros(100))
    assert is_flat(np.ones(3))


def test_how_much_of_the_power_stands_out_is_told():
    rng = np.random.default_rng(7)
    t = np.linspace(0.0, 25.0, 5000)
    line = math.sqrt(2.0) * np.sin(2.0 * math.pi * 9.0 * t)
    for share in (0.05, 0.2, 0.5):
        noise = rng.standard_normal((50, 5000))
        told = [
            unevenness(math.sqrt(1.0 - share) * n + math.sqrt(share) * line, 1e-3) for n in noise
        ]
        # a tenth of the noise lies below the line: so much of its share is not seen to stand out
        assert np.mean(told) == pytest.approx(0.92 * share, abs=0.012)
    noise = rng.standard_normal((1000, 5000))
    assert sum(unevenness(n, 0.1) > 0.0 for n in noise) == pytest.approx(100, abs=30)
    assert unevenness(np.zeros(100)) == unevenness(np.ones(3)) == 0.0


def test_covariance_is_the_inverse_where_there_is_one():
    normal = np.array([[4.0, 1.0], [1.0, 1e8]])
    np.testing.assert_allclose(covariance(normal, 2.0), 2.0 * np.linalg.inv(normal), rtol=1e-9)
    unseen = covariance(np.diag([1.0, 0.0]), 1.0)
    assert np.isfinite(unseen).all()
    assert unseen[1, 1] > 1e9


# --- several at once


def test_nothing_is_left_running_when_one_of_several_raises():
    done = []

    def work(job):
        if job == 0:
            raise ModelError("ended")
        time.sleep(0.05)  # long enough for the error to come first
        done.append(job)

    with pytest.raises(ModelError, match="ended"):
        parallel_map(work, range(20), 2)
    finished = list(done)
    time.sleep(0.2)  # time in which nothing more may end; a slow machine cannot make it fail
    assert done == finished
    assert len(done) < 19
    assert parallel_map(lambda job: 2 * job, range(5), 2) == [0, 2, 4, 6, 8]


def test_work_that_asks_for_the_same_threads_does_not_wait_for_itself():
    def inner(job):
        return parallel_map(lambda k: 10 * job + k, range(3), 2)

    done = []
    asked = Thread(target=lambda: done.append(parallel_map(inner, range(4), 2)), daemon=True)
    asked.start()
    asked.join(20.0)
    assert done == [[[10 * job + k for k in range(3)] for job in range(4)]]


def test_who_is_one_of_several_at_work_does_its_own():
    """To hand work over takes as long as some of it: only who is alone asks the others for help."""
    meet, left = Barrier(2, timeout=20.0), Event()

    def inner(_):
        return current_thread().name

    def abreast(_):
        meet.wait()  # both are at work
        names = parallel_map(inner, range(4), 2)
        meet.wait()
        return {current_thread().name}, set(names)

    for mine, names in parallel_map(abreast, range(2), 2, "fit"):
        assert names == mine

    def alone(job):
        if job == 0:
            return left.set()
        left.wait(20.0)
        for _ in range(200):  # the other has said that it leaves, and does so at once
            names = set(parallel_map(inner, range(4), 2))
            if not any(n.startswith("fit") for n in names):
                return names
            time.sleep(0.01)  # until the other has left, 200 times at most
        return set()

    _, helped = parallel_map(alone, range(2), 2, "fit")
    assert helped
    assert all(n.startswith("simulation") for n in helped)


def test_records_of_any_length_are_shared_out_evenly():
    plain = Actuator(THESIS_FILM, THESIS_LOAD, ONE)
    short = made(ONE)
    drive = short.drive
    long = replace(
        short,
        drive=Drive(np.arange(3 * drive.time.size) * 0.01, np.tile(drive.voltage, 3)),
        displacement=np.tile(short.displacement, 3),
    )
    problem = Problem([short, long], FitLayout(plain), 2, kernel.QUICK)
    lengths = [r.drive.time.size for r in problem.records]
    for members, packed in ((1, False), (2, False), (3, False), (8, False), (10, True)):
        shares = problem._shared_out(np.zeros(members, dtype=bool), packed)
        jobs = [job for share in shares for job in share]
        films = sorted((m, i) for some, i in jobs for m in some)
        assert films == [(m, i) for m in range(members) for i in range(2)]
        assert max(len(some) for some, _ in jobs) == (4 if packed else 1)
        loads = [sum(lengths[i] for _, i in share) for share in shares]
        assert max(loads) - min(loads) <= max(lengths)
    # and whoever simulates them, they say the same
    several = np.tile(problem.layout.initial(), (3, 1)) * np.array([[1.0], [1.1], [0.9]])
    one_by_one = Problem([short, long], FitLayout(plain), 1, kernel.QUICK).predict(several)[0]
    np.testing.assert_array_equal(problem.predict(several)[0], one_by_one)


def test_a_film_is_simulated_once_however_it_is_read():
    record = replace(made(ONE), lag=2e-3, lead_in=50, means_of=2)
    sensed = (*effect("sensor curvature", quadratic=3.0), *effect("sensor lag", time_constant=0.02))
    model = Actuator(THESIS_FILM, THESIS_LOAD, ONE, effects=sensed)
    problem = Problem([record], FitLayout(model), 1, kernel.QUICK)
    layout = problem.layout
    values = np.tile(layout.initial(), (6, 1))
    values[1, layout.names.index("sensor curvature: quadratic")] = -4.0
    values[2, layout.names.index("sensor lag: time_constant")] = 0.05
    values[3, layout.column("mu")[1]] *= 1.02
    values[4] = values[3]
    values[4, layout.names.index("sensor lag: time_constant")] = 0.0
    told = []
    problem.on_simulations = lambda *work: told.append(work)
    several, status = problem.predict(values)
    assert (status == kernel.OK).all()
    assert problem.simulations == told[0][0] == 2
    for row, reading in zip(values, several, strict=True):
        np.testing.assert_array_equal(problem.predict(row[None])[0][0], reading)
    assert len({reading.tobytes() for reading in several}) == 5
    # what moves the film is simulated for each
    problem.simulations = 0
    problem.predict(values[:3] * np.linspace(1.0, 1.1, 3)[:, None])
    assert problem.simulations == 3


def test_work_is_counted_in_steps_and_in_populations():
    record, plain = made(ONE), Actuator(THESIS_FILM, THESIS_LOAD, ONE)
    told = []

    def work(model, fidelity=kernel.QUICK, members=1):
        problem = Problem([record], FitLayout(model), 1, fidelity, lambda *work: told.append(work))
        problem.predict(np.tile(FitLayout(model).initial(), (members, 1)))
        return told[-1]

    samples = record.drive.time.size
    one, four, five = (work(plain, members=m) for m in (1, 4, 5))
    assert (one[0], four[0], five[0]) == (1, 4, 5)
    # films go four at a time
    assert four[1] == one[1]
    steps = five[1] - four[1]
    assert steps >= samples - 1
    # a population takes something besides its steps
    assert one[1] - steps == pytest.approx(1.5e4)
    # careful steps are shorter, and an effect that moves the film takes a part of each
    assert work(plain, kernel.CAREFUL)[1] > one[1] + samples
    dragged = replace(plain, effects=effect("linear drag", drag=300.0))
    assert work(dragged)[1] - one[1] == pytest.approx(0.8 * steps, rel=0.2)
    # what asks for short steps takes as long: bristles, and a drag that grows fast
    dry = (("friction", 50.0), ("presliding", 1e-4), ("damping", 1e-3))
    assert work(replace(plain, effects=(("dry friction", dry),)))[1] > work(dragged)[1] + samples
    growing = effect("power-law drag", drag=1e4, exponent=2.0)
    assert work(replace(plain, effects=growing))[1] > work(dragged)[1] + samples
