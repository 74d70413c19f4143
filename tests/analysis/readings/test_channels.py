"""Electrical channels of a recording: which can be used, their noise, and why others cannot."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from dearig.analysis.readings.channels import electric_of
from dearig.model.readings.channels import CURRENT, VOLTAGE_MONITOR
from dearig.model.simulation.actuator import Drive

TIME = np.arange(4000) * 1e-3
COMMAND = np.where(TIME < 1.0, 0.0, 8e3 * np.sin(np.pi * (TIME - 1.0)) ** 2)
RNG = np.random.default_rng(3)
MONITOR = COMMAND + RNG.standard_normal(TIME.size)
AMPERES = 4e-6 * RNG.standard_normal(TIME.size)


def electric(monitor=MONITOR, current=AMPERES, drive="command"):
    recording = SimpleNamespace(
        name="run",
        voltage_monitor=monitor,
        current_monitor=current,
        quiet_samples=1000,
        average=1,
        provenance={},
        channels=(
            SimpleNamespace(name="voltage_monitor", skew=1e-5),
            SimpleNamespace(name="current_monitor", skew=2e-5),
        ),
    )
    return electric_of(recording, Drive(TIME, COMMAND), np.zeros_like(TIME), drive)


def reasons(found):
    return {channel.name: channel.reason for channel in found.channels}


def test_monitor_and_current_have_the_noise_of_their_rest_and_their_skew():
    monitor, current = electric().channels
    assert (monitor.name, monitor.unit, monitor.skew) == (VOLTAGE_MONITOR, "V", 1e-5)
    assert (current.name, current.unit, current.skew) == (CURRENT, "A", 2e-5)
    assert monitor.noise == pytest.approx(1.0, rel=0.1)
    assert current.noise == pytest.approx(4e-6, rel=0.1)
    assert monitor.lead_in == current.lead_in == 1000


def test_a_recording_without_either_has_none():
    assert electric(None, None) is None


def test_what_was_not_recorded_is_said():
    assert reasons(electric(current=None)) == {VOLTAGE_MONITOR: "", CURRENT: "not recorded"}


def test_a_monitor_that_drives_the_model_says_nothing_of_the_amplifier():
    assert reasons(electric(drive="monitor")) == {VOLTAGE_MONITOR: "not recorded", CURRENT: ""}


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (np.zeros_like(TIME), "never changes"),
        (np.where(TIME < 3.9, MONITOR, np.nan), "a part of its readings is missing"),
        (np.clip(MONITOR, -100.0, 6e3), "clipped"),
    ],
)
def test_a_monitor_that_cannot_be_used(values, reason):
    found = electric(monitor=values)
    assert reasons(found)[VOLTAGE_MONITOR].startswith(reason)
    assert [channel.name for channel in found.used] == [CURRENT]
