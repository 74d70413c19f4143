"""Tests that every rig must pass.

Derive a class ``Test...`` from ``RigContract`` and return the opened rig from ``open_rig``.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import pytest

from dearig.drivers import gate
from dearig.drivers.channels import CHANNEL_NAMES
from dearig.drivers.errors import ChangedWaveform, RigError, RigStateError
from dearig.drivers.gate import (
    BlockGate,
    FilmForecast,
    GatedWaveform,
    Limits,
    admit,
    open_block_gate,
)
from dearig.drivers.rig import Block, Event, Rig, RigState
from dearig.drivers.samples import Computed
from dearig.drivers.settings import LimitsSettings

__all__ = [
    "LIMITS",
    "RATE",
    "Record",
    "RigContract",
    "begin",
    "corrected",
    "drain",
    "foreseen",
    "lobes",
    "play",
]

LIMITS = LimitsSettings().gate_limits()
RATE = 1000.0
FIELD_PER_VOLT = 1.25e3  # 1/m: a film of 1 mm, stretched


def foreseen(samples: int) -> FilmForecast:
    """Return the prediction of a film that does not move."""
    return FilmForecast(np.full(samples, FIELD_PER_VOLT), 2e-16)


def lobes(
    peaks: tuple[float, ...] = (6000.0, 8000.0),
    seconds: float = 0.15,
    quiet: float = 0.02,
    rate: float = RATE,
    limits: Limits = LIMITS,
) -> GatedWaveform:
    """Return an admitted waveform of half-sine lobes of ``peaks`` V with quiet ends."""
    time = np.arange(round(seconds * rate)) / rate
    lobe = np.sin(np.pi * time / seconds)
    still = np.zeros(round(quiet * rate))
    voltage = np.concatenate((still, *(peak * lobe for peak in peaks), still))
    return admit(voltage, rate, limits, foreseen(voltage.size))


def corrected(waveform: GatedWaveform, block: int = 50) -> BlockGate:
    """Return the gate for corrections of ``waveform`` by up to 4 %, in blocks of 50 ms."""
    return open_block_gate(
        waveform, block=block, authority=0.04, rate_limit=10.0,
        edge=foreseen(waveform.samples), prediction=foreseen(waveform.samples),
    )  # fmt: skip


@dataclass(frozen=True)
class Record:
    """Record of one run: ``counts`` (channels, N) int16, with its blocks and events."""

    counts: np.ndarray
    blocks: tuple[Block, ...]
    events: tuple[Event, ...]

    def physical(self, rig: Rig, name: str) -> np.ndarray:
        """Return the values (N,) of the channel ``name`` of ``rig`` in its unit."""
        channels = rig.identify().channels
        at = [channel.name for channel in channels].index(name)
        return channels[at].scaling.physical(self.counts[at])


def begin(rig: Rig, waveform: GatedWaveform) -> None:
    """Load, arm and start ``rig``."""
    rig.load(waveform)
    rig.arm()
    rig.start()


def drain(rig: Rig) -> Record:
    """Read until the end of the waveform."""
    blocks = []
    while (block := rig.read()) is not None:
        blocks.append(block)
    counts = np.concatenate([block.counts for block in blocks], axis=1)
    return Record(counts, tuple(blocks), tuple(e for block in blocks for e in block.events))


def play(rig: Rig, waveform: GatedWaveform) -> Record:
    """Play ``waveform`` to its end and return the record."""
    begin(rig, waveform)
    return drain(rig)


CALLS: dict[str, Callable[[Rig], object]] = {
    "load": lambda rig: rig.load(lobes()),
    "arm": lambda rig: rig.arm(),
    "start": lambda rig: rig.start(),
    "read": lambda rig: rig.read(),
    "stop": lambda rig: rig.stop(),
    "identify": lambda rig: rig.identify(),
}

#: Calls that a rig allows in each state; the last one may end it.
ALLOWED: dict[RigState, tuple[str, ...]] = {
    RigState.SAFE: ("identify", "load"),
    RigState.LOADED: ("identify", "arm"),
    RigState.ARMED: ("identify", "start"),
    RigState.RUNNING: ("identify", "read", "stop"),
    RigState.DONE: ("identify", "read", "stop", "load"),
    RigState.CLOSED: (),
}


def bring_to(rig: Rig, state: RigState) -> None:
    """Bring a new rig to ``state`` by the ordinary calls."""
    if state is RigState.CLOSED:
        rig.close()
    if state in (RigState.SAFE, RigState.CLOSED):
        return
    rig.load(lobes())
    if state is RigState.LOADED:
        return
    rig.arm()
    if state is RigState.ARMED:
        return
    rig.start()
    if state is RigState.DONE:
        drain(rig)


def _plays_growing(rig: Rig) -> bool:
    return bool(getattr(rig, "plays_growing_waveforms", False))


class RigContract:
    """Tests of a rig; a derived class must define ``open_rig`` only.

    A real rig has no seed and does not repeat its noise: its class skips
    ``test_same_seed_gives_the_same_bytes``, ``test_another_seed_or_run_gives_other_noise`` and
    ``test_block_length_changes_nothing``.
    """

    MONITOR_TOLERANCE = 20.0  # V at the film between command and monitor

    def open_rig(self, *, block_samples: int | None = None, seed: int = 0) -> Rig:
        """Return a new rig with default settings that runs as fast as possible."""
        raise NotImplementedError

    @contextmanager
    def opened(self, **options: Any) -> Iterator[Rig]:
        """Open a rig and close it after the body."""
        rig = self.open_rig(**options)
        try:
            yield rig
        finally:
            rig.close()

    @pytest.fixture
    def rig(self) -> Iterator[Rig]:
        """Yield a rig for one test."""
        with self.opened() as rig:
            yield rig

    def test_identity_names_instruments_and_channels(self, rig: Rig) -> None:
        identity = rig.identify()
        assert {i.role for i in identity.instruments} >= {"card", "amplifier", "laser"}
        assert all(i.model and i.serial for i in identity.instruments)
        names = [channel.name for channel in identity.channels]
        known = [name for name in CHANNEL_NAMES if name in names]
        assert names[: len(known)] == known
        assert len(set(names)) == len(names)
        assert names[:4] == list(CHANNEL_NAMES[:4])
        assert [c.unit for c in identity.channels[:4]] == ["V", "V", "A", "m"]
        assert identity.channels[0].skew == 0.0
        skews = [channel.skew for channel in identity.channels[1:]]
        assert skews == sorted(skews)
        assert len(set(skews)) == len(skews)
        # asking moves nothing
        assert rig.state is RigState.SAFE
        assert rig.identify() == identity

    @pytest.mark.parametrize("state", list(RigState))
    def test_calls_out_of_order_are_refused(self, rig: Rig, state: RigState) -> None:
        bring_to(rig, state)
        allowed = ALLOWED[state]
        for name in (name for name in CALLS if name not in allowed):
            with pytest.raises(RigStateError, match=f"{name}: the rig is {state.value}"):
                CALLS[name](rig)
            assert rig.state is state
        for name in allowed:
            CALLS[name](rig)

    def test_states_follow_each_other(self, rig: Rig) -> None:
        seen = [rig.state]
        rig.load(lobes())
        seen.append(rig.state)
        rig.arm()
        seen.append(rig.state)
        rig.start()
        seen.append(rig.state)
        drain(rig)
        seen.append(rig.state)
        rig.make_safe()
        seen.append(rig.state)
        rig.close()
        seen.append(rig.state)
        expected = ["safe", "loaded", "armed", "running", "done", "safe", "closed"]
        assert [state.value for state in seen] == expected

    def test_takes_nothing_but_a_gated_waveform(self, rig: Rig) -> None:
        with pytest.raises(TypeError, match="GatedWaveform"):
            rig.load(cast("GatedWaveform", np.zeros(100)))
        assert rig.state is RigState.SAFE

    def test_refuses_a_waveform_admitted_under_wider_limits(self, rig: Rig) -> None:
        wide = replace(LIMITS, voltage_max=2.0 * LIMITS.voltage_max)
        with pytest.raises(RigError, match="wider limits"):
            rig.load(lobes(limits=wide))
        assert rig.state is RigState.SAFE

    def test_says_the_rate_it_really_runs_at(self, rig: Rig) -> None:
        assert rig.load(lobes(rate=997.0)) == pytest.approx(997.0, rel=1e-4)

    def test_blocks_follow_without_gap_and_every_sample_comes_once(self, rig: Rig) -> None:
        waveform = lobes()
        record = play(rig, waveform)
        expected = 0
        for block in record.blocks:
            assert block.start == expected
            assert block.counts.dtype == np.int16
            assert block.counts.shape[0] == len(rig.identify().channels)
            expected += block.counts.shape[1]
        assert expected == waveform.samples
        assert rig.read() is None

    def test_values_of_a_run_are_those_of_the_waveform_and_the_film(self, rig: Rig) -> None:
        waveform = lobes()
        record = play(rig, waveform)
        command = record.physical(rig, "voltage_command")
        monitor = record.physical(rig, "voltage_monitor")
        displacement = record.physical(rig, "displacement")
        # the output is at 0 V before the first sample
        assert abs(command[0]) < 1.0
        assert abs(monitor[0]) < self.MONITOR_TOLERANCE
        # the command channel is the waveform within half a count, and the monitor follows it
        scaling = rig.identify().channels[0].scaling
        half = 0.5 * abs(scaling.gain * scaling.coefficients[1])
        assert np.abs(command - waveform.window()).max() <= half * (1.0 + 1e-9)
        assert np.abs(monitor - command).max() < self.MONITOR_TOLERANCE
        # the film gets longer under voltage, from a reading that needs zeroing
        rest = displacement[:20].mean()
        assert abs(rest) > 1e-3
        assert 2e-5 < displacement.max() - rest < 5e-3

    @pytest.mark.parametrize("blocks_read", [0, 1, 3])
    def test_stop_ramps_down_and_leaves_the_record_readable(self, blocks_read: int) -> None:
        waveform = lobes(peaks=(8000.0,) * 10)
        with self.opened(block_samples=50) as rig:
            begin(rig, waveform)
            head = [block for _ in range(blocks_read) if (block := rig.read()) is not None]
            rig.stop()
            rig.stop()  # a second press of the button changes nothing
            tail = drain(rig)
            assert rig.state is RigState.DONE
            first = tail.blocks[0].start
            assert first == 50 * blocks_read
            counts = np.concatenate([*(b.counts for b in head), tail.counts], axis=1)
            command = rig.identify().channels[0].scaling.physical(counts[0])
        assert command.size < waveform.samples
        assert command[-1] == pytest.approx(0.0, abs=1.0)
        # the same as without the stop, then a straight line to 0 within the limits
        played = np.flatnonzero(np.abs(command - waveform.window(0, command.size)) > 1.0)
        at = played[0] if played.size else command.size
        assert np.all(np.diff(command[at - 1 :]) <= 1.0)
        assert np.all(np.abs(np.diff(command)) * RATE <= LIMITS.slew * 1.01)
        if command[at - 1] > 1.0:
            expected = LimitsSettings().ramp_down_s * RATE
            assert command.size - at == pytest.approx(expected, abs=2.0)

    def test_samples_that_have_changed_since_the_gate_are_never_output(self) -> None:
        checked = lobes(peaks=(8000.0,) * 8).window()
        factor = 1.0

        def window(start: int, stop: int) -> np.ndarray:
            values = checked[start:stop].copy()
            return factor * values if start >= 640 else values

        # pieces so short that the waveform is computed again while it is played
        with patch.multiple(gate, _PIECE=64, _KEPT=2), self.opened(block_samples=50) as rig:
            waveform = admit(Computed(checked.size, window), RATE, LIMITS, foreseen(checked.size))
            factor = 0.5  # within all limits, and yet not what was checked
            counts = [np.empty(0, dtype=np.int16)]

            def run() -> None:
                begin(rig, waveform)
                while (block := rig.read()) is not None:
                    counts.append(block.counts[0])

            with pytest.raises(ChangedWaveform, match="not those that passed the gate"):
                run()
            rig.make_safe()
            assert rig.state is RigState.SAFE
            command = rig.identify().channels[0].scaling.physical(np.concatenate(counts))
        assert command.size <= 640
        assert np.abs(command - checked[: command.size]).max(initial=0.0) < 1.0

    def test_a_waveform_computed_again_plays_as_one_that_is_held(self) -> None:
        checked = lobes(peaks=(8000.0,) * 8).window()
        source = Computed(checked.size, lambda start, stop: checked[start:stop])
        with patch.multiple(gate, _PIECE=64, _KEPT=2), self.opened(block_samples=50) as rig:
            record = play(rig, admit(source, RATE, LIMITS, foreseen(checked.size)))
            command = record.physical(rig, "voltage_command")
        assert np.abs(command - checked).max() < 1.0

    def test_a_waveform_that_grows_is_played_as_it_is_admitted(self) -> None:
        waveform = lobes(peaks=(6000.0,) * 8)
        gate_ = corrected(waveform)
        with self.opened(block_samples=50) as rig:
            if not _plays_growing(rig):
                pytest.skip("this rig does not play waveforms that grow")
            for _ in range(4):
                gate_.admit(0.0)
            begin(rig, gate_.waveform)
            blocks = []
            while (block := rig.read()) is not None:
                blocks.append(block)
                if not gate_.complete:
                    gate_.admit(0.03 if block.start < 600 else -0.03)
            command = (
                rig.identify()
                .channels[0]
                .scaling.physical(np.concatenate([block.counts[0] for block in blocks]))
            )
        assert command.size == waveform.samples
        assert np.abs(command - gate_.waveform.window()).max() < 1.0
        # the first answer is output after the four blocks that were admitted before the start
        differs = np.flatnonzero(np.abs(command - waveform.window()) > 1.0)
        assert 200 <= differs[0] < 230
        assert not np.array_equal(command, waveform.window())

    @pytest.mark.parametrize("answered", [0, 3])
    def test_a_waveform_that_stops_growing_ends_in_an_error(self, answered: int) -> None:
        gate_ = corrected(lobes(peaks=(6000.0,) * 8))
        with self.opened(block_samples=50) as rig:
            if not _plays_growing(rig):
                pytest.skip("this rig does not play waveforms that grow")
            for _ in range(2):
                gate_.admit(0.0)
            begin(rig, gate_.waveform)
            counts = [np.empty(0, dtype=np.int16)]

            def run() -> None:
                while (block := rig.read()) is not None:
                    counts.append(block.counts[0])
                    if len(counts) <= answered + 1:
                        gate_.admit(0.0)

            with pytest.raises(RigError):
                run()
            rig.make_safe()
            assert rig.state is RigState.SAFE
            command = rig.identify().channels[0].scaling.physical(np.concatenate(counts))
        assert command.size <= gate_.waveform.admitted
        assert np.abs(command - gate_.waveform.window(0, command.size)).max(initial=0.0) < 1.0

    @pytest.mark.parametrize("blocks_read", [0, 1, 7])
    def test_a_waveform_that_grows_can_be_stopped_at_any_time(self, blocks_read: int) -> None:
        gate_ = corrected(lobes(peaks=(6000.0,) * 8))
        with self.opened(block_samples=50) as rig:
            if not _plays_growing(rig):
                pytest.skip("this rig does not play waveforms that grow")
            for _ in range(4):
                gate_.admit(0.03)
            begin(rig, gate_.waveform)
            head = []
            for _ in range(blocks_read):
                block = rig.read()
                assert block is not None
                head.append(block)
                gate_.admit(0.03)
            rig.stop()
            tail = drain(rig)
            assert rig.state is RigState.DONE
            counts = np.concatenate([*(b.counts[0] for b in head), tail.counts[0]])
            command = rig.identify().channels[0].scaling.physical(counts)
        assert command[-1] == pytest.approx(0.0, abs=1.0)
        assert np.all(np.abs(np.diff(command)) * RATE <= LIMITS.slew * 1.01)
        played = gate_.waveform.window(0, command.size)
        left = np.flatnonzero(np.abs(command[: played.size] - played) > 1.0)
        at = left[0] if left.size else min(played.size, command.size)
        assert np.all(np.diff(command[at - 1 :]) <= 1.0)

    def test_stop_after_the_end_changes_nothing(self, rig: Rig) -> None:
        play(rig, lobes())
        rig.stop()
        assert rig.state is RigState.DONE

    @pytest.mark.parametrize("state", list(RigState))
    def test_make_safe_at_any_time_and_twice(self, rig: Rig, state: RigState) -> None:
        bring_to(rig, state)
        rig.make_safe()
        rig.make_safe()
        assert rig.state is (RigState.CLOSED if state is RigState.CLOSED else RigState.SAFE)
        if state is not RigState.CLOSED:
            assert play(rig, lobes()).counts.shape[1] == lobes().samples

    @pytest.mark.parametrize("state", list(RigState))
    def test_close_at_any_time_and_twice(self, rig: Rig, state: RigState) -> None:
        bring_to(rig, state)
        rig.close()
        rig.close()
        assert rig.state is RigState.CLOSED

    def test_runs_again(self, rig: Rig) -> None:
        first, second = play(rig, lobes()), play(rig, lobes(peaks=(5000.0,)))
        assert first.counts.shape[1] == lobes().samples
        assert second.blocks[0].start == 0
        assert second.counts.shape[1] == lobes(peaks=(5000.0,)).samples

    def test_same_seed_gives_the_same_bytes(self) -> None:
        records = []
        for _ in range(2):
            with self.opened(seed=5) as rig:
                records.append([play(rig, lobes()).counts for _ in range(2)])
        for before, after in zip(*records, strict=True):
            np.testing.assert_array_equal(before, after)

    def test_another_seed_or_run_gives_other_noise(self) -> None:
        counts = []
        for seed in (5, 6):
            with self.opened(seed=seed) as rig:
                counts += [play(rig, lobes()).counts for _ in range(2)]
        for one, other in itertools.combinations(counts, 2):
            assert not np.array_equal(one[3], other[3])

    def test_block_length_changes_nothing(self) -> None:
        # a card is asked once for each block: blocks of one sample only in a short run
        for many, lengths in ((1, (None, 1)), (8, (None, 333, 10**6))):
            waveform = lobes(peaks=(8000.0,) * many)
            records = []
            for block_samples in lengths:
                with self.opened(block_samples=block_samples) as rig:
                    records.append(play(rig, waveform))
            for record in records[1:]:
                np.testing.assert_array_equal(record.counts, records[0].counts)
                assert record.events == records[0].events
