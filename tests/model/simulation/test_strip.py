"""The film under an imposed stretch: the compiled kernel against SciPy and closed forms."""

import math

import numpy as np
import pytest
from scipy.integrate import odeint

from dearig.model import kernel
from dearig.model.errors import ModelError
from dearig.model.film.material import Branch, Network, Spring
from dearig.model.simulation.strip import Strip, unit_stresses
from tests.tools.model_oracle import spring_stress

ELASTIC = Spring(50e3, 40.0)


def expected_stress(network, kinematics, time, stretch):
    """Eq. 40 by LSODA, from sample to sample, for one branch after the other."""
    total = np.array([spring_stress(network.equilibrium, kinematics, lam) for lam in stretch])
    for branch in network.branches:
        unit = Spring(1.0, branch.spring.limit, branch.spring.kind)
        xi = [stretch[0]]
        for k in range(time.size - 1):
            t0, dt = time[k], time[k + 1] - time[k]

            def flow(t, y, k=k, t0=t0, dt=dt, unit=unit, branch=branch):
                lam = stretch[k] + (stretch[k + 1] - stretch[k]) * (t - t0) / dt
                e = lam / y[0]
                return [spring_stress(unit, kinematics, e) * e / branch.relaxation_time]

            span = (t0, t0 + dt)
            xi.append(odeint(flow, [xi[-1]], span, tfirst=True, rtol=1e-9, atol=1e-11)[1, 0])
        pulls = [
            spring_stress(branch.spring, kinematics, s / x) / x
            for s, x in zip(stretch, xi, strict=True)
        ]
        total += np.array(pulls)
    return total


@pytest.mark.parametrize("kinematics", ["constrained-width", "uniaxial", "equibiaxial"])
@pytest.mark.parametrize("relaxation_time", [1e-3, 0.05, 0.7, 50.0])
def test_against_scipy(kinematics, relaxation_time):
    rng = np.random.default_rng(3)
    time = np.concatenate([[0.0], np.cumsum(rng.choice([0.002, 0.03, 0.4, 2.0], 25))])
    stretch = 1.3 + 0.25 * np.sin(0.9 * time)
    network = Network(ELASTIC, (Branch(Spring(80e3, 5.0), relaxation_time),))
    found = Strip(network, kinematics).simulate(time, stretch)
    assert found.ok, found.status_text
    expected = expected_stress(network, kinematics, time, stretch)
    assert np.abs(found.stress - expected).max() < 1.0  # Pa of some 50 kPa


def test_mixed_springs_against_scipy():
    time = np.linspace(0.0, 20.0, 41)
    stretch = 1.0 + 0.6 * np.abs(np.sin(0.3 * time))
    network = Network(
        Spring(50e3, 30.0, "arruda-boyce"),
        (Branch(Spring(30e3, kind="neo-hookean"), 0.3), Branch(Spring(20e3, 2.0), 4.0)),
    )
    found = Strip(network).simulate(time, stretch)
    expected = expected_stress(network, "uniaxial", time, stretch)
    assert np.abs(found.stress - expected).max() < 1.0


def test_a_small_step_relaxes_exponentially():
    # linear viscoelasticity: uniaxial tangent modulus 3 mu, flow at 3/T
    step, relaxation_time, mu = 1e-5, 2.0, 80e3
    time = np.concatenate([[0.0, 1e-6], np.linspace(0.1, 5.0, 50)])
    stretch = np.where(time > 0.0, 1.0 + step, 1.0)
    network = Network(Spring(0.0), (Branch(Spring(mu, 1e6), relaxation_time),))
    stress = Strip(network).simulate(time, stretch).stress
    expected = 3.0 * mu * step * np.exp(-3.0 * time[1:] / relaxation_time)
    np.testing.assert_allclose(stress[1:], expected, rtol=1e-4)


def test_a_neo_hookean_branch_relaxes_as_in_closed_form():
    # held in width at one stretch, u = xi/lam follows u' = (u^-2 - u^2)/(T lam), so that
    # (artanh u - arctan u)/2 grows as t/(T lam)
    mu, relaxation_time, lam = 30e3, 4.0, 1.8
    u = np.linspace(1.0 / lam, 0.999, 60)
    elapsed = 0.5 * relaxation_time * lam * np.diff(np.arctanh(u) - np.arctan(u), prepend=0.0)
    elapsed[0] = 1e-9
    time = np.concatenate([[0.0], np.cumsum(elapsed)])
    stretch = np.where(time > 0.0, lam, 1.0)
    network = Network(Spring(0.0), (Branch(Spring(mu, kind="neo-hookean"), relaxation_time),))
    found = Strip(network, "constrained-width").simulate(time, stretch)
    np.testing.assert_allclose(found.stress[1:], mu * (u**-2 - u**2) / lam, rtol=1e-5)


def test_stress_is_linear_in_the_moduli():
    time = np.linspace(0.0, 3.0, 40)
    stretch = 1.0 + 0.2 * time
    network = Network(ELASTIC, (Branch(Spring(80e3, 5.0), 0.1), Branch(Spring(9e3, 7.0), 3.0)))
    parts, status, _ = unit_stresses(network.coefficients(1), time, stretch)
    assert status == kernel.OK
    moduli = [s.modulus for s in network.springs]
    found = Strip(network).simulate(time, stretch)
    np.testing.assert_allclose(moduli @ parts, found.stress, rtol=1e-12)


@pytest.mark.parametrize(
    ("time", "stretch", "status", "reached"),
    [
        ([0.0, 1.0, 2.0], [1.0, 1.5, 9.0], kernel.LOCKED, 2),
        ([0.0, 1.0, 1.0], [1.0, 1.1, 1.2], kernel.BAD_INPUT, 2),
        ([0.0, 1.0, 2.0], [1.0, -1.0, 1.2], kernel.BAD_INPUT, 1),
        ([0.0, 1.0, 2.0], [1.0, math.nan, 1.2], kernel.BAD_INPUT, 1),
    ],
)
def test_how_it_can_end(time, stretch, status, reached):
    network = Network(ELASTIC, (Branch(Spring(80e3, 5.0), 0.1),))
    found = Strip(network).simulate(np.array(time), np.array(stretch))
    assert (found.status, found.reached) == (status, reached)
    assert np.isfinite(found.stress).all()
    assert not found.ok


@pytest.mark.parametrize(
    ("kinematics", "samples", "message"),
    [
        ("radial", 3, "'radial' is not one of constrained-width, uniaxial, equibiaxial"),
        ("uniaxial", 2, r"time \(3,\) and stretch \(2,\) must be rows of one length"),
    ],
)
def test_refusals(kinematics, samples, message):
    with pytest.raises(ModelError, match=message):
        Strip(Network(ELASTIC), kinematics).simulate(np.arange(3.0), np.ones(samples))
