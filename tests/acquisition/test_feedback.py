"""A run whose voltage answers the readings: through the gate, in time, and safe without a laser."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.feedback import Feedback
from dearig.acquisition.replay import original_of
from dearig.acquisition.run import RunObserver, RunOptions, RunResult, record
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.errors import InputError, InstrumentFault, SafetyStop
from dearig.model.control import HoldAnswer, HoldController
from dearig.recording import open_recording
from dearig.recording.reading.summary import describe_rows
from dearig.sim_backend.rig import SimulatedRig

RATE = 200.0
RIG = RigFile.model_validate({"card": {"sample_rate_Hz": RATE}, "limits": {"voltage_max_kV": 7.5}})
SEQUENCE = """\
name = "4 kV"
lead_in_s = 0.4
tail_s = 0.2
[[segment]]
kind = "ramp"
to_kV = 4.0
duration_s = 1.0
[[segment]]
kind = "hold"
duration_s = 6.0
[[segment]]
kind = "ramp"
to_kV = 0.0
duration_s = 1.0
"""
LOADED = parse_sequence(SEQUENCE, "4 kV", Path())
#: Under 4 kV the film stands at 0.515 mm and creeps to 0.526 mm: it is asked for less.
HOLD = Feedback(
    setpoint=0.5e-3, sensitivity=1.07e-3, lead_in=0.4, start=2.4, stop=7.4, authority=0.1,
    rate_limit=0.02, response=0.5, ahead=0.5, laser_loss=1.0,
)  # fmt: skip
BLOCK, WAITING = 20, 6  # samples; blocks that are output before an answer


class Seen(RunObserver):
    """Keeps the answers."""

    def __init__(self) -> None:
        self.answers: list[tuple[float, HoldAnswer]] = []

    def answered(self, time: float, answer: HoldAnswer) -> None:
        self.answers.append((time, answer))


def held(out: Path, *faults: str, feedback: Feedback = HOLD, observer=None) -> RunResult:
    options = RunOptions(faults=faults)
    return record(LOADED, "sim", RIG, out, options, feedback=feedback, observer=observer)


def played(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Command and plan in V."""
    command = open_recording(path).voltage_command
    assert command is not None
    return command, LOADED.on_clock(RATE).window(0, command.size)


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> tuple[RunResult, Seen]:
    seen = Seen()
    return held(tmp_path_factory.mktemp("held") / "held.h5", observer=seen), seen


def test_the_error_falls_within_the_authority(run) -> None:
    result, seen = run
    assert seen.answers[0][1].error == pytest.approx(-15e-6, abs=3e-6)
    # it creeps on meanwhile, and answers a voltage slower than it will once it has relaxed
    assert abs(np.mean([a.error for _, a in seen.answers[-10:]])) < 4e-6
    command, plan = played(result.path)
    assert np.all(np.abs(command - plan) <= HOLD.authority * plan + 1.0)
    assert command[-1] == pytest.approx(0.0, abs=1.0)
    assert result.outcome == "finished"


def test_an_answer_is_output_exactly_so_long_after_its_readings(run) -> None:
    result, seen = run
    command, plan = played(result.path)
    corrected = np.flatnonzero(np.abs(command - plan) > 0.4)  # more than a count
    first = round(seen.answers[0][0] * RATE - 0.5 * BLOCK)  # of its readings
    begins = first + WAITING * BLOCK
    assert begins <= corrected[0] < begins + 10  # the correction begins at 0
    report = result.feedback
    assert report is not None
    assert report.delay == pytest.approx(WAITING * BLOCK / RATE)
    assert report.waiting == pytest.approx((WAITING - 1) * BLOCK / RATE)


def test_the_recording_says_what_was_held_and_how(run) -> None:
    result, seen = run
    recording = open_recording(result.path)
    noted = tomllib.loads(str(recording.provenance["feedback"]))
    assert noted["setpoint_mm"] == pytest.approx(0.5)
    assert noted["delay_s"] == pytest.approx(0.6)
    assert noted["gain_margin"] == pytest.approx(0.5 * math.pi * 1.1 / 0.6, rel=1e-5)
    assert result.feedback is not None
    shown = dict(describe_rows(recording))["feedback"]
    assert shown.startswith("setpoint_mm 0.5; from_s 2.4; ")
    said = [event.message for event in recording.events]
    assert result.feedback.sentence in said
    assert said[0].startswith("feedback: 0.5 mm are held, correction ")
    assert f"{len(seen.answers)} answers, each 0.6 s after its readings" in said[-1]
    with pytest.raises(InputError, match="hold the displacement again"):
        original_of(result.path)


