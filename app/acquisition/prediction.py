"""Prediction of the film under a planned voltage, computed while the gate reads the voltage."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dearig.drivers.gate import Limits
from dearig.drivers.samples import Repeated, Samples
from dearig.model import kernel
from dearig.model.effects import SENSOR_MEMORY
from dearig.model.kinematics import thinning
from dearig.model.simulation.actuator import NO_AIR, STATUS_TEXTS, Actuator, at_rest, initial_state

__all__ = ["PredictedFilm", "peaks_of", "stride_at"]

# Hz; enough to predict a film with a period of milliseconds, at any rate of the clock; the field is
# still checked with every sample of the voltage
_RATE = 5000.0
_CALM_RATE = 1000.0  # Hz, while the voltage changes slowly: what a rig plays by default
# Change of the voltage within one step at that rate, of the largest allowed: the film is predicted
# under at most so much more voltage than it gets
_CALM = 2.5e-3
_PIECE_STEPS = 4096  # of the prediction, whose peaks are found together


def stride_at(rate: float) -> int:
    """Return the samples that one value of the prediction is for, on a clock of ``rate`` Hz.

    It is a power of two, so that the gate's pieces hold whole strides.
    """
    return _power_of_two(rate / _RATE)


class PredictedFilm:
    """Prediction of ``actuator``'s film under ``samples`` of voltage; see ``FilmPrediction``.

    The voltage arrives piece by piece on a clock of ``rate`` Hz. One ``stride`` of samples is one
    step of the prediction, and several are one step where the voltage changes little. Each step has
    the voltage farthest from 0 V among its samples, and the film's smaller thickness at either end:
    the predicted field is not below that of the model under the samples themselves.

    The prediction ends where the voltage leaves ``limits``, because such a waveform is refused, and
    where the model fails. ``observe`` is called with the first sample of each piece and its samples
    (n,) V. With ``keeps`` False, ``displacement`` and ``field`` are not kept.

    Raises ``ModelError`` for a film without a rest state.
    """

    def __init__(
        self,
        actuator: Actuator,
        samples: int,
        rate: float,
        limits: Limits,
        film: str,
        observe: Callable[[int, np.ndarray], None] | None = None,
        *,
        keeps: bool = True,
    ) -> None:
        self.film = film
        self.stride = stride_at(rate)
        self.electric_volume = actuator.film.electric_volume
        self.pull_in = ""
        self._samples = samples
        self._rate = rate
        self._limits = limits
        self._observe = observe
        self._merged_max = _power_of_two(rate / (_CALM_RATE * self.stride))
        self._calm = _CALM * max(limits.voltage_max, -limits.voltage_min)
        self._held, self._thickness = actuator.film.held, actuator.film.thickness
        self._length = actuator.film.length
        actuator.rest()
        self._coefficients = actuator.coefficients()
        _, self._rest = at_rest(self._coefficients)
        self._state = initial_state(self._coefficients, self._rest)
        self._memory = np.zeros(SENSOR_MEMORY)
        self._thin = float(self._thinned(np.array([self._rest]))[0])  # 1/m, at the newest sample
        self._ended = False
        self._next = 0  # sample
        # single precision: 8 bytes for each step of a run of hours
        count = -(-samples // self.stride) if keeps else 0
        self._displacement = np.full(count, np.nan, dtype=np.float32)
        self._field = np.full(count, np.nan, dtype=np.float32)

    @property
    def displacement(self) -> np.ndarray:
        """Displacement (M,) m at each stride, NaN where there is no prediction; float32."""
        return self._displacement

    @property
    def field(self) -> np.ndarray:
        """True field (M,) V/m at the highest voltage of each stride, NaN without a prediction."""
        return self._field

    def fits(self, samples: int) -> bool:
        """Return whether it is the prediction of a waveform of so many samples."""
        return samples == self._samples

    def follow(self, start: int, voltage: np.ndarray) -> np.ndarray:
        """Return the field per volt (n,) 1/m under the samples (n,) V from ``start`` on.

        Raises ``ValueError`` for samples that do not continue those before.
        """
        if start != self._next or start % self.stride:
            raise ValueError(
                f"samples from {start} on do not continue those before {self._next} in whole "
                f"strides of {self.stride}"
            )
        self._next += voltage.size
        if self._observe is not None:
            self._observe(start, voltage)
        merged, peaks = _steps(voltage, self.stride, self._merged_max, self._calm)
        thin = np.full(peaks.size, self._thin)
        steps = 0 if self._ended else self._steps_within(peaks)
        if steps:
            thin[:steps] = self._advance(start, merged, peaks[:steps])
            thin[steps:] = self._thin
        return Repeated(thin, self.stride * merged, voltage.size).window(0, voltage.size)

    def _steps_within(self, peaks: np.ndarray) -> int:
        """Return the steps before the voltage leaves the limits; the gate refuses it then."""
        low, high = self._limits.voltage_min, self._limits.voltage_max
        beyond = ~((peaks >= low) & (peaks <= high))
        if not beyond.any():
            return int(peaks.size)
        self._ended = True
        return int(np.argmax(beyond))

    def _advance(self, start: int, merged: int, peaks: np.ndarray) -> np.ndarray:
        """Advance from sample ``start`` by steps of ``merged`` strides under ``peaks`` (n,) V.

        Returns one over the smaller thickness at either end of each step, (n,) 1/m.
        """
        step, c = merged * self.stride, self._coefficients
        time = (start + step * np.arange(peaks.size + 1)) / self._rate  # with the end of the last
        voltage = np.append(peaks, peaks[-1])
        stretch, speed = np.empty(time.size), np.empty(time.size)
        status, reached, _ = kernel.drive_by_voltage(
            c, time, voltage, voltage, NO_AIR, self._state, stretch, speed
        )
        reading, velocity = (stretch - self._rest) * self._length, speed * self._length
        kernel.read_sensor(c, time, reading, velocity, self._memory)
        ends = self._thinned(stretch)
        thin: np.ndarray = np.maximum(ends[:-1], ends[1:])
        self._thin = float(ends[-1])
        predicted = peaks.size
        if status != kernel.OK:
            self._ended = True
            self.pull_in = f"{STATUS_TEXTS[status]} (at {time[min(reached, predicted)]:.4g} s)"
            predicted = min(reached, predicted)
        first = start // self.stride
        for kept, values in (
            (self._displacement, reading[:predicted]),
            (self._field, (np.abs(peaks) * thin)[:predicted]),
        ):
            room = kept[first : first + merged * predicted]
            room[:] = np.repeat(values, merged)[: room.size]
        return thin

    def _thinned(self, stretch: np.ndarray) -> np.ndarray:
        return thinning(self._held, stretch) / self._thickness


def peaks_of(voltage: Samples, stride: int) -> np.ndarray:
    """Return the sample (M,) V farthest from 0 V of each ``stride`` samples, a power of two."""
    piece = _PIECE_STEPS * stride
    pieces = (voltage.window(at, at + piece) for at in range(0, voltage.samples, piece))
    return np.concatenate([_steps(volts, stride, 1, 0.0)[1] for volts in pieces])


def _steps(
    voltage: np.ndarray, stride: int, merged_max: int, calm: float
) -> tuple[int, np.ndarray]:
    """Return how many strides are one step, and the sample (n,) V farthest from 0 V of each step.

    They are as many as may be, up to ``merged_max``, with at most ``calm`` V of change in each
    step of ``voltage`` (N,). ``stride`` and ``merged_max`` are powers of two.
    """
    whole = stride * merged_max
    high = low = np.pad(voltage, (0, -voltage.size % whole), mode="edge")
    width, merged, peaks = 1, 1, high
    while True:
        if width >= stride:
            if width > stride and not np.max(high - low) <= calm:
                break
            merged, peaks = width // stride, np.where(high >= -low, high, low)
        if width == whole:
            break
        high, low = np.maximum(high[0::2], high[1::2]), np.minimum(low[0::2], low[1::2])
        width *= 2
    return merged, peaks[: -(-voltage.size // (stride * merged))]


def _power_of_two(limit: float) -> int:
    """Return the greatest power of two up to ``limit``, and at least 1."""
    return int(2 ** math.floor(math.log2(max(limit, 1.0))))
