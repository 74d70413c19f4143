"""Instruments at the card's terminals, wired as in the rig file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pydantic import Field

from dearig.drivers.channels import COUNT_MAX
from dearig.drivers.settings import RigSettings
from dearig.sim_backend.card import Converters
from dearig.sim_backend.daqmx.card.channels import AnalogInput
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.plant import Plant
from dearig.sim_backend.signal_path import PathState, SignalPath
from dearig.sim_backend.streams import Streams

__all__ = ["OUTPUT_MONITOR", "Wiring"]

#: The card's internal connection from its output to its inputs.
OUTPUT_MONITOR = "_{}_vs_aognd"
_SINE_SAMPLES = 100  # of one period of the sine on an input without a wire
_SINE_PART = 0.6  # of the span between the limits, so that no count at narrow limits is beyond them


def _is_monitor(terminal: str) -> bool:
    return terminal.startswith("_ao") and terminal.endswith("_vs_aognd")


class _TaskSettings(RigSettings):
    """Settings of the rig with a task's conversion times: ``conversions`` in s after the tick."""

    conversions: tuple[float, ...] = Field(default=())

    def skew(self, place: int) -> float:
        """Return the time in s from the tick to the conversion of the rig's input in ``place``."""
        return self.conversions[place] if self.conversions else super().skew(place)


