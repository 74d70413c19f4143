"""Electrical channels in a fit: what a model predicts for the voltage monitor and the current.

The measured stretch is imposed on the circuit, so that no mechanics is solved. What an effect
changes is computed on means at 200 Hz, and added to what the plain film's circuit reads at every
sample: without an effect the prediction is that of the plain circuit, exactly. Each channel has
unknowns of its own that enter linearly and are eliminated in every prediction:

    y = g p + o + C_s s + G d                                                              (11)

p is the predicted reading, g its gain, 1 within the uncertainty of the channel's scale, and o its
offset. Of the current, s = (Z/z)^2 dU/dt is what a jump of the output leaves at the instant of a
reading, and what a cable draws; G is the conductance in series with a film that leaks, and d the
voltage that drops there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from threading import Lock

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.model.circuit import loop
from dearig.model.coefficients import CAPACITANCE, HELD, LENGTH
from dearig.model.effects import EFFECTS, PLACES
from dearig.model.effects.assembly import AMPLIFIER, HOOK_BITS, active
from dearig.model.errors import ModelError
from dearig.model.fitting.intervals import correlation_time
from dearig.model.fitting.parameters import FitLayout
from dearig.model.fitting.slow_noise import Drift, WhitenedProblem
from dearig.model.fitting.thinning import RATE
from dearig.model.kernel import OK
from dearig.model.kinematics import thinning
from dearig.model.readings.channels import (
    CURRENT,
    VOLTAGE_MONITOR,
    ChannelRecord,
    ElectricRecord,
)
from dearig.model.readings.noise import REST_MIN
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator, Drive, at_rest

__all__ = [
    "ChannelCurve",
    "ChannelMisfit",
    "ChannelResult",
    "Channels",
    "JointProblem",
    "drops",
    "is_electric",
    "results_of",
]

_SMOOTHING = 0.010  # s, of the imposed stretch: as in the regression
_FINEST = 2e-4  # s: faster held outputs are taken as lines, late by half a sample, 0.1 ms
_KNOWN = 1.0 / 6.0  # of the gain: 3 standard errors below half
_SCALE = 0.2  # of the gain of a voltage monitor: no amplifier loses as much
_SHOWS = 25.0  # of chi-square, above that of as many numbers: five standard deviations
_FUNCTIONS = 7  # of the voltage, that stand for any effect: five powers and two differences
_KEPT = 256  # predictions that are kept
_ALIKE = 1e-12  # relative square: a column that differs less from another is parallel to it

_HOOKS = ("supply", "polarise", "permittivity", "charge", "conduct", "drop")


def is_electric(name: str) -> bool:
    """Whether an effect takes part in the circuit."""
    return any(getattr(PLACES[name].module, hook, None) is not None for hook in _HOOKS)


#: Indices in the coefficient vector of the parameters of effects that take part in the circuit.
_COLUMNS = np.array(
    [
        PLACES[n].at + i
        for n, e in EFFECTS.items()
        if is_electric(n)
        for i in range(len(e.parameters))
    ]
)


@dataclass(frozen=True)
class ChannelMisfit:
    """What a model leaves of a channel, pooled over the records.

    ``cost`` is the mean square of the residual over the noise, ``samples`` the number of
    independent means, ``rms`` the residual of one mean and ``noise`` its noise, in the channel's
    unit.
    """

    cost: float
    samples: float
    rms: float
    noise: float


@dataclass(frozen=True)
class ChannelResult:
    """One recorded channel in a result: ``before`` and ``after`` are RMS residuals in ``unit``.

    ``noise`` is of what the residuals are of: means at 200 Hz of an electrical channel. Both are
    None where the channel is not ``used``; ``reason`` then says why.
    """

    name: str
    unit: str
    used: bool
    noise: float | None = None
    before: float | None = None
    after: float | None = None
    reason: str = ""


@dataclass(frozen=True)
class ChannelCurve:
    """Means of one channel of one record at ``time`` (M,) s, and their prediction, in ``unit``.

    ``predicted`` (M,) has the channel's own gain and offset, of the current also the cable; it
    leaves ``residual`` (M,) of ``measured`` (M,). ``noise`` is that of one mean.
    """

    name: str
    unit: str
    time: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    noise: float

    @property
    def residual(self) -> np.ndarray:
        """Measured less predicted, (M,)."""
        return self.measured - self.predicted

    @property
    def rms(self) -> float:
        """RMS of the residual."""
        return float(np.sqrt(np.mean(self.residual**2)))


class _Circuit:
    """The circuit of one record: what an effect adds to the plain film's readings, in means."""

    def __init__(self, record: ElectricRecord, c: np.ndarray) -> None:
        self.record = record
        drive = record.drive
        self.c = c.copy()
        status, rest = at_rest(self.c, drive)
        if status != OK:
            raise ModelError("the model has no rest state under its load")
        self.step = float(np.median(np.diff(drive.time)))
        self.every = max(1, int(1.0 / (RATE * self.step) + 1e-6))
        self._held = drive.hold and not record.means and self.step > _FINEST
        stretch = rest + record.displacement / c[LENGTH]
        stretch[: max(record.lead_in, 1)] = rest
        width = max(_SMOOTHING / self.step, 0.5)
        self._stretch = np.asarray(scipy.ndimage.gaussian_filter1d(stretch, width, mode="nearest"))
        late = 0.5 * self.step if drive.hold and not record.means else 0.0
        self.time = self.means(drive.time)
        self._thin = Drive(
            self.time + late, self.means(drive.voltage), hold=False,
            temperature=drive.temperature, humidity=drive.humidity,
            warmth=None if drive.warmth is None else self.means(drive.warmth),
            moisture=None if drive.moisture is None else self.means(drive.moisture),
        )  # fmt: skip
        self._thin_stretch = self.means(self._stretch)
        self._plain_full = self._full(self.c)
        self.plain = self.means(self._plain_full)
        self._finer = self.plain - self._thinned(self.c)  # what samples show and means do not
        area = thinning(int(c[HELD]), self._thin_stretch) ** 2
        self.area_slope = area * self.plain[loop.SLOPE]

    @property
    def least_conductance(self) -> float:
        """Least conductance in series with a film that leaks, in S.

        The charging that laws of leakage neglect takes less than a mean: else it were a lag.
        """
        return float(self.c[CAPACITANCE] / (self.step * self.every))

    def means(self, rows: np.ndarray) -> np.ndarray:
        """Return means (..., M) of neighbouring ``rows`` (..., N)."""
        whole = rows.shape[-1] // self.every
        shape = (*rows.shape[:-1], whole, self.every)
        return np.asarray(rows[..., : whole * self.every].reshape(shape).mean(axis=-1))

    def _full(self, c: np.ndarray) -> np.ndarray:
        d, way = self.record.drive, loop.ABOUT if self.record.means else loop.AT
        into = max((x.skew for x in self.record.channels), default=0.0)
        return loop.follow(c, d.time, d.voltage, d.ends, d.air, self._stretch, way, into)

    def _thinned(self, c: np.ndarray) -> np.ndarray:
        d = self._thin
        return loop.follow(c, d.time, d.voltage, d.ends, d.air, self._thin_stretch, loop.ABOUT)

    def rows(self, c: np.ndarray) -> np.ndarray:
        """Return the rows (5, M) of ``loop.follow`` in means, with the effects in ``c``."""
        mine = self.c.copy()
        mine[_COLUMNS] = c[_COLUMNS]
        acting = int(active(mine))
        if not acting & loop.ELECTRIC_BITS:
            return self.plain
        rows = self._thinned(mine) + self._finer
        if acting & AMPLIFIER and self._held:
            # a lag of the order of a sample: what a reading sees of each step of the output counts
            # (what the current sees of it is free: C_s)
            rows[loop.OUTPUT] = self.means(self._full(mine)[loop.OUTPUT])
        return rows


