"""Gate: every sample passes it before it reaches a rig's output.

Drivers take only a ``GatedWaveform``. ``admit`` makes one of samples that are known before a run.
``open_block_gate`` makes one that is corrected while it is played: its ``BlockGate`` admits block
after block. Ordinary code enforces the limits and raises errors. It never uses ``assert``, which an
optimising interpreter removes.
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
from dearig.drivers.judgement import (
    Limits,
    Margin,
    Reached,
    end_reasons,
    judged,
    require_above_zero,
    require_film,
    require_finite,
)
from dearig.drivers.samples import Computed, Listed, Repeated, Samples

__all__ = [
    "BlockGate",
    "FilmForecast",
    "FilmPrediction",
    "GatedWaveform",
    "Limits",
    "Margin",
    "admit",
    "open_block_gate",
    "ramp_down",
]

_KEY = object()
_BYTES = 8  # of one sample, a float64
#: Relative: a rate of 100 kHz may become the next one that a card divides from 20 MHz.
_RATE_TOLERANCE = 5e-3
_ROUNDING = 1e-9  # of a change: that of a difference of two corrections
# Samples that are computed, checked and hashed together: 0.5 MB, which stays in a processor's cache
_PIECE = 2**16
# Pieces that are kept: 64 MB. They hold every waveform of up to 8.4 million samples, and 8 s at
# 1 MHz, which is longer than the card's output buffer: the interlocks read what was written before.
_KEPT = 128


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
class FilmForecast:
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


@final
class GatedWaveform:
    """A voltage waveform that has passed the gate; it cannot be changed or copied.

    Its ``samples`` in V at the film are even at ``rate`` Hz, and start and end at 0 V. A long
    waveform is not held in memory: ``window`` computes samples again and gives them only where they
    are, bit for bit, those that passed the gate. Its methods may be called from any thread.

    A waveform of a ``BlockGate`` grows while it is played: its first ``admitted`` samples have
    passed, and a driver must not expect the others before they have.
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

    @property
    def admitted(self) -> int:
        """Return the number of samples that have passed so far: all, unless it grows."""
        return self._pieces.admitted

    @property
    def block(self) -> int:
        """Return the samples that are admitted together while it grows, 0 where it does not."""
        return self._pieces.length if self._pieces.grows else 0

    def window(self, start: int = 0, stop: int | None = None) -> np.ndarray:
        """Return the samples ``start`` to ``stop`` (n,) V, read-only; by default all of them.

        ``start`` and ``stop`` are those of a slice of the admitted samples. Raises
        ``ChangedWaveform`` where the samples, computed again, are not those that passed the gate.
        """
        start, stop, _ = slice(start, stop).indices(self.admitted)
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

    def check_rate(self, actual: float) -> None:
        """Raise ``RefusedWaveform`` where a rig plays at another rate in Hz than was judged.

        Slew, energy and time at voltage were judged at ``rate``.
        """
        if not abs(actual - self.rate) <= _RATE_TOLERANCE * self.rate:
            reason = (
                f"the rig's sample clock would run at {actual:g} Hz in place of {self.rate:g} Hz, "
                f"for which the limits were judged: set card.sample_rate_Hz to a rate that it has"
            )
            raise RefusedWaveform((reason,))

    @property
    def duration(self) -> float:
        """Return the time in s from the first to the last sample."""
        return (self.samples - 1) / self._rate


