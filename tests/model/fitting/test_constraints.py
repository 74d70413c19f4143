"""What is stated of parameters before a fit: against SciPy, a reduced problem, and the truth."""

import functools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares

from dearig.model.errors import ModelError
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.fitting import Constraint, GivenValue, identify, with_budget
from dearig.model.fitting.estimates import AT_STATED_BOUND
from dearig.model.fitting.identify import _farthest
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.problem import Problem
from dearig.model.fitting.rejection import ABOVE, DIAGNOSE, with_intervals
from dearig.model.readings.records import FilmRecord
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from tests.tools.engine import NOISE, ONE, PLAIN, record_of, thesis_drive

TWO = Network.gent((45e3, 60e3, 40e3), (1e4, 1e4, 1e4), (0.15, 1.2))
#: Standard errors by which one descent, and two, may miss: they end a tenth of chi-square above.
ENDED, ENDED_BOTH = 0.32, 0.45
LIMITS = (Constraint("J_0", fixed=1e4), Constraint("J_1", fixed=1e4))


@functools.cache
def record(seed=0):
    return record_of(PLAIN, thesis_drive(rate=50.0), seed=seed)


def fit(*constraints, records=None, base=PLAIN, **options):
    return identify(records or [record()], base, constraints=(*LIMITS, *constraints), **options)


@functools.cache
def free():
    return fit()


def values(found):
    return {e.name: e for e in found.estimates}


def oracle(constraints):
    """Optimum and standard errors by SciPy, with a residual more for each prior."""
    layout = FitLayout(PLAIN, constraints=LIMITS)
    problem = Problem([record()], layout, workers=1)
    names = [n for n, f in zip(layout.names, layout.fixed, strict=True) if not f]
    stated = {c.name: c for c in constraints}
    varied = [n for n in names if n not in stated or stated[n].fixed is None]
    start = dict(zip(layout.names, layout.initial(), strict=True))
    start |= {n: c.fixed for n, c in stated.items() if c.fixed is not None}

    def residuals(scaled):
        at = start | {n: start[n] * v for n, v in zip(varied, scaled, strict=True)}
        # offsets are eliminated by both alike
        row = np.array([[at[n] for n in layout.names]])
        left = (problem.predict(row)[0][0] - problem.measured) / problem.sigma
        rows = [(at[n] - c.mean) / c.sd for n, c in stated.items() if c.mean is not None]
        return np.concatenate([left, rows])

    found = least_squares(residuals, np.ones(len(varied)), diff_step=1e-5, x_scale=1e-2)
    scale = np.array([start[n] for n in varied])
    covariance = np.linalg.inv(found.jac.T @ found.jac) * np.outer(scale, scale)
    errors = dict(zip(varied, np.sqrt(np.diag(covariance)), strict=True))
    return dict(zip(varied, found.x * scale, strict=True)), errors, 2.0 * found.cost


def beside(name, far, sd=None):
    """A prior, or a fixed value, so many standard errors from what the data alone say."""
    e = values(free())[name]
    error = (e.high - e.low) / (2.0 * 1.96)
    if sd is None:
        return Constraint(name, fixed=e.value + far * error)
    return Constraint(name, mean=e.value + far * error, sd=sd * error)


CASES = [
    [("mu_0", 2.0, 1.0)],
    [("T_1", 1.5, 0.5), ("mu_1", -1.0, 2.0)],
    [("mu_1", 1.0)],
    [("T_1", -2.0), ("mu_0", 1.0, 0.7)],
]


@pytest.mark.parametrize("case", CASES, ids=["prior", "two priors", "fixed", "fixed and prior"])
def test_fit_is_that_of_least_squares_with_a_row_for_each_prior(case):
    stated = [beside(*one) for one in case]
    found = fit(*stated)
    expected, errors, chi2 = oracle(stated)
    known = values(found)
    # the intervals are widened by what is left, as SciPy's are not
    wider = math.sqrt(max(found.cost, 1.0) * max(found.correlation, 1.0))
    for name, value in expected.items():
        assert known[name].value == pytest.approx(value, abs=ENDED * errors[name]), name
        half = 0.5 * (known[name].high - known[name].low)
        assert half == pytest.approx(1.96 * errors[name] * wider, rel=0.1), name
    assert found.cost * record().time.size + found.prior_chi2 == pytest.approx(chi2, abs=0.1)


