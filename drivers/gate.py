"""The one gate: no sample reaches a rig's output that has not passed here.

Drivers take a ``GatedWaveform`` and nothing else, and only ``admit`` can make one. Limits are
errors raised by ordinary code, never ``assert``, which an optimising interpreter would drop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NoReturn, final

import numpy as np

from drivers.errors import RefusedWaveform, RigError

__all__ = ["GatedWaveform", "Limits", "Margin", "Prediction", "admit", "ramp_down"]

_KEY = object()


@dataclass(frozen=True)
class Limits:
    """What the film and the amplifier may see, in SI units.

    ``voltage_min`` and ``voltage_max`` in V bound the voltage at the film (their signs are the
    polarity that is allowed), ``slew`` in V/s its rate, ``field`` in V/m the true electric field,
    ``energy`` in J what the amplifier charges into the film over all rises of a run, and
    ``time_at_voltage`` in s how long it may stand at ``at_voltage`` V or more without a pause.
    ``film`` names the film they are for; empty, they are for any.
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
        """True where nothing passes these limits that ``other`` would refuse."""
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
    """What a model foresees of the film under a waveform of N samples; this layer has no model.

    ``field_per_volt`` (N,) 1/m is the reciprocal of the film's thickness, so that the true field is
    its product with the voltage; ``capacitance`` (N,) F. ``pull_in`` says in words that the film
    would collapse, and is empty where it would not. ``film`` names the film that was asked for.
    """

    field_per_volt: np.ndarray
    capacitance: np.ndarray
    pull_in: str = ""
    film: str = ""


@dataclass(frozen=True)
class Margin:
    """How near a waveform comes to one limit: ``reached`` and ``allowed`` in ``unit``."""

    quantity: str
    reached: float
    allowed: float
    unit: str


