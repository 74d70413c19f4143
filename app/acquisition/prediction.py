"""Prediction of the film under a planned voltage, computed while the gate reads the voltage."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from dearig.drivers.gate import Limits
from dearig.drivers.samples import Repeated, Samples
from dearig.model import kernel
from dearig.model.actuator import STATUS_WORDS, Actuator, at_rest, initial_state
from dearig.model.effects import SENSOR_MEMORY
from dearig.model.kinematics import thinning

__all__ = ["PredictedFilm", "peaks_of", "stride_at"]

# Hz; enough to predict a film with a period of milliseconds, at any rate of the clock; the field is
# still checked with every sample of the voltage
_RATE = 5000.0
_PIECE_STEPS = 4096  # of the prediction, whose peaks are found together


def stride_at(rate: float) -> int:
    """Return the samples for each of which the film is predicted once, on a clock of ``rate`` Hz.

    It is a power of two, so that the gate's pieces hold whole strides.
    """
    return int(2 ** math.floor(math.log2(max(rate / _RATE, 1.0))))


class PredictedFilm:
    """Prediction of ``actuator``'s film under ``samples`` of voltage; see ``FilmPrediction``.

    The voltage arrives piece by piece on a clock of ``rate`` Hz. One ``stride`` of samples is one
    step of the prediction, with the voltage farthest from 0 V among them: the predicted film is
    pulled at least as hard as the real one. The prediction ends where the voltage leaves
    ``limits``, because such a waveform is refused, and where the model fails. ``observe`` is called
    with the first sample of each piece and its samples (n,) V.

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
    ) -> None:
        self.film = film
        self.stride = stride_at(rate)
        self.electric_volume = actuator.film.electric_volume
        self.pull_in = ""
        self._samples = samples
        self._rate = rate
        self._limits = limits
        self._observe = observe
        self._held, self._thickness = actuator.film.held, actuator.film.thickness
        self._length = actuator.film.length
        actuator.rest()
        self._coefficients = actuator.coefficients()
        _, self._rest = at_rest(self._coefficients)
        self._state = initial_state(self._coefficients, self._rest)
        self._memory = np.zeros(SENSOR_MEMORY)
        self._before = np.zeros(3)  # V, m and m/s, of the step before
        self._thin = float(self._thinned(np.array([self._rest]))[0])  # 1/m, of the newest step
        self._ended = False
        self._steps = 0
        # single precision: 8 bytes for each step of a run of hours
        count = -(-samples // self.stride)
        self._displacement = np.full(count, np.nan, dtype=np.float32)
        self._field = np.full(count, np.nan, dtype=np.float32)

    @property
    def displacement(self) -> np.ndarray:
        """Displacement (M,) m of the steps, NaN where there is no prediction; single precision."""
        return self._displacement

    @property
    def field(self) -> np.ndarray:
        """True field (M,) V/m at the highest voltage of each step, NaN without a prediction."""
        return self._field

    def fits(self, samples: int) -> bool:
        """Return whether it is the prediction of a waveform of so many samples."""
        return samples == self._samples

    def follow(self, start: int, voltage: np.ndarray) -> np.ndarray:
        """Return the field per volt (n,) 1/m under the samples (n,) V from ``start`` on.

        Raises ``ValueError`` for samples that do not continue those before.
        """
        if start != self._steps * self.stride:
            raise ValueError(
                f"samples from {start} on do not continue the {self._steps} steps of "
                f"{self.stride} samples before"
            )
        if self._observe is not None:
            self._observe(start, voltage)
        peaks = _peaks(voltage, self.stride)
        thin = np.full(peaks.size, self._thin)
        steps = 0 if self._ended else self._steps_within(peaks)
        if steps:
            thin[:steps] = self._advance(peaks[:steps])
            thin[steps:] = self._thin
        self._steps += peaks.size
        return Repeated(thin, self.stride, voltage.size).window(0, voltage.size)

    def _steps_within(self, peaks: np.ndarray) -> int:
        """Return the steps before the voltage leaves the limits; the gate refuses it then."""
        low, high = self._limits.voltage_min, self._limits.voltage_max
        beyond = ~((peaks >= low) & (peaks <= high))
        if not beyond.any():
            return int(peaks.size)
        self._ended = True
        return int(np.argmax(beyond))

    def _advance(self, peaks: np.ndarray) -> np.ndarray:
        """Advance the film by one step for each of ``peaks`` (n,) V; returns 1/m (n,)."""
        c, first = self._coefficients, 1 if self._steps else 0  # the step before
        time = (self._steps - first + np.arange(first + peaks.size)) * (self.stride / self._rate)
        voltage = np.append(self._before[0], peaks) if first else peaks
        stretch, speed = np.empty(time.size), np.empty(time.size)
        status, reached, _ = kernel.drive_by_voltage(
            c, time, voltage, voltage, np.zeros(0), self._state, stretch, speed
        )
        reading, velocity = (stretch - self._rest) * self._length, speed * self._length
        if first:
            reading[0], velocity[0] = self._before[1:]
        else:
            velocity[0] = 0.0
        self._before = np.array([voltage[-1], reading[-1], velocity[-1]])
        kernel.read_sensor(c, time, reading, velocity, self._memory)
        thin = self._thinned(stretch[first:])
        self._thin = float(thin[-1])
        now = slice(self._steps, self._steps + peaks.size)
        self._displacement[now] = reading[first:]
        self._field[now] = np.abs(peaks) * thin
        if status != kernel.OK:
            self._ended = True
            self.pull_in = f"{STATUS_WORDS[status]} (at {time[min(reached, time.size - 1)]:.4g} s)"
            failed = slice(self._steps + max(reached - first, 0), self._steps + peaks.size)
            self._displacement[failed] = self._field[failed] = np.nan
        return thin

    def _thinned(self, stretch: np.ndarray) -> np.ndarray:
        return thinning(self._held, stretch) / self._thickness


def peaks_of(voltage: Samples, stride: int) -> np.ndarray:
    """Return the sample (M,) V farthest from 0 V of each ``stride`` samples of ``voltage``."""
    piece = _PIECE_STEPS * stride
    return np.concatenate(
        [_peaks(voltage.window(at, at + piece), stride) for at in range(0, voltage.samples, piece)]
    )


def _peaks(voltage: np.ndarray, stride: int) -> np.ndarray:
    """Return the sample farthest from 0 V of each ``stride`` samples of ``voltage`` (N,)."""
    if stride == 1:
        return voltage.copy()
    whole = voltage.size // stride * stride
    groups = voltage[:whole].reshape(-1, stride)
    high, low = groups.max(axis=1), groups.min(axis=1)
    peaks = np.where(high >= -low, high, low)
    rest = voltage[whole:]
    return np.append(peaks, rest[np.argmax(np.abs(rest))]) if rest.size else peaks