@pytest.mark.parametrize("name", ["mu_0", "mu_1", "T_1"])
def test_wide_prior_is_no_prior(name):
    alone = values(free())
    wide = values(fit(beside(name, 1e3, 1e5)))
    for other in ("mu_0", "mu_1", "T_1"):
        half = 0.5 * (alone[other].high - alone[other].low)
        assert wide[other].value == pytest.approx(alone[other].value, abs=ENDED_BOTH * half / 1.96)
        assert wide[other].high - wide[other].low == pytest.approx(2.0 * half, rel=0.05)


@pytest.mark.parametrize(("name", "far"), [("mu_0", 2.0), ("mu_1", -1.0), ("T_1", 1.0)])
def test_tight_prior_is_a_fixed_value(name, far):
    fixed = values(fit(beside(name, far)))
    tight = values(fit(beside(name, far, 1e-3)))
    assert fixed[name].value == pytest.approx(tight[name].value, rel=1e-4)
    for other in {"mu_0", "mu_1", "T_1"} - {name}:
        half = 0.5 * (fixed[other].high - fixed[other].low)
        assert tight[other].value == pytest.approx(fixed[other].value, abs=ENDED_BOTH * half / 1.96)
        assert tight[other].high - tight[other].low == pytest.approx(2.0 * half, rel=0.05)


def test_fixed_parameter_has_no_interval_no_share_and_no_covariance():
    found = fit(Constraint("mu_1", fixed=60e3))
    one = values(found)["mu_1"]
    assert (one.value, one.low, one.high) == (60e3, 60e3, 60e3)
    assert (one.is_fixed, one.free, one.determined, one.note) == (True, False, True, "fixed")
    assert found.covariance_names == ("mu_0", "T_1")
    assert found.covariance.shape == (2, 2)
    assert found.model.network.springs[1].modulus == 60e3
    assert not found.held_limits


def test_every_parameter_may_be_fixed():
    stated = [Constraint(n, fixed=v) for n, v in (("mu_0", 45e3), ("mu_1", 60e3), ("T_1", 0.4))]
    found = fit(*stated)
    assert found.covariance_names == ()
    assert found.model.network == ONE
    assert found.cost == pytest.approx(1.0, abs=0.1)


def test_interval_ends_at_a_bound_and_says_so():
    e = values(free())["mu_1"]
    bound = 0.5 * (e.value + e.high)
    one = values(fit(Constraint("mu_1", high=bound)))["mu_1"]
    assert one.value == pytest.approx(e.value, rel=1e-4)
    assert one.high == bound
    assert one.low == pytest.approx(e.low, rel=1e-3)
    assert "stated bound" in one.note
    assert one.determined
    assert not one.at_bound


def test_value_at_a_bound_is_marked_and_warned_of():
    e = values(free())["T_1"]
    found = fit(Constraint("T_1", low=1.01 * e.value, high=2.0 * e.value))
    one = values(found)["T_1"]
    assert one.value == pytest.approx(1.01 * e.value)
    assert one.at_bound
    assert one.note == AT_STATED_BOUND
    assert f"T_1 is {AT_STATED_BOUND}: the data may ask for a value beyond it" in found.warnings


@pytest.mark.deep
def test_wrong_fixed_value_is_rejected_by_the_noise():
    leads = [replace_lead(record_of(Actuator(THESIS_FILM, THESIS_LOAD, TWO), seed=s)) for s in (1,)]
    base = Actuator(THESIS_FILM, THESIS_LOAD, TWO)
    right = identify(leads, base, intervals=False, constraints=[Constraint("T_1", fixed=0.15)])
    wrong = identify(leads, base, intervals=False, constraints=[Constraint("mu_0", fixed=49e3)])
    assert not any("rejected" in w for w in right.warnings)
    assert any("rejected" in w for w in wrong.warnings)


def replace_lead(made):
    """The record with two seconds at rest before the voltage."""
    from dataclasses import replace

    rest = 200
    step = made.time[1] - made.time[0]
    time = np.arange(made.time.size + rest) * step
    voltage = np.concatenate([np.zeros(rest), made.drive.voltage])
    noise = NOISE * np.random.default_rng(9).standard_normal(rest)
    moved = np.concatenate([noise, made.displacement])
    drive = replace(made.drive, time=time, voltage=voltage)
    return replace(made, drive=drive, displacement=moved, lead_in=rest)