class _Pieces:
    """A waveform in pieces of ``length`` samples, read from ``source`` once and checked after that.

    The first reading hashes each piece. A piece that is read again is compared with its hash. The
    newest pieces are kept as bytes, which cannot change; a waveform that is kept whole is never
    read again. Pieces of a waveform that ``grows`` are taken in one by one, by ``grow``.
    """

    def __init__(self, source: Samples, length: int, *, grows: bool = False) -> None:
        self._source: Samples | None = source
        self.samples = int(source.samples)
        self.length = length
        self.grows = grows
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

    @property
    def admitted(self) -> int:
        """Return the number of samples in the pieces that were taken in."""
        return min(len(self._digests) * self.length, self.samples)

    def following(self) -> np.ndarray:
        """Return the samples (n,) V of the piece that is next to be taken in."""
        return np.frombuffer(self._read(len(self._digests))[0])

    def grow(self, checked: np.ndarray) -> None:
        """Take in the next piece, whose samples (n,) V were ``checked``."""
        piece = checked.tobytes()
        with self._lock:
            self._note(piece, hashlib.sha256(piece).digest())

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
    require_above_zero("the film's permittivity times its volume", volume, "F m")

    reached = Reached(rate, limits, volume)
    with (
        np.errstate(over="ignore", invalid="ignore"),  # an overflow exceeds every limit
        closing(pieces.first_reading()) as reading,
    ):
        for start, voltage in reading:
            _follow(reached, prediction, start, voltage, rate)
            if progress is not None:
                progress((start + voltage.size) / pieces.samples)
    margins, reasons = judged(reached, rate, limits)
    reasons += end_reasons(reached)
    reasons += _film_reasons(prediction, limits)
    if reasons:
        raise RefusedWaveform(tuple(reasons))
    return GatedWaveform(pieces, rate, limits, margins, _KEY)


def _follow(
    reached: Reached, prediction: FilmPrediction, start: int, voltage: np.ndarray, rate: float
) -> None:
    """Include in ``reached`` the samples (n,) V from ``start`` on, and the film under them."""
    require_finite(voltage, start, rate)
    reached.take_voltage(start, voltage)
    field_per_volt = np.asarray(prediction.follow(start, voltage), dtype=np.float64)
    require_film(field_per_volt, voltage.size, start, rate)
    reached.take_field(start, voltage, field_per_volt)


def _film_reasons(prediction: FilmPrediction, limits: Limits) -> list[str]:
    """Return a sentence for a predicted pull-in, and for limits of another film."""
    reasons = []
    if prediction.pull_in:
        reasons.append(f"the model predicts {prediction.pull_in}")
    if limits.film and prediction.film != limits.film:
        asked = f"film {prediction.film!r}" if prediction.film else "a film without a name"
        reasons.append(f"the limits are declared for film {limits.film!r}, not for {asked}")
    return reasons


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


