"""A run flows over the screen, although its samples come in blocks."""

from __future__ import annotations

import numpy as np
import pytest

from dearig.window.run.pace import ShownTime

FRAME, BLOCK = 1.0 / 60.0, 0.1


def test_each_frame_between_blocks_shows_something_new_and_nothing_that_is_not_there() -> None:
    pace, shown = ShownTime(), []
    for frame in range(600):
        now = frame * FRAME
        end = BLOCK * np.floor(now / BLOCK)
        shown.append(pace.shown(end, now))
        assert shown[-1] <= end
        assert end - shown[-1] <= 2.0 * BLOCK + 1e-9
    steps = np.diff(shown[30:])
    # at the speed of the clock, but for rounding at the moment in which a block comes
    assert np.all(steps > 0.0)
    assert np.mean(steps) == pytest.approx(FRAME, rel=0.02)


def test_a_run_that_is_faster_than_real_time_is_followed_within_two_blocks() -> None:
    pace = ShownTime()
    for frame in range(1, 100):
        end = frame * 3.0  # s of the run in a frame
        assert end - pace.shown(end, frame * FRAME) <= 2.0 * 3.0


def test_what_does_not_come_is_not_passed_and_another_run_begins_anew() -> None:
    pace = ShownTime()
    pace.shown(0.5, 0.0)
    assert pace.shown(0.5, 10.0) == 0.5
    assert pace.shown(0.6, 20.0) == pytest.approx(0.6)
    assert pace.shown(0.1, 20.0) <= 0.1
