"""The computer's clock is set while the program runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from dearig.acquisition.run import record
from dearig.clock import ClockWatch, UnixTime
from dearig.recording import open_recording
from tests.acquisition.test_run import LOADED, RIG_FILE


class Clocks:
    """Unix time that may be set, and the time that has passed; both in s."""

    def __init__(self) -> None:
        self.unix, self.passed = 1_800_000_000.0, 50.0

    def go_on(self, seconds: float, step: float = 0.0) -> None:
        self.passed += seconds
        self.unix += seconds + step


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (-3600.0, "set back by 3600 s;"),
        (3600.0, "set forward by 3600 s, or the computer was suspended;"),
        (0.9, ""),
    ],
)
def test_a_change_is_told_once(step: float, said: str) -> None:
    clocks = Clocks()
    watch = ClockWatch(lambda: clocks.unix, lambda: clocks.passed)
    clocks.go_on(10.0)
    assert watch.change() == ""
    clocks.go_on(10.0, step)
    assert said in watch.change()
    assert watch.change() == ""


def test_unix_time_goes_on_where_the_clock_is_set_back() -> None:
    clocks = Clocks()
    time = UnixTime(lambda: clocks.unix, lambda: clocks.passed)
    begin = time()
    for step, later in ((-3600.0, 10.0), (3600.0, 20.0), (60.0, 90.0)):
        clocks.go_on(10.0, step)
        assert time() == begin + later
    assert UnixTime(lambda: clocks.unix, lambda: clocks.passed, begin + 1e6)() == begin + 1e6


def test_a_run_records_that_the_clock_was_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clocks = Clocks()

    def unix() -> float:
        clocks.go_on(0.1, -3600.0 if clocks.passed > 50.25 > clocks.passed - 0.1 else 0.0)
        return clocks.unix

    monkeypatch.setattr(
        "dearig.acquisition.run.ClockWatch", lambda: ClockWatch(unix, lambda: clocks.passed)
    )
    result = record(LOADED, "sim", RIG_FILE, tmp_path / "run.h5")
    events = [event.message for event in open_recording(tmp_path / "run.h5").events]
    assert [e for e in events if "clock was set back by 3600 s" in e] == events[:1]
    assert result.output_state.confirmed
