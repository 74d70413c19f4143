"""Strain energies, kinematics and network stress against definitions, series and closed forms."""

import math
from decimal import Decimal, getcontext

import numpy as np
import pytest

from dearig.model import springs
from dearig.model.kinematics import (
    directions,
    electric,
    electric_slope,
    pull_slope,
    strain_and_pull,
    thinning,
)
from dearig.model.material import Branch, Network, Spring
from dearig.model.network import network_stress, nominal_pull, nominal_pull_slope
from dearig.model.specimen import KINEMATICS
from dearig.model.springs import SPRINGS, arruda_boyce
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
    (NEO_HOOKEAN, math.inf, 0.3),
    (NEO_HOOKEAN, math.inf, 30.0),
    (GENT, 9.77e3, 0.15),
    (GENT, 2.0, 0.5),
    (GENT, 2.0, 1.98),
    (ARRUDA_BOYCE, 25.0, 0.15),
    (ARRUDA_BOYCE, 3.0, 4.0),
    (ARRUDA_BOYCE, 1.5, 1.45),
]


def derivative(f, x, h):
    """Fourth order, central."""
    return (8.0 * (f(x + h) - f(x - h)) - f(x + 2.0 * h) + f(x - 2.0 * h)) / (12.0 * h)


def test_codes_are_positions():
    assert SPRINGS == ("neo-hookean", "gent", "arruda-boyce")
    assert KINEMATICS == ("constrained-width", "uniaxial", "equibiaxial")


@pytest.mark.parametrize(("kind", "limit", "strain"), CASES)
def test_slope_and_curvature_are_derivatives_of_the_energy(kind, limit, strain):
    h = 1e-3 * min(strain, springs.locking_strain(kind, limit) - strain)
    slope = derivative(lambda s: springs.energy(kind, s, MU, limit), strain, h)
    assert springs.slope(kind, strain, MU, limit) == pytest.approx(slope, rel=1e-8)
    curvature = derivative(lambda s: springs.slope(kind, s, MU, limit), strain, h)
    assert springs.curvature(kind, strain, MU, limit) == pytest.approx(curvature, rel=1e-7, abs=1.0)


@pytest.mark.parametrize(("kind", "limit"), [(k, j) for k, j, _ in CASES])
def test_energy_is_zero_at_rest(kind, limit):
    assert springs.energy(kind, 0.0, MU, limit) == pytest.approx(0.0, abs=1e-9)


def test_gent_in_closed_form():
    assert springs.energy(GENT, 1.0, MU, 2.0) == pytest.approx(MU * math.log(2.0), rel=1e-14)
    assert springs.slope(GENT, 1.0, MU, 2.0) == MU
    assert springs.locking_strain(GENT, 2.0) == 2.0


@pytest.mark.parametrize("strain", [1e-3, 0.2, 5.0])
def test_gent_without_limit_is_neo_hookean(strain):
    for of in (springs.energy, springs.slope):
        expected = of(NEO_HOOKEAN, strain, MU, math.inf)
        assert of(GENT, strain, MU, 1e12) == pytest.approx(expected, rel=1e-10)


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
    assert springs.slope(ARRUDA_BOYCE, i1 - 3.0, 1.0, links) == pytest.approx(series, rel=left_out)


@pytest.mark.parametrize("links", [2.0, 30.0])
def test_arruda_boyce_energy_in_closed_form(links):
    strain = 1.0

    def energy(i1):
        chain, root = math.sqrt(i1 / 3.0), math.sqrt(links)
        beta = arruda_boyce.inverse_langevin(chain / root)
        return MU * root * (beta * chain - root * math.log(math.sinh(beta) / beta))

    expected = energy(3.0 + strain) - energy(3.0)
    assert springs.energy(ARRUDA_BOYCE, strain, MU, links) == pytest.approx(expected, rel=1e-10)


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
            springs.energy(SPRINGS.index(s.kind), invariant(name, e) - 3.0, s.modulus, s.limit)
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
@pytest.mark.parametrize(("kind", "limit"), [(NEO_HOOKEAN, math.inf), (GENT, 4.0), (2, 5.0)])
def test_stiffness_of_a_spring(held, kind, limit):
    locking = springs.locking_strain(kind, limit)
    for e in (0.8, 1.0, 1.3):
        slope = derivative(lambda x: nominal_pull(held, kind, limit, locking, x), e, 1e-3)
        found = nominal_pull_slope(held, kind, limit, locking, e)
        assert found == pytest.approx(slope, rel=1e-7)


@pytest.mark.parametrize("held", range(3))
def test_beyond_locking_a_spring_is_infinitely_stiff(held):
    assert nominal_pull(held, GENT, 0.5, 0.5, 3.0) == math.inf
    assert nominal_pull_slope(held, GENT, 0.5, 0.5, 3.0) == math.inf
