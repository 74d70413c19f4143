"""What a live plot shows: fixed bins, nothing lost, nothing that grows."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.window.run.traces import Pyramid, RunningErrors


def pushed(values: np.ndarray, cuts: list[int], capacity: int = 64) -> Pyramid:
    pyramid = Pyramid(values.size, capacity)
    for part in np.split(values, cuts):
        pyramid.push(part)
    return pyramid


def test_the_end_of_a_run_is_shown_sample_by_sample() -> None:
    values = np.arange(50.0)
    x, y = pushed(values, [7, 30]).view(0, 50)
    np.testing.assert_array_equal(x, values)
    np.testing.assert_array_equal(y, values)


@pytest.mark.parametrize("cuts", [[], [1, 2, 3], [100, 333, 900], list(range(50, 1000, 50))])
def test_blocks_of_any_length_give_the_same_picture(cuts: list[int]) -> None:
    values = np.random.default_rng(1).standard_normal(1000)
    whole, cut = pushed(values, []).view(0, 1000), pushed(values, cuts).view(0, 1000)
    np.testing.assert_array_equal(whole[0], cut[0])
    np.testing.assert_array_equal(whole[1], cut[1])


@pytest.mark.parametrize("at", [0, 3, 517, 999])
def test_no_spike_is_lost(at: int) -> None:
    values = np.zeros(1000)
    values[at] = 1.0
    x, y = pushed(values, [400, 401]).view(0, 1000)
    assert y.max() == 1.0
    assert abs(x[np.argmax(y)] - at) <= 16  # the bin it is in
    assert x.size < 2 * 64 + 16


def triangle(samples: int, period: int) -> np.ndarray:
    return np.abs((np.arange(samples) / period) % 1.0 * 2.0 - 1.0)


@pytest.mark.parametrize("seed", range(5))
def test_drawn_points_are_samples_in_the_order_of_time_at_every_zoom(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(300, 5000))
    values = triangle(size, int(rng.integers(40, 900))) + (rng.standard_normal(size) * (seed % 2))
    values[rng.integers(0, size, 20 * (seed // 3))] = np.nan
    pyramid = pushed(values, sorted(rng.integers(0, size, 9)))
    for first, last in np.sort(rng.integers(0, size + 1, (40, 2)), axis=1):
        x, y = pyramid.view(int(first), int(last))
        assert (np.diff(x) > 0).all()
        np.testing.assert_array_equal(y[~np.isnan(y)], values[x.astype(int)][~np.isnan(y)])


def test_rising_and_falling_slopes_of_a_triangle_are_drawn_alike() -> None:
    # straight lines between the points lie on the triangle, except where a bin holds a corner
    values = triangle(4096, 1024)
    x, y = pushed(values, []).view(0, 4096)
    between = 0.5 * (x[1:] + x[:-1])
    on_curve = np.interp(between, np.arange(4096), values)
    off = np.abs(0.5 * (y[1:] + y[:-1]) - on_curve) > 1e-9
    rising = (between / 1024.0) % 1.0 > 0.5
    assert np.count_nonzero(off & rising) <= 8
    assert np.count_nonzero(off & ~rising) <= 8
    assert x.size > 100


def test_bins_stand_still_while_a_run_goes_on() -> None:
    values = np.random.default_rng(2).standard_normal(900)
    pyramid = Pyramid(10_000, 64)
    pyramid.push(values[:600])
    x, y = pyramid.view(0, 500)
    pyramid.push(values[600:601])
    again = pyramid.view(0, 500)
    np.testing.assert_array_equal(x, again[0])
    np.testing.assert_array_equal(y, again[1])


def test_x_goes_forward_and_what_is_new_is_there_at_once() -> None:
    values = np.arange(1003.0)
    x, y = pushed(values, [10, 500]).view(100, 1003)
    assert (np.diff(x) > 0).all()
    assert (x[-1], y[-1]) == (1002.0, 1002.0)


def test_gaps_are_drawn_as_gaps() -> None:
    values = np.full(1000, np.nan)
    values[500:] = 2.0
    x, y = pushed(values, [333]).view(0, 1000)
    assert np.isnan(y[x < 480]).all()
    assert (y[x > 520] == 2.0).all()


def test_memory_does_not_grow_with_the_run() -> None:
    pyramid = Pyramid(10**9, 64)
    assert sum(level.kept.shape[1] for level in pyramid._levels) <= 64 * 26


def test_nothing_pushed_is_nothing_to_draw() -> None:
    x, y = Pyramid(100).view(0, 100)
    assert x.size == y.size == 0


def test_errors_so_far_and_of_the_last_moment() -> None:
    running = RunningErrors(window=100)
    measured = np.linspace(0.0, 1.0, 400)
    residual = np.concatenate((np.full(300, 0.3), np.full(100, 0.1)))
    for part in np.split(np.arange(400), [30, 155, 390]):
        running.push(measured[part], measured[part] - residual[part])
    errors = running.now()
    assert errors.rms == pytest.approx(np.sqrt(np.mean(residual**2)))
    assert errors.recent == pytest.approx(0.1)
    assert errors.nrmse_pct == pytest.approx(100.0 * errors.rms)


def test_errors_leave_out_what_the_model_does_not_know() -> None:
    running = RunningErrors(window=10)
    running.push(np.ones(4), np.full(4, np.nan))
    assert np.isnan(running.now().rms)
    running.push(np.array([1.0, 2.0]), np.array([np.nan, 1.5]))
    assert running.now().rms == pytest.approx(0.5)
