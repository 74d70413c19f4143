"""Judgement of a voltage by the limits, piece by piece; the gate alone admits by it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dearig.drivers.errors import RefusedWaveform

__all__ = [
    "Limits",
    "Margin",
    "Reached",
    "end_reasons",
    "judged",
    "require_above_zero",
    "require_film",
    "require_finite",
]


@dataclass(frozen=True)
class Limits:
    """Limits of the film and the amplifier, in SI units.

    ``voltage_min`` and ``voltage_max`` in V bound the voltage at the film; their signs give the
    allowed polarity. ``slew`` in V/s bounds its rate and ``field`` in V/m the true electric field.
    ``energy`` in J bounds the energy that the amplifier charges into the film over all rises of a
    run, and ``time_at_voltage`` in s the time at ``at_voltage`` V or more without a pause. ``film``
    names the film of these limits; an empty name stands for any film.
    """

    voltage_min: float
    voltage_max: float
    slew: float
    field: float
    energy: float
    at_voltage: float
    time_at_voltage: float
    film: str = ""

    def within(self, other: Limits) -> bool:
        """Return True where ``other`` admits every waveform that these limits admit."""
        return (
            self.voltage_max <= other.voltage_max
            and self.voltage_min >= other.voltage_min
            and self.slew <= other.slew
            and self.field <= other.field
            and self.energy <= other.energy
            and self.at_voltage <= other.at_voltage
            and self.time_at_voltage <= other.time_at_voltage
            and (self.film == other.film or not other.film)
        )


@dataclass(frozen=True)
class Margin:
    """Margin of a waveform to one limit: ``reached`` and ``allowed`` in ``unit``."""

    quantity: str
    reached: float
    allowed: float
    unit: str


def require_finite(values: np.ndarray, start: int, rate: float) -> None:
    """Raise ``RefusedWaveform`` where one of ``values`` (n,) from ``start`` on is not finite."""
    if np.isfinite(values.sum()):  # fast; a sum may overflow, so check each value then
        return
    at = int(np.argmin(np.isfinite(values)))
    if not np.isfinite(values[at]):
        at += start
        raise RefusedWaveform((f"sample {at} (at {at / rate:.4g} s) is not a finite number",))


def require_film(field_per_volt: np.ndarray, samples: int, start: int, rate: float) -> None:
    """Raise ``RefusedWaveform`` where the predicted field per volt (n,) is not that of a film."""
    if field_per_volt.shape != (samples,):
        raise RefusedWaveform(
            (f"{samples} samples from {start} on have {field_per_volt.shape} predictions",)
        )
    require_finite(field_per_volt, start, rate)
    require_above_zero("one over the thickness", float(field_per_volt.min()), "1/m")


def require_above_zero(quantity: str, value: float, unit: str) -> None:
    """Raise ``RefusedWaveform`` unless the predicted ``value`` is finite and above 0."""
    if not (math.isfinite(value) and value > 0.0):
        raise RefusedWaveform((f"{quantity} is predicted as {value:.4g} {unit}, not above 0",))


class Reached:
    """Maximum of each quantity in the pieces so far, with its sample."""

    def __init__(self, rate: float, limits: Limits, electric_volume: float) -> None:
        self._rate = rate
        self._at_voltage = limits.at_voltage
        self._electric_volume = electric_volume
        self.high = self.low = self.slew = self.field = (-math.inf, 0)
        self.energy = 0.0
        self.longest = 0  # samples in a row at voltage
        self.first = self.last = math.nan  # V, of the first and the last sample so far
        self._standing = 0  # samples in a row at voltage at the end of the last piece
        self._last = (0.0, 0.0)  # V and C, of the last sample whose field was taken

    def take_voltage(self, start: int, voltage: np.ndarray) -> None:
        """Include the samples (n,) V from ``start`` on, which continue those before."""
        self.high = _higher(self.high, voltage, start)
        self.low = _higher(self.low, -voltage, start)
        steps = np.abs(np.diff(voltage))
        if start:
            step = np.array([abs(float(voltage[0]) - self.last)]) * self._rate
            self.slew = _higher(self.slew, step, start - 1)
        else:
            self.first = float(voltage[0])
        self.slew = _higher(self.slew, steps * self._rate, start)
        self.last = float(voltage[-1])
        self._take_standing(voltage)

    def take_field(self, start: int, voltage: np.ndarray, field_per_volt: np.ndarray) -> None:
        """Include the field and the energy of the same samples."""
        self.field = _higher(self.field, np.abs(voltage) * field_per_volt, start)
        # in this order no overflow makes a NaN where the voltage is 0
        charge = (self._electric_volume * field_per_volt) * (field_per_volt * voltage)
        rises = 0.5 * (voltage[1:] + voltage[:-1]) * np.diff(charge)
        before, held = self._last
        # a waveform starts at 0 V and without charge, or it is refused
        rise = 0.5 * (float(voltage[0]) + before) * (float(charge[0]) - held)
        # a NaN propagates and is refused
        self.energy += float(np.sum(np.maximum(rises, 0.0))) + float(np.maximum(rise, 0.0))
        self._last = (float(voltage[-1]), float(charge[-1]))

    def _take_standing(self, voltage: np.ndarray) -> None:
        standing = ~(np.abs(voltage) < self._at_voltage)
        if not standing.any():
            self._standing = 0
            return
        edges = np.flatnonzero(np.diff(np.concatenate(([False], standing, [False]))))
        lengths = edges[1::2] - edges[::2]
        if edges[0] == 0:
            lengths[0] += self._standing
        self.longest = int(np.max(lengths, initial=self.longest))
        self._standing = int(lengths[-1]) if standing[-1] else 0


def _higher(peak: tuple[float, int], values: np.ndarray, first: int) -> tuple[float, int]:
    """Return the greater of ``peak`` and the maximum of ``values`` (n,) from ``first`` on."""
    if values.size == 0 or math.isnan(peak[0]):
        return peak
    value = float(values.max())  # NaN if there is one
    return peak if peak[0] >= value else (value, first + int(np.argmax(values)))


def judged(reached: Reached, rate: float, limits: Limits) -> tuple[tuple[Margin, ...], list[str]]:
    """Return the margin to each limit, and a sentence for each limit that is broken.

    That a waveform also ends at 0 V is ``end_reasons``.
    """
    reasons: list[str] = []

    def check(
        quantity: str, peak: tuple[float, int], allowed: float, unit: str, scale: float
    ) -> Margin:
        value, at = peak
        # not (<=), so that NaN is refused
        if not value <= allowed:
            where = f" at {at / rate:.4g} s" if at >= 0 else ""
            reasons.append(
                f"{quantity} reaches {value * scale:.6g} {unit}{where}, "
                f"{allowed * scale:.6g} {unit} is allowed"
            )
        # + 0.0: show 0 instead of -0 for a waveform without negative voltage
        return Margin(quantity, value * scale + 0.0, allowed * scale + 0.0, unit)

    standing = reached.longest / rate
    margins = (
        check("voltage", reached.high, limits.voltage_max, "kV", 1e-3),
        check("negative voltage", reached.low, 0.0 - limits.voltage_min, "kV", 1e-3),
        check("slew", reached.slew, limits.slew, "kV/s", 1e-3),
        check("true field", reached.field, limits.field, "MV/m", 1e-6),
        check("energy", (reached.energy, -1), limits.energy, "J", 1.0),
        check(
            f"time at {limits.at_voltage * 1e-3:.4g} kV or more", (standing, -1),
            limits.time_at_voltage, "s", 1.0,
        ),
    )  # fmt: skip
    if reached.first != 0.0:
        reasons.append(f"the waveform starts at {reached.first * 1e-3:.6g} kV, not at 0")
    return margins, reasons


def end_reasons(reached: Reached) -> list[str]:
    """Return a sentence where the last sample of a whole waveform is not 0 V."""
    if reached.last == 0.0:
        return []
    return [f"the waveform ends at {reached.last * 1e-3:.6g} kV, not at 0"]