class Wiring:
    """Instruments of ``settings`` with the film ``plant`` at rest and noise of ``noise_seed``."""

    def __init__(
        self,
        settings: RigSettings,
        plant: Plant,
        noise_seed: tuple[int, ...],
        faults: FaultPlan,
        *,
        sine: bool = False,
    ) -> None:
        self._settings = settings
        self._plant = plant
        self._streams = Streams(noise_seed)
        self._faults = faults
        self._output = Converters(settings, self._streams).channels[0].scaling
        self._sine = sine
        self._names = {t: n for n, t in settings.terminals().items() if n != "voltage_command"}
        if sine:
            self._names = {}
        laser = settings.laser
        self._laser_at_rest = laser.direction * laser.rest_position_mm / laser.mm_per_V
        self.zero = int(self._output.counts(np.zeros(1))[0])

    def warm_up(self) -> None:
        """Compute two samples, so that the kernels are compiled before a client waits for 0 V."""
        rate = self._settings.card.conversion_rate_Hz
        wired = [t for n, t in self._settings.terminals().items() if n != "voltage_command"]
        inputs = [AnalogInput(t, t, (-10.0, 10.0), 10.0, 0) for t in wired]
        skews = [self._settings.skew(place) for place in range(len(inputs))]
        path, state = self.run(0, rate, inputs, skews)
        path.advance(0, np.full(2, self.zero, dtype=np.int16), state)

    def film_voltage(self, counts: int) -> float:
        """Return the V at the film for ``counts`` on the output, with the amplifier enabled."""
        limit = self._settings.amplifier.range_kV * 1e3
        held = float(self._output.physical(np.array([counts], dtype=np.int16))[0])
        return min(max(held, -limit), limit)

    def output_volts(self, counts: int) -> float:
        """Return the voltage in V at the output's terminal."""
        return counts * self._settings.card.ao_range_V / (COUNT_MAX + 1)

    def coefficients(self, channel: AnalogInput) -> tuple[float, ...]:
        """Return the scaling of ``channel``: V over counts, lowest power first."""
        name = self._names.get(channel.terminal)
        if name is None:
            return (0.0, channel.range / (COUNT_MAX + 1), 0.0, 0.0)
        card = self._card([channel])
        return next(c.scaling.coefficients for c in card.channels if c.name == name)

    def run(
        self, number: int, rate: float, inputs: Sequence[AnalogInput], skews: Sequence[float]
    ) -> tuple[SignalPath, PathState]:
        """Return the signal path of run ``number`` at ``rate`` Hz, and its initial state.

        ``skews`` are the times in s from the tick to the conversion of each of ``inputs``.
        """
        at = dict(zip((c.terminal for c in inputs), skews, strict=True))
        wired = self._settings.terminals()
        settings = self._as_converted(
            inputs,
            # the conversion time of an input that the task does not read is arbitrary
            tuple(at.get(wired[n], skews[0]) for n in self._settings.channel_names[1:]),
        )
        card = Converters(settings, self._streams)
        path = SignalPath(settings, card, self._streams, number, rate, self._faults)
        return path, path.start(self._plant)

    def laser_reading(self, counts: np.ndarray, inputs: Sequence[AnalogInput]) -> tuple[int, float]:
        """Return the laser's last reading in the rig's ``counts`` (channels, n), and its range."""
        ranges = [c.range for c in inputs if c.terminal == self._settings.card.ai_displacement]
        limit = ranges[0] if ranges else self._settings.card.range_displacement_V
        return int(counts[self._settings.channel_names.index("displacement"), -1]), limit

    def monitored(self, inputs: Sequence[AnalogInput]) -> list[str]:
        """Return the outputs, such as ``ao0``, that ``inputs`` read back within the card."""
        return [c.terminal[1:].partition("_")[0] for c in inputs if _is_monitor(c.terminal)]

    def as_read(
        self,
        counts: np.ndarray,
        outputs: Mapping[str, np.ndarray],
        inputs: Sequence[AnalogInput],
        first: int = 0,
    ) -> np.ndarray:
        """Return counts (inputs, n) of a task from the rig's ``counts`` (channels, n).

        ``outputs`` has the counts (n,) of each output that is read back; an input without a wire
        reads 0, or a sine. ``first`` is the number of the first sample.
        """
        rows = {name: i for i, name in enumerate(self._settings.channel_names)}
        read = np.zeros((len(inputs), counts.shape[1]), dtype=np.int16)
        for row, channel in zip(read, inputs, strict=True):
            name = self._names.get(channel.terminal)
            if name is not None:
                row[:] = counts[rows[name]]
            else:
                self._without_wire(row, outputs, channel, first)
        return read

    def still(
        self,
        inputs: Sequence[AnalogInput],
        samples: int,
        reading: int,
        film: float,
        outputs: Mapping[str, int],
        laser: tuple[int, float] | None,
    ) -> np.ndarray:
        """Return counts (inputs, samples) of reading number ``reading`` of a rig at rest.

        ``film`` V are at the film, ``outputs`` counts on each output. ``laser`` is the last reading
        of its input in counts with its range; None: the film is at the loaded rest state.
        """
        amplifier = self._settings.amplifier
        noise = self._streams.before_run("card", reading).standard_normal((2, samples))
        noise *= amplifier.monitor_noise_mV * 1e-3
        volts: Mapping[str, np.ndarray] = {
            "voltage_monitor": film * 1e-3 * amplifier.monitor_V_per_kV + noise[0],
            "current_monitor": noise[1],
            "displacement": np.full(samples, self._laser_volts(laser)),
            "temperature": np.full(samples, self._room()),
            **{
                c.name: c.volts(np.full(samples, c.simulated_value)) for c in self._settings.channel
            },
        }
        card = self._card(inputs)
        read = np.zeros((len(inputs), samples), dtype=np.int16)
        for row, channel in zip(read, inputs, strict=True):
            name = self._names.get(channel.terminal)
            if name is not None:
                row[:] = card.convert(name, volts[name])
            else:
                held = {ao: np.full(samples, counts) for ao, counts in outputs.items()}
                self._without_wire(row, held, channel, reading)
        return read

    def _without_wire(
        self,
        row: np.ndarray,
        outputs: Mapping[str, np.ndarray],
        channel: AnalogInput,
        first: int,
    ) -> None:
        """Fill ``row`` (n,) with the output that ``channel`` reads back, or with a sine."""
        if self._sine and not _is_monitor(channel.terminal):
            low, high = channel.volts
            phase = 2.0 * np.pi * (first + np.arange(row.size)) / _SINE_SAMPLES
            volts = 0.5 * (low + high) + _SINE_PART * 0.5 * (high - low) * np.sin(phase)
            row[:] = np.clip(
                np.rint(volts * (COUNT_MAX + 1) / channel.range), -COUNT_MAX - 1, COUNT_MAX
            )
        for ao in self.monitored([channel]):
            scale = self._settings.card.ao_range_V / channel.range
            row[:] = np.clip(np.rint(outputs[ao] * scale), -COUNT_MAX - 1, COUNT_MAX)

    def _laser_volts(self, last: tuple[int, float] | None) -> float:
        if last is None:
            return self._laser_at_rest
        counts, limit = last
        terminal = self._settings.card.ai_displacement
        channel = AnalogInput("", terminal, (-limit, limit), limit, 0)
        return float(np.polynomial.polynomial.polyval(counts, self.coefficients(channel)))

    def _room(self) -> float:
        thermometer = self._settings.thermometer
        if thermometer is None:
            return 0.0
        return (thermometer.room_celsius - thermometer.celsius_at_0_V) / thermometer.celsius_per_V

    def _card(self, inputs: Sequence[AnalogInput]) -> Converters:
        return Converters(self._as_converted(inputs, ()), self._streams)

    def _as_converted(
        self, inputs: Sequence[AnalogInput], conversions: tuple[float, ...]
    ) -> _TaskSettings:
        """Return the settings with the ranges of ``inputs``, which each task may choose."""
        ranges = {self._names[c.terminal]: c.range for c in inputs if c.terminal in self._names}
        declared = tuple(
            c.model_copy(update={"range_V": ranges.pop(c.name, c.range_V)})
            for c in self._settings.channel
        )
        card = self._settings.card.model_copy(
            update={f"range_{name}_V": limit for name, limit in ranges.items()}
        )
        parts = {name: getattr(self._settings, name) for name in RigSettings.model_fields}
        changed = {"card": card, "channel": declared, "conversions": conversions}
        return _TaskSettings.model_construct(**{**parts, **changed})
