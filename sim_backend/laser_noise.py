"""Kinds of noise of the laser displacement sensor.

``white``: normal and independent, as the settings say. ``student``: heavy tails, Student's t with 4
degrees of freedom. ``pink``: white, and 1/f noise of the same RMS between 0.02 and 40 Hz.
``averaged``: normal noise that a filter has averaged over 20 ms, without delaying the reading.
``coarse``: white, and the reading in steps of 6 um. ``spikes``: white, and one reading in a
thousand is 8 to 60 times the noise off. A reading lasts as long as the sensor averages: a faster
clock samples it several times. All but ``coarse`` and ``spikes`` and the 1/f part have the
RMS of the settings.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["NOISES", "WHITE", "LaserNoise"]

WHITE = "white"
NOISES = (WHITE, "student", "pink", "averaged", "coarse", "spikes")

_FREEDOM = 4.0  # degrees of freedom: the variance is 2
_PINK_TIMES = 1.0 / (2.0 * math.pi * np.geomspace(0.02, 40.0, 12))  # s; equal shares give 1/f
_WINDOW = 20e-3  # s
_COARSE = 6e-6  # m
_SPIKES = 1e-3  # share of the readings
_SPIKE = (8.0, 60.0)  # of the noise


class LaserNoise:
    """Noise of one kind in one run, at one sample every ``interval`` s; see ``NOISES``.

    The sensor averages over ``window`` s.
    """

    def __init__(self, kind: str, interval: float, window: float = 0.0) -> None:
        if kind not in NOISES:
            raise ValueError(f"no noise {kind!r}: choose one of {', '.join(NOISES)}")
        self._kind = kind
        self._left = np.exp(-interval / _PINK_TIMES)
        self._window = max(2, round(_WINDOW / interval))
        self._repeats = max(1, round(window / interval))  # samples of one reading

    def start(self, generator: np.random.Generator) -> np.ndarray:
        """Return the state before the first sample."""
        if self._kind == "pink":
            return generator.standard_normal(_PINK_TIMES.size)
        if self._kind == "averaged":
            return generator.standard_normal(self._window - 1)
        # samples that are left of a reading, and its noise
        return np.zeros(2)

    def shape(
        self, white: np.ndarray, chunk: int, generator: np.random.Generator, state: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return noise (N,) over the settings' RMS, and the next state.

        ``white`` (N,) is the noise that the settings describe, with unit variance. ``chunk`` is the
        number of samples to draw, N or more, so that the rest of the run does not depend on N.
        """
        samples = white.size
        if self._kind == "student":
            drawn = generator.standard_t(_FREEDOM, chunk)[:samples]
            return self._repeated(drawn * math.sqrt((_FREEDOM - 2.0) / _FREEDOM), state)
        if self._kind == "pink":
            drawn = generator.standard_normal((_PINK_TIMES.size, chunk))[:, :samples]
            # takes a second to import, and one noise of six needs it
            from scipy.signal import lfilter

            pink, after = np.zeros(samples), np.empty_like(state)
            for i, left in enumerate(self._left):
                size = math.sqrt(1.0 - left * left)
                part, last = lfilter([size], [1.0, -left], drawn[i], zi=[left * state[i]])
                pink += part
                after[i] = last[0] / left
            return white + pink / math.sqrt(_PINK_TIMES.size), after
        if self._kind == "averaged":
            drawn = np.concatenate((state, generator.standard_normal(chunk)[:samples]))
            walk = np.concatenate(([0.0], np.cumsum(drawn)))
            sums = walk[self._window :] - walk[: -self._window]
            return sums / math.sqrt(self._window), drawn[-(self._window - 1) :]
        if self._kind == "spikes":
            hits, signs, sizes = generator.random((3, chunk))[:, :samples]
            size = _SPIKE[0] * (_SPIKE[1] / _SPIKE[0]) ** sizes
            spikes = np.where(hits < _SPIKES, np.where(signs < 0.5, -size, size), 0.0)
            spikes, after = self._repeated(spikes, state)
            return white + spikes, after
        return white, state

    def _repeated(self, drawn: np.ndarray, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ``drawn`` (N,) with each value for all samples of a reading, and the state."""
        left, before = int(state[0]), state[1]
        reading = (np.arange(drawn.size) - left) // self._repeats  # -1: of the last chunk
        noise = np.where(reading < 0, before, drawn[np.maximum(reading, 0)])
        next_at = left + (int(reading[-1]) + 1) * self._repeats
        return noise, np.array([next_at - drawn.size, noise[-1]])

    @property
    def step(self) -> float:
        """Return the step of the reading in m that the kind adds, or 0."""
        return _COARSE if self._kind == "coarse" else 0.0
