"""Strain energies, kinematics and network stress against definitions, series and closed forms."""

import json
import math
import os
import subprocess
import sys
from decimal import Decimal, getcontext

import numpy as np
import pytest

from dearig.model import springs
from dearig.model.errors import ModelError
from dearig.model.film.material import Branch, Network, Spring
from dearig.model.film.network import network_stress, nominal_pull, nominal_pull_slope
from dearig.model.film.specimen import KINEMATICS
from dearig.model.kinematics import (
    directions,
    electric,
    electric_slope,
    pull_slope,
    strain_and_pull,
    thinning,
)
from dearig.model.springs import SPRING_LAWS, SPRINGS, arruda_boyce
from tests.tools.model_oracle import (
    invariant,
    invariant_slope,
    maxwell_stress,
    share,
    spring_stress,
)

NEO_HOOKEAN, GENT, ARRUDA_BOYCE = range(3)
MU = 45.8e3
CASES = [
    (Spring(MU, kind="neo-hookean"), 0.3),
    (Spring(MU, kind="neo-hookean"), 30.0),
    (Spring(MU, 9.77e3), 0.15),
    (Spring(MU, 2.0), 0.5),
    (Spring(MU, 2.0), 1.98),
    (Spring(MU, 25.0, "arruda-boyce"), 0.15),
    (Spring(MU, 3.0, "arruda-boyce"), 4.0),
    (Spring(MU, 1.5, "arruda-boyce"), 1.45),
    (Spring(MU, kind="yeoh", shape=(-0.02, 3e-4)), 20.0),
    (Spring(MU, kind="mooney-rivlin", shape=(0.3,)), 20.0),
    (Spring(MU, kind="ogden", shape=(1.3,)), 20.0),
    (Spring(MU, kind="ogden", shape=(1e-5,)), 4.0),
    (Spring(MU, kind="ogden-two-terms", shape=(1.3, -3.0, 0.2)), 20.0),
    (Spring(MU, 50.0, "extended-tube", (0.3, 0.2)), 20.0),
    (Spring(MU, 50.0, "extended-tube", (0.3, 0.0)), 49.0),
]

# W/mu of the principal stretches as the papers print it, by the law and its parameters
PUBLISHED = {
    "neo-hookean": lambda lam: 0.5 * first(lam),
    "gent": lambda lam, j: -0.5 * j * math.log(1.0 - first(lam) / j),
    "yeoh": lambda lam, c2, c3: 0.5 * (first(lam) + c2 * first(lam) ** 2 + c3 * first(lam) ** 3),
    "mooney-rivlin": lambda lam, s: 0.5 * ((1.0 - s) * first(lam) + s * powers(lam, -2.0)),
    "ogden": lambda lam, a: 2.0 / a**2 * powers(lam, a),
    "ogden-two-terms": lambda lam, a, b, s: (
        (1.0 - s) * 2.0 / a**2 * powers(lam, a) + s * 2.0 / b**2 * powers(lam, b)
    ),
    # Kaliske and Heinrich (1999), with delta^2 = 1/j
    "extended-tube": lambda lam, j, s, b: (
        0.5 * (1.0 - s) / (1.0 - 2.0 / j)
        * ((1.0 - 1.0 / j) * first(lam) / (1.0 - first(lam) / j) + math.log(1.0 - first(lam) / j))
        + 2.0 * s / b**2 * powers(lam, -b)
    ),
}  # fmt: skip


def powers(lam, exponent):
    return sum(x**exponent - 1.0 for x in lam)


def first(lam):
    """Return I1 - 3."""
    return powers(lam, 2.0)


def code(spring):
    return SPRINGS.index(spring.kind)


def shape(spring):
    """Return the shape as the kernels have it."""
    return (spring.limit, *spring.shape, 0.0, 0.0, 0.0)[:4]


def principal(name, e):
    """Return the principal stretches of a film held so."""
    second = {"constrained-width": 1.0, "uniaxial": e**-0.5, "equibiaxial": e}[name]
    return e, second, 1.0 / (e * second)


