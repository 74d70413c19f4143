"""The voltage with which the film follows a path: inversion of the model.

The wanted displacement is imposed. The equation of motion then says, sample by sample, which
Maxwell stress is missing (``kernel.balance``):

    pull = s sum_i mu_i p_i(lam) + sigma + (m + m_e) lam'' - F

Its voltage squared u = pull/(eps/Z^2 a(lam) e(lam, u)) is exact for a film that gets its voltage as
it was commanded. What acts between the command and the film (amplifier, electrodes, polarisation),
between the film and the reading (the sensor), and the converter's steps have no inverse sample by
sample: a lag of second order, held between samples, has an unstable one. They are inverted over the
whole path, by a quasi-Newton iteration with the forward simulation,

    u <- u + G^-1 (target - reading(u)),

with G of the linearised model (``linear``), accelerated as D. G. Anderson, J. ACM 12, 547 (1965),
proposed. Every pass brings the voltage within its limits. Where it stands at one, the error no
longer counts: the path is unreachable there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.coefficients import ELECTRIC, FORCE, HELD, MODULUS, WIDTH
from dearig.model.control.bands import low_pass
from dearig.model.control.linear import level_of, linearise, repeatable_part
from dearig.model.control.task import TrackingTask
from dearig.model.effects import PLACES, SENSOR_MEMORY
from dearig.model.errors import ModelError
from dearig.model.film.network import HEAD
from dearig.model.film.sensor import at_sensor
from dearig.model.kernel import OK, read_sensor
from dearig.model.kernel.balance import carried_stress
from dearig.model.kinematics import electric_along, thinning
from dearig.model.simulation.actuator import (
    NO_AIR,
    STATUS_TEXTS,
    Actuator,
    Drive,
    at_rest,
    reading_of,
)
from dearig.model.simulation.stability import pull_in_voltage, static_stretch
from dearig.model.simulation.strip import unit_stresses

__all__ = ["CAUSES", "Inversion", "Unreachable", "invert"]

_PASSES = 30  # of the quasi-Newton iteration
_REMEMBERED = 6  # passes of which Anderson's acceleration makes use
_CLOSE = 0.01e-6  # m: no pass follows an error that is nowhere larger
_SMALL = 0.1e-6  # m: an error that counts as small next to what is unreachable
_SENSOR_PASSES = 4  # of a sensor effect along the target, for the start
_ELECTRIC_PASSES = 3  # of what is between command and film along the target, for the start
_AT_LIMIT = 1e-3  # of the highest voltage: so near it stands at a limit
_BELOW_PULL_IN = 0.95  # of the displacement at which the film pulls in; the gate refuses more
_PAUSE = 0.1  # s between two parts of a target that are unreachable as one
_ATTEMPTS = 80  # with less and less voltage: the last has a sixtieth of the first
_GIVEN_BACK = 0.9  # of the voltage, while the film runs away
_NOTHING = np.zeros(0)


@dataclass(frozen=True)
class Unreachable:
    """A part of a target that the film cannot follow.

    ``start`` and ``stop`` are in s of the target's time. ``cause`` is one of ``CAUSES``.
    ``worst`` in m is the largest distance of the nearest feasible target, ``at`` in s when.
    ``needed`` and ``allowed`` in V are the voltage that the path needs there and the highest that
    the limits allow; ``needed`` is NaN where no voltage would do.
    """

    start: float
    stop: float
    cause: str
    worst: float
    at: float
    needed: float
    allowed: float

    @property
    def why(self) -> str:
        """The cause in words."""
        words = CAUSES[self.cause]
        if self.cause in ("voltage", "field") and math.isfinite(self.needed):
            words += f" ({self.needed * 1e-3:.4g} kV, {self.allowed * 1e-3:.4g} kV is allowed)"
        return words

    @property
    def sentence(self) -> str:
        """When, by how much and why, in one sentence."""
        when = f"{self.start:.4g} s to {self.stop:.4g} s"
        off = f"{self.worst * 1e6:.3g} um at {self.at:.4g} s"
        return f"{when}: {self.why}; the film misses the target by up to {off}"


#: Why a target is unreachable, by its short name.
CAUSES = {
    "zero": "the film does not return so fast on its own, and no voltage pushes it",
    "voltage": "the path needs more than the highest voltage",
    "field": "the path needs more than the highest true field",
    "pull-in": "the film would pull in",
    "slew": "the voltage may not change so fast",
    "bandwidth": "the target changes faster than is followed",
    "dynamics": "no voltage was found that follows so closely",
}


@dataclass(frozen=True, eq=False)
class Inversion:
    """The voltage for a target, and what the model reads under it; arrays are (N,).

    ``time`` is in s, ``voltage`` in V at the film, held between samples at ``rate`` Hz. ``target``
    in m is the asked one, ``reference`` the nearest feasible target: ``target`` without what is
    faster than the bandwidth, and the model's reading where that is unreachable. ``reading`` in m
    is that of the model. ``reachable`` is True where the film can follow. ``unreachable`` are the
    parts where it cannot. ``passes`` counts simulations.
    """

    time: np.ndarray
    rate: float
    voltage: np.ndarray
    target: np.ndarray
    reference: np.ndarray
    reading: np.ndarray
    reachable: np.ndarray
    unreachable: tuple[Unreachable, ...]
    passes: int

    @property
    def feasible(self) -> bool:
        """True if the film can follow the whole target."""
        return not self.unreachable

    @property
    def error(self) -> float:
        """Largest distance in m of the model's reading from the reference."""
        return float(np.abs(self.reading - self.reference).max())


