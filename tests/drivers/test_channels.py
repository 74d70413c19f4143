"""Counts and what they mean."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.drivers.channels import COUNT_MAX, COUNT_MIN, Scaling

IDEAL = Scaling((0.0, 10.0 / 32768.0), 1000.0)
CROOKED = Scaling((1e-3, 3.05e-4, 1e-12, 2e-17), -4e-3, 0.5)


@pytest.mark.parametrize("scaling", [IDEAL, CROOKED])
def test_every_count_survives_the_way_there_and_back(scaling):
    counts = np.arange(COUNT_MIN, COUNT_MAX + 1).astype(np.int16)
    np.testing.assert_array_equal(scaling.counts(scaling.physical(counts)), counts)


@settings(max_examples=100)
@given(st.floats(-5e3, 5e3))
def test_counts_are_the_nearest(value):
    back = IDEAL.physical(IDEAL.counts(np.array([value])))[0]
    assert abs(back - value) <= 0.5 * 10.0 / 32768.0 * 1000.0 * (1 + 1e-9)


def test_counts_saturate():
    np.testing.assert_array_equal(
        IDEAL.counts(np.array([-1e9, 1e9])), np.array([COUNT_MIN, COUNT_MAX])
    )
    np.testing.assert_array_equal(
        CROOKED.counts(np.array([1e9, -1e9])), np.array([COUNT_MIN, COUNT_MAX])
    )


def test_a_scaling_that_is_far_from_straight_has_no_inverse_here():
    with pytest.raises(ValueError, match="nearly linear"):
        Scaling((0.0, 1e-4, 1e-8), 1.0).counts(np.zeros(1))
