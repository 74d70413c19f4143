"""Records with the measured stretch imposed on the springs: what the regression is made of.

A record becomes stresses per unit modulus of many springs, and a function that returns the stress
which they must carry together under given effects. Both pass through the linearised compliance
G(s) = L1/(m s^2 + K(s)) of the film,

    K = mu_0 (1 + 3/lam0^4) + sum (4 mu_i/lam0^2) s t_i/(1 + s t_i),  t_i = lam0 T_i/4,

so that an error of the stress becomes, to first order, the error of the reading: white and of the
noise's size. The ratio of the instantaneous stiffness at rest to that at the sample comes before
it. Films driven by stretch measure the stress itself: G is 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.coefficients import (
    ELECTRIC,
    FORCE,
    HELD,
    INERTIA,
    LENGTH,
    MODULUS,
    RATE,
    REST,
    WIDTH,
)
from dearig.model.effects import EFFECTS, MEMORY, PLACES, SENSOR_MEMORY
from dearig.model.errors import ModelError
from dearig.model.film.material import Branch, Network
from dearig.model.film.network import HEAD
from dearig.model.kernel import OK, read_sensor
from dearig.model.kernel.balance import carried_stress, effect_inertia
from dearig.model.kinematics import electric_along
from dearig.model.readings.records import ActuatorRecord, FilmRecord
from dearig.model.simulation.actuator import NO_AIR, Actuator, at_rest
from dearig.model.simulation.strip import Strip, unit_stresses

__all__ = [
    "ImposedActuator",
    "ImposedStrip",
    "is_sensor",
    "lateness",
    "springs_of_grid",
    "without_sensor",
]

_WIDE_LIMIT = 1e4  # J of a spring that does not stiffen within any stretch of an actuator
_DAMPING = 0.05  # of critical, of the film as an oscillator: it only keeps G finite at its peak
_INVERSIONS = 3  # of a sensor effect; each leaves its square, relative to the motion
_NOTHING = np.zeros(0)
_STEADY = 1e-4  # m/s: a motion by which the delay of a reading shows


def is_sensor(name: str) -> bool:
    """Whether the effect acts on the reading alone."""
    return PLACES[name].is_sensor


def springs_of_grid(model: Actuator | Strip, grid: np.ndarray) -> Network:
    """Return springs of unit modulus: the equilibrium spring and branches at times ``grid`` (G,).

    Their limits are those of ``model`` for a strip, whose springs stiffen; wide for an actuator.
    """
    springs = model.network.springs
    wide = isinstance(model, Actuator)
    first, last = springs[0], max(springs[1:], key=lambda s: s.limit)
    if wide:
        first, last = (replace(s, limit=_WIDE_LIMIT) for s in (first, last))
    branch = replace(last, modulus=1.0)
    return Network(replace(first, modulus=1.0), tuple(Branch(branch, float(t)) for t in grid))


def lateness(model: Actuator, name: str) -> float:
    """Return by how many s the sensor effect ``name`` makes the reading of a steady motion late."""
    time = np.linspace(0.0, 1.0, 1001)
    moved = _STEADY * time
    read = _sensed(_only(model.coefficients(), name), time, moved, float(time[1]))
    return float(moved[-1] - read[-1]) / _STEADY


def without_sensor(record: ActuatorRecord, model: Actuator, smoothing: float) -> np.ndarray:
    """Return the displacement (N,) of ``record`` with the sensor effects of ``model`` inverted."""
    measured = record.displacement
    if not any(is_sensor(name) for name, _ in model.effects):
        return measured
    c = model.coefficients()
    step = _step(record)
    moved = _smooth(measured, smoothing, step)
    for _ in range(_INVERSIONS):
        change = _sensed(c, record.time, moved, step) - moved
        moved = _smooth(measured - change, smoothing, step)
    return np.asarray(measured - change)


class ImposedActuator:
    """An actuator's record with the stretch imposed that ``displacement`` (N,) in m says.

    ``every`` samples make one mean. ``springs`` are those of ``springs_of_grid``. The coefficients
    ``c`` are the model's. ``columns`` (1 + G, M) is the reading, in noises of a mean, that a unit
    modulus of each spring holds back.
    """

    def __init__(
        self,
        record: ActuatorRecord,
        displacement: np.ndarray,
        c: np.ndarray,
        springs: Network,
        every: int,
        smoothing: float,
    ) -> None:
        self.record, self.every = record, every
        self.length = float(c[LENGTH])
        self.c = c.copy()
        status, self.rest = at_rest(self.c, record.drive)
        if status != OK:
            raise ModelError("the model has no rest state under its load")
        self.step = _step(record)
        stretch = self.rest + displacement / self.length
        stretch[: max(record.lead_in, 1)] = self.rest
        smooth = _smooth(stretch, smoothing, self.step)
        rate = np.gradient(smooth, self.step)
        self.motion = np.ascontiguousarray([smooth, rate, np.gradient(rate, self.step)])
        self._drive()
        self._compliance()
        parts, _, _ = unit_stresses(springs.coefficients(int(c[HELD])), record.time, stretch)
        self.columns = self.through(parts - parts[:, :1])
        self._carried = self._stress(self.c)

    def _drive(self) -> None:
        """Set the voltage (N,) at the samples, straight between them, when the sensor reads.

        The film follows a held voltage as a line through the middles of its jumps, half a sample
        later; the ringing about that is above the band.
        """
        record = self.record
        voltage = record.drive.voltage
        if record.drive.hold:
            before = np.append(voltage[0], voltage[:-1])
            square = 0.5 * (before * np.abs(before) + voltage * np.abs(voltage))
            voltage = np.sign(square) * np.sqrt(np.abs(square))
        self.voltage = np.interp(record.time - record.lag, record.time, voltage)
        self.ends = np.append(self.voltage[1:], self.voltage[-1])

    def _compliance(self) -> None:
        """Set the transfer function at the means' frequencies, and the ratio of stiffnesses."""
        c, rest = self.c, self.rest
        first = c[HEAD + MODULUS]
        begins = range(HEAD + WIDTH, c.size, WIDTH)
        stiff = [4.0 * c[k + MODULUS] / rest**2 for k in begins]
        times = [rest / (4.0 * c[k + RATE]) for k in begins]
        at_rest_stiff = first * (1.0 + 3.0 / rest**4) + sum(stiff)
        lam = self.motion[0]
        now = first * (1.0 + 3.0 / lam**4) - c[ELECTRIC] * self.voltage**2 * _pull_slope(c, lam)
        now += sum(stiff) * (1.0 + 3.0 * (rest / lam) ** 4) / 4.0
        self.ratio = self._means(at_rest_stiff / np.maximum(now, 0.1 * at_rest_stiff))
        means = self.ratio.size
        s = 2j * math.pi * np.fft.rfftfreq(2 * means, self.step * self.every)
        inertia = effect_inertia(c, np.zeros(MEMORY))
        k = first * (1.0 + 3.0 / rest**4) + inertia * s * s
        k = k + 2.0 * _DAMPING * math.sqrt(at_rest_stiff * inertia) * s
        for b, t in zip(stiff, times, strict=True):
            k = k + b * s * t / (1.0 + s * t)
        self.compliance = self.length / k
        self._edges = self._lead_in_means()

    def _lead_in_means(self) -> int:
        return max(self.record.lead_in // self.every, 1)

    def _means(self, rows: np.ndarray) -> np.ndarray:
        whole = rows.shape[-1] // self.every
        shape = (*rows.shape[:-1], whole, self.every)
        return np.asarray(rows[..., : whole * self.every].reshape(shape).mean(axis=-1))

    def through(self, stress: np.ndarray) -> np.ndarray:
        """Return ``stress`` (..., N) Pa as readings (..., M) in noises of a mean."""
        means = self._means(stress) * self.ratio
        n = means.shape[-1]
        moved = np.fft.irfft(np.fft.rfft(means, 2 * n) * self.compliance, 2 * n)[..., :n]
        return self._counted(moved)

    def _counted(self, moved: np.ndarray) -> np.ndarray:
        """Return ``moved`` (..., M) m in noises, from the lead-in's mean, 0 where masked."""
        moved = moved - moved[..., : self._edges].mean(axis=-1, keepdims=True)
        valid = self.record.valid
        if valid is not None:
            moved = np.where(self._means(valid.astype(float)) == 1.0, moved, 0.0)
        return np.asarray(moved / (self.record.noise / math.sqrt(self.every)))

    def _stress(self, c: np.ndarray) -> np.ndarray:
        """Return the stress (N,) in Pa that the springs must carry, less that at the start."""
        r, out = self.record, np.empty(self.record.time.size)
        carried_stress(c, r.time, self.voltage, self.ends, r.drive.air, self.motion, out, _NOTHING)
        return out - out[0]

    def target(self) -> np.ndarray:
        """Return what the springs must hold back under the model's effects, (M,) in noises."""
        return self.through(self._carried)

    def response(self, name: str, values: Sequence[float]) -> np.ndarray:
        """Return what effect ``name`` at ``values`` adds to the reading, (M,) in noises."""
        c = self.c.copy()
        at = PLACES[name].at
        c[at : at + len(values)] = values
        if not is_sensor(name):
            return self.through(self._stress(c) - self._carried)
        moved = (self.motion[0] - self.rest) * self.length
        return self._counted(
            self._means(_sensed(_only(c, name), self.record.time, moved, self.step) - moved)
        )


class ImposedStrip:
    """A strip's record: the stress is measured, the stretch imposed. As ``ImposedActuator``."""

    def __init__(self, record: FilmRecord, c: np.ndarray, springs: Network) -> None:
        self.record = record
        self.c = c.copy()
        self.c[REST] = record.stretch[0]
        self.c[ELECTRIC] = self.c[INERTIA] = 0.0
        rate = np.append(0.0, np.diff(record.stretch) / np.diff(record.time))
        self.motion = np.ascontiguousarray([record.stretch, rate, np.zeros_like(rate)])
        self.columns = self.through(
            unit_stresses(springs.coefficients(int(c[HELD])), record.time, record.stretch)[0]
        )
        self._carried = self._stress(self.c)

    def through(self, stress: np.ndarray) -> np.ndarray:
        """Return ``stress`` (..., N) Pa in noises, 0 where masked."""
        used = np.asarray(stress / self.record.noise)
        return used if self.record.valid is None else np.where(self.record.valid, used, 0.0)

    def _stress(self, c: np.ndarray) -> np.ndarray:
        """Return the stress that the springs must carry: (measured - sigma)/s, (N,) Pa."""
        r = self.record
        none = np.zeros_like(r.time)
        free, loaded = c.copy(), c.copy()
        free[FORCE], loaded[FORCE] = 0.0, 1.0
        at_none, at_one = np.empty_like(none), np.empty_like(none)
        for row, out in ((free, at_none), (loaded, at_one)):
            carried_stress(row, r.time, none, none, NO_AIR, self.motion, out, _NOTHING)
        return at_none + (at_one - at_none) * r.stress

    def target(self) -> np.ndarray:
        """Return what the springs must carry under the model's effects, (N,) in noises."""
        return self.through(self._carried)

    def response(self, name: str, values: Sequence[float]) -> np.ndarray:
        """Return what effect ``name`` at ``values`` adds to the stress to carry, in noises."""
        c = self.c.copy()
        at = PLACES[name].at
        c[at : at + len(values)] = values
        return self.through(self._stress(c) - self._carried)


def _only(c: np.ndarray, name: str) -> np.ndarray:
    """Return coefficients ``c`` with all sensor effects but ``name`` neutral."""
    c = c.copy()
    for other, effect in EFFECTS.items():
        if other != name and is_sensor(other):
            for i, p in enumerate(effect.parameters):
                if p.neutral is not None:
                    c[PLACES[other].at + i] = p.neutral
    return c


def _sensed(c: np.ndarray, time: np.ndarray, moved: np.ndarray, step: float) -> np.ndarray:
    """Return what the sensor effects in ``c`` read of a displacement ``moved`` (N,) m."""
    reading = moved.copy()
    read_sensor(c, time, reading, np.gradient(moved, step), np.zeros(SENSOR_MEMORY))
    return reading


def _pull_slope(c: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Return d(electric)/d(lam) (N,), by differences."""
    d = 1e-6
    held = int(c[HELD])
    return np.asarray((electric_along(held, lam + d) - electric_along(held, lam - d)) / (2.0 * d))


def _step(record: ActuatorRecord) -> float:
    return float(np.median(np.diff(record.time)))


def _smooth(values: np.ndarray, width: float, step: float) -> np.ndarray:
    # half a sample at least: a narrower kernel is none
    return np.asarray(
        scipy.ndimage.gaussian_filter1d(values, max(width / step, 0.5), mode="nearest")
    )
