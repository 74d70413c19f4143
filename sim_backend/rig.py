"""Simulated rig: the simulated instruments behind the common interface of rigs."""

from __future__ import annotations

import math
import threading
import time

import numpy as np

from dearig.drivers.command import Command
from dearig.drivers.errors import RigError, RigStateError
from dearig.drivers.gate import GatedWaveform
from dearig.drivers.identity import instruments
from dearig.drivers.rig import Block, Event, RigIdentity, RigState
from dearig.drivers.settings import RigSettings
from dearig.drivers.zero_reading import ZeroReading
from dearig.sim_backend.card import INPUT_OVERWRITTEN, Converters
from dearig.sim_backend.clock import Clock
from dearig.sim_backend.faults import Fault, FaultKind, FaultPlan
from dearig.sim_backend.laser_noise import WHITE
from dearig.sim_backend.plant import Plant
from dearig.sim_backend.room import air_of_run
from dearig.sim_backend.signal_path import CHUNK, PathState, SignalPath
from dearig.sim_backend.streams import Streams

__all__ = ["OUTPUT_STARVED", "SimulatedRig"]

OUTPUT_STARVED = -200290  #: DAQmx: the output ran out of written samples

_ZERO_AVERAGED = 10  # values of the monitor whose mean is its reading at 0 V

# tolerance of the clock's rounding when ticks are counted
_TICK_TOLERANCE = 1e-6

# faults that only a card behind a server, or a laser at a serial port, can have
_NOT_IN_PROCESS = (FaultKind.SERVER_FROZEN, FaultKind.SERVER_GONE, FaultKind.SERIAL_GARBAGE)

_CARD_ERRORS = {
    FaultKind.AI_OVERFLOW: (
        INPUT_OVERWRITTEN,
        "samples were overwritten before they were read; read more often or enlarge "
        "card.ai_buffer_samples",
    ),
    FaultKind.AO_UNDERFLOW: (
        OUTPUT_STARVED,
        "the output ran out of written samples; enlarge card.ao_buffer_s, or close other programs "
        "on this computer",
    ),
}


class _Run:
    """One waveform being played, with its computed and delivered samples."""

    def __init__(self, command: Command, path: SignalPath, state: PathState) -> None:
        self.command = command
        self.started = 0.0  # s on the rig's clock
        self.delivered = 0  # samples handed to the reader
        self.stopped = False
        self.replied: set[Fault] = set()  # late replies that are over
        self.silent_until = 0.0  # s on the rig's clock
        self.events: list[Event] = []
        # samples of a waveform that grows are known block by block
        self._chunk = command.block or CHUNK
        self._path = path
        self._state = state  # after the newest chunk
        self._before = state  # before the newest chunk
        self._chunks = 0  # computed so far
        self._ready = np.empty((0, 0), dtype=np.int16)  # computed, not delivered

    @property
    def total(self) -> int:
        return self.command.samples

    def take(self, end: int) -> np.ndarray:
        """Return counts (channels, n) of the samples after the delivered ones, up to ``end``."""
        while self._chunks * self._chunk < end:
            self._compute()
        samples = end - self.delivered
        counts, self._ready = self._ready[:, :samples], self._ready[:, samples:]
        self.delivered = end
        return counts

    def ramp_from(self, sample: int, seconds: float) -> tuple[float, int]:
        """Replace the command from ``sample`` on with a ramp; returns as ``Command.ramp_from``.

        ``sample`` is later than all delivered samples, so only the newest chunk can hold samples
        that were computed ahead and are no longer valid. That chunk is computed again.
        """
        ramp = self.command.ramp_from(sample, seconds)
        if self._chunks * self._chunk > sample:
            self._chunks -= 1
            self._state = self._before
            self._ready = self._ready[:, :0]
            # the new computation also returns the undelivered samples of this chunk
            self.events = [e for e in self.events if e.sample < self._chunks * self._chunk]
        return ramp

    def _compute(self) -> None:
        first = self._chunks * self._chunk
        self._before = self._state
        counts, events, self._state = self._path.advance(
            self._chunks, self.command.window(first, first + self._chunk), self._before
        )
        counts = counts[:, max(0, self.delivered - first) :]
        self._ready = np.concatenate((self._ready, counts), axis=1) if self._ready.size else counts
        self.events.extend(e for e in events if e.sample >= self.delivered)
        self._chunks += 1


