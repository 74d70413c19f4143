"""Interlocks on blocks: the block length changes nothing, and a plain reference finds the same."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.drivers.interlocks import Interlocks
from dearig.drivers.rig import Block
from tests.deep import examples
from tests.tools.interlock_signals import (
    RATE,
    Signals,
    breakdown,
    current,
    displacement,
    following,
    laser,
    monitor,
    watch,
)


def test_a_block_must_continue_the_previous_one():
    counts = Signals().counts()
    interlocks = Signals().interlocks()
    interlocks.watch(Block(0, counts[:, :10]))
    with pytest.raises(ValueError, match="begins with sample 20, but sample 10 is next"):
        interlocks.watch(Block(20, counts[:, 20:30]))


def test_an_empty_block_changes_nothing():
    signals = Signals()
    interlocks = signals.interlocks()
    assert interlocks.watch(Block(0, signals.counts()[:, :0])) == []
    assert watch(interlocks, signals.counts()) == []


SPOILT = st.tuples(
    st.sampled_from([
        monitor, breakdown, current, laser, displacement, following,
        "still", "jump", "stopped", "noise",
    ]),
    st.integers(0, 599),
    st.integers(1, 300),
)  # fmt: skip


def spoilt(faults, **locks) -> Signals:
    signals = Signals(600, monitor_debounce_ms=20.0, following_debounce_ms=30.0,
                      laser_stuck_s=0.05, laser_debounce_ms=20.0, **locks)  # fmt: skip
    for what, start, length in faults:
        at = slice(start, start + length)
        if what == "still":
            signals.displacement[at] = signals.displacement[start]
        elif what == "jump":
            signals.displacement[at] += 2.1e-3
        elif what == "noise":
            signals.displacement[at] += 3e-3 * np.cos(7.0 * np.arange(600)[at] ** 2)
        elif what == "stopped":
            signals.voltage_command[start:] = 0.0
        else:
            what(signals, at)
    return signals


@pytest.mark.deep
@examples(60, suite=20)
@given(
    faults=st.lists(SPOILT, max_size=5),
    cuts=st.sets(st.integers(1, 599), max_size=40),
    plan=st.booleans(),
)
def test_block_lengths_change_nothing(faults, cuts, plan):
    signals = spoilt(faults)
    whole = signals.trips(plan=plan)
    assert signals.trips(cuts=cuts, plan=plan) == whole
    assert signals.trips(cuts=range(1, 600), plan=plan) == whole


THRESHOLDS = ("monitor", "breakdown", "current", "laser", "displacement")


def reference(signals: Signals) -> dict[str, int]:
    """Return where the ``THRESHOLDS`` trip, found sample by sample in plain numbers."""
    locks, rate = signals.settings.interlocks, signals.rate
    physical = {
        c.name: c.scaling.physical(row).tolist()
        for c, row in zip(signals.channels, signals.counts(), strict=True)
    }
    command, shown = physical["voltage_command"], physical["voltage_monitor"]
    reading = physical["displacement"]
    quiet = next((i for i, v in enumerate(command) if v != 0.0), None)
    rest = sum(reading[:quiet]) / quiet if quiet else reading[0]
    in_a_row = dict.fromkeys(THRESHOLDS, 0)
    needed = {name: getattr(locks, f"{name}_debounce_ms") for name in THRESHOLDS}
    found: dict[str, int] = {}
    for i, now in enumerate(command):
        last = command[i - 1] if i else 0.0
        low, high, least = min(now, last), max(now, last), min(abs(now), abs(last))
        moved = (reading[i] - rest) * 1e3
        broken = {
            "monitor": not low - 1500.0 <= shown[i] <= high + 1500.0,
            "breakdown": least > 500.0 and shown[i] < 0.4 * least,
            "current": abs(physical["current_monitor"][i]) >= 0.02,
            "laser": abs(reading[i]) >= 0.03996,
            "displacement": quiet is not None and i >= quiet and not -20.0 <= moved <= 25.0,
        }
        for name, is_broken in broken.items():
            in_a_row[name] = in_a_row[name] + 1 if is_broken else 0
            if in_a_row[name] * 1e3 / rate >= needed[name] and is_broken:
                found.setdefault(name, i)
    return found


@settings(max_examples=100)
@given(faults=st.lists(SPOILT, min_size=1, max_size=5))
def test_the_same_samples_trip_as_in_the_plain_reference(faults):
    signals = spoilt(faults)
    found = reference(signals)
    tripped = signals.tripped()
    assert {name: at for name, at in tripped.items() if name in THRESHOLDS} == found


@settings(max_examples=60)
@given(
    counts=st.lists(
        st.tuples(*(st.sampled_from([-32768, -20000, 0, 1, 300, 20000, 32767]) for _ in range(4))),
        min_size=1,
        max_size=120,
    ),
    cuts=st.sets(st.integers(1, 119), max_size=10),
)
def test_any_counts_give_ordered_trips(counts, cuts):
    wild = np.array(counts, dtype=np.int16).T
    signals = Signals(100)
    whole = watch(signals.interlocks(), wild)
    names = [trip.interlock for trip in whole]
    assert len(set(names)) == len(names)
    assert [t.sample for t in whole] == sorted(t.sample for t in whole)
    assert all(0 <= t.sample < wild.shape[1] and t.message for t in whole)
    assert watch(signals.interlocks(), wild, [c for c in cuts if c < wild.shape[1]]) == whole


def test_a_thermometer_among_the_channels_is_ignored():
    signals = Signals()
    channels = (*signals.channels, replace(signals.channels[3], name="temperature", unit="K"))
    counts = np.concatenate((signals.counts(), np.full((1, 2000), 32767, dtype=np.int16)))
    interlocks = Interlocks(signals.settings, channels, RATE, signals.predicted, signals.planned)
    assert watch(interlocks, counts) == []