def energy(spring, stretches):
    """Return the energy in J/m^3 by the compiled functions."""
    i1 = sum(x * x for x in stretches)
    parts = sum(springs.principal_energy(code(spring), x, shape(spring)) for x in stretches)
    return spring.modulus * (springs.energy(code(spring), i1 - 3.0, shape(spring)) + parts)


def derivative(f, x, h):
    """Fourth order, central."""
    return (8.0 * (f(x + h) - f(x - h)) - f(x + 2.0 * h) + f(x - 2.0 * h)) / (12.0 * h)


def test_codes_are_positions():
    assert SPRINGS[:3] == ("neo-hookean", "gent", "arruda-boyce")
    assert KINEMATICS == ("constrained-width", "uniaxial", "equibiaxial")


def test_every_law_is_tried():
    assert {spring.kind for spring, _ in CASES} == set(SPRING_LAWS)


@pytest.mark.parametrize(("spring", "strain"), CASES)
def test_slopes_are_derivatives_of_the_energies(spring, strain):
    kind, of = code(spring), shape(spring)
    h = 1e-3 * min(strain, springs.locking_strain(kind, of) - strain)
    slope = derivative(lambda s: springs.energy(kind, s, of), strain, h)
    assert springs.slope(kind, strain, of) == pytest.approx(slope, rel=1e-8, abs=1e-12)
    curvature = derivative(lambda s: springs.slope(kind, s, of), strain, h)
    assert springs.curvature(kind, strain, of) == pytest.approx(curvature, rel=1e-7, abs=1e-5)
    for lam in (0.4, 1.0, 1.7, 4.0):
        rise = derivative(lambda x: springs.principal_energy(kind, x, of), lam, 1e-3)
        pull = springs.principal_pull(kind, lam, of)
        assert pull == pytest.approx(lam * rise, rel=1e-6, abs=1e-9)
        bend = derivative(lambda x: springs.principal_pull(kind, x, of), lam, 1e-3)
        found = springs.principal_pull_slope(kind, lam, of)
        assert found == pytest.approx(bend, rel=1e-7, abs=1e-12)


@pytest.mark.parametrize("spring", [spring for spring, _ in CASES])
def test_a_spring_has_its_modulus_at_small_strain_and_no_stress_at_rest(spring):
    assert energy(spring, (1.0, 1.0, 1.0)) == pytest.approx(0.0, abs=1e-9)
    for held, times in enumerate((4.0, 3.0, 6.0)):
        locking = springs.locking_strain(code(spring), shape(spring))
        assert nominal_pull(held, code(spring), shape(spring), locking, 1.0) == 0.0
        slope = nominal_pull_slope(held, code(spring), shape(spring), locking, 1.0)
        if spring.kind == "arruda-boyce":  # a chain of few links is stiffer than its mu
            assert slope > times
        else:
            assert slope == pytest.approx(times, rel=1e-9)


@pytest.mark.parametrize(
    "spring",
    [s for s, _ in CASES if s.kind in PUBLISHED and (not s.shape or abs(s.shape[-1]) > 1e-4)],
)
@pytest.mark.parametrize("held", range(3))
def test_the_stress_is_the_derivative_of_the_published_energy(spring, held):
    name = KINEMATICS[held]
    numbers = [value for _, value in spring.values]

    def published(e):
        return PUBLISHED[spring.kind](principal(name, e), *numbers)

    locking = springs.locking_strain(code(spring), shape(spring))
    for e in (0.8, 1.1, 1.45):
        expected = share(name) * derivative(published, e, 1e-3)
        found = nominal_pull(held, code(spring), shape(spring), locking, e)
        if math.isfinite(found):
            assert found == pytest.approx(expected, rel=1e-7)
            assert energy(spring, principal(name, e)) == pytest.approx(MU * published(e), rel=1e-9)


@pytest.mark.parametrize("kind", SPRING_LAWS)
def test_a_law_at_its_neutral_values_is_neo_hookean(kind):
    law = SPRING_LAWS[kind]
    limited = Spring.of(kind, MU, (1e9, *law.neutral[1:]) if law.has_limit else law.neutral)
    for held in range(3):
        for e in (0.7, 1.3, 3.0):
            expected = nominal_pull(held, NEO_HOOKEAN, (math.inf, 0.0, 0.0, 0.0), math.inf, e)
            locking = springs.locking_strain(code(limited), shape(limited))
            found = nominal_pull(held, code(limited), shape(limited), locking, e)
            assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("kind", SPRING_LAWS)
