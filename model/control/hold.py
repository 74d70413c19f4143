"""Hold of a displacement: integral action on the error, averaged over blocks of readings.

The correction is a part of the feedforward's voltage. A small change of it moves the film, once its
branches have relaxed, by ``sensitivity`` m per unit, which the model says. Before they have relaxed
the film moves less, so that the loop is slower then, and not nearer to its limit of stability.

The loop is that of a gain with a delay. Skogestad's rule for it (SIMC; S. Skogestad, J. Process
Control 13, 291 (2003)) is pure integral action,

    dc/dt = e/(K (tau + theta)),

with the gain K = ``sensitivity``, the delay theta and the response time tau, which is chosen. Its
gain margin is pi/2 (tau + theta)/theta, its phase margin 90 deg - theta/(tau + theta) rad.

The state of the integrator is the correction itself, after its limits: it cannot wind up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.model.control.readings import mean_without_outliers
from dearig.model.errors import ModelError
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.stability import static_stretch

__all__ = ["HoldAnswer", "HoldController", "HoldSettings", "sensitivity_of"]

_STEP = 0.01  # of the voltage, either way, for the sensitivity
_NEGLIGIBLE = 1e-12  # of a limit: a correction so near to it stands at it


@dataclass(frozen=True)
class HoldSettings:
    """Settings of a hold, in SI units.

    Attributes
    ----------
    setpoint : float
        Displacement in m from the loaded rest state.
    sensitivity : float
        Displacement in m per unit of the correction, see ``sensitivity_of``.
    period : float
        Time in s between two answers; each is from the readings since the one before.
    delay : float
        Time in s from the middle of these readings to the middle of the block that answers them.
    response : float
        Response time tau in s of the closed loop, besides the delay.
    authority, rate_limit : float
        Largest correction either way, and its largest change in 1/s.
    resolution : float
        Step of a reading in m; deviations as small as this are not outliers.
    """

    setpoint: float
    sensitivity: float
    period: float
    delay: float
    response: float
    authority: float
    rate_limit: float
    resolution: float

    def __post_init__(self) -> None:
        if not math.isfinite(self.setpoint):
            raise ModelError(f"hold: the setpoint {self.setpoint!r} m is not a finite number")
        for name, value in vars(self).items():
            if name != "setpoint" and not (math.isfinite(value) and value > 0.0):
                raise ModelError(f"hold: {name} = {value!r} must be finite and above 0")

    @property
    def gain(self) -> float:
        """Gain of the integral action in 1/(m s)."""
        return 1.0 / (self.sensitivity * (self.response + self.delay))

    @property
    def gain_margin(self) -> float:
        """Factor by which the film may be more sensitive before the loop is unstable."""
        return 0.5 * math.pi * (self.response + self.delay) / self.delay

    @property
    def phase_margin(self) -> float:
        """Phase margin in degrees."""
        return 90.0 - math.degrees(self.delay / (self.response + self.delay))


@dataclass(frozen=True)
class HoldAnswer:
    """Answer to a block: the next ``correction``, from the ``error`` in m (setpoint - mean).

    ``state`` is ``holding``, ``limited`` (the correction stands at its authority), or ``frozen``:
    the readings cannot be used, the correction stays, and ``error`` is NaN.
    """

    correction: float
    error: float
    state: str


class HoldController:
    """Controller of one hold with ``settings``, whose ``answer`` takes block after block."""

    def __init__(self, settings: HoldSettings) -> None:
        self.settings = settings
        self.correction = 0.0
        #: time in s since the readings were last of use
        self.blind = 0.0

    def answer(self, readings: np.ndarray, usable: np.ndarray) -> HoldAnswer:
        """Return the answer to ``readings`` (n,) in m from the loaded rest state.

        Only those with ``usable`` (n,) count, and less than half of them count as none. So do
        readings that are all the same, as of a laser whose output is held: noise changes them.
        """
        settings = self.settings
        mean = block_mean(readings, usable, settings.resolution)
        if math.isnan(mean):
            self.blind += settings.period
            return HoldAnswer(self.correction, math.nan, "frozen")
        self.blind = 0.0
        error = settings.setpoint - mean
        most = settings.rate_limit * settings.period
        step = min(max(settings.gain * settings.period * error, -most), most)
        authority = settings.authority
        self.correction = min(max(self.correction + step, -authority), authority)
        at_limit = abs(self.correction) >= authority * (1.0 - _NEGLIGIBLE)
        return HoldAnswer(self.correction, error, "limited" if at_limit else "holding")


def block_mean(readings: np.ndarray, usable: np.ndarray, resolution: float) -> float:
    """Return the mean in m of the usable ``readings`` (n,) without outliers, or NaN for none.

    ``resolution`` in m is the step of a reading: a smaller deviation is not an outlier.
    """
    seen = readings[usable & np.isfinite(readings)]
    if 2 * seen.size < readings.size or seen.size == 0:
        return math.nan
    if readings.size > 1 and seen.max() == seen.min():
        return math.nan
    return mean_without_outliers(seen, resolution)


def sensitivity_of(model: Actuator, voltage: float) -> float:
    """Return the displacement in m per unit of relative change of ``voltage`` in V, relaxed.

    Raises ``ModelError`` where the film does not stand the voltage.
    """
    low, high = (static_stretch(model, voltage * part) for part in (1.0 - _STEP, 1.0 + _STEP))
    found = (high - low) / (2.0 * _STEP) * model.film.length
    if not (math.isfinite(found) and found > 0.0):
        raise ModelError(f"the model does not say how far {voltage * 1e-3:.4g} kV moves the film")
    return found
