"""The nearest waveform within the limits, of any row of numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from dearig.model.control import VoltageLimits
from dearig.model.errors import ModelError

ANY = arrays.arrays(np.float64, st.integers(4, 60), elements=st.floats(width=64))


@given(ANY, st.floats(1e2, 1e4), st.floats(1e3, 1e7))
def test_any_row_becomes_a_waveform_within_the_limits(wanted, highest, slew):
    limits, rate = VoltageLimits(highest, slew), 1e3
    ceiling = np.full(wanted.size, highest)
    found = limits.nearest(wanted, ceiling, rate)
    assert found.min() >= 0.0
    assert found.max() <= highest
    assert np.abs(np.diff(found)).max() * rate <= slew
    assert found[0] == found[-1] == 0.0


@given(ANY)
def test_a_waveform_within_the_limits_stays_as_it_is(wanted):
    limits = VoltageLimits(8e3, 1e6)
    once = limits.nearest(wanted, np.full(wanted.size, 8e3), 1e3)
    again = limits.nearest(once, np.full(wanted.size, 8e3), 1e3)
    np.testing.assert_allclose(again, once, atol=1e-6)


@pytest.mark.parametrize("values", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.nan)])
def test_limits_are_above_zero(values):
    with pytest.raises(ModelError, match="must be above 0"):
        VoltageLimits(*values)