def test_starts_are_springs_that_fits_may_end_at(kind):
    law = SPRING_LAWS[kind]
    assert law.source
    for values in law.starts(9.0):
        spring = Spring.of(kind, MU, values)
        for parameter, value in spring.values:
            low, high = parameter.fit_bounds
            assert low <= value <= high


@pytest.mark.parametrize(
    ("kind", "numbers", "words"),
    [
        ("ogden", (30.0,), "exponent = 30.0 must be from -20 to 20"),
        ("ogden", (math.nan,), "exponent = nan must be"),
        ("extended-tube", (1.5, 0.1, 0.5), "limit = 1.5 must be above 2"),
        ("gent", (0.0,), "limit = 0.0 must be above 0"),
        ("yeoh", (0.1,), r"must be 2 numbers \(quadratic, cubic\)"),
    ],
)
def test_numbers_that_a_law_does_not_have_are_refused(kind, numbers, words):
    with pytest.raises(ModelError, match=words):
        Spring.of(kind, MU, numbers)


def test_gent_in_closed_form():
    gent = (2.0, 0.0, 0.0, 0.0)
    assert springs.energy(GENT, 1.0, gent) == pytest.approx(math.log(2.0), rel=1e-14)
    assert springs.slope(GENT, 1.0, gent) == 1.0
    assert springs.locking_strain(GENT, gent) == 2.0


def test_a_spring_that_is_given_no_limit_becomes_neo_hookean():
    assert Spring(MU, math.inf, "gent").kind == "neo-hookean"
    assert Spring(MU, math.inf, "arruda-boyce").kind == "neo-hookean"


@pytest.mark.parametrize(
    "beta",
    ["1e-6", "1e-4", "0.01", "0.0499", "0.0501", "0.3", "1", "4", "10", "19.9", "20.1", "1e3"],
)
def test_inverse_langevin(beta):
    getcontext().prec = 60
    b = Decimal(beta)
    down = (-2 * b).exp()
    x = (1 + down) / (1 - down) - 1 / b
    found = arruda_boyce.inverse_langevin(float(x))
    # x itself is rounded: near 1 that alone moves beta by a part of 1e-16 beta
    assert found == pytest.approx(float(b), rel=max(1e-12, 1e-15 * float(b)))


@pytest.mark.parametrize("links", [4.0, 25.0, 400.0])
def test_arruda_boyce_at_small_strain_is_its_series(links):
    # the five-term series of Arruda and Boyce (1993), in their mu = n k theta
    weights = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)
    i1 = 3.05
    series = sum(
        (i + 1) * w * i1**i / links**i for i, w in enumerate(weights)
    )  # sum of i C_i/n^(i-1) I1^(i-1)
    left_out = 10.0 * (3.05 / links / 3.0) ** 5
    assert springs.slope(ARRUDA_BOYCE, i1 - 3.0, (links, 0.0, 0.0, 0.0)) == pytest.approx(
        series, rel=left_out
    )


@pytest.mark.parametrize("links", [2.0, 30.0])
def test_arruda_boyce_energy_in_closed_form(links):
    strain = 1.0

    def energy(i1):
        chain, root = math.sqrt(i1 / 3.0), math.sqrt(links)
        beta = arruda_boyce.inverse_langevin(chain / root)
        return MU * root * (beta * chain - root * math.log(math.sinh(beta) / beta))

    expected = energy(3.0 + strain) - energy(3.0)
    assert MU * springs.energy(ARRUDA_BOYCE, strain, (links, 0.0, 0.0, 0.0)) == pytest.approx(
        expected, rel=1e-10
    )


