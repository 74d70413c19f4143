"""Gate: every sample passes it before it reaches a rig's output.

Drivers take only a ``GatedWaveform``, and only ``admit`` can make one. Ordinary code enforces the
limits and raises errors. It never uses ``assert``, which an optimising interpreter removes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NoReturn, final

import numpy as np

from dearig.drivers.errors import RefusedWaveform, RigError

__all__ = ["GatedWaveform", "Limits", "Margin", "Prediction", "admit", "ramp_down"]

_KEY = object()
_PIECE = 2**20  # samples checked at a time; bounds the temporary memory for a run of hours


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
class Prediction:
    """Prediction of the film under a waveform of N samples, made by a layer above.

    ``field_per_volt`` (M,) 1/m is the reciprocal of the film's thickness: the true field is its
    product with the voltage. There is one number for each ``stride`` samples, M = ceil(N/stride),
    since a film moves slowly compared with a fast clock. ``electric_volume`` in F m is permittivity
    times volume, which is constant: the capacitance is its product with the square of
    ``field_per_volt``. ``pull_in`` describes the film's collapse, and is empty without one.
    ``film`` names the predicted film.
    """

    field_per_volt: np.ndarray
    electric_volume: float
    pull_in: str = ""
    film: str = ""
    stride: int = 1


@dataclass(frozen=True)
class Margin:
    """Margin of a waveform to one limit: ``reached`` and ``allowed`` in ``unit``."""

    quantity: str
    reached: float
    allowed: float
    unit: str


@final
class GatedWaveform:
    """A voltage waveform that has passed the gate; it cannot be changed or copied.

    ``voltage`` (N,) V at the film is sampled evenly at ``rate`` Hz, and starts and ends at 0 V.
    """

    __slots__ = ("_limits", "_margins", "_rate", "_voltage")

    _limits: Limits
    _margins: tuple[Margin, ...]
    _rate: float
    _voltage: np.ndarray

    def __init__(
        self,
        voltage: np.ndarray,
        rate: float,
        limits: Limits,
        margins: tuple[Margin, ...],
        key: object,
    ) -> None:
        if key is not _KEY:
            raise TypeError("only drivers.gate.admit can make a GatedWaveform")
        # an array over bytes cannot be made writeable again, unlike one with its flag cleared
        held = np.frombuffer(np.asarray(voltage, dtype=np.float64).tobytes())
        object.__setattr__(self, "_voltage", held)
        object.__setattr__(self, "_rate", rate)
        object.__setattr__(self, "_limits", limits)
        object.__setattr__(self, "_margins", margins)

    def __init_subclass__(cls, **kwargs: object) -> NoReturn:
        raise TypeError("a GatedWaveform cannot be derived from: that would bypass the gate")

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a GatedWaveform cannot be changed after the gate ({name!r})")

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        # copying and unpickling build objects without calling __init__
        raise TypeError("a GatedWaveform cannot be copied or pickled: admit the waveform again")

    @property
    def voltage(self) -> np.ndarray:
        """Return the voltage (N,) V, read-only."""
        return self._voltage

    @property
    def rate(self) -> float:
        """Return the sample rate in Hz."""
        return self._rate

    @property
    def limits(self) -> Limits:
        """Return the limits under which it passed."""
        return self._limits

    @property
    def margins(self) -> tuple[Margin, ...]:
        """Return the margin to each limit."""
        return self._margins

    def check_within(self, limits: Limits) -> None:
        """Raise ``RigError`` where it passed the gate under wider limits than ``limits``."""
        if not self._limits.within(limits):
            raise RigError(
                f"the waveform passed the gate under wider limits ({self._limits}) than this "
                f"rig's ({limits}); admit it under this rig's limits"
            )

    @property
    def duration(self) -> float:
        """Return the time in s from the first to the last sample."""
        return (self._voltage.size - 1) / self._rate


def admit(
    voltage: np.ndarray, rate: float, limits: Limits, prediction: Prediction
) -> GatedWaveform:
    """Return the admitted waveform, or raise ``RefusedWaveform`` with a sentence per broken limit.

    ``voltage`` is (N,) V at the film, ``rate`` is in Hz, ``prediction`` is the film's response.

    The slew rate is computed from sample to sample, as the converter steps. There are no further
    steps before and after the run, because the waveform must start and end at 0 V.
    """
    # a copy: the checked samples are those that go out, even if the caller changes its array
    voltage = np.array(voltage, dtype=np.float64)
    field_per_volt = np.asarray(prediction.field_per_volt, dtype=np.float64)
    _require_comparable(voltage, field_per_volt, rate, limits, prediction)

    reached = _Reached()
    with np.errstate(over="ignore", invalid="ignore"):  # an overflow exceeds every limit
        for first in range(0, voltage.size, _PIECE):
            last = min(first + _PIECE, voltage.size)
            before = max(0, first - 1)  # include the step and the rise from the previous piece
            strides = np.arange(before, last) // prediction.stride
            reached.take(
                voltage[before:last],
                field_per_volt[strides],
                before,
                first,
                rate,
                limits,
                prediction,
            )

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
    reasons.extend(
        f"the waveform {'starts' if i == 0 else 'ends'} at {voltage[i] * 1e-3:.6g} kV, not at 0"
        for i in (0, -1)
        if voltage[i] != 0.0
    )
    if prediction.pull_in:
        reasons.append(f"the model predicts {prediction.pull_in}")
    if limits.film and prediction.film != limits.film:
        asked = f"film {prediction.film!r}" if prediction.film else "a film without a name"
        reasons.append(f"the limits are declared for film {limits.film!r}, not for {asked}")
    if reasons:
        raise RefusedWaveform(tuple(reasons))
    return GatedWaveform(voltage, rate, limits, margins, _KEY)


def _require_comparable(
    voltage: np.ndarray,
    field_per_volt: np.ndarray,
    rate: float,
    limits: Limits,
    prediction: Prediction,
) -> None:
    """Raise ``RefusedWaveform`` for values that cannot be compared with the limits."""
    for name, limit in vars(limits).items():
        if isinstance(limit, float) and math.isnan(limit):
            raise RefusedWaveform((f"the limit {name} is nan, which admits no waveform",))
    if not (math.isfinite(rate) and rate > 0.0):
        raise RefusedWaveform((f"the sample rate {rate!r} Hz is not a finite number above 0",))
    predicted = (-(-voltage.size // prediction.stride),) if prediction.stride >= 1 else (0,)
    if voltage.ndim != 1 or voltage.size < 2 or field_per_volt.shape != predicted:
        raise RefusedWaveform(
            (
                f"a waveform is one row of at least 2 samples with a prediction for each "
                f"{prediction.stride}, not {voltage.shape} and {field_per_volt.shape}",
            )
        )
    for values, step in ((voltage, 1), (field_per_volt, prediction.stride)):
        if not np.isfinite(values.sum()):  # fast; a sum may overflow, so check each value then
            at = int(np.argmin(np.isfinite(values))) * step
            if not np.isfinite(values[at // step]):
                raise RefusedWaveform(
                    (f"sample {at} (at {at / rate:.4g} s) is not a finite number",)
                )
    thickest = float(field_per_volt.min())
    for quantity, value, unit in (
        ("one over the thickness", thickest, "1/m"),
        ("the film's permittivity times its volume", prediction.electric_volume, "F m"),
    ):
        if not (math.isfinite(value) and value > 0.0):
            raise RefusedWaveform((f"{quantity} is predicted as {value:.4g} {unit}, not above 0",))


class _Reached:
    """Maximum of each quantity in the pieces so far, with its sample."""

    def __init__(self) -> None:
        self.high = self.low = self.slew = self.field = (-math.inf, 0)
        self.energy = 0.0
        self.longest = 0  # samples in a row at voltage
        self._standing = 0  # samples in a row at voltage at the end of the last piece

    def take(
        self,
        voltage: np.ndarray,
        field_per_volt: np.ndarray,
        start: int,
        first: int,
        rate: float,
        limits: Limits,
        prediction: Prediction,
    ) -> None:
        """Include the piece from sample ``first``; the arrays (n,) begin at sample ``start``."""
        slew = np.abs(np.diff(voltage)) * rate
        charge = prediction.electric_volume * field_per_volt**2 * voltage
        rises = 0.5 * (voltage[1:] + voltage[:-1]) * np.diff(charge)
        self.energy += float(np.sum(np.maximum(rises, 0.0)))  # a NaN propagates and is refused
        self.slew = _higher(self.slew, slew, start)
        new = slice(first - start, None)
        self.high = _higher(self.high, voltage[new], first)
        self.low = _higher(self.low, -voltage[new], first)
        self.field = _higher(self.field, np.abs(voltage[new]) * field_per_volt[new], first)

        standing = ~(np.abs(voltage[new]) < limits.at_voltage)
        edges = np.flatnonzero(np.diff(np.concatenate(([False], standing, [False]))))
        lengths = edges[1::2] - edges[::2]
        if lengths.size and edges[0] == 0:
            lengths[0] += self._standing
        self.longest = int(np.max(lengths, initial=self.longest))
        self._standing = int(lengths[-1]) if lengths.size and standing[-1] else 0


def _higher(peak: tuple[float, int], values: np.ndarray, first: int) -> tuple[float, int]:
    """Return the greater of ``peak`` and the maximum of ``values`` (n,) from ``first`` on."""
    if values.size == 0:
        return peak
    at = int(np.argmax(values))  # argmax returns the first NaN if there is one
    value = float(values[at])
    return peak if peak[0] >= value or math.isnan(peak[0]) else (value, first + at)


def ramp_down(waveform: GatedWaveform, last: int, duration: float) -> np.ndarray:
    """Return (M,) V that ramp the output from sample ``last`` of ``waveform`` to 0 V linearly.

    ``duration`` in s is lengthened where the waveform's slew limit requires it. Only these samples
    reach an output without being part of the waveform; they lie between a sample that passed the
    gate and 0 V. The ramp is empty where sample ``last`` is 0 V already.
    """
    voltage = float(waveform.voltage[last])
    if voltage == 0.0:
        return np.empty(0)
    seconds = max(duration, abs(voltage) / waveform.limits.slew)
    steps = max(1, math.ceil(seconds * waveform.rate))
    return voltage * (1.0 - np.arange(1, steps + 1) / steps)