def invert(
    model: Actuator,
    task: TrackingTask,
    *,
    tolerance: float = 1e-6,
    start: np.ndarray | None = None,
) -> Inversion:
    """Compute the voltage with which the reading of ``model`` follows the target of ``task``.

    Parameters
    ----------
    model : Actuator
        Film, load, springs and effects. The reading is what its sensor effects make of the film.
    task : TrackingTask
        Target, rests and limits.
    tolerance : float
        Distance in m from the target beyond which it counts as unreachable.
    start : (N,) array, optional
        Voltage in V to start from; computed from the balance of stresses by default.

    Raises
    ------
    ModelError
        For a model without a rest state.
    """
    job = _Job(model, task)
    first = job.from_balance() if start is None else np.square(start)
    return job.result(job.within_field(job.follow(first)), tolerance)


@dataclass
class _Pass:
    """One simulation: voltage squared (N,) V^2, reading and error (N,) m, and where it is free."""

    u: np.ndarray
    reading: np.ndarray
    error: np.ndarray
    free: np.ndarray

    @property
    def size(self) -> float:
        """Cauchy's measure of the error, without a unit.

        What cannot be reached counts little more however far it is, so that the rest decides.
        """
        return float(np.mean(np.log1p((self.error / _SMALL) ** 2)))


