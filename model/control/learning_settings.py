"""Settings of the learning from run to run: every number of it, each with its derivation."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["LearningSettings"]


@dataclass(frozen=True)
class LearningSettings:
    """Numbers of the learning, in groups: evidence, filter, readings.

    Parameters
    ----------
    significant
        Standard errors by which a mean square differs if it does: one in 44 differences is as large
        by chance, either way. An amplitude tells something from so many noises on.
    usable
        Part of the samples of a path without which a run teaches nothing: across a gap what is
        lacking is a straight line, so that at least as much must be measured as is drawn.
    contraction
        Largest |Q| W that is learned with: the error of a run is at most this part of the last
        one's. W may be a quarter larger than it was seen before an error grows anywhere.
    ratio_max, phase_max_deg
        Largest ratio of the film's slowest response to the model's, and its largest phase, that are
        corrected for. With a ratio of g exp(i phi) learning by the model alone converges where
        |1 - g exp(i phi)| < 1: up to g = 2, or to phi = 60 deg. Beyond, it is another film, or the
        sign of the laser is wrong. The smallest ratio is the inverse of the largest. Faster, what
        was measured is believed: the film or its stand may resonate where the model does not.
    ratio_octaves
        Width of the bands from which the ratio is taken: that at half of the power of a resonance
        with a damping ratio of 0.035.
    octaves
        Width of the bands in which errors are compared, and twice that by which the band of Q is
        widened or narrowed at once: Q falls over an octave, so a run tells of one more than it
        learned.
    step_backs
        Steps in a row that are stepped back from, at which the learning ends. Each learns half the
        band of the one before: where two fail, it is not the band that is wrong.
    spike
        Noises by which a spike differs from its neighbours, and standard deviations of a jump.
        Gaussian noise reaches 5 once in a million readings; the rest is for heavier tails.
    spike_readings
        Readings about a spike. Their median is right with up to half of them wrong: bursts of 5.
    stuck_s
        Time in s of one and the same reading while the film is predicted to move by ``moved``
        noises. Where a step of the reading is the noise, independent readings repeat ten times in
        a row, as at 200 Hz, at 2 of 10^5 places by chance.
    moved
        Noises that the prediction moves meanwhile: two steps of a reading whose noise is that of
        its steps alone, step/sqrt(12).
    released_s
        Time in s without a voltage after which a film that is above its target is let go: more
        than half a period of the loaded film, 7 Hz, so that it does not swing back.
    released_part
        Part of the highest voltage that counts as none: its square pulls 1/400 as much.
    jump_s
        Time in s on either side of a jump over which is averaged: a slip is over within
        milliseconds, and the loaded film moves for seven times as long.
    jump_apart
        Times as long a time: over that a jump is no larger, and what moves steadily as many times.
    """

    significant: float = 2.0
    usable: float = 0.5
    contraction: float = 0.8
    ratio_max: float = 2.0
    phase_max_deg: float = 60.0
    ratio_octaves: float = 0.1
    octaves: float = 2.0
    step_backs: int = 2
    spike: float = 8.0
    spike_readings: int = 11
    stuck_s: float = 0.05
    moved: float = 2.0 * math.sqrt(12.0)
    released_s: float = 0.1
    released_part: float = 0.05
    jump_s: float = 0.02
    jump_apart: int = 4

    @property
    def detected(self) -> float:
        """Power over that of the noise from which a band tells something."""
        return self.significant**2

    @property
    def clear(self) -> float:
        """Power over that of the noise from which a path tells the response of the film.

        The error of their ratio is the root of its inverse, and less than what a contraction
        leaves.
        """
        return (1.0 - self.contraction) ** -2

    @property
    def widening(self) -> float:
        """Factor of Q's band from a run to the next, at most; its inverse after a step back."""
        return float(2.0 ** (0.5 * self.octaves))