def test_prior_that_the_data_contradict_is_said():
    far = fit(beside("mu_0", 8.0, 1.0), intervals=False)
    near = fit(beside("mu_0", 1.0, 1.0), intervals=False)
    assert far.prior_p < 1e-6
    assert any("the priors contradict the data" in w and "mu_0" in w for w in far.warnings)
    assert near.prior_p > 0.05
    assert not any("priors" in w for w in near.warnings)
    assert free().prior_p is None


@pytest.mark.deep
def test_p_of_priors_is_uniform_where_they_are_true():
    rng = np.random.default_rng(5)
    found = []
    for seed in range(30):
        # as well known as by the data, and ten times as well
        stated = [
            Constraint(name, mean=truth + sd * rng.standard_normal(), sd=sd)
            for name, truth, sd in (("mu_0", 45e3, 2.0), ("T_1", 0.4, 5e-5))
        ]
        one = fit(*stated, records=[record(100 + seed)], intervals=False)
        found.append(one.prior_p)
    # Kolmogorov: 30 uniform numbers are within 0.29 of their line with 99 %
    line = (np.arange(30) + 0.5) / 30.0
    assert np.max(np.abs(np.sort(found) - line)) < 0.29


def test_prior_settles_what_the_data_leave_open():
    short = record(3)
    alone = identify([short], Actuator(THESIS_FILM, THESIS_LOAD, TWO))
    stated = [
        Constraint("T_1", mean=0.4, sd=0.01),
        Constraint("T_2", fixed=0.05),
        Constraint("mu_1", mean=60e3, sd=1e3),
    ]
    found = identify([short], Actuator(THESIS_FILM, THESIS_LOAD, TWO), constraints=stated)
    known = values(found)
    assert alone.sums or not values(alone)["T_2"].determined
    assert known["mu_1"].determined
    assert known["mu_1"].low < 60e3 < known["mu_1"].high
    assert known["T_2"].value == 0.05


def test_branch_of_which_something_is_stated_keeps_its_number():
    truth = Actuator(THESIS_FILM, THESIS_LOAD, TWO)
    for stated in ([Constraint("T_1", fixed=1.2)], [Constraint("T_1", low=0.8, high=2.0)]):
        made = record_of(truth, thesis_drive(rate=50.0))
        found = identify([made], truth, intervals=False, constraints=stated)
        assert found.cost == pytest.approx(1.0, abs=0.1)
        assert found.model.network.times[0] == pytest.approx(1.2, rel=0.05)
        assert found.model.network.times[1] == pytest.approx(0.15, rel=0.05)


def test_other_branches_are_sorted_among_themselves():
    three = Network.gent((45e3, 1.0, 1.0, 1.0), (1e4,) * 4, (5.0, 3.0, 1.0))
    layout = FitLayout(
        Actuator(THESIS_FILM, THESIS_LOAD, three), constraints=[Constraint("mu_2", low=0.5)]
    )
    sorted_ = layout.by_relaxation_time(layout.initial())
    assert list(sorted_[layout.column("T")]) == pytest.approx([1.0, 3.0, 5.0])
    assert list(layout.order_by_relaxation_time(layout.initial())[layout.column("T")]) == [
        layout.column("T")[2],
        layout.column("T")[1],
        layout.column("T")[0],
    ]


@pytest.mark.parametrize(
    "stated",
    [
        [Constraint("mu_0", fixed=40e3)],
        [Constraint("T_1", fixed=2.0), Constraint("J_0", fixed=60.0)],
        [Constraint("mu_1", low=20e3, high=29e3)],
    ],
    ids=["mu_0", "T_1 and J_0", "mu_1"],
)
def test_film_driven_by_stretch_is_fitted_with_constraints(stated):
    strip = Strip(Network(Spring(40e3, 60.0), (Branch(Spring(30e3, 80.0), 2.0),)))
    time = np.linspace(0.0, 40.0, 801)
    corners = [0.0, 5.0, 6.0, 12.0, 20.0, 30.0, 31.0, 40.0]
    stretch = np.interp(time, corners, [1.0, 1.5, 1.05, 1.05, 1.9, 1.9, 1.05, 1.05])
    stress = strip.simulate(time, stretch).stress + 20.0 * np.random.default_rng(0).standard_normal(
        time.size
    )
    found = identify([FilmRecord("strip", time, stretch, stress, 20.0)], strip, constraints=stated)
    known = values(found)
    for c in stated:
        if c.fixed is not None:
            assert known[c.name].value == c.fixed
        else:
            assert c.low <= known[c.name].value <= c.high
            assert known[c.name].at_bound
            assert found.cost > 2.0
    if all(c.fixed is not None for c in stated):
        assert found.cost == pytest.approx(1.0, abs=0.15)


