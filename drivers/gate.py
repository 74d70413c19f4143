"""Gate: every sample passes it before it reaches a rig's output.

Drivers take only a ``GatedWaveform``, and only ``admit`` can make one. Ordinary code enforces the
limits and raises errors. It never uses ``assert``, which an optimising interpreter removes.
"""

from __future__ import annotations

import hashlib
import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from typing import NoReturn, Protocol, final

import numpy as np

from dearig.drivers.errors import ChangedWaveform, RefusedWaveform, RigError
from dearig.drivers.samples import Listed, Repeated, Samples

__all__ = [
    "FilmPrediction",
    "GatedWaveform",
    "Limits",
    "Margin",
    "Prediction",
    "admit",
    "ramp_down",
]

_KEY = object()
_BYTES = 8  # of one sample, a float64
# Samples that are computed, checked and hashed together: 0.5 MB, which stays in a processor's cache
_PIECE = 2**16
# Pieces that are kept: 64 MB. They hold every waveform of up to 8.4 million samples, and 8 s at
# 1 MHz, which is longer than the card's output buffer: the interlocks read what was written before.
_KEPT = 128


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


class FilmPrediction(Protocol):
    """Prediction of the film under a waveform, made by a layer above while the gate reads it.

    ``electric_volume`` in F m is permittivity times volume, which is constant: the capacitance is
    its product with the square of the field per volt. ``film`` names the predicted film.
    ``pull_in`` describes the film's collapse so far, and is empty without one.
    """

    @property
    def electric_volume(self) -> float: ...

    @property
    def film(self) -> str: ...

    @property
    def pull_in(self) -> str: ...

    def fits(self, samples: int) -> bool:
        """Return whether it is the prediction of a waveform of so many samples."""
        ...

    def follow(self, start: int, voltage: np.ndarray) -> np.ndarray:
        """Return the field per volt (n,) 1/m under the samples (n,) V from ``start`` on.

        It is the reciprocal of the film's thickness: the true field is its product with the
        voltage. The gate asks for the whole waveform once, piece by piece and in order.
        """
        ...


