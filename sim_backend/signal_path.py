"""Signal path of the simulated rig: converter, amplifier, film, laser, converter."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace

import numpy as np

from dearig.drivers.channels import HUMIDITY
from dearig.drivers.rig import Event
from dearig.drivers.settings import RigSettings, ThermometerSettings
from dearig.sim_backend.amplifier import Amplifier, AmplifierRows, AmplifierState
from dearig.sim_backend.card import Converters
from dearig.sim_backend.current import CurrentMonitor, CurrentState
from dearig.sim_backend.faults import FaultKind, FaultPlan
from dearig.sim_backend.laser import Laser, LaserRows, LaserState
from dearig.sim_backend.laser_noise import WHITE
from dearig.sim_backend.plant import Motion, Plant
from dearig.sim_backend.room import AirOfRoom
from dearig.sim_backend.streams import Streams

__all__ = ["CHUNK", "PathState", "SignalPath"]

#: Samples in a chunk. Chunks are counted from the start of the run, whatever the reader's block
#: length: the kernels may round differently at a chunk's edge, and the data must not depend on it.
CHUNK = 4096

_NODE_SPACING = 1e-3  # s; a cubic over it is within 1e-4 of the amplitude of the film's ringing

_GRAVITY = 9.81  # m/s^2
_FLOOR = 0.2  # m; where the load comes to lie below its rest position after the film ruptures
_NO_VOLTAGE = 10.0  # V; below this command the current into a short is negligible
_BURST = 4e-3  # m, RMS of the sensor's noise burst

_SHORTED = (FaultKind.ARC, FaultKind.FILM_RUPTURE)
_DEAD = (*_SHORTED, FaultKind.AMPLIFIER_TRIP)


@dataclass(frozen=True)
class PathState:
    """State of the signal path between two chunks.

    ``torn`` is the load's position in m and velocity in m/s when the film ruptured. ``stuck`` is
    the laser's count when it got stuck. Each is None until that happens.
    """

    plant: Plant
    amplifier: AmplifierState
    laser: LaserState
    current: CurrentState = field(default_factory=CurrentState)
    settled: bool = True
    torn: tuple[float, float] | None = None
    stuck: int | None = None


class SignalPath:
    """Signal path in one run at ``rate`` Hz with ``faults``; the state is passed in and out.

    It is computed in chunks of ``chunk`` samples; ``air`` is that of the room.
    """

    def __init__(
        self,
        settings: RigSettings,
        card: Converters,
        streams: Streams,
        run: int,
        rate: float,
        faults: FaultPlan | None = None,
        noise: str = WHITE,
        chunk: int = CHUNK,
        air: AirOfRoom | None = None,
    ) -> None:
        self._chunk = chunk
        self._air = air or AirOfRoom(settings.room)
        self._settings = settings
        self._rate = rate
        self._faults = faults or FaultPlan()
        self._card = card
        self._streams = streams
        self._run = run
        # nodes of the film's motion: at least one a sample, spaced by _NODE_SPACING at most
        self._nodes = max(1, math.ceil(1.0 / (rate * _NODE_SPACING) - 1e-9))
        self._spacing = 1.0 / (rate * self._nodes)
        self._amplifier = Amplifier(settings.amplifier)
        self._current = CurrentMonitor(settings.amplifier, self._spacing)
        self._laser = Laser(settings.laser, streams, run, 1.0 / rate, self._spacing, noise)
        self._names = settings.channel_names
        self._skews = {name: settings.skew(i) for i, name in enumerate(self._names[1:])}

    def start(self, plant: Plant) -> PathState:
        """Return the state before the first sample, with ``plant`` redrawn for this run."""
        plant = plant.renewed(self._streams.before_run("film", self._run)).in_room(self._air)
        return PathState(plant, AmplifierState(), self._laser.start())

    def advance(
        self, chunk: int, command: np.ndarray, state: PathState
    ) -> tuple[np.ndarray, list[Event], PathState]:
        """Play chunk number ``chunk``: ``command`` (n,) int16 counts, n up to a chunk.

        Returns counts (channels, n) int16, events, and the state after the chunk.
        """
        first, samples, nodes = chunk * self._chunk, command.size, self._nodes
        dead = self._active(first, samples, *_DEAD)
        rows, amplifier = self._amplify(command, dead, state)
        time = np.arange(first * nodes, (first + samples) * nodes + 1) * self._spacing
        pulling, held = rows.effective, rows.target
        broken_lead = self._active(first, samples, FaultKind.ELECTRODE_OPEN)
        if broken_lead.any():
            pulling, held = (
                np.where(np.repeat(broken_lead, nodes), 0.0, volts) for volts in (pulling, held)
            )
        motion, plant = state.plant.advance(
            time, np.append(pulling, pulling[-1]), True, np.append(held, held[-1])
        )
        electricity = motion.electricity
        motion, torn = self._fall(motion, time, first, state.torn)

        monitors = self._settings.amplifier
        generator = self._streams.of_chunk("amplifier", self._run, chunk)
        noise = generator.standard_normal((2, self._chunk))
        noise = noise[:, :samples] * (monitors.monitor_noise_mV * 1e-3)

        at, into = self._converted("voltage_monitor", samples)
        voltage = self._amplifier.outputs(rows, at, into)
        if electricity.shown is not None:
            shown, part = electricity.shown[:, at], into / self._spacing
            difference = shown[0] * (1.0 - part) + shown[1] * part - held[at]
            voltage += np.where(dead, 0.0, difference)
        voltage[self._active(first, samples, FaultKind.MONITOR_WIRE_OFF)] = 0.0
        counts = np.empty((len(self._names), samples), dtype=np.int16)
        counts[0] = command
        counts[1] = self._card.convert(
            "voltage_monitor", voltage * 1e-3 * monitors.monitor_V_per_kV + noise[0]
        )
        at, into = self._converted("current_monitor", samples)
        current, delivered = self._current.read(
            electricity, rows.slew, state.plant.capacitance, at, into, state.current
        )
        current[dead | broken_lead] = 0.0
        shorted = self._active(first, samples, *_SHORTED)
        current[shorted] = self._into_short(command[shorted])
        counts[2] = self._card.convert(
            "current_monitor", current * 1e3 * monitors.current_monitor_V_per_mA + noise[1]
        )
        at, into = self._converted("displacement", samples)
        reading, laser = self._laser.read(
            motion.displacement, motion.velocity, time[at] + into, chunk, self._chunk, state.laser
        )
        # the burst draws last from this generator, so that all other noise stays the same
        reading = self._disturb(reading, first, generator)
        laser = replace(laser, alarm=bool(reading.alarm[-1]))
        counts[3], stuck = self._stick(
            self._card.convert("displacement", reading.volts), first, state.stuck
        )
        times = (first + np.arange(samples)) / self._rate
        if self._settings.thermometer is not None:
            at, _ = self._converted("temperature", samples)
            warming = motion.heating[at] + self._air.temperature_change(times)
            counts[4] = self._temperature(self._settings.thermometer, warming, chunk)
        declared = self._settings.channel
        if declared:
            counts[-len(declared) :] = self._declared(chunk, times)

        events = [
            *self._amplifier_events(first, rows.settled, state.settled),
            *_laser_events(first, reading, state.laser.alarm),
        ]
        if motion.fault is not None:
            events.append(Event(first + motion.fault_at // nodes, "fault", f"film: {motion.fault}"))
        events.sort(key=lambda event: event.sample)
        after = PathState(plant, amplifier, laser, delivered, bool(rows.settled[-1]), torn, stuck)
        return counts, events, after

    def _active(self, first: int, samples: int, *kinds: FaultKind) -> np.ndarray:
        return self._faults.active(first, samples, self._rate, *kinds)

    def _amplify(
        self, command: np.ndarray, dead: np.ndarray, state: PathState
    ) -> tuple[AmplifierRows, AmplifierState]:
        """Return the amplifier's output under ``command`` (n,) counts, 0 V where ``dead`` (n,)."""
        nodes = self._nodes
        capacitance = state.plant.capacitance + self._settings.amplifier.cable_pF * 1e-12
        volts = np.repeat(self._card.put_out(command), nodes)
        edges = [0, *(np.flatnonzero(np.diff(dead)) + 1), command.size]
        now, pieces = state.amplifier, []
        for begin, end in itertools.pairwise(edges):
            part = slice(begin * nodes, end * nodes)
            rows, now = self._amplifier.advance(volts[part], self._spacing, capacitance, now)
            if dead[begin]:
                nothing, now = np.zeros_like(rows.start), AmplifierState()
                idle = np.repeat(np.abs(self._wanted(command[begin:end])) < _NO_VOLTAGE, nodes)
                rows = AmplifierRows(nothing, nothing, nothing, idle, rows.slew)
            pieces.append(rows)
        if len(pieces) == 1:
            return pieces[0], now
        start, target, effective, settled = (
            np.concatenate([getattr(rows, name) for rows in pieces])
            for name in ("start", "target", "effective", "settled")
        )
        return AmplifierRows(start, target, effective, settled, pieces[0].slew), now

    def _wanted(self, command: np.ndarray) -> np.ndarray:
        """Return the voltage (n,) V at the film that ``command`` (n,) counts ask for."""
        return self._card.channels[0].scaling.physical(command)

    def _into_short(self, command: np.ndarray) -> np.ndarray:
        """Return the current (n,) A into a short under ``command`` (n,) counts."""
        wanted = self._wanted(command)
        limit = self._settings.amplifier.current_limit_mA * 1e-3
        return np.where(np.abs(wanted) < _NO_VOLTAGE, 0.0, np.copysign(limit, wanted))

    def _fall(
        self, motion: Motion, time: np.ndarray, first: int, torn: tuple[float, float] | None
    ) -> tuple[Motion, tuple[float, float] | None]:
        """Return ``motion`` with the load in free fall from where it was when the film ruptured."""
        nodes = self._nodes
        for fault in self._faults.of(FaultKind.FILM_RUPTURE)[:1]:
            node = (fault.samples(self._rate)[0] - first) * nodes
            if node >= time.size - 1:
                continue
            if torn is None:
                torn = float(motion.displacement[node]), float(motion.velocity[node])
            begin = max(0, node)
            elapsed = time[begin:] - (first * nodes + node) * self._spacing
            position = torn[0] + torn[1] * elapsed + 0.5 * _GRAVITY * elapsed**2
            velocity = torn[1] + _GRAVITY * elapsed
            velocity[position > _FLOOR] = 0.0
            motion = replace(
                motion,
                displacement=np.append(motion.displacement[:begin], np.minimum(position, _FLOOR)),
                velocity=np.append(motion.velocity[:begin], velocity),
            )
        return motion, torn

    def _disturb(self, reading: LaserRows, first: int, generator: np.random.Generator) -> LaserRows:
        """Return the laser's output with the sensor's faults."""
        laser, samples = self._settings.laser, reading.volts.size
        burst = self._active(first, samples, FaultKind.SENSOR_NOISE_BURST)
        lost = self._active(first, samples, FaultKind.SENSOR_OUT_OF_RANGE)
        if not (burst | lost).any():
            return reading
        noise = generator.standard_normal(self._chunk)[:samples] * _BURST * 1e3 / laser.mm_per_V
        rail = laser.analog_range_V
        volts = np.clip(reading.volts + np.where(burst, noise, 0.0), -rail, rail)
        return LaserRows(np.where(lost, rail, volts), reading.alarm | lost)

    def _stick(
        self, counts: np.ndarray, first: int, stuck: int | None
    ) -> tuple[np.ndarray, int | None]:
        """Return the laser's ``counts`` (n,), held where the laser is stuck."""
        held = counts.copy()
        for fault in self._faults.of(FaultKind.SENSOR_STUCK):
            begin, end = (s - first for s in fault.samples(self._rate))
            if begin >= counts.size or end <= 0:
                continue
            if begin >= 0:
                stuck = int(counts[begin])
            if stuck is not None:
                held[max(0, begin) : min(end, counts.size)] = stuck
        return held, stuck

    def _converted(self, channel: str, samples: int) -> tuple[slice, float]:
        """Return the node intervals in which ``channel`` is converted, and the s into each."""
        skew = self._skews[channel]
        node = int(skew / self._spacing)
        return slice(node, samples * self._nodes, self._nodes), skew - node * self._spacing

    def _temperature(
        self, thermometer: ThermometerSettings, heating: np.ndarray, chunk: int
    ) -> np.ndarray:
        generator = self._streams.of_chunk("thermometer", self._run, chunk)
        noise = generator.standard_normal(self._chunk)[: heating.size] * thermometer.noise_mK * 1e-3
        celsius = thermometer.room_celsius + heating + noise
        volts = (celsius - thermometer.celsius_at_0_V) / thermometer.celsius_per_V
        return self._card.convert("temperature", volts)

    def _declared(self, chunk: int, times: np.ndarray) -> np.ndarray:
        """Return counts (channels, n) at ``times`` (n,) s of the rig file's channels.

        The one of the relative humidity follows the room.
        """
        channels = self._settings.channel
        noise = self._streams.of_chunk("channels", self._run, chunk)
        drawn = noise.standard_normal((len(channels), self._chunk))[:, : times.size]
        counts = []
        for channel, row in zip(channels, drawn, strict=True):
            values = channel.simulated_value + channel.simulated_noise * row
            if channel.name == HUMIDITY:
                values = values + self._air.humidity_change(times)
            counts.append(self._card.convert(channel.name, channel.volts(values)))
        return np.array(counts)

    def _amplifier_events(self, first: int, settled: np.ndarray, before: bool) -> list[Event]:
        return [
            Event(
                first + at // self._nodes,
                "warning",
                "amplifier: the output lags behind its command "
                "(slew, current limit or bandwidth); the voltage monitor shows what the film gets",
            )
            if not arrived
            else Event(first + at // self._nodes, "info", "amplifier: the output follows again")
            for at, arrived in _changes(settled, before)
        ]


def _laser_events(first: int, reading: LaserRows, before: bool) -> list[Event]:
    return [
        Event(first + at, "warning", "laser: the film is out of the measuring range")
        if alarm
        else Event(first + at, "info", "laser: the film is back in the measuring range")
        for at, alarm in _changes(reading.alarm, before)
    ]


def _changes(flags: np.ndarray, before: bool) -> list[tuple[int, bool]]:
    """Return the places where ``flags`` (N,) change, with the new value."""
    changed = np.flatnonzero(np.diff(flags, prepend=before))
    return [(int(at), bool(flags[at])) for at in changed]