@final
class GatedWaveform:
    """A voltage waveform that has passed the gate; neither changed nor copied afterwards.

    ``voltage`` (N,) V at the film on an even clock of ``rate`` Hz, starting and ending at 0 V.
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
            raise TypeError("a GatedWaveform comes from drivers.gate.admit and from nowhere else")
        # an array over bytes: unlike one with its flag cleared, it cannot be made writeable again
        held = np.frombuffer(np.asarray(voltage, dtype=np.float64).tobytes())
        object.__setattr__(self, "_voltage", held)
        object.__setattr__(self, "_rate", rate)
        object.__setattr__(self, "_limits", limits)
        object.__setattr__(self, "_margins", margins)

    def __init_subclass__(cls, **kwargs: object) -> NoReturn:
        raise TypeError("a GatedWaveform cannot be derived from: it would open the gate")

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a GatedWaveform is not changed after the gate ({name!r})")

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        # copying and unpickling build objects without passing __init__
        raise TypeError("a GatedWaveform is not copied or pickled: admit the waveform again")

    @property
    def voltage(self) -> np.ndarray:
        """(N,) V, read-only."""
        return self._voltage

    @property
    def rate(self) -> float:
        """Sample rate in Hz."""
        return self._rate

    @property
    def limits(self) -> Limits:
        """The limits under which it passed."""
        return self._limits

    @property
    def margins(self) -> tuple[Margin, ...]:
        """How near it comes to each limit."""
        return self._margins

    def check_within(self, limits: Limits) -> None:
        """Raise ``RigError`` where it passed the gate under wider limits than ``limits``."""
        if not self._limits.within(limits):
            raise RigError(
                f"the waveform passed the gate under wider limits ({self._limits}) than this "
                f"rig's ({limits}); admit it under the rig's own"
            )

    @property
    def duration(self) -> float:
        """s, from the first to the last sample."""
        return (self._voltage.size - 1) / self._rate


def admit(
    voltage: np.ndarray, rate: float, limits: Limits, prediction: Prediction
) -> GatedWaveform:
    """Let a waveform pass, or raise ``RefusedWaveform`` with a sentence for every limit it breaks.

    ``voltage`` is (N,) V at the film, ``rate`` Hz, ``prediction`` what the film will do under it.

    Slew is judged sample to sample, as the converter steps; the steps from and to the 0 V before
    and after the run are none, because the waveform must start and end at 0 V.
    """
    # a copy: what is judged is what goes out, whatever the caller does to its array meanwhile
    voltage = np.array(voltage, dtype=np.float64)
    field_per_volt = np.asarray(prediction.field_per_volt, dtype=np.float64)
    capacitance = np.asarray(prediction.capacitance, dtype=np.float64)
    for name, limit in vars(limits).items():
        if isinstance(limit, float) and math.isnan(limit):
            raise RefusedWaveform((f"the limit {name} is nan, and lets nothing pass",))
    if not (math.isfinite(rate) and rate > 0.0):
        raise RefusedWaveform((f"the sample rate {rate!r} Hz is not a finite number above 0",))
    shapes = {voltage.shape, field_per_volt.shape, capacitance.shape}
    if voltage.ndim != 1 or voltage.size < 2 or len(shapes) > 1:
        raise RefusedWaveform(
            (
                f"a waveform is one row of at least 2 samples with as many predictions, not "
                f"{voltage.shape}, {field_per_volt.shape} and {capacitance.shape}",
            )
        )
    finite = np.isfinite(voltage) & np.isfinite(field_per_volt) & np.isfinite(capacitance)
    if not finite.all():
        at = int(np.argmin(finite))
        raise RefusedWaveform((f"sample {at} (at {at / rate:.4g} s) is not a finite number",))
    for quantity, values, unit in (
        ("one over the thickness", field_per_volt, "1/m"),
        ("the capacitance", capacitance, "F"),
    ):
        if not (values > 0.0).all():
            at = int(np.argmin(values))
            raise RefusedWaveform(
                (f"{quantity} is predicted as {values[at]:.4g} {unit} at sample {at}, not above 0",)
            )

    reasons: list[str] = []

    def check(
        quantity: str, reached: float, allowed: float, unit: str, scale: float, where: str = ""
    ) -> Margin:
        # not (<=), so that what is not a number is refused
        if not reached <= allowed:
            reasons.append(
                f"{quantity} reaches {reached * scale:.6g} {unit}{where}, "
                f"{allowed * scale:.6g} {unit} is allowed"
            )
        # + 0.0: a waveform that never goes negative reaches 0, not -0
        return Margin(quantity, reached * scale + 0.0, allowed * scale + 0.0, unit)

    def peak(quantity: str, values: np.ndarray, allowed: float, unit: str, scale: float) -> Margin:
        at = int(np.argmax(values))
        where = f" at {at / rate:.4g} s"
        return check(quantity, float(values[at]), allowed, unit, scale, where)

    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is beyond every limit
        slew = np.abs(np.diff(voltage)) * rate
        field = np.abs(voltage) * field_per_volt
        rises = 0.5 * (voltage[1:] + voltage[:-1]) * np.diff(capacitance * voltage)
        energy = float(np.sum(np.maximum(rises, 0.0)))  # a NaN stays one, and is refused
    standing = _longest(~(np.abs(voltage) < limits.at_voltage)) / rate
    margins = (
        peak("voltage", voltage, limits.voltage_max, "kV", 1e-3),
        peak("negative voltage", -voltage, 0.0 - limits.voltage_min, "kV", 1e-3),
        peak("slew", slew, limits.slew, "kV/s", 1e-3),
        peak("true field", field, limits.field, "MV/m", 1e-6),
        check("energy", energy, limits.energy, "J", 1.0),
        check(
            f"time at {limits.at_voltage * 1e-3:.4g} kV or more", standing,
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


def _longest(true: np.ndarray) -> int:
    """Most samples of ``true`` (N,) in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], true, [False]))))
    return int(np.max(edges[1::2] - edges[::2], initial=0))


def ramp_down(waveform: GatedWaveform, last: int, duration: float) -> np.ndarray:
    """(M,) V that take the output from sample ``last`` of ``waveform`` to 0 V in a straight line.

    ``duration`` in s is lengthened where the waveform's slew limit asks for it. These are the only
    samples that reach an output without having been in the waveform; they lie between one that
    passed the gate and 0 V. Empty when sample ``last`` already is 0 V.
    """
    voltage = float(waveform.voltage[last])
    if voltage == 0.0:
        return np.empty(0)
    seconds = max(duration, abs(voltage) / waveform.limits.slew)
    steps = max(1, math.ceil(seconds * waveform.rate))
    return voltage * (1.0 - np.arange(1, steps + 1) / steps)