@final
class BlockGate:
    """Gate of a waveform that is corrected while it is played; ``open_block_gate`` makes it.

    A correction is a part of the feedforward's voltage: sample k of ``waveform`` is
    ``feedforward[k] * (1 + c[k])`` and is computed here, from passed samples. A controller
    gives one number for each block, the correction at its last sample. From the end of the
    block before it changes linearly. Nothing else that it gives can reach an output.

    Every block is checked before it can be played: the correction against the ``authority`` and the
    ``rate_limit`` in 1/s, and its samples, with all before them, against every limit of the gate.
    After a refusal no further block is admitted.
    """

    def __init__(
        self,
        feedforward: GatedWaveform,
        edge: GatedWaveform,
        prediction: FilmPrediction,
        block: int,
        authority: float,
        rate_limit: float,
        key: object,
    ) -> None:
        if key is not _KEY:
            raise TypeError("only drivers.gate.open_block_gate can make a BlockGate")
        self._feedforward = feedforward
        self._prediction = prediction
        self._authority, self._rate_limit = authority, rate_limit
        self._ends = [0.0]  # correction at the last sample of each block, one more than blocks
        self._closed = False
        rate, limits = feedforward.rate, feedforward.limits
        self._reached = Reached(rate, limits, float(prediction.electric_volume))
        self._margins = edge.margins
        source = Computed(feedforward.samples, self._corrected)
        self._pieces = _Pieces(source, block, grows=True)
        self._waveform = GatedWaveform(self._pieces, rate, limits, edge.margins, _KEY)

    @property
    def waveform(self) -> GatedWaveform:
        """Return the waveform that grows; its margins are those of the most that is allowed."""
        return self._waveform

    @property
    def complete(self) -> bool:
        """Return True once the last block is admitted."""
        return self._pieces.admitted == self._pieces.samples

    @property
    def correction(self) -> float:
        """Return the correction at the last admitted sample."""
        return self._ends[-1]

    @property
    def margins(self) -> tuple[Margin, ...]:
        """Return the margins of the admitted samples to each limit."""
        return self._margins

    def admit(self, correction: float) -> None:
        """Admit the next block, at whose last sample the correction is ``correction``.

        Raises ``RefusedWaveform`` with a sentence for each broken limit. ``waveform`` then stays as
        it is, and every later block is refused.
        """
        if self._closed:
            raise RefusedWaveform(("a block was refused before: no further one is admitted",))
        if self.complete:
            raise RefusedWaveform(("every block of the waveform is admitted already",))
        self._closed = True  # until it has passed
        start = self._pieces.admitted
        samples = min(self._pieces.length, self._pieces.samples - start)
        self._check_correction(correction, start, samples)
        self._ends.append(float(correction))
        try:
            self._check_and_grow(start, start + samples == self._pieces.samples)
        except BaseException:
            self._ends.pop()
            raise
        self._closed = False

    def _check_and_grow(self, start: int, last: bool) -> None:
        """Check the samples of the next block, and let the waveform grow by them."""
        rate, limits = self._waveform.rate, self._waveform.limits
        with np.errstate(over="ignore", invalid="ignore"):
            voltage = self._pieces.following()
            _follow(self._reached, self._prediction, start, voltage, rate)
        margins, reasons = judged(self._reached, rate, limits)
        reasons += end_reasons(self._reached) if last else []
        reasons += _film_reasons(self._prediction, limits)
        if reasons:
            raise RefusedWaveform(tuple(reasons))
        self._pieces.grow(voltage)
        self._margins = margins

    def _check_correction(self, correction: float, start: int, samples: int) -> None:
        """Raise ``RefusedWaveform`` for a correction beyond its own limits."""
        at = f"the correction from sample {start} on (at {start / self._waveform.rate:.4g} s)"
        if not (isinstance(correction, int | float) and math.isfinite(correction)):
            raise RefusedWaveform((f"{at} is {correction!r}, which is not a finite number",))
        if not abs(correction) <= self._authority:
            raise RefusedWaveform(
                (f"{at} is {correction:.6g}, {self._authority:.6g} is allowed either way",)
            )
        change = abs(correction - self._ends[-1])
        seconds = samples / self._waveform.rate
        if not change <= self._rate_limit * seconds * (1.0 + _ROUNDING):
            raise RefusedWaveform(
                (
                    f"{at} changes by {change / seconds:.6g} 1/s, {self._rate_limit:.6g} 1/s is "
                    f"allowed",
                )
            )

    def _corrected(self, start: int, stop: int) -> np.ndarray:
        """Return the corrected samples ``start`` to ``stop``, which are one block."""
        i = start // self._pieces.length
        before, end = self._ends[i : i + 2]
        part = np.arange(1, stop - start + 1) / (stop - start)
        return self._feedforward.window(start, stop) * (1.0 + before + (end - before) * part)


def open_block_gate(
    feedforward: GatedWaveform,
    *,
    block: int,
    authority: float,
    rate_limit: float,
    edge: FilmPrediction,
    prediction: FilmPrediction,
    progress: Callable[[float], None] | None = None,
) -> BlockGate:
    """Return the gate for corrections of ``feedforward`` in blocks of ``block`` samples.

    A correction is a part of the voltage, up to ``authority`` either way, and changes by at most
    ``rate_limit`` in 1/s. The feedforward with the whole authority must pass the gate too, with the
    prediction ``edge``; ``prediction`` is for the samples that are played. Raises
    ``RefusedWaveform`` where it does not pass, and for values that are not limits.
    """
    if not block >= 1:
        raise RefusedWaveform((f"a block has 1 sample or more, not {block}",))
    if not 0.0 <= authority < 1.0:
        raise RefusedWaveform((f"the authority {authority!r} is not from 0 to below 1",))
    if not (math.isfinite(rate_limit) and rate_limit > 0.0):
        raise RefusedWaveform((f"the rate limit {rate_limit!r} 1/s is not finite and above 0",))
    if not prediction.fits(feedforward.samples):
        raise RefusedWaveform(
            (f"the prediction is not that of a waveform of {feedforward.samples} samples",)
        )
    if feedforward.admitted < feedforward.samples:
        raise RefusedWaveform(("a waveform that still grows cannot be corrected",))
    most = Computed(
        feedforward.samples,
        lambda start, stop: feedforward.window(start, stop) * (1.0 + authority),
    )
    highest = admit(most, feedforward.rate, feedforward.limits, edge, progress)
    return BlockGate(feedforward, highest, prediction, block, authority, rate_limit, _KEY)


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
