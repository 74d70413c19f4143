"""The way of a sample through the rig: converter, amplifier, film, laser, converter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.rig import Event
from drivers.settings import RigSettings, ThermometerSettings
from sim_backend.amplifier import Amplifier, AmplifierState
from sim_backend.card import Card
from sim_backend.laser import Laser, LaserRows, LaserState
from sim_backend.plant import Motion, Plant
from sim_backend.streams import Streams

__all__ = ["CHUNK", "PathState", "SignalPath"]

#: Samples that are computed at a time, counted from the start of the run whatever the reader asks
#: for: the kernels may round differently where a record is cut, and the data must not.
CHUNK = 4096

_NODE_SPACING = 1e-3  # s; a cubic follows the film's ringing over that to 1e-4 of its amplitude


@dataclass(frozen=True)
class PathState:
    """All that the rig remembers between two chunks."""

    plant: Plant
    amplifier: AmplifierState
    laser: LaserState
    settled: bool = True


class SignalPath:
    """The rig during one run at ``rate`` Hz; holds no state of its own."""

    def __init__(
        self, settings: RigSettings, card: Card, streams: Streams, run: int, rate: float
    ) -> None:
        self._settings = settings
        self._card = card
        self._streams = streams
        self._run = run
        # nodes of the film's motion: as many to each sample as accuracy asks for
        self._nodes = max(1, math.ceil(1.0 / (rate * _NODE_SPACING) - 1e-9))
        self._spacing = 1.0 / (rate * self._nodes)
        self._amplifier = Amplifier(settings.amplifier)
        self._laser = Laser(settings.laser, streams, run, 1.0 / rate, self._spacing)
        self._names = settings.channel_names
        self._skews = {name: settings.skew(i) for i, name in enumerate(self._names[1:])}

    def start(self, plant: Plant) -> PathState:
        """State before the first sample."""
        return PathState(plant, AmplifierState(), self._laser.start())

    def advance(
        self, chunk: int, command: np.ndarray, state: PathState
    ) -> tuple[np.ndarray, list[Event], PathState]:
        """Play chunk number ``chunk``, ``command`` (n,) int16 counts, n up to ``CHUNK``.

        Returns counts (channels, n) int16, events, and the state after it.
        """
        first, samples, nodes = chunk * CHUNK, command.size, self._nodes
        volts = self._card.put_out(command)
        if nodes > 1:
            volts = np.repeat(volts, nodes)
        rows, amplifier = self._amplifier.advance(
            volts, self._spacing, state.plant.capacitance, state.amplifier
        )
        time = np.arange(first * nodes, (first + samples) * nodes + 1) * self._spacing
        held = np.append(rows.effective, rows.effective[-1])
        motion, plant = state.plant.advance(time, held, True)

        monitors = self._settings.amplifier
        noise = self._streams.of_chunk("amplifier", self._run, chunk).standard_normal((2, CHUNK))
        noise = noise[:, :samples] * (monitors.monitor_noise_mV * 1e-3)

        at, into = self._converted("voltage_monitor", samples)
        voltage, _ = self._amplifier.outputs(rows, at, into)
        counts = np.empty((len(self._names), samples), dtype=np.int16)
        counts[0] = command
        counts[1] = self._card.convert(
            "voltage_monitor", voltage * 1e-3 * monitors.monitor_V_per_kV + noise[0]
        )
        at, into = self._converted("current_monitor", samples)
        voltage, slope = self._amplifier.outputs(rows, at, into)
        current = self._current(motion, at, voltage, slope)
        counts[2] = self._card.convert(
            "current_monitor", current * 1e3 * monitors.current_monitor_V_per_mA + noise[1]
        )
        at, into = self._converted("displacement", samples)
        reading, laser = self._laser.read(
            motion.displacement, motion.velocity, time[at] + into, chunk, CHUNK, state.laser
        )
        counts[3] = self._card.convert("displacement", reading.volts)
        if self._settings.thermometer is not None:
            at, _ = self._converted("temperature", samples)
            counts[4] = self._temperature(self._settings.thermometer, motion.heating[at], chunk)

        events = [
            *self._amplifier_events(first, rows.settled, state.settled),
            *_laser_events(first, reading, state.laser.alarm),
        ]
        if motion.fault is not None:
            events.append(Event(first + motion.fault_at // nodes, "fault", f"film: {motion.fault}"))
        events.sort(key=lambda event: event.sample)
        return counts, events, PathState(plant, amplifier, laser, bool(rows.settled[-1]))

    def _converted(self, channel: str, samples: int) -> tuple[slice, float]:
        """Intervals between nodes in which ``channel`` is converted, and how far into them in s."""
        skew = self._skews[channel]
        node = int(skew / self._spacing)
        return slice(node, samples * self._nodes, self._nodes), skew - node * self._spacing

    def _current(
        self, motion: Motion, at: slice, voltage: np.ndarray, slope: np.ndarray
    ) -> np.ndarray:
        """Current (n,) A into the film: its charge is C V, and both change; and the leakage."""
        growth = np.diff(motion.capacitance)[at] / self._spacing
        return motion.capacitance[:-1][at] * slope + growth * voltage + motion.leakage[:-1][at]

    def _temperature(
        self, thermometer: ThermometerSettings, heating: np.ndarray, chunk: int
    ) -> np.ndarray:
        generator = self._streams.of_chunk("thermometer", self._run, chunk)
        noise = generator.standard_normal(CHUNK)[: heating.size] * thermometer.noise_mK * 1e-3
        celsius = thermometer.room_celsius + heating + noise
        volts = (celsius - thermometer.celsius_at_0_V) / thermometer.celsius_per_V
        return self._card.convert("temperature", volts)

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
    """Where ``flags`` (N,) change, with what they change to."""
    changed = np.flatnonzero(np.diff(flags, prepend=before))
    return [(int(at), bool(flags[at])) for at in changed]