class SimulatedRig:
    """Simulated rig on a ``clock`` with the film ``plant``; see ``dearig.drivers.rig.Rig``.

    ``plant`` is the film at rest. Every run starts from it, as if the operator had let the film
    relax. Blocks hold ``block_samples`` samples, or a tenth of a second where that is None; the
    data do not depend on their length. A waveform that grows is computed in its own blocks.
    ``faults`` occur in every run. ``noise`` is the laser's kind of noise, one of
    ``laser_noise.NOISES``. All methods are thread-safe.
    """

    plays_growing_waveforms = True

    def __init__(
        self,
        settings: RigSettings,
        plant: Plant,
        clock: Clock,
        *,
        address: str = "sim",
        noise_seed: tuple[int, ...] = (0,),
        identity_seed: int | None = None,
        block_samples: int | None = None,
        faults: FaultPlan | None = None,
        noise: str = WHITE,
    ) -> None:
        if block_samples is not None and block_samples < 1:
            raise ValueError(f"block_samples = {block_samples} must be 1 or more, or None")
        self._faults = faults or FaultPlan()
        self._noise = noise
        for fault in self._faults.of(*_NOT_IN_PROCESS):
            raise ValueError(
                f"fault {fault.kind} needs a server or a serial port: an in-process rig cannot "
                f"have it"
            )
        self._settings = settings
        self._plant = plant
        self._clock = clock
        self._address = address
        self._identity_seed = identity_seed
        self._block_samples = block_samples
        self._streams = Streams(noise_seed)
        self._card = Converters(settings, self._streams)
        self._lock = threading.RLock()
        self._wake = threading.Event()
        self._state = RigState.SAFE
        self._run: _Run | None = None
        self._runs = 0
        self._rate = 0.0
        self._zero_reading: ZeroReading | None = None

    @property
    def state(self) -> RigState:
        """Return the state of the rig."""
        return self._state

    @property
    def zero_reading(self) -> ZeroReading | None:
        """Return the voltage monitor's reading after ``make_safe``, None before the first call."""
        return self._zero_reading

    @property
    def output(self) -> float:
        """Return the present command in V at the film."""
        with self._lock:
            run = self._run
            if self._state is not RigState.RUNNING or run is None:
                return 0.0
            at = max(0, min(self._ticks(run), run.command.available - 1))
            scaling = self._card.channels[0].scaling
            return float(scaling.physical(run.command.window(at, at + 1))[0])

    def identify(self) -> RigIdentity:
        """Return the rig's instruments; the output does not change."""
        with self._lock:
            self._expect("identify", *(s for s in RigState if s is not RigState.CLOSED))
        return RigIdentity(
            address=self._address,
            simulated=True,
            instruments=instruments(
                self._settings,
                card_model=self._settings.card.model,
                card_serial="simulated",
                unnamed="simulated",
            ),
            channels=self._card.channels,
            seed=self._identity_seed,
        )

    def load(self, waveform: GatedWaveform) -> float:
        """Load a waveform that has passed the gate; returns the actual sample rate in Hz.

        Raises ``RigError`` for a waveform that passed under wider limits than this rig's, or for a
        rate that the card cannot run at.
        """
        if not isinstance(waveform, GatedWaveform):
            raise TypeError(
                f"a rig plays a GatedWaveform, which drivers.gate.admit makes, "
                f"not {type(waveform).__name__}"
            )
        with self._lock:
            self._expect("load", RigState.SAFE, RigState.DONE)
            waveform.check_within(self._settings.limits.gate_limits())
            rate = self._card.actual_rate(waveform.rate)
            path = SignalPath(
                self._settings,
                self._card,
                self._streams,
                self._runs,
                rate,
                self._faults,
                self._noise,
                waveform.block or CHUNK,
                air_of_run(self._settings.room, self._streams.seed[0] + self._runs),
            )
            command = Command(waveform, self._card.channels[0].scaling)
            self._run = _Run(command, path, path.start(self._plant))
            self._runs += 1
            self._rate = rate
            self._state = RigState.LOADED
            return rate

    def arm(self) -> None:
        """Prepare for a start without delay; the output stays at 0 V."""
        with self._lock:
            self._expect("arm", RigState.LOADED)
            self._state = RigState.ARMED

    def start(self) -> None:
        """Start the sample clock."""
        with self._lock:
            self._expect("start", RigState.ARMED)
            self._running().started = self._clock.now()
            self._state = RigState.RUNNING

    def read(self) -> Block | None:
        """Wait for the next block and return it, or None after the last one.

        Raises ``RigError`` with DAQmx's code -200279 where the reader was so late that samples were
        overwritten, for a planned fault of the card, and ``ChangedWaveform`` for a waveform that
        is not the admitted one; the output is then at 0 V. Raises ``RigStateError`` where the rig
        was made safe.
        """
        while True:
            with self._lock:
                if self._state is RigState.DONE:
                    return None
                self._expect("read", RigState.RUNNING)
                run = self._running()
                if run.delivered == run.total:
                    self._state = RigState.DONE
                    return None
                end = min(run.delivered + self._block_size(run), run.total)
                acquired = min(self._ticks(run), run.total)
                try:
                    self._card.check_buffer(acquired - run.delivered, self._rate)
                    self._check_output(run, acquired)
                    self._card_fails(run)
                    silent = self._silent(run)
                    if acquired >= end and not silent:
                        return self._deliver(run, end)
                except RigError:
                    self.make_safe()
                    raise
                due = run.silent_until if silent else self._due(run, end)
                self._wake.clear()
            self._clock.wait(due, self._wake)

    @property
    def waiting(self) -> float:
        """Return the reader's delay in s: samples that were acquired and not read."""
        with self._lock:
            run = self._run
            if self._state is not RigState.RUNNING or run is None:
                return 0.0
            return (min(self._ticks(run), run.total) - run.delivered) / self._rate

    def stop(self) -> None:
        """End the run early with a ramp to 0 V; acquired samples stay readable."""
        with self._lock:
            if self._state is RigState.DONE:
                return  # the waveform ended just before the call
            self._expect("stop", RigState.RUNNING)
            run = self._running()
            # with the sample that is on the output now
            played = min(self._ticks(run) + 1, run.command.available)
            if run.stopped or played >= run.total:
                return
            volts, samples = run.ramp_from(played, self._settings.limits.ramp_down_s)
            run.stopped = True
            run.events.append(
                Event(
                    played,
                    "info",
                    f"stopped: ramping from {volts * 1e-3:.4g} kV to 0 in "
                    f"{samples / self._rate:.3g} s",
                )
            )
            self._wake.set()

    def make_safe(self) -> None:
        """Take the output to 0 V at once and discard the waveform."""
        with self._lock:
            if self._state is RigState.CLOSED:
                return
            self._run = None
            self._state = RigState.SAFE
            self._zero_reading = self._read_zero()
            self._wake.set()

    def close(self) -> None:
        """Make safe and release the instruments."""
        with self._lock:
            self.make_safe()
            self._state = RigState.CLOSED

    def _read_zero(self) -> ZeroReading:
        """Return a reading of the voltage monitor at 0 V, with its noise."""
        settings = self._settings
        noise = self._streams.before_run("amplifier", self._runs).standard_normal(_ZERO_AVERAGED)
        counts = self._card.convert(
            "voltage_monitor", noise * settings.amplifier.monitor_noise_mV * 1e-3
        )
        monitor = next(c for c in self._card.channels if c.name == "voltage_monitor")
        voltage = float(monitor.scaling.physical(counts).mean())
        allowed = settings.limits.zero_tolerance_kV * 1e3
        return ZeroReading(voltage, time.time(), abs(voltage) <= allowed)

    def _deliver(self, run: _Run, end: int) -> Block:
        start = run.delivered
        counts = run.take(end)
        if not run.events:
            return Block(start, counts)
        due = sorted((e for e in run.events if e.sample < end), key=lambda event: event.sample)
        run.events = [e for e in run.events if e.sample >= end]
        if end == run.total:  # the event of an empty ramp is one sample beyond the last
            due, run.events = due + run.events, []
        return Block(start, counts, tuple(due))

    def _block_size(self, run: _Run) -> int:
        """Return the number of samples in the next block, fewer where a short read is planned."""
        size = self._block_samples or max(1, round(0.1 * self._rate))
        for fault in self._faults.of(FaultKind.SHORT_READ):
            first, end = fault.samples(self._rate)
            wanted = first + 1 - run.delivered  # up to the start of the fault
            if 0 < wanted <= size:
                return max(1, min(wanted, size - 1))
            if first < run.delivered < end:
                return max(1, size // 2)
        return size

    def _check_output(self, run: _Run, acquired: int) -> None:
        """Raise ``RigError`` where the waveform has not grown as fast as it was played."""
        if acquired > run.command.available:
            _, words = _CARD_ERRORS[FaultKind.AO_UNDERFLOW]
            raise RigError(f"card {self._settings.card.device}: {words}", OUTPUT_STARVED)

    def _card_fails(self, run: _Run) -> None:
        for fault in self._faults.of(*_CARD_ERRORS):
            # the same sum as in _due, so that a reader that waited until then finds the fault
            if self._clock.now() >= run.started + fault.at:
                code, words = _CARD_ERRORS[fault.kind]
                raise RigError(f"card {self._settings.card.device}: {words}", code)

    def _silent(self, run: _Run) -> bool:
        """Return True while a late reply delays the reader."""
        now = self._clock.now()
        for fault in self._faults.of(FaultKind.LATE_REPLY):
            if fault not in run.replied and now >= run.started + fault.at:
                run.replied.add(fault)
                run.silent_until = max(run.silent_until, now + fault.duration)
        return now < run.silent_until

    def _due(self, run: _Run, end: int) -> float:
        """Return the clock's time in s of sample ``end``, or of an earlier fault."""
        events = self._faults.of(*_CARD_ERRORS, FaultKind.LATE_REPLY)
        times = (run.started + fault.at for fault in events if fault not in run.replied)
        return min(run.started + end / self._rate, *times, math.inf)

    def _ticks(self, run: _Run) -> int:
        """Return the number of whole sample intervals since the start."""
        return int((self._clock.now() - run.started) * self._rate + _TICK_TOLERANCE)

    def _running(self) -> _Run:
        if self._run is None:
            raise RigStateError("no waveform is loaded")
        return self._run

    def _expect(self, call: str, *states: RigState) -> None:
        if self._state not in states:
            wanted = " or ".join(state.value for state in states)
            raise RigStateError(f"{call}: the rig is {self._state.value}, it must be {wanted}")