class _Channel:
    """One channel of one record in means: readings ``y`` (M,), ``noise`` of one of them."""

    def __init__(self, circuit: _Circuit, channel: ChannelRecord) -> None:
        self.circuit, self.name, self.unit = circuit, channel.name, channel.unit
        self.y = circuit.means(channel.values)
        rest = self.y[: channel.lead_in // circuit.every]
        self.noise = channel.noise / math.sqrt(circuit.every)
        if rest.size >= REST_MIN:
            # hum and slow noise are not averaged away
            self.noise = max(self.noise, float(np.std(rest)))
        self._gain_error = channel.gain_error
        self._row = loop.OUTPUT if channel.name == VOLTAGE_MONITOR else loop.INTO
        self._least = circuit.least_conductance
        free = [np.ones_like(self.y)]
        if channel.name == CURRENT:
            free.append(circuit.area_slope)
        self._free = np.linalg.qr(np.transpose(free) / [np.linalg.norm(x) or 1.0 for x in free])[0]
        self._left = self._away(self.y / self.noise)
        self.reason = self._assess()
        self.correlation, self.least = 1.0, math.inf
        if not self.reason:
            self.see(self._flexible(shapes=True)[2])

    def see(self, residual: np.ndarray) -> bool:
        """Take account of a ``residual`` (N,) in noises, if it is the least so far.

        What no model explains is noise: its size and its correlation lower the channel's weight.
        """
        cost = float(np.mean(residual**2))
        if not cost < self.least:
            return False
        self.least, self.correlation = cost, max(1.0, correlation_time(residual))
        return True

    @property
    def samples(self) -> float:
        """Number of independent means."""
        return self.y.size / self.correlation

    def residuals(self, rows: np.ndarray) -> np.ndarray:
        """Return measured less predicted (M + 1,) in noises, the last that of the gain."""
        predicted = self._away(rows[self._row] / self.noise)
        left, drop = self._left - predicted, rows[loop.DROP]
        if self.name != CURRENT or not drop.any():
            return self._solved(predicted, left)[1]
        dropped = self._away(drop / self.noise)
        conductance, residual = self._solved(predicted, left, dropped)
        if conductance < self._least:
            return self._solved(predicted, left - self._least * dropped)[1]
        return residual

    def _away(self, values: np.ndarray) -> np.ndarray:
        """Return ``values`` (M,) without what the offset, and of the current the cable, explain."""
        return np.asarray(values - self._free @ (self._free.T @ values))

    def _solved(
        self, predicted: np.ndarray, left: np.ndarray, dropped: np.ndarray | None = None
    ) -> tuple[float, np.ndarray]:
        """Return the conductance of ``dropped``, and the residual (M + 1,) of ``left`` (M,).

        The other unknown is the gain's deviation from 1, with its prior: the factor of
        ``predicted``. All (M,) are in noises, and orthogonal to what is free.
        """
        inside = float(predicted @ predicted) + self._gain_error**-2
        gain, conductance = float(predicted @ left) / inside, 0.0
        if dropped is not None:
            # the gain is eliminated from the normal equations
            shared, size = float(predicted @ dropped) / inside, float(dropped @ dropped)
            own = size - shared**2 * inside
            if own > _ALIKE * size:
                conductance = (float(dropped @ left) - shared * gain * inside) / own
            gain -= shared * conductance
        residual = np.empty(left.size + 1)
        np.multiply(predicted, -gain, out=residual[:-1])
        residual[:-1] += left
        if dropped is not None:
            residual[:-1] -= conductance * dropped
        residual[-1] = -gain / self._gain_error
        return conductance, residual

    # -- whether it can be used

    def _flexible(self, shapes: bool) -> tuple[float, float, np.ndarray, float]:
        """Return gain and its error of a regression that knows no effect; its residual; its gain.

        Powers of the output stand for what leaks or saturates, with ``shapes`` its differences for
        what is late. The last value is what all but a constant takes off chi-square.
        """
        circuit = self.circuit
        plain, output = circuit.plain[self._row], circuit.plain[loop.OUTPUT]
        largest = float(np.abs(output).max()) or 1.0
        u = output / largest
        columns = [np.ones_like(plain), plain]
        if self.name == CURRENT:
            columns.append(circuit.area_slope)
        if shapes:
            columns += [np.gradient(u), np.gradient(np.gradient(u))]
        powers = [u, u * np.abs(u), u**3, u**3 * np.abs(u), u**5]
        columns += powers[1:] if self.name == VOLTAGE_MONITOR else powers
        matrix = np.transpose(columns) / self.noise
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        q, r = np.linalg.qr(matrix / scale)
        target = self.y / self.noise
        inside = q.T @ target
        inverse = np.linalg.pinv(r)
        gain = float((inverse @ inside)[1] / scale[1])
        error = float(np.linalg.norm(inverse[1]) / scale[1])
        return gain, error, target - q @ inside, float(np.sum(inside[1:] ** 2))

    def _assess(self) -> str:
        """Return why the channel cannot be used, "" where it can."""
        if not np.ptp(self.circuit.plain[loop.OUTPUT]) > 0.0:
            return "the voltage never changes, so that nothing shows whether the channel is wired"
        if self.name == VOLTAGE_MONITOR:
            u = self.circuit.plain[loop.OUTPUT]
            away = u - u.mean()
            gain = float(away @ self.y / (away @ away))
            error = self.noise / math.sqrt(float(away @ away))
            if abs(gain) < max(5.0 * error, 1e-3):
                return "does not follow the command: not wired, or of another signal"
            if abs(gain - 1.0) > _SCALE:
                return f"reads {gain:.3g} times the command: its scale is wrong"
            return ""
        gain, error, left, shown = self._flexible(shapes=False)
        above = max(1.0, float(np.mean(left**2)))
        error *= math.sqrt(above)
        if shown < (_SHOWS + 2 * _FUNCTIONS) * above:
            if error > _KNOWN:
                return "too noisy to show the film's current: a wire that is off reads the same"
            return "does not show how the film charges as it moves: not wired, or of another signal"
        if error < _KNOWN and (gain + 3.0 * error < 0.5 or gain - 3.0 * error > 2.0):
            return f"reads {gain:.3g} times the film's current: its scale is wrong"
        return ""


class Channels:
    """The electrical channels of ``records`` about a ``model`` of the film.

    ``used`` are the names of those that count; ``reasons`` say, by name, why another does not.
    """

    def __init__(self, records: Iterable[ElectricRecord | None], model: Actuator) -> None:
        plain = replace(model, effects=())
        c = plain.coefficients()
        self._channels: list[_Channel] = []
        self.reasons: dict[str, str] = {}
        self.units: dict[str, str] = {}
        for electric in records:
            if electric is not None:
                self._add(electric, c)
        names = {x.name for x in self._channels}
        self.used = tuple(n for n in (VOLTAGE_MONITOR, CURRENT) if n in names)
        self.reasons = {n: r for n, r in self.reasons.items() if n not in names}
        self._circuits = list({id(x.circuit): x.circuit for x in self._channels}.values())
        self._known: dict[bytes, list[np.ndarray]] = {}
        self._lock = Lock()

    def _add(self, electric: ElectricRecord, c: np.ndarray) -> None:
        for channel in electric.channels:
            self.units[channel.name] = channel.unit
            if not channel.used:
                self.reasons.setdefault(channel.name, channel.reason)
        if not electric.used:
            return
        circuit = _Circuit(electric, c)
        for channel in electric.used:
            found = _Channel(circuit, channel)
            if found.reason:
                self.reasons.setdefault(channel.name, found.reason)
            else:
                self._channels.append(found)

    def __bool__(self) -> bool:
        return bool(self._channels)

    def concern(self, names: Iterable[str]) -> bool:
        """Whether one of the effects ``names`` takes part in the circuit."""
        return bool(self._channels) and any(map(is_electric, names))

    def _residuals(self, c: np.ndarray) -> list[np.ndarray]:
        """Return each channel's residuals under the effects in ``c``; computed once for each."""
        key = c[_COLUMNS].tobytes()
        with self._lock:
            if key in self._known:
                return self._known[key]
        rows = {id(circuit): circuit.rows(c) for circuit in self._circuits}
        found = [x.residuals(rows[id(x.circuit)]) for x in self._channels]
        with self._lock:
            while len(self._known) >= _KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[key] = found
        return found

    def rows(self, c: np.ndarray) -> np.ndarray:
        """Return predicted less measured (M,) over the noise: rows of a least-squares problem.

        Correlated noise, and what no smooth function of the voltage explains, lower their weight.
        """
        return np.concatenate(
            [
                -r / math.sqrt(x.correlation * max(1.0, x.least))
                for x, r in zip(self._channels, self._residuals(c), strict=True)
            ]
        )

    def see(self, model: Actuator) -> bool:
        """Take account of what ``model`` leaves; True where it is less than anything before."""
        found = self._residuals(model.coefficients())
        less = [x.see(r[:-1]) for x, r in zip(self._channels, found, strict=True)]
        return any(less)

    def misfits(self, model: Actuator) -> dict[str, ChannelMisfit]:
        """Return what ``model`` leaves of each channel that is used."""
        residuals = self._residuals(model.coefficients())
        found = {}
        for name in self.used:
            some = [
                (x, r) for x, r in zip(self._channels, residuals, strict=True) if x.name == name
            ]
            count = sum(x.y.size for x, _ in some)
            found[name] = ChannelMisfit(
                cost=sum(float(r @ r) for _, r in some) / count,
                samples=sum(x.samples for x, _ in some),
                rms=math.sqrt(sum(float(r @ r) * x.noise**2 for x, r in some) / count),
                noise=math.sqrt(sum(x.noise**2 * x.y.size for x, _ in some) / count),
            )
        return found

    def curves(self, model: Actuator) -> tuple[ChannelCurve, ...]:
        """Return each channel of each record with what ``model`` predicts of it."""
        residuals = self._residuals(model.coefficients())
        return tuple(
            ChannelCurve(x.name, x.unit, x.circuit.time, x.y, x.y - r[:-1] * x.noise, x.noise)
            for x, r in zip(self._channels, residuals, strict=True)
        )

    def explicable(self, name: str) -> tuple[float, int]:
        """Return the cost that smooth functions of the voltage leave, and their number.

        They stand for whatever may leak, saturate or be late.
        """
        some = [x for x in self._channels if x.name == name]
        count = sum(x.y.size for x in some)
        return sum(x.least * x.y.size for x in some) / count, _FUNCTIONS * len(some)

    def implied(self, model: Actuator, name: str) -> float:
        """Return the RMS by which the effects of ``model`` change channel ``name``, in its unit.

        A voltage that drops in front of the film takes the least current that can do it.
        """
        c = model.coefficients()
        squares, count = 0.0, 0
        for circuit in self._circuits:
            rows = circuit.rows(c)
            row = loop.OUTPUT if name == VOLTAGE_MONITOR else loop.INTO
            change = rows[row] - circuit.plain[row]
            if name == CURRENT:
                change = change + circuit.least_conductance * rows[loop.DROP]
            squares, count = squares + float(change @ change), count + change.size
        return math.sqrt(squares / max(count, 1))


def drops(model: Actuator) -> bool:
    """Whether an effect of ``model`` conducts through a resistance of unknown size."""
    return bool(int(active(model.coefficients())) & HOOK_BITS["drop"])


def results_of(channels: Channels, before: Actuator, after: Actuator) -> tuple[ChannelResult, ...]:
    """Return the residual of each channel with two models; of those not used, the reason."""
    first, last = channels.misfits(before), channels.misfits(after)
    found = []
    for name, unit in channels.units.items():
        if name in first:
            noise, rms, now = first[name].noise, first[name].rms, last[name].rms
            found.append(ChannelResult(name, unit, True, noise, rms, now))
        else:
            found.append(ChannelResult(name, unit, False, reason=channels.reasons.get(name, "")))
    return tuple(found)


class JointProblem(WhitenedProblem):
    """Least squares of displacement and electrical channels; the channels' rows come last.

    Everything that is said of readings is of the displacement alone, as in ``WhitenedProblem``.
    """

    def __init__(
        self,
        records: Sequence[Record],
        layout: FitLayout,
        drift: Drift | None,
        channels: Channels,
        **options: object,
    ) -> None:
        super().__init__(records, layout, drift, **options)
        self._channels: Channels | None = channels
        self._more = channels.rows(self._c(layout.initial()[None])[0]).size

    def _c(self, values: np.ndarray) -> np.ndarray:
        return self.layout.coefficients(values)

    def _rows(self, values: np.ndarray) -> np.ndarray:
        """Return the channels' rows (P, M) of a population ``values`` (P, d), natural."""
        if self._channels is None:
            return np.zeros((len(values), 0))
        return np.array([self._channels.rows(c) for c in self._c(values)])

    @property
    def samples(self) -> int:
        """Number of readings that are fitted, those of the channels included."""
        return super().samples + self._more

    def of_channels(self, residuals: np.ndarray) -> np.ndarray:
        """Return the part (M,) of ``residuals`` that belongs to the channels."""
        return residuals[residuals.size - self._more :]

    def white(self) -> WhitenedProblem:
        """Return the displacement alone, under white noise alone."""
        return self.alone(super().white())

    @staticmethod
    def alone(problem: WhitenedProblem) -> WhitenedProblem:
        """Return ``problem`` of the readings alone, without the rows of channels and priors."""
        return JointProblem.without_channels(problem.without_priors())

    @staticmethod
    def without_channels(problem: WhitenedProblem) -> WhitenedProblem:
        """Return ``problem`` without the rows of channels."""
        other = copy(problem)
        if isinstance(other, JointProblem):
            other._channels, other._more = None, 0
        return other

    def scaled(self, values: np.ndarray) -> np.ndarray:
        """Return predictions (P, N + M) over the noise, those of channels but for a constant."""
        return np.hstack([super().scaled(values), self._rows(values)])

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return (model - measured)/noise, (N + M,), at coordinates ``x`` (d,)."""
        rows = self._rows(self.layout.values(x)[None])[0]
        return np.concatenate([super().residuals(x), rows])

    def evaluate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return costs (P,) and residuals (P, N + M) of coordinates (P, d)."""
        costs, residuals = super().evaluate(x)
        rows = self._rows(self.layout.values(x))
        return costs + np.sum(rows**2, axis=1) / self.samples, np.hstack([residuals, rows])

    def jacobian(
        self,
        x: np.ndarray,
        free: np.ndarray,
        residuals: np.ndarray | None = None,
        coarse: bool = False,
    ) -> np.ndarray:
        """Return d(residuals)/dx (N + M, f) over the ``free`` (d,) coordinates."""
        above = super().jacobian(x, free, residuals, coarse)
        up, down = self._sides(x, free, self.layout.differences(x))
        below = np.zeros((self._more, above.shape[1]))
        electric = np.array(
            [q.kind == "effect" and is_electric(q.effect) for q in self.layout.quantities]
        )[free]
        for j in np.flatnonzero(electric) if self._more else ():
            high, low = self._rows(self.layout.values(np.array([up[j], down[j]])))
            below[:, j] = (high - low) / float(np.sum(up[j] - down[j]))
        return np.vstack([above, below])

    def find_coarse_columns(
        self, x: np.ndarray, free: np.ndarray, known: np.ndarray | None = None
    ) -> np.ndarray:
        """Return which derivatives of the displacement coarse drives give, as of ``Problem``."""
        if self._channels is not None:
            return self.alone(self).find_coarse_columns(x, free, known)
        return super().find_coarse_columns(x, free, known)

    def space_mapped(
        self, x: np.ndarray, residuals: np.ndarray, free: np.ndarray
    ) -> WhitenedProblem | None:
        """Return the problem under coarse drives, corrected to ``residuals`` at ``x``."""
        found = super().space_mapped(x, residuals, free)
        return found if isinstance(found, WhitenedProblem) else None
