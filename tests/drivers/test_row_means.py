"""Rows as means of conversions: exact sums, whatever the blocks, with the scaling of the mean."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.rig import Block, Event
from dearig.drivers.row_means import RowMeans, row_channels
from dearig.drivers.settings.card import AVERAGE_MAX

BENT = Scaling((1e-3, 3e-4, 2e-12, -1e-16), 1000.0, 5.0)


def counts(conversions: int) -> np.ndarray:
    rng = np.random.default_rng(1)
    return rng.integers(-32768, 32768, (3, conversions), dtype=np.int16)


def taken(rows: RowMeans, conversions: np.ndarray, block: int) -> list[Block]:
    starts = range(0, conversions.shape[1], block)
    return [rows.take(Block(at, conversions[:, at : at + block])) for at in starts]


@pytest.mark.parametrize("block", [1, 7, 40, 1000])
def test_a_row_is_the_sum_of_its_conversions_whatever_the_blocks(block: int) -> None:
    given = counts(403)
    blocks = taken(RowMeans(10), given, block)
    found = np.concatenate([b.counts for b in blocks], axis=1)
    assert found.dtype == np.int32
    expected = given[:, :400].astype(object).reshape(3, 40, 10).sum(axis=2)
    np.testing.assert_array_equal(found, expected)
    due = 0
    for one in blocks:
        assert one.start == due
        due += one.counts.shape[1]


def test_without_averaging_a_block_stays_as_it_is() -> None:
    block = Block(3, counts(5), (Event(4, "info", "x"),))
    assert RowMeans(1).take(block) is block


def test_the_largest_sum_fits() -> None:
    rows = RowMeans(AVERAGE_MAX)
    for end in (-32768, 32767):
        found = rows.take(Block(0, np.full((1, AVERAGE_MAX), end, dtype=np.int16)))
        assert int(found.counts[0, 0]) == end * AVERAGE_MAX


def test_events_are_at_the_row_of_their_conversion() -> None:
    rows = RowMeans(10)
    events = tuple(Event(at, "warning", "x") for at in (0, 9, 10, 25))
    found = rows.take(Block(0, counts(25), events))
    assert [event.sample for event in found.events] == [0, 0, 1, 2]
    assert found.counts.shape == (3, 2)


def test_an_average_is_one_or_more() -> None:
    with pytest.raises(ValueError, match="average = 0 must be 1 or more"):
        RowMeans(0)


def test_the_scaling_of_a_sum_is_that_of_its_mean() -> None:
    channel = Channel("x", "V", BENT, skew=2e-6, delay=1e-3, delay_error=1e-5)
    (of_sums,) = row_channels([channel], 100)
    sums = np.array([-3276800, -100, 0, 57, 3276700], dtype=np.int32)
    volts = 1e-3 + 3e-4 * (sums / 100) + 2e-12 * (sums / 100) ** 2 - 1e-16 * (sums / 100) ** 3
    np.testing.assert_allclose(of_sums.scaling.physical(sums), 5.0 + 1000.0 * volts, rtol=1e-12)
    assert (of_sums.skew, of_sums.delay, of_sums.delay_error) == (2e-6, 1e-3, 1e-5)
    assert row_channels([channel], 1) == (channel,)