@pytest.mark.parametrize("held", range(3))
@pytest.mark.parametrize("e", [0.6, 0.999, 1.0, 1.19, 2.5])
def test_kinematics_against_the_invariant(held, e):
    name = KINEMATICS[held]
    strain, pull = strain_and_pull(held, e * e, 1.0 / (e * e))
    assert strain == pytest.approx(invariant(name, e) - 3.0, abs=1e-13)
    slope = derivative(lambda x: invariant(name, x), e, 1e-3)
    assert invariant_slope(name, e) == pytest.approx(slope, abs=1e-7)
    assert pull == pytest.approx(e * share(name) * slope / 2.0, abs=1e-7)

    def nominal(x):
        return strain_and_pull(held, x * x, 1.0 / (x * x))[1] / x

    assert pull_slope(held, e) == pytest.approx(derivative(nominal, e, 1e-3), rel=1e-8)
    assert 1.0 / directions(held) == share(name)


@pytest.mark.parametrize("held", range(3))
@pytest.mark.parametrize("lam", [0.8, 1.2, 3.0])
def test_the_electrical_term_is_half_the_change_of_area_squared(held, lam):
    name = KINEMATICS[held]
    second = {"constrained-width": 0.0, "uniaxial": -0.5, "equibiaxial": 1.0}[name]

    def area2(x):
        return (x * x**second) ** 2

    expected = 0.5 * derivative(area2, lam, 1e-3) * share(name)
    assert electric(held, lam) == pytest.approx(expected, rel=1e-9)
    assert electric(held, lam) == pytest.approx(maxwell_stress(name, lam), rel=1e-14)
    slope = derivative(lambda x: electric(held, x), lam, 1e-3)
    assert electric_slope(held, lam) == pytest.approx(slope, abs=1e-8)
    # incompressible: the film gets thinner by what its area gains
    assert thinning(held, np.array([lam]))[0] == pytest.approx(math.sqrt(area2(lam)))


@pytest.mark.parametrize("held", range(3))
@pytest.mark.parametrize("lam", [0.9, 1.2, 1.6])
def test_network_stress_is_the_derivative_of_the_energy(held, lam):
    name = KINEMATICS[held]
    network = Network(
        Spring(MU, 9.0),
        (
            Branch(Spring(3e4, kind="neo-hookean"), 0.4),
            Branch(Spring(2e4, 6.0, "arruda-boyce"), 0.3),
            Branch(Spring(1e4, 50.0), 8.0),
        ),
    )
    xi = np.array([1.1, 0.95, 1.2])

    def energy(x):
        stretches = (x, *(x / xi))
        return sum(
            s.modulus * springs.energy(code(s), invariant(name, e) - 3.0, shape(s))
            for s, e in zip(network.springs, stretches, strict=True)
        )

    stress = network_stress(network.coefficients(held), lam, xi)
    assert stress == pytest.approx(share(name) * derivative(energy, lam, 1e-3), rel=1e-7, abs=1e-3)
    parts = [spring_stress(network.equilibrium, name, lam)]
    parts += [
        spring_stress(b.spring, name, lam / x) / x
        for b, x in zip(network.branches, xi, strict=True)
    ]
    assert stress == pytest.approx(sum(parts), rel=1e-10)


@pytest.mark.parametrize("held", range(3))
@pytest.mark.parametrize("spring", [spring for spring, _ in CASES])
def test_stiffness_of_a_spring(held, spring):
    kind, of = code(spring), shape(spring)
    locking = springs.locking_strain(kind, of)
    for e in (0.8, 1.0, 1.3):
        found = nominal_pull_slope(held, kind, of, locking, e)
        if math.isfinite(found):
            slope = derivative(lambda x: nominal_pull(held, kind, of, locking, x), e, 1e-4)
            assert found == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("held", range(3))
def test_beyond_locking_a_spring_is_infinitely_stiff(held):
    assert nominal_pull(held, GENT, (0.5, 0.0, 0.0, 0.0), 0.5, 3.0) == math.inf
    assert nominal_pull_slope(held, GENT, (0.5, 0.0, 0.0, 0.0), 0.5, 3.0) == math.inf


def test_a_law_is_added_by_its_file_and_one_line(tmp_path):
    ran = subprocess.run(
        [sys.executable, "-m", "tests.model.one_more_spring", str(tmp_path)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout) == {
        "options": True, "read": True, "shown": "Cubic", "kernel": [1.5, 1.0, 0.25, 0.0],
        "locking": True, "principal": False,
    }  # fmt: skip