class _Job:
    """The inversion of one target."""

    def __init__(self, model: Actuator, task: TrackingTask) -> None:
        model = repeatable_part(model)
        self.model, self.target, self.rate = model, task.target, task.rate
        self.limits, self.lag, self.bandwidth = task.limits, task.lag, task.edge
        self.time, self.inside = task.time, task.inside
        self.c = model.coefficients()
        status, self.rest = at_rest(self.c)
        if status != OK:
            raise ModelError(STATUS_TEXTS[status])
        highest = self._highest_displacement()
        self.pulls_in = self.target > highest
        self.smooth = low_pass(np.minimum(self.target, highest), self.rate, self.bandwidth)
        self.moved = self._without_sensor()
        self.stretch = self.rest + self.moved / model.film.length
        thickness = model.film.thickness / thinning(int(self.c[HELD]), self.stretch)
        self.ceiling = np.where(self.inside, self.limits.ceiling(thickness), 0.0)
        self.needed = np.zeros(self.target.size)
        self.passes = 0

    def _highest_displacement(self) -> float:
        """Return the displacement in m below that at which the film pulls in; inf without one."""
        pull_in = pull_in_voltage(self.model)
        if pull_in is None:
            return math.inf
        last = static_stretch(self.model, pull_in * (1.0 - 1e-9))
        return _BELOW_PULL_IN * (last - self.rest) * self.model.film.length

    def _without_sensor(self) -> np.ndarray:
        """Return the film's displacement (N,) m under which the sensor reads the target."""
        sensed = any(PLACES[name].is_sensor for name, _ in self.model.effects)
        if not sensed and self.lag == 0.0:
            return self.smooth
        moved = self.smooth.copy()
        for _ in range(_SENSOR_PASSES):
            speed = np.gradient(moved, 1.0 / self.rate)
            reading, shown = np.empty_like(moved), np.empty_like(moved)
            at_sensor(self.time, moved, speed, self.time - self.lag, reading, shown)
            read_sensor(self.c, self.time, reading, shown, np.zeros(SENSOR_MEMORY))
            # what is added to every reading (drift, interference) must not be followed twice
            moved = low_pass(moved + self.smooth - reading, self.rate, self.bandwidth)
        return moved

    def from_balance(self) -> np.ndarray:
        """Return the voltage squared (N,) V^2 that the balance of stresses asks for."""
        step, c = 1.0 / self.rate, self.c
        speed = np.gradient(self.stretch, step)
        motion = np.ascontiguousarray([self.stretch, speed, np.gradient(speed, step)])
        parts, _, _ = unit_stresses(c, self.time, self.stretch)
        springs = c[HEAD + MODULUS :: WIDTH] @ parts
        fieldless, loaded = c.copy(), c.copy()
        fieldless[ELECTRIC] = loaded[ELECTRIC] = 0.0
        loaded[FORCE] += 1e3
        none = np.zeros(self.time.size)
        base = self._carried(fieldless, none, motion)
        soft = 1e3 / (self._carried(loaded, none, motion) - base)
        pull = soft * (springs - base)
        gain = c[ELECTRIC] * electric_along(int(c[HELD]), self.stretch)
        u = pull / gain
        for _ in range(_ELECTRIC_PASSES):
            volts = np.sqrt(np.maximum(u, 0.0))
            there = soft * (self._carried(c, volts, motion) - base)
            u = u + (pull - there) / gain
        self.needed = np.where(np.isfinite(u), u, 0.0)
        return self.needed

    def _carried(self, c: np.ndarray, voltage: np.ndarray, motion: np.ndarray) -> np.ndarray:
        out = np.empty(self.time.size)
        carried_stress(c, self.time, voltage, voltage, NO_AIR, motion, out, _NOTHING)
        return out

    def follow(self, u: np.ndarray) -> _Pass:
        """Return the pass of the smallest error, from the voltage squared ``u`` (N,) V^2 on."""
        best = now = self._started(u)
        if now.u.max() <= (_AT_LIMIT * self.limits.voltage) ** 2:
            return best  # nothing is asked for
        try:
            linear = linearise(self.model, self.target.size, self.rate, level_of(now.u), self.lag)
        except ModelError:  # the film stands so much for a moment, and not for as long as this
            return best
        inverse = linear.inverse(self.bandwidth)
        mixing = _Anderson()
        for _ in range(_PASSES):
            if np.abs(now.error[now.free]).max(initial=0.0) < _CLOSE:
                break
            correction = linear.through(inverse, np.where(now.free, now.error, 0.0))
            following = self._pass(mixing.next(now.u, correction))
            if following is None or following.size > 2.0 * best.size:
                mixing = _Anderson()
                halved = linear.through(0.5 * inverse, np.where(best.free, best.error, 0.0))
                following = self._pass(best.u + halved)
                if following is None or following.size > best.size:
                    break  # nothing better in this direction
            now = following
            if now.size < best.size:
                best = now
        return best

    def _started(self, u: np.ndarray) -> _Pass:
        """Return the first pass that the film survives, with less voltage where it does not."""
        for _ in range(_ATTEMPTS):
            first = self._pass(u)
            if first is not None:
                return first
            u = _GIVEN_BACK * np.maximum(u, 0.0)
        raise ModelError("the film cannot be simulated, however small the voltage is")

    def _pass(self, wanted: np.ndarray) -> _Pass | None:
        """Simulate the voltage squared ``wanted`` (N,) V^2 within limits; None: it ran away."""
        self.passes += 1
        asked = np.sqrt(np.maximum(np.nan_to_num(wanted), 0.0))
        voltage = self.limits.nearest(asked, self.ceiling, self.rate)
        reading = self.reading(voltage)
        if reading is None:
            return None
        error = np.where(self.inside, self.smooth - reading, 0.0)
        u = voltage * voltage
        near = _AT_LIMIT * self.limits.voltage
        low = (voltage <= near) & (error < 0.0)
        high = (voltage >= self.ceiling - near) & (error > 0.0)
        # a correction of limited bandwidth reaches into what stands at a limit from this near
        width = 2 * math.ceil(0.5 * self.rate / self.bandwidth) + 1
        stuck = scipy.ndimage.binary_dilation(low | high, np.ones(width, dtype=bool))
        return _Pass(u, reading, error, self.inside & ~stuck)

    def reading(self, voltage: np.ndarray) -> np.ndarray | None:
        """Return the reading (N,) m under ``voltage`` (N,) V; None where the film runs away."""
        drive = Drive(self.time, voltage, hold=True)
        reading, status = reading_of(self.c, self.model.film.length, drive, self.lag)
        return reading if status == OK else None

    def within_field(self, found: _Pass) -> _Pass:
        """Return ``found``, with less voltage where its film is thinner than the target's.

        The ceiling is that of a film on the target, and a film that misses it may be thinner.
        """
        if not math.isfinite(self.limits.field):
            return found
        while True:
            drive = Drive(self.time, np.sqrt(found.u), hold=True)
            reached = float(self.model.simulate(drive, self.lag).field.max())
            if reached <= self.limits.highest_field:
                return found
            lowered = _GIVEN_BACK * self.limits.highest_field / reached
            self.ceiling = np.minimum(self.ceiling, lowered * math.sqrt(float(found.u.max())))
            found = self._started(np.minimum(found.u, np.square(self.ceiling)))

    def result(self, found: _Pass, tolerance: float) -> Inversion:
        """Return ``found`` with its unreachable parts, farther than ``tolerance`` in m."""
        beyond = self.inside & (np.abs(self.target - found.reading) > tolerance)
        # a film that was let go rings: what it misses with pauses is one part
        width = 2 * math.ceil(0.5 * _PAUSE * self.rate) + 1
        pause = np.ones(width, dtype=bool)
        joined = scipy.ndimage.binary_closing(np.pad(beyond, width), pause)[width:-width]
        beyond |= joined & self.inside
        parts = tuple(self._part(found, first, last) for first, last in _runs(beyond))
        reference = np.where(beyond | ~self.inside, found.reading, self.smooth)
        return Inversion(
            time=self.time,
            rate=self.rate,
            voltage=np.sqrt(found.u),
            target=self.target,
            reference=reference,
            reading=found.reading,
            reachable=self.inside & ~beyond,
            unreachable=parts,
            passes=self.passes,
        )

    def _part(self, found: _Pass, first: int, last: int) -> Unreachable:
        """Return the unreachable part of the samples ``first`` to before ``last``."""
        part = slice(first, last)
        off = np.abs(self.target - found.reading)[part]
        worst = first + int(np.argmax(off))
        voltage, near = np.sqrt(found.u[part]), _AT_LIMIT * self.limits.voltage
        ceiling, wanted = self.ceiling[part], np.sqrt(np.maximum(self.needed[part], 0.0))
        most = int(np.argmax(wanted - ceiling))
        needed, cause = float(wanted[most]), "dynamics"
        if self.pulls_in[part].any():
            cause, needed = "pull-in", math.nan
        elif np.abs(self.target - self.smooth)[worst] > 0.5 * off.max():
            cause = "bandwidth"
        elif (voltage >= ceiling - near).any():
            capped = ceiling[most] < (1.0 - 1e-3) * self.limits.voltage
            cause = "field" if capped else "voltage"
        elif (voltage <= near).any():
            cause, needed = "zero", math.nan
        elif np.abs(np.diff(wanted)).max(initial=0.0) * self.rate > self.limits.slew:
            cause = "slew"
        return Unreachable(
            start=float(self.time[first]),
            stop=float(self.time[last - 1]),
            cause=cause,
            worst=float(off.max()),
            at=float(self.time[worst]),
            needed=needed,
            allowed=float(ceiling[most]),
        )


class _Anderson:
    """Anderson's acceleration of ``u <- u + correction``."""

    def __init__(self) -> None:
        self._u: list[np.ndarray] = []
        self._corrections: list[np.ndarray] = []

    def next(self, u: np.ndarray, correction: np.ndarray) -> np.ndarray:
        """Return the next ``u`` (N,) from the last ones and their corrections (N,)."""
        self._u = [*self._u, u][-_REMEMBERED:]
        self._corrections = [*self._corrections, correction][-_REMEMBERED:]
        if len(self._u) < 2:
            return u + correction
        steps = np.diff(np.array(self._u), axis=0)
        changes = np.diff(np.array(self._corrections), axis=0)
        weights, *_ = np.linalg.lstsq(changes.T, correction, rcond=1e-8)
        return np.asarray(u + correction - weights @ (steps + changes))


def _runs(mask: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield the first sample of each run of True, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