def test_a_laser_that_comes_back_finds_the_correction_as_it_was(tmp_path: Path) -> None:
    seen = Seen()
    result = held(tmp_path / "run.h5", "sensor-out-of-range@4.0+0.5", observer=seen)
    assert result.outcome == "finished"
    frozen = [a.correction for _, a in seen.answers if a.state == "frozen"]
    assert 4 <= len(frozen) <= 6
    assert len(set(frozen)) == 1
    assert result.feedback is not None
    assert result.feedback.frozen == pytest.approx(len(frozen) * BLOCK / RATE)
    assert any("the readings cannot be used" in event for event in result.events)


@pytest.mark.parametrize("fault", ["sensor-out-of-range@4.0", "sensor-stuck@4.0"])
def test_a_laser_that_stays_away_ramps_the_voltage_down_after_the_stated_time(
    fault: str, tmp_path: Path
) -> None:
    out = tmp_path / "run.h5"
    with pytest.raises(SafetyStop, match="ramped down"):
        held(out, fault)
    command, plan = played(out)
    ramp = np.flatnonzero((plan == 4000.0) & (command < 3500.0))[0] / RATE
    assert 4.0 + HOLD.laser_loss < ramp < 4.0 + HOLD.laser_loss + 0.5
    before = command[round(4.7 * RATE) : round(5.0 * RATE)]
    assert np.ptp(before) < 0.6  # a count: it was held
    assert command[-1] == pytest.approx(0.0, abs=1.0)


HOSTILE: dict[str, Callable[[int], float]] = {
    "not a number": lambda _: math.nan,
    "infinite": lambda _: math.inf,
    "beyond the authority": lambda _: 0.5,
    "a spike": lambda i: 0.05 if i == 7 else 0.0,
    "to and fro": lambda i: 0.01 * (-1.0) ** i,
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_whatever_a_controller_asks_for_the_gate_ends_the_run_at_zero_volts(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = iter(range(1000))

    def answer(self: HoldController, *_: object) -> HoldAnswer:
        self.correction = HOSTILE[kind](next(calls))
        return HoldAnswer(self.correction, 0.0, "holding")

    monkeypatch.setattr(HoldController, "answer", answer)
    out = tmp_path / "run.h5"
    with pytest.raises(SafetyStop, match="the gate refused the correction"):
        held(out)
    command, plan = played(out)
    assert np.all(command <= plan * (1.0 + HOLD.authority) + 1.0)
    steps = np.abs(np.diff(command)) * RATE
    # no step but those of the plan and of the ramp to 0 V, in half a second
    assert steps.max() <= 8400.0
    assert command[-1] == pytest.approx(0.0, abs=1.0)
    assert open_recording(out).outcome.startswith("stopped by an interlock")


@pytest.mark.parametrize(
    ("delay", "ends"),
    [("0.15", None), ("0.4", SafetyStop), ("2.0", InstrumentFault)],
)
def test_a_computer_that_is_too_slow_ends_it_before_it_is_guesswork(
    delay: str, ends: type[Exception] | None, tmp_path: Path
) -> None:
    out = tmp_path / "run.h5"
    if ends is None:
        report = held(out, f"late-reply@4.0+{delay}").feedback
        assert report is not None
        assert report.waiting < (WAITING - 1) * BLOCK / RATE
        return
    with pytest.raises(ends):
        held(out, f"late-reply@4.0+{delay}")
    command, plan = played(out)
    assert np.all(np.abs(command - plan)[: round(4.0 * RATE)] <= HOLD.authority * plan.max())


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"authority": 0.99}, "lower the authority"),
        ({"authority": 1.5}, "authority"),
        ({"rate_limit": math.nan}, "rate limit"),
        ({"sensitivity": 0.0}, "sensitivity"),
        ({"ahead": 0.0}, "ahead"),
        ({"setpoint": math.nan}, "setpoint"),
    ],
)
def test_what_is_no_feedback_is_refused_before_anything_is_opened(
    wrong: dict[str, float], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dearig.acquisition.run.open_rig", lambda *_: pytest.fail("opened"))
    with pytest.raises(InputError, match=said):
        held(tmp_path / "run.h5", feedback=replace(HOLD, **wrong))


def test_a_rig_that_cannot_grow_a_waveform_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SimulatedRig, "plays_growing_waveforms", False)
    with pytest.raises(InputError, match="cannot correct a run"):
        held(tmp_path / "run.h5")
    assert not list(tmp_path.iterdir())
