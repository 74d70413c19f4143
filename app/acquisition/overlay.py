"""An overlay model that runs in step with a run, block by block."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.rig import Block
from dearig.model import kernel
from dearig.model.circuit import loop
from dearig.model.circuit.loop import circuit_state
from dearig.model.effects import SENSOR_MEMORY
from dearig.model.errors import ModelError
from dearig.model.film.sensor import at_sensor
from dearig.model.simulation.actuator import (
    NO_AIR,
    STATUS_TEXTS,
    Actuator,
    at_rest,
    ends_of,
    initial_state,
)

__all__ = ["Overlay", "OverlayModel"]

_TEMPERATURE_MEAN = 1.0  # s over which a temperature is averaged, as in a fit


@dataclass(frozen=True)
class OverlayModel:
    """A model that runs in step with a measurement.

    ``path`` is that of its model file, None for a model that is in no file; ``toml`` is the text
    that a recording keeps.
    """

    name: str
    actuator: Actuator
    path: Path | None = None
    toml: str = ""

    def compile(self) -> None:
        """Compile the kernels that an ``Overlay`` of this model calls, unless they are.

        A first use takes minutes. During a run it would hold up the thread that writes the
        recording, until no more samples fit into memory. A model without a rest state is left to
        the ``Overlay``, which says what is wrong.
        """
        channel = Channel("voltage_command", "V", Scaling((0.0, 1.0), 1.0))
        with contextlib.suppress(ModelError):
            overlay = Overlay(self.actuator, (channel,), rate=1000.0)
            for start in (0, 2):  # the second block goes on from the first
                overlay.advance(Block(start, np.zeros((1, 2), dtype=np.int16)))


class Overlay:
    """``actuator`` driven by the ``command`` or the ``monitor`` voltage of a run's blocks.

    ``channels`` are those of the blocks, in their order, with ``rate`` rows a second. Each is the
    mean of ``average`` conversions; between means the voltage is linear. The film starts
    at rest; its state and the sensor's are carried from block to block, so that the result does not
    depend on the length of the blocks, except for integration errors (hundredths of a micrometre).
    The temperature rise is the mean of the last second less the mean of the first.

    Raises ``ModelError`` for a film without a rest state, and ``ValueError`` where the channels
    hold no such voltage.
    """

    def __init__(
        self,
        actuator: Actuator,
        channels: Sequence[Channel],
        rate: float,
        drive: str = "command",
        average: int = 1,
    ) -> None:
        names = [channel.name for channel in channels]
        if f"voltage_{drive}" not in names:
            raise ValueError(f"drive {drive!r}: the channels are {', '.join(names)}")
        self._row = names.index(f"voltage_{drive}")
        self._scaling = channels[self._row].scaling
        self._thermometer = names.index("temperature") if "temperature" in names else None
        self._channels = tuple(channels)
        reading = next((c for c in channels if c.name == "displacement"), None)
        self._lag = 0.0 if reading is None else reading.delay - reading.skew
        if average > 1:
            # as ``Readings.lag`` of the recording
            self._lag += 0.5 / (rate * average)
        self._holds = average == 1
        self._rate = rate
        self._length = actuator.film.length
        self._coefficients = actuator.coefficients()
        status, self._rest = at_rest(self._coefficients)
        if status != kernel.OK:
            raise ModelError(STATUS_TEXTS[status])
        self._state = initial_state(self._coefficients, self._rest)
        self._memory = np.zeros(SENSOR_MEMORY)
        self._next = 0
        self._voltage = 0.0
        # time, displacement and velocity that a sensor with a delay has not read yet
        self._past = np.zeros((3, 0))
        self._keep = max(2, math.ceil(max(self._lag, 0.0) * rate) + 2)
        self._read = (0.0, 0.0)  # displacement and velocity before the sensor's effects
        self._temperature_rise = _TemperatureRise(rate)
        into = next((c.skew for c in channels if c.name == "current_monitor"), 0.0)
        self._reads = (loop.ABOUT if average > 1 else loop.AT, max(into, 0.0))
        self._circuit = circuit_state()
        #: current (n,) A that the film draws at the samples of the last block, by the model; NaN
        #: where that failed. The monitor also reads its offset, the cable, and what it is slow for.
        self.current = np.empty(0)
        self._failure = ""

    @property
    def failure(self) -> str:
        """Reason why the model failed; empty while it works."""
        return self._failure

    def advance(self, block: Block) -> np.ndarray:
        """Return the displacement (n,) m that the sensor would read at the samples of ``block``.

        NaN from the sample at which the model failed. Raises ``ValueError`` for a
        block that does not begin where the one before ended.
        """
        samples = block.counts.shape[1]
        if block.start != self._next:
            raise ValueError(f"a block starts at sample {block.start}, not at {self._next}")
        self._next += samples
        self.current = np.full(samples, np.nan)
        if self._failure or samples == 0:
            return np.full(samples, np.nan)
        first = 0 if block.start == 0 else 1  # the sample before, from which the state goes on
        time = (block.start - first + np.arange(first + samples)) / self._rate
        voltage = np.empty(first + samples)
        voltage[:first] = self._voltage
        voltage[first:] = self._scaling.physical(block.counts[self._row])
        self._voltage = float(voltage[-1])
        air = NO_AIR
        if self._thermometer is not None:
            scaling = self._channels[self._thermometer].scaling
            now = self._temperature_rise.after(scaling.physical(block.counts[self._thermometer]))
            air = np.stack((np.full(time.size, now), np.zeros(time.size)))
        stretch, speed = np.empty(time.size), np.empty(time.size)
        status, reached, _ = kernel.drive_by_voltage(
            self._coefficients,
            time,
            voltage,
            ends_of(voltage, self._holds),
            air,
            self._state,
            stretch,
            speed,
        )
        if status == kernel.OK:
            self._draw(time, voltage, air, stretch, first)
        moved = (stretch - self._rest) * self._length
        out = self._sensed(time[first:], moved[first:], speed[first:] * self._length)
        if status != kernel.OK:
            self._failure = f"{STATUS_TEXTS[status]} (at {time[min(reached, time.size - 1)]:.4g} s)"
            out[max(reached - first, 0) :] = np.nan
        return out

    def _draw(
        self,
        time: np.ndarray,
        voltage: np.ndarray,
        air: np.ndarray,
        stretch: np.ndarray,
        first: int,
    ) -> None:
        """Compute the current along ``stretch`` (n,) at ``time`` (n,) s.

        After the last sample voltage and film go on as before it: what follows is not known yet.
        """
        if time.size < 2:
            self.current = np.zeros(time.size)
            return
        ends = ends_of(voltage, self._holds).copy()
        if not self._holds:
            ends[-1] = 2.0 * voltage[-1] - voltage[-2]
        way, into = self._reads
        rows = loop.follow(
            self._coefficients, time, voltage, ends, air, stretch, way, into, self._circuit
        )
        self.current = rows[loop.INTO, first:]

    def _sensed(self, time: np.ndarray, moved: np.ndarray, speed: np.ndarray) -> np.ndarray:
        known = np.concatenate((self._past, np.stack((time, moved, speed))), axis=1)
        self._past = known[:, -self._keep :].copy()
        begin = known.shape[1] - time.size
        before = 1 if begin else 0
        times = known[0, begin - before :].copy()
        reading, velocity = np.empty(times.size), np.empty(times.size)
        at, value, rate = (np.ascontiguousarray(row) for row in known)
        at_sensor(at, value, rate, times - self._lag, reading, velocity)
        if before:
            reading[0], velocity[0] = self._read
        self._read = (float(reading[-1]), float(velocity[-1]))
        kernel.read_sensor(self._coefficients, times, reading, velocity, self._memory)
        return reading[before:]


class _TemperatureRise:
    """Temperature rise: mean of the last second less the mean of the first."""

    def __init__(self, rate: float) -> None:
        self._count = max(1, round(_TEMPERATURE_MEAN * rate))
        self._blocks: list[np.ndarray] = []
        self._first: list[np.ndarray] = []
        self._start = 0.0

    def after(self, temperature: np.ndarray) -> float:
        """Return the rise in K after the next readings ``temperature`` (n,) K."""
        seen = sum(part.size for part in self._first)
        if seen < self._count:
            self._first.append(temperature[: self._count - seen])
            self._start = float(np.concatenate(self._first).mean())
        self._blocks.append(temperature)
        while sum(part.size for part in self._blocks[1:]) >= self._count:
            self._blocks.pop(0)
        return float(np.concatenate(self._blocks)[-self._count :].mean()) - self._start
