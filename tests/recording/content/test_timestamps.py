"""Times that are shown, and the computer's clock against the sample clock."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.drivers.rig import Block
from dearig.recording import describe_rows, open_recording
from dearig.recording.content.timestamps import compare_clocks, local_time
from dearig.recording.reading.index import index_folder, lines
from dearig.recording.verify import Verification, verify
from tests.tools.recordings import IDENTITY, Clock, run_counts, write_run, writer


@pytest.fixture
def berlin(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The time zone of Berlin."""
    if sys.platform == "win32":
        pytest.skip("the time zone of a process cannot be set")
    monkeypatch.setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.usefixtures("berlin")
def test_one_time_is_shown_everywhere_with_its_offset(tmp_path: Path) -> None:
    write_run(tmp_path / "run.h5")
    shown = "2027-01-15 09:00:00+01:00"
    found = index_folder(tmp_path, cache=tmp_path / "c.json")
    assert lines(found)[0].startswith(shown)
    assert dict(describe_rows(open_recording(tmp_path / "run.h5")))["start time"] == shown
    # programs read UTC
    assert found[0].start_time == "2027-01-15T08:00:00.000+00:00"


@pytest.mark.usefixtures("berlin")
def test_text_that_is_no_time_is_shown_as_it_is() -> None:
    assert local_time("2026-07-01T12:00:00Z") == "2026-07-01 14:00:00+02:00"
    for text in ("", "yesterday", "2026-07-01T12:00:00", "9999-12-31T23:59:59+00:00"):
        assert local_time(text) == text


def run(path: Path, steps: dict[int, float], clock_rate: float = 1.0) -> Verification:
    """A run of 30 s, with the computer's clock set by ``steps`` (s) after some of its seconds."""
    clock = Clock()
    identity = replace(IDENTITY, simulated=False)
    run = {"rate_Hz": 100.0, "samples_expected": 3000, "now": clock}
    with writer(path, identity=identity, **run) as recorder:
        counts = run_counts(3000)
        for i in range(30):
            clock.moment += clock_rate + steps.get(i, 0.0)
            recorder.append(Block(100 * i, counts[:, 100 * i : 100 * i + 100]))
    return verify(path)


@pytest.mark.parametrize(
    ("step", "shown"),
    [(0.7, "0.7 s"), (119.0, "119 s"), (3600.0, "60 min"), (86_400.0, "24 h"), (1e8, "1157 days")],
)
def test_a_clock_that_is_set_forward_is_a_note(tmp_path: Path, step: float, shown: str) -> None:
    found = run(tmp_path / "run.h5", {14: step})
    assert found.faults == []
    assert found.notes == [
        f"the computer's clock was set forward by {shown} during the run, or the computer "
        f"slept, at sample 1400 (14 s); the sample clock is not affected"
    ]


def test_a_clock_that_is_set_back_is_a_note(tmp_path: Path) -> None:
    assert run(tmp_path / "a.h5", {14: -3600.0}).faults == []
    found = run(tmp_path / "b.h5", {14: -0.6})
    assert found.faults == []
    assert "set back by 0.6 s" in found.notes[0]


def test_a_wrong_rate_is_a_fault_whatever_the_clock_does(tmp_path: Path) -> None:
    for n, (steps, rate) in enumerate((({14: 3600.0}, 1.05), ({}, 2.0), ({}, 1.05))):
        found = run(tmp_path / f"{n}.h5", steps, rate)
        assert any("rate_Hz is wrong" in fault for fault in found.faults), (steps, rate)


def test_a_slow_disk_does_not_set_the_clock() -> None:
    sample = np.arange(0.0, 30_000.0, 250.0)
    moments = 1.8e9 + sample / 1000.0
    # five seconds of samples come late, and all at once
    moments[40:60] = moments[60] - 1e-3 * np.arange(20, 0, -1)
    found = compare_clocks(sample, moments, 1000.0)
    assert found.step == 0.0
    assert found.computer == pytest.approx(found.counted)
