"""The model linearised about a constant voltage: reading per voltage squared, over frequency."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from dearig.model.control.bands import padded_length, pass_band
from dearig.model.control.task import TrackingTask
from dearig.model.effects import EFFECTS
from dearig.model.effects.description import Effect
from dearig.model.errors import ModelError
from dearig.model.kernel import OK
from dearig.model.simulation.actuator import Actuator, Drive, reading_of

__all__ = ["Linearised", "level_of", "linearise", "readings_under", "repeatable_part"]

_STEP = 0.02  # of the voltage squared
_FLOOR = 1e-4  # of the largest gain: what is less is not inverted
#: Gain in a dip, over the gain on both sides of it, below which the inverse is bounded. A sensor
#: that averages over time reads nothing at some frequencies, and an exact inverse rings there. The
#: value assumes that the error of a model's gain is a tenth of the gain next to the dip.
_DIP = 0.1


class Linearised:
    """Frequency response of the reading to the voltage squared, with its inverse.

    ``frequency`` (M,) is in Hz, ``gain`` (M,) complex in m/V^2; ``samples`` N at ``rate`` Hz is the
    length of the rows that it takes.
    """

    def __init__(self, gain: np.ndarray, samples: int, rate: float) -> None:
        self.gain, self.samples, self.rate = gain, samples, rate
        self.length = padded_length(samples)
        self.frequency = np.fft.rfftfreq(self.length, 1.0 / rate)

    def inverse(self, edge: float) -> np.ndarray:
        """Return the inverse (M,) in V^2/m up to ``edge`` Hz, see ``pass_band``."""
        size = np.abs(self.gain)
        slower = np.maximum.accumulate(size)
        faster = np.maximum.accumulate(size[::-1])[::-1]
        floor = np.maximum(_FLOOR * size.max(), _DIP * np.minimum(slower, faster))
        inverse = np.conj(self.gain) / (size * size + floor * floor)
        return inverse * pass_band(self.frequency, edge)

    def through(self, response: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return ``values`` (N,) through a ``response`` (M,), as if they were 0 outside."""
        spectrum = np.fft.rfft(values, self.length) * response
        return np.fft.irfft(spectrum, self.length)[: self.samples]


def repeatable_part(model: Actuator) -> Actuator:
    """Return ``model`` without what belongs to one recording: drift, interference and events."""
    kept = tuple((n, v) for n, v in model.effects if _is_repeatable(EFFECTS[n]))
    return replace(model, effects=kept)


def readings_under(model: Actuator, task: TrackingTask, voltage: np.ndarray) -> list[np.ndarray]:
    """Return what ``model`` reads in m, zeroed in the lead-in, under a ``voltage`` (N,) V.

    The first item (N,) is of its repeatable part, the second, if it has more, of all its effects. A
    model that does not stand that voltage reads infinity.
    """
    drive, found = Drive(task.time, voltage, hold=True), []
    for one in dict.fromkeys((repeatable_part(model), model)):
        reading, status = reading_of(one.coefficients(), one.film.length, drive, task.lag)
        rest = float(np.mean(reading[: task.lead_in])) if task.lead_in else 0.0
        found.append(reading - rest if status == OK else np.full(voltage.size, np.inf))
    return found


def _is_repeatable(effect: Effect) -> bool:
    return effect.is_reproducible and effect.family not in ("drift", "interference")


def smooth_part(model: Actuator) -> Actuator:
    """Return ``model`` without its hysteretic effects, which no linear response describes."""
    kept = tuple((n, v) for n, v in model.effects if not EFFECTS[n].is_hysteretic)
    return replace(model, effects=kept)


def level_of(square: np.ndarray) -> float:
    """Return the mean in V^2 of the voltage squared (N,), each weighted by itself.

    What stands at 0 V, where the film does nothing, so does not count.
    """
    return float(np.sum(square * square) / np.sum(square))


def linearise(
    model: Actuator, samples: int, rate: float, level: float, lag: float = 0.0
) -> Linearised:
    """Linearise ``model`` about the ``level`` in V^2 of the voltage squared.

    The response is that to a small step, from two simulations. ``samples`` at ``rate`` Hz are held
    by a converter; ``lag`` in s is the known age of a reading. Hysteretic effects are left out.
    Raises ``ModelError`` where the film does not stand that level.
    """
    model = smooth_part(model)
    c, time = model.coefficients(), np.arange(samples) / rate
    rows = []
    for part in (1.0, 1.0 + _STEP):
        drive = Drive(time, np.full(samples, math.sqrt(part * level)), hold=True)
        reading, status = reading_of(c, model.film.length, drive, lag)
        if status != OK:
            raise ModelError(f"the film does not stand {math.sqrt(level) * 1e-3:.4g} kV")
        rows.append(reading)
    step = (rows[1] - rows[0]) / (_STEP * level)
    impulse = np.diff(step, append=step[-1])
    return Linearised(np.fft.rfft(impulse, padded_length(samples)), samples, rate)
