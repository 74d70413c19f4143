"""The linear part of the motion in closed form, against SciPy's matrix exponential."""

import numpy as np
import pytest
from scipy.linalg import expm

from dearig.model.kernel.phi import double_phi, fill_phi
from dearig.model.kernel.propagator import PROPAGATOR, drag_class, fill_propagator


def phi_by_scipy(a):
    """exp and phi_1 .. phi_3 of ``a`` as blocks of one larger exponential."""
    n = len(a)
    larger = np.zeros((4 * n, 4 * n))
    larger[:n, :n] = a
    for j in range(3):
        larger[j * n : (j + 1) * n, (j + 1) * n : (j + 2) * n] = np.eye(n)
    whole = expm(larger)
    return np.array([whole[:n, j * n : (j + 1) * n] for j in range(4)])


@pytest.mark.parametrize("doublings", [0, 1, 6])
def test_phi_functions_are_blocks_of_a_larger_exponential(doublings):
    a = np.array([[0.0, 0.3, 0.0], [-0.4, -0.1, 0.2], [0.3, 0.0, -0.2]])
    phi = np.empty((4, 3, 3))
    fill_phi(a, doublings, np.empty((2, 3, 3)), phi)
    np.testing.assert_allclose(phi, phi_by_scipy(2.0**doublings * a), rtol=1e-10, atol=1e-12)
    double_phi(phi, np.empty((3, 3)))
    np.testing.assert_allclose(phi, phi_by_scipy(2.0 ** (doublings + 1) * a), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("drag", [0.0, 40.0, 2e4])
def test_the_propagator_is_the_exponential_of_the_linear_motion(drag):
    stiffness, h = 2e5, 5e-3
    branches = np.array([[3e4, 1e4, 0.0], [10.0, 2.0, 0.0]])
    propagator = np.zeros(PROPAGATOR)
    fill_propagator(stiffness, drag, branches, h, np.empty((7, 3, 3)), propagator)
    # branches flow in the mean at 3.04e6/3.2e5 1/s, which is weighted by what they give way
    fades = 9.5
    matrix = np.array([[0.0, 1.0, 0.0], [-stiffness, -drag, 3.2e5], [1.0, 0.0, -fades]])
    half = expm(0.5 * h * matrix)
    np.testing.assert_allclose(propagator[:9], half.ravel(), rtol=1e-9, atol=1e-9)
    # a force that stands still, or grows evenly, over half a step: rows of one larger exponential
    larger = np.zeros((5, 5))
    larger[:3, :3], larger[1, 3], larger[3, 4] = matrix, 1.0, 1.0
    forced = expm(0.5 * h * larger)
    np.testing.assert_allclose(propagator[9:12], forced[:3, 3], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(propagator[12:15], forced[:3, 4], rtol=1e-9, atol=1e-12)
    # over a whole step, with a force 1, t and t^2 at its start, middle and end
    whole = expm(h * matrix)
    np.testing.assert_allclose(propagator[15:18], whole[:, 1], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(propagator[27:30], whole[:, 2], rtol=1e-9, atol=1e-9)
    larger = np.zeros((6, 6))
    larger[:3, :3], larger[1, 3], larger[3, 4], larger[4, 5] = matrix, 1.0, 1.0, 1.0
    forced = expm(h * larger)
    weights = propagator[18:27].reshape(3, 3) * [[1.0], [2.0], [1.0]]
    for power, column, scale in ((0, 3, 1.0), (1, 4, 1.0), (2, 5, 2.0)):
        at_nodes = np.array([0.0**power, (0.5 * h) ** power, h**power])
        exact = scale * forced[:3, column]
        np.testing.assert_allclose(at_nodes @ weights, exact, rtol=1e-8, atol=1e-12)
    # of a flow of 1 that fades
    gone = -np.expm1(-fades * np.array([0.5 * h, h])) / fades
    np.testing.assert_allclose(propagator[35:38], [fades, *gone], rtol=1e-12)


def test_drags_of_one_class_differ_by_a_fifth_at_most():
    assert drag_class(0.0) == drag_class(9e-3) == 0
    drags = np.geomspace(1e-2, 1e6, 500)
    classes = np.array([drag_class(d) for d in drags])
    assert (np.diff(classes) >= 0).all()
    for one in np.unique(classes):
        assert np.ptp(drags[classes == one]) <= 0.2 * drags[classes == one].min()