def test_algorithm_1_keeps_bounds_and_refuses_priors(monkeypatch):
    import importlib

    search = importlib.import_module("dearig.model.fitting.search")
    quick = search.Algorithm1(generations=3, members=12)
    module = importlib.import_module("dearig.model.fitting.identify")
    monkeypatch.setattr(
        module, "algorithm_1", lambda p, seed, told: search.algorithm_1(p, seed, told, quick)
    )
    stated = [Constraint("mu_0", fixed=45e3), Constraint("T_1", low=0.3, high=0.5)]
    found = values(identify([record()], PLAIN, "de", constraints=stated))
    assert found["mu_0"].value == 45e3
    assert 0.3 <= found["T_1"].value <= 0.5
    with pytest.raises(ModelError, match="takes no prior"):
        identify([record()], PLAIN, "de", constraints=[Constraint("mu_0", mean=45e3, sd=1.0)])


def test_budget_moves_no_fixed_parameter():
    found = fit(Constraint("mu_1", fixed=60e3), intervals=False)
    moved = with_budget([record()], found, [GivenValue("thickness", 0.01)])
    known = values(moved)
    assert known["mu_1"].systematic == 0.0
    assert known["mu_0"].systematic > 100.0


@pytest.mark.parametrize(
    ("numbers", "sentence"),
    [
        ({}, "nothing is stated"),
        ({"fixed": 1.0, "low": 0.0}, "neither bounds nor a prior"),
        ({"fixed": 1.0, "mean": 1.0, "sd": 1.0}, "neither bounds nor a prior"),
        ({"low": 2.0, "high": 1.0}, "not below"),
        ({"mean": 1.0}, "a mean and a standard deviation"),
        ({"sd": 1.0}, "a mean and a standard deviation"),
        ({"mean": 1.0, "sd": 0.0}, "not above 0"),
        ({"mean": 1.0, "sd": -1.0}, "not above 0"),
        ({"mean": 3.0, "sd": 1.0, "high": 2.0}, "outside of its bounds"),
        ({"fixed": math.nan}, "finite"),
        ({"high": math.inf}, "finite"),
    ],
)
def test_contradictions_are_refused(numbers, sentence):
    with pytest.raises(ModelError, match=sentence):
        Constraint("mu_0", **numbers)


@pytest.mark.parametrize("stated", [{"fixed": -1.0}, {"low": -3.0}, {"fixed": 1e9}, {"high": 1e9}])
def test_values_that_no_fit_allows_are_refused(stated):
    with pytest.raises(ModelError, match="outside of what a fit allows"):
        FitLayout(PLAIN, constraints=[Constraint("mu_0", **stated)])


def test_constraints_of_parameters_that_the_model_lacks_have_no_part():
    layout = FitLayout(PLAIN, constraints=[Constraint("T_3", fixed=1.0)])
    assert not layout.fixed.any()
    assert np.array_equal(layout.lower, FitLayout(PLAIN).lower)


def test_far_from_a_prior_is_a_plain_number():
    layout = SimpleNamespace(names=("mu_0",), priors=[0])
    told = [_farthest(layout, np.array([far])) for far in (-1.64, 164.2)]
    assert told == [f"mu_0, by {n} of its standard deviations" for n in ("1.6", "164")]


def test_a_fit_without_intervals_does_not_speak_of_them():
    plain = f"the model is rejected: p < 1e-15{DIAGNOSE}"
    assert with_intervals(plain) == (
        "the model is rejected: p < 1e-15; the intervals hold only if the model were right; "
        "run a diagnosis"
    )
    assert "are a rough guide" in with_intervals(ABOVE)
    assert with_intervals("mu_0 is at its end") == "mu_0 is at its end"
    assert not any("interval" in w for w in fit(beside("mu_0", 8.0, 1.0), intervals=False).warnings)
