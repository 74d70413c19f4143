"""Displacement from voltage and current alone: the film as its own sensor.

The charge of the film is the integral of the current that neither the monitor's offset nor a
conduction explains, and its capacitance gives the stretch:

    Q = integral of (i - o - G V) dt,   C = Q/V = C_0 (Z/z)^2 F,

with F the effects' share, 1 for the plain film. The charge is known wherever the voltage is almost
zero, so that the integral is anchored there: the offset o and the conductance G are fitted to what
the anchors leave, and between two anchors the noise is a Brownian bridge of variance
s^2 t (T - t)/T, with s^2 the noise of one reading times its interval. Both anchors are used: this
is for a record, not for a controller that cannot know the next one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dearig.model.circuit import loop
from dearig.model.coefficients import CAPACITANCE, HELD, LENGTH
from dearig.model.effects import PLACES
from dearig.model.effects.assembly import active
from dearig.model.errors import ModelError
from dearig.model.kernel import OK
from dearig.model.kinematics import thinning, thinning_squared
from dearig.model.readings.channels import ChannelRecord
from dearig.model.simulation.actuator import Actuator, Drive, at_rest

__all__ = ["SHARES", "Sensed", "sense_displacement"]

#: Share of the film's charge, at rest, that readings of the current must carry. Films are pulled to
#: less than 1.4 of their rest stretch, twice the capacitance; a part of 0.5 is lost by no scale.
SHARES = (0.5, 2.0)

_ZERO = 0.01  # of the largest voltage: C V, known there to 10 %, is known to 0.1 % of the largest
_RELATIVE = 0.1  # of C: up to this standard error the stretch is linear in it to 5 % of the error
_EXPONENT = (2.0, 1.0, 4.0)  # of the stretch in (Z/z)^2, by the kinematics


@dataclass(frozen=True)
class Sensed:
    """Displacement (N,) in m from voltage and current, with its standard errors (N,) in m.

    ``noise_error`` is that of the noise, the offset and the conduction; ``gain_error`` that of the
    charge's scale, common to all rows. All are NaN where the voltage is too low for an estimate,
    below ``threshold`` V about. ``share`` is the charge at the readings over that of the film at
    rest; outside ``SHARES`` there is no estimate. ``offset`` A and ``conductance`` S are fitted at
    the ``anchors``, intervals between two voltages of almost zero; ``excess`` is the standard
    deviation of what these leave over what the noise explains, 1 at least. ``noise`` is that of one
    reading in A, ``scale`` the charge in C at rest under the largest voltage, ``gradient`` (N,) the
    displacement in m by the logarithm of the capacitance, and ``lobe`` (N,) the number of the
    anchor before each row.
    """

    displacement: np.ndarray
    noise_error: np.ndarray
    gain_error: np.ndarray
    threshold: float
    share: float
    offset: float
    conductance: float
    anchors: int
    excess: float
    noise: float
    scale: float
    gradient: np.ndarray
    lobe: np.ndarray

    @property
    def standard_error(self) -> np.ndarray:
        """Standard error (N,) in m of the displacement."""
        return np.hypot(self.noise_error, self.gain_error)


def sense_displacement(
    model: Actuator, drive: Drive, current: ChannelRecord, gain: float, gain_error: float
) -> Sensed:
    """Return the displacement that ``current`` shows under ``drive``, by ``model``.

    ``gain`` is what the charge is over that of the model, 1 unless a calibration says otherwise,
    and ``gain_error`` its relative standard uncertainty. Raises ``ModelError``
    for a drive without a voltage, or that never comes back to zero.
    """
    c = model.coefficients()
    status, rest = at_rest(c, drive)
    if status != OK:
        raise ModelError("the model has no rest state under its load")
    held = int(c[HELD])
    voltage = _at_film(c, drive, rest)
    largest = float(np.max(np.abs(voltage)))
    if not largest > 0.0:
        raise ModelError("there is no voltage: a film without one shows no capacitance")
    at_rest_capacitance = gain * c[CAPACITANCE] * thinning_squared(held, rest)
    bridges = _Bridges(drive.time, voltage, current, at_rest_capacitance, _ZERO * largest)
    charge, variance = bridges.charge, bridges.variance
    busy = np.abs(voltage) > _ZERO * largest
    norm = at_rest_capacitance * float(voltage[busy] @ voltage[busy])
    share = float(charge[busy] @ voltage[busy]) / norm
    with np.errstate(divide="ignore", invalid="ignore"):
        area = charge / (gain * c[CAPACITANCE] * voltage)
        relative = np.sqrt(variance) / np.abs(at_rest_capacitance * voltage)
    usable = busy & (relative < _RELATIVE) & (area > 0.0) & (SHARES[0] < share < SHARES[1])
    exponent = _EXPONENT[held]
    stretch = np.full(voltage.size, np.nan)
    stretch[usable] = area[usable] ** (1.0 / exponent)
    if usable.any():
        stretch /= _effects_share(model, c, drive, stretch, voltage) ** (1.0 / exponent)
    # d(displacement)/d(ln C)
    gradient = c[LENGTH] * stretch / exponent
    error = np.sqrt(variance) / np.abs(charge, where=usable, out=np.full(voltage.size, np.nan))
    return Sensed(
        displacement=c[LENGTH] * (stretch - rest),
        noise_error=gradient * error,
        gain_error=gradient * gain_error,
        threshold=float(np.min(np.abs(voltage[usable]))) if usable.any() else largest,
        share=share,
        offset=bridges.offset,
        conductance=bridges.conductance,
        anchors=bridges.anchors,
        excess=bridges.excess,
        noise=current.noise,
        scale=at_rest_capacitance * largest,
        gradient=gradient,
        lobe=bridges.lobe,
    )


class _Bridges:
    """Charge (N,) in C at each row, anchored where the voltage is almost zero, and its variance."""

    def __init__(
        self,
        time: np.ndarray,
        voltage: np.ndarray,
        current: ChannelRecord,
        capacitance: float,
        zero: float,
    ) -> None:
        # a row is the mean over its interval: its charge at the middle is half of it later
        step = np.gradient(time)
        flow = np.stack([current.values, np.ones(time.size), voltage]) * step
        whole = np.cumsum(flow, axis=1) - 0.5 * flow
        at = np.flatnonzero(np.abs(voltage) <= zero)
        if at.size < 2:
            raise ModelError(
                "the voltage does not come back to 0 V: the charge is known there alone, and "
                "without it the error of the integrated current has no bound"
            )
        density = current.noise**2 * float(np.median(step))  # of the charge, in C^2/s
        known = np.diff(capacitance * voltage[at])
        between = np.diff(whole[:, at], axis=1)
        long = np.diff(time[at])
        weight = 1.0 / np.sqrt(density * long)
        y, x = (between[0] - known) * weight, between[1:].T * weight[:, None]
        size = np.linalg.norm(x, axis=0)
        solved, *_ = np.linalg.lstsq(x / size, y, rcond=None)
        left = y - x / size @ solved
        self.offset, self.conductance = (float(v) for v in solved / size)
        lobes = np.diff(at) > 1
        self.anchors = int(np.count_nonzero(lobes))
        spread = float(np.sqrt(np.mean(left[lobes] ** 2))) if lobes.any() else 1.0
        self.excess = max(spread, 1.0)
        # what remains at an anchor is spread over the time since the last one
        free = whole[0] - self.offset * whole[1] - self.conductance * whole[2]
        self.charge = free - np.interp(time, time[at], free[at] - capacitance * voltage[at])
        index = np.clip(np.searchsorted(at, np.arange(time.size), "right") - 1, 0, at.size - 2)
        self.lobe = index
        start, end = time[at[index]], time[at[index + 1]]
        inside = np.clip(time - start, 0.0, None) * np.clip(end - time, 0.0, None) / (end - start)
        covariance = np.linalg.pinv((x / size).T @ (x / size)) / np.outer(size, size)
        conducted = whole[2] - np.interp(time, time[at], whole[2, at])
        variance = density * inside + covariance[1, 1] * conducted**2
        # before the first and after the last one only the fit holds: no estimate there
        outside = (time < time[at[0]]) | (time > time[at[-1]])
        # a bend of the voltage within a row: the mean is off the middle by an eighth of it at most
        bend = np.zeros(time.size)
        bend[1:-1] = (0.125 * capacitance * np.diff(voltage, 2)) ** 2
        bend += np.interp(time, time[at], bend[at])
        self.variance = np.where(outside, np.inf, variance * self.excess**2 + bend)


def _at_film(c: np.ndarray, drive: Drive, rest: float) -> np.ndarray:
    """Return the voltage (N,) at the film that ``drive`` causes, by the effects in ``c``."""
    if not int(active(c)) & loop.ELECTRIC_BITS:
        return drive.voltage
    still = np.full(drive.time.size, rest)
    return _follow(c, drive, still)[loop.FILM]


def _follow(c: np.ndarray, drive: Drive, stretch: np.ndarray) -> np.ndarray:
    given = (drive.time, drive.voltage, drive.ends, drive.air)
    return loop.follow(c, *given, stretch, loop.ABOUT)


def _effects_share(
    model: Actuator, c: np.ndarray, drive: Drive, stretch: np.ndarray, voltage: np.ndarray
) -> np.ndarray | float:
    """Return F (N,), the charge with the model's effects over that of the plain film.

    ``voltage`` (N,) at the film is that of a film that does not move: what the motion changes of it
    is in F. F depends on the stretch little, so that the one of the plain film serves for it.
    """
    if not int(active(c)) & loop.ELECTRIC_BITS:
        return 1.0
    kept = tuple(e for e in model.effects if not _conducts(e[0]))
    storing = replace(model, effects=kept).coefficients()
    at_rest(storing, drive)
    known = np.isfinite(stretch)
    along = np.interp(drive.time, drive.time[known], stretch[known])
    rows = _follow(storing, drive, along)
    into = rows[loop.INTO] * np.gradient(drive.time)
    charge = np.cumsum(into) - 0.5 * into
    plain = c[CAPACITANCE] * thinning(int(c[HELD]), along) ** 2 * rows[loop.FILM]
    film = _follow(c, drive, along)[loop.FILM]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(known, charge / plain * film / voltage, 1.0)


def _conducts(name: str) -> bool:
    module = PLACES[name].module
    return any(getattr(module, hook, None) is not None for hook in ("conduct", "drop"))