@dataclass(frozen=True)
class Prediction:
    """Prediction of the film that was made before; see ``FilmPrediction``.

    ``field_per_volt`` (M,) 1/m has one number for each ``stride`` of the waveform's N samples,
    M = ceil(N/stride).
    """

    field_per_volt: np.ndarray
    electric_volume: float
    pull_in: str = ""
    film: str = ""
    stride: int = 1

    def fits(self, samples: int) -> bool:
        """Return whether there is one number for each ``stride`` of so many samples."""
        wanted = -(-samples // self.stride) if self.stride >= 1 else -1
        return np.shape(self.field_per_volt) == (wanted,)

    def follow(self, start: int, voltage: np.ndarray) -> np.ndarray:
        """Return the field per volt (n,) 1/m of the samples from ``start`` on."""
        stop = start + voltage.size
        return Repeated(np.asarray(self.field_per_volt), self.stride, stop).window(start, stop)


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

    Its ``samples`` in V at the film are even at ``rate`` Hz, and start and end at 0 V. A long
    waveform is not held in memory: ``window`` computes samples again and gives them only where they
    are, bit for bit, those that passed the gate. Its methods may be called from any thread.
    """

    __slots__ = ("_limits", "_margins", "_pieces", "_rate")

    _limits: Limits
    _margins: tuple[Margin, ...]
    _pieces: _Pieces
    _rate: float

    def __init__(
        self,
        pieces: _Pieces,
        rate: float,
        limits: Limits,
        margins: tuple[Margin, ...],
        key: object,
    ) -> None:
        if key is not _KEY:
            raise TypeError("only drivers.gate.admit can make a GatedWaveform")
        object.__setattr__(self, "_pieces", pieces)
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
    def samples(self) -> int:
        """Return the number of samples."""
        return self._pieces.samples

    def window(self, start: int = 0, stop: int | None = None) -> np.ndarray:
        """Return the samples ``start`` to ``stop`` (n,) V, read-only; by default all of them.

        ``start`` and ``stop`` are those of a slice. Raises ``ChangedWaveform`` where the samples,
        computed again, are not those that passed the gate.
        """
        start, stop, _ = slice(start, stop).indices(self.samples)
        if stop <= start:
            return np.empty(0)
        length = self._pieces.length
        parts = [
            memoryview(self._pieces.take(i))[
                _BYTES * max(0, start - i * length) : _BYTES * (stop - i * length)
            ]
            for i in range(start // length, -(-stop // length))
        ]
        # an array over bytes cannot be made writeable again, unlike one with its flag cleared
        return np.frombuffer(parts[0] if len(parts) == 1 else b"".join(parts))

    @property
    def rate(self) -> float:
        """Return the sample rate in Hz."""
        return self._rate

    @property
    def digest(self) -> str:
        """Return a hash of the samples and their rate; equal waveforms have equal ones."""
        return self._pieces.digest(self._rate)

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
        return (self.samples - 1) / self._rate


class _Pieces:
    """A waveform in pieces of ``length`` samples, read from ``source`` once and checked after that.

    The first reading hashes each piece. A piece that is read again is compared with its hash. The
    newest pieces are kept as bytes, which nobody can change; a waveform that is kept whole is never
    read again.
    """

    def __init__(self, source: Samples, length: int) -> None:
        self._source: Samples | None = source
        self.samples = int(source.samples)
        self.length = length
        self._count = -(-self.samples // length)
        self._digests: list[bytes] = []
        self._kept: OrderedDict[int, bytes] = OrderedDict()
        self._lock = threading.Lock()

    def first_reading(self) -> Generator[tuple[int, np.ndarray]]:
        """Yield the first sample of each piece, and its samples (n,) V, read-only.

        While one piece is checked, a thread reads the next.
        """
        if self._count == 1:
            yield 0, self._note(*self._read(0))
        else:
            with ThreadPoolExecutor(1, thread_name_prefix="gate") as ahead:
                coming = ahead.submit(self._read, 0)
                for i in range(self._count):
                    piece, digest = coming.result()
                    if i + 1 < self._count:
                        coming = ahead.submit(self._read, i + 1)
                    yield i * self.length, self._note(piece, digest)
        if self._count <= _KEPT:
            self._source = None

    def take(self, i: int) -> bytes:
        """Return piece ``i`` as it was read first. Raises ``ChangedWaveform`` where it is not."""
        with self._lock:
            piece = self._kept.get(i)
            if piece is not None:
                self._kept.move_to_end(i)
                return piece
            at = f"the waveform's samples from {i * self.length} on"
            try:
                piece, digest = self._read(i)
            except Exception as error:  # a segment of another distribution may raise anything
                raise ChangedWaveform(
                    f"{at} could not be computed again ({error}); none of them was output"
                ) from error
            if digest != self._digests[i]:
                raise ChangedWaveform(
                    f"{at} are not those that passed the gate: computed again, the sequence gave "
                    f"other values; none of them was output"
                )
            self._keep(i, piece)
            return piece

    def digest(self, rate: float) -> str:
        """Return a hash of all pieces at ``rate`` Hz, once they have been read."""
        about = f"{self.samples} samples at {rate!r} Hz".encode()
        return hashlib.sha256(about + b"".join(self._digests)).hexdigest()

    def _note(self, piece: bytes, digest: bytes) -> np.ndarray:
        self._keep(len(self._digests), piece)
        self._digests.append(digest)
        return np.frombuffer(piece)

    def _keep(self, i: int, piece: bytes) -> None:
        self._kept[i] = piece
        if len(self._kept) > _KEPT:
            self._kept.popitem(last=False)

    def _read(self, i: int) -> tuple[bytes, bytes]:
        """Return piece ``i``, computed by the source, with its hash."""
        start, stop = i * self.length, min((i + 1) * self.length, self.samples)
        if self._source is None:
            raise RigError(f"piece {i} of the waveform is not kept")
        values = np.asarray(self._source.window(start, stop), dtype=np.float64)
        if values.shape != (stop - start,):
            raise RefusedWaveform(
                (f"{stop - start} samples from {start} on were asked for, not {values.shape}",)
            )
        # bytes are a copy, before the check: the source may keep its array and change it
        piece = values.tobytes()
        return piece, hashlib.sha256(piece).digest()


def admit(
    waveform: Samples | np.ndarray,
    rate: float,
    limits: Limits,
    prediction: FilmPrediction,
    progress: Callable[[float], None] | None = None,
) -> GatedWaveform:
    """Return the admitted waveform, or raise ``RefusedWaveform`` with a sentence per broken limit.

    ``waveform`` is (N,) V at the film, as an array or computed window by window; ``rate`` is in Hz,
    ``prediction`` is the film's response. ``progress`` is called with the part that is checked, and
    may raise an exception to end the check.

    The slew rate is computed from sample to sample, as the converter steps. There are no further
    steps before and after the run, because the waveform must start and end at 0 V.
    """
    if isinstance(waveform, np.ndarray) and waveform.ndim != 1:
        raise RefusedWaveform((f"a waveform is one row of samples, not {waveform.shape}",))
    # a copy of an array: the checked samples are those that go out, even if the caller changes it
    source = Listed(np.array(waveform)) if isinstance(waveform, np.ndarray) else waveform
    pieces = _Pieces(source, _PIECE)
    _require_comparable(pieces.samples, rate, limits, prediction)
    volume = float(prediction.electric_volume)
    _require_above_zero("the film's permittivity times its volume", volume, "F m")

    reached = _Reached(rate, limits, volume)
    with (
        np.errstate(over="ignore", invalid="ignore"),  # an overflow exceeds every limit
        closing(pieces.first_reading()) as reading,
    ):
        for start, voltage in reading:
            _require_finite(voltage, start, rate)
            reached.take_voltage(start, voltage)
            field_per_volt = np.asarray(prediction.follow(start, voltage), dtype=np.float64)
            _require_film(field_per_volt, voltage.size, start, rate)
            reached.take_field(start, voltage, field_per_volt)
            if progress is not None:
                progress((start + voltage.size) / pieces.samples)
    margins, reasons = _judged(reached, rate, limits)
    if prediction.pull_in:
        reasons.append(f"the model predicts {prediction.pull_in}")
    if limits.film and prediction.film != limits.film:
        asked = f"film {prediction.film!r}" if prediction.film else "a film without a name"
        reasons.append(f"the limits are declared for film {limits.film!r}, not for {asked}")
    if reasons:
        raise RefusedWaveform(tuple(reasons))
    return GatedWaveform(pieces, rate, limits, margins, _KEY)


def _require_comparable(
    samples: int, rate: float, limits: Limits, prediction: FilmPrediction
) -> None:
    """Raise ``RefusedWaveform`` for values that cannot be compared with the limits."""
    for name, limit in vars(limits).items():
        if isinstance(limit, float) and math.isnan(limit):
            raise RefusedWaveform((f"the limit {name} is nan, which admits no waveform",))
    if not (math.isfinite(rate) and rate > 0.0):
        raise RefusedWaveform((f"the sample rate {rate!r} Hz is not a finite number above 0",))
    if samples < 2:
        raise RefusedWaveform((f"a waveform has at least 2 samples, not {samples}",))
    if not prediction.fits(samples):
        raise RefusedWaveform(
            (f"the prediction of the film is not that of a waveform of {samples} samples",)
        )


def _require_finite(values: np.ndarray, start: int, rate: float) -> None:
    """Raise ``RefusedWaveform`` where one of ``values`` (n,) from ``start`` on is not finite."""
    if np.isfinite(values.sum()):  # fast; a sum may overflow, so check each value then
        return
    at = int(np.argmin(np.isfinite(values)))
    if not np.isfinite(values[at]):
        at += start
        raise RefusedWaveform((f"sample {at} (at {at / rate:.4g} s) is not a finite number",))


def _require_film(field_per_volt: np.ndarray, samples: int, start: int, rate: float) -> None:
    """Raise ``RefusedWaveform`` where the predicted field per volt (n,) is not that of a film."""
    if field_per_volt.shape != (samples,):
        raise RefusedWaveform(
            (f"{samples} samples from {start} on have {field_per_volt.shape} predictions",)
        )
    _require_finite(field_per_volt, start, rate)
    _require_above_zero("one over the thickness", float(field_per_volt.min()), "1/m")


def _require_above_zero(quantity: str, value: float, unit: str) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise RefusedWaveform((f"{quantity} is predicted as {value:.4g} {unit}, not above 0",))


class _Reached:
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


def _judged(reached: _Reached, rate: float, limits: Limits) -> tuple[tuple[Margin, ...], list[str]]:
    """Return the margin to each limit, and a sentence for each limit that is broken."""
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
        f"the waveform {end} at {value * 1e-3:.6g} kV, not at 0"
        for end, value in (("starts", reached.first), ("ends", reached.last))
        if value != 0.0
    )
    return margins, reasons


def ramp_down(waveform: GatedWaveform, last: int, duration: float) -> np.ndarray:
    """Return (M,) V that ramp the output from sample ``last`` of ``waveform`` to 0 V linearly.

    ``duration`` in s is lengthened where the waveform's slew limit requires it. Only these samples
    reach an output without being part of the waveform; they lie between a sample that passed the
    gate and 0 V. The ramp is empty where sample ``last`` is 0 V already.
    """
    voltage = float(waveform.window(last, last + 1)[0])
    if voltage == 0.0:
        return np.empty(0)
    seconds = max(duration, abs(voltage) / waveform.limits.slew)
    steps = max(1, math.ceil(seconds * waveform.rate))
    return voltage * (1.0 - np.arange(1, steps + 1) / steps)
