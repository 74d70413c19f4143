"""Interlocks: conditions that end a run, evaluated on every sample that the rig reads.

They take blocks and return trips; they read no clock and set no output. They keep state between
blocks, so that the result does not depend on the block length.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dearig.drivers.channels import COUNT_MAX, COUNT_MIN, Channel, Scaling
from dearig.drivers.rig import Block
from dearig.drivers.samples import Samples, as_samples
from dearig.drivers.settings import Action, RigSettings

__all__ = ["Interlocks", "Trip", "laser_reach", "would_trip"]

_JUMP_WITHIN = 2e-3  # s
# s; at longer sample intervals the film's ordinary motion between samples looks like a jump
_JUMP_INTERVAL = 4e-3

_NOMINAL = (0.0, 10.0 / 32768)  # V over counts of a converter of +-10 V
_RANGE_END = 0.999  # of the laser's range; an alarm holds the analog output beyond it
_PLANNED_BLOCK = 2**16  # samples of a planned run that are judged together
_PLAN_TOLERANCE = 2  # counts; a command that is nearer to the plan than this follows it


@dataclass(frozen=True)
class Trip:
    """Trip of ``interlock`` at ``sample`` of the run; ``message`` says why ``action`` is taken."""

    interlock: str
    sample: int
    action: Action
    message: str


class Interlocks:
    """Interlocks of one run on a rig with ``settings``, whose ``channels`` run at ``rate`` Hz.

    ``predicted`` (N,) m is the displacement from the loaded rest state that a model predicts under
    the voltage ``planned`` (N,) V, NaN where there is no prediction; both are read window by
    window. The interlock ``following`` compares the film with it while the command is the planned
    one; without ``predicted`` it is off. Without ``planned`` every command counts as the planned
    one. Each interlock trips at most once.

    A reading at the end of the laser's range is tolerated for ``laser_grace`` s; ``displacement``,
    ``jump`` and ``following`` judge the last reading before it meanwhile.

    Raises ``ValueError`` for a prediction and a plan of different lengths.
    """

    def __init__(
        self,
        settings: RigSettings,
        channels: tuple[Channel, ...],
        rate: float,
        predicted: Samples | np.ndarray | None,
        planned: Samples | np.ndarray | None = None,
        *,
        laser_grace: float = 0.0,
    ) -> None:
        self._bridges = laser_grace > 0.0
        self._predicted = None if predicted is None else as_samples(predicted)
        self._planned = None if planned is None else as_samples(planned)
        if (
            self._predicted is not None
            and self._planned is not None
            and self._predicted.samples != self._planned.samples
        ):
            raise ValueError(
                f"{self._predicted.samples} predicted displacements for {self._planned.samples} "
                f"planned voltages: give one for each"
            )
        scalings = {channel.name: channel.scaling for channel in channels}
        self._scalings = scalings
        self._rows = {channel.name: row for row, channel in enumerate(channels)}
        self._command = scalings["voltage_command"]
        self._monitor = scalings["voltage_monitor"]
        self._current = scalings["current_monitor"]
        self._laser = scalings["displacement"]
        self._settings = settings
        self._locks = locks = settings.interlocks
        self._rate = rate

        # thresholds in counts, so that samples within bounds need no scaling
        limit = locks.current_max_mA * 1e-3
        self._current_ends = _sorted(self._current.counts(np.array([-limit, limit])))
        reach = laser_reach(settings)
        self._laser_ends = _sorted(self._laser.counts(np.array([-reach, reach])))
        self._zero = int(self._command.counts(np.zeros(1))[0])
        self._swing = round(locks.laser_stuck_swing_kV * 1e3 / _step(self._command))
        self._lag = max(1, round(_JUMP_WITHIN * rate))
        slow = max(1.0, 1.0 / (rate * _JUMP_INTERVAL))
        self._jump = locks.displacement_jump_mm * 1e-3 * slow**2  # m
        self._jump_counts = max(1, math.ceil(self._jump / _step(self._laser)))

        # state between blocks
        self._tripped: set[str] = set()
        self._watched = 0  # samples
        self._last_command = self._zero
        self._last_readings = np.empty(0, dtype=np.int32)
        self._last_seen: int | None = None  # newest reading within the laser's range
        self._lead_in_sum = self._lead_in_samples = 0  # readings of the lead-in
        self._rest: float | None = None  # m, the laser's reading at the loaded rest state
        self._rest_from = 0  # sample
        self._allowed: tuple[int, int] | None = None  # counts, from the rest state
        self._left_plan = False  # True once the command has left the plan
        self._still = _StuckDetector()
        self._broken = {
            name: _Debounce(self._samples(seconds))
            for name, seconds in (
                ("monitor", locks.monitor_debounce_ms * 1e-3),
                ("breakdown", locks.breakdown_debounce_ms * 1e-3),
                ("current", locks.current_debounce_ms * 1e-3),
                ("laser", max(locks.laser_debounce_ms * 1e-3, laser_grace)),
                ("displacement", locks.displacement_debounce_ms * 1e-3),
                ("jump", 0.0),
                ("following", locks.following_debounce_ms * 1e-3),
                *((f"channel {c.name}", c.limit_debounce_ms * 1e-3) for c in settings.channel),
            )
        }

    def watch(self, block: Block) -> list[Trip]:
        """Return the interlocks that trip within ``block``, in the order of their samples.

        Raises ``ValueError`` for a block that does not continue the previous one.
        """
        if block.start != self._watched:
            raise ValueError(
                f"the block begins with sample {block.start}, but sample {self._watched} is next"
            )
        if not block.counts.shape[1]:
            return []
        command = block.counts[self._rows["voltage_command"]]
        monitor = block.counts[self._rows["voltage_monitor"]]
        current = block.counts[self._rows["current_monitor"]]
        reading = block.counts[self._rows["displacement"]]
        self._find_rest(command, reading)
        seen = self._bridged(reading) if self._bridges else reading
        trips = [
            *self._watch_voltage(command, monitor, current),
            *self._watch_current(current),
            *self._watch_laser(reading),
            *self._watch_stuck(command, reading),
            *self._watch_displacement(seen),
            *self._watch_jump(seen),
            *self._watch_following(command, seen),
            *self._watch_declared(block.counts),
        ]
        self._last_command = int(command[-1])
        self._watched += command.size
        return sorted(trips, key=lambda trip: (trip.sample, trip.action != "at once"))

    def late(self, waiting_s: float) -> Trip | None:
        """Return the trip for samples that have waited unread for ``waiting_s`` s, or None."""
        locks = self._locks
        if "late" in self._tripped or waiting_s < locks.late_s:
            return None
        return self._trip(
            "late",
            0,
            locks.late_action,
            f"samples had waited {waiting_s:.3g} s for the program, {locks.late_s:.3g} s is "
            f"allowed: the computer, or the link to the card, is too slow; close other programs",
        )

    def disk(self, free_bytes: int) -> Trip | None:
        """Return the trip for a disk with ``free_bytes`` left for the recording, or None."""
        locks = self._locks
        if "disk" in self._tripped or free_bytes >= locks.disk_free_min_MB * 1e6:
            return None
        return self._trip(
            "disk",
            0,
            locks.disk_action,
            f"the disk had {free_bytes * 1e-6:.4g} MB left, {locks.disk_free_min_MB:.4g} MB must "
            f"stay free: delete or move files before the next run",
        )

    def _find_rest(self, command: np.ndarray, reading: np.ndarray) -> None:
        """Set the rest state to the mean reading of the lead-in, while the command is 0."""
        if self._rest is not None:
            return
        driven = command != self._zero
        quiet = int(np.argmax(driven)) if driven.any() else command.size
        # integers, so that their sum does not depend on the block length
        self._lead_in_sum += int(reading[:quiet].sum(dtype=np.int64))
        self._lead_in_samples += quiet
        if quiet < command.size:
            # with a command from the first sample on, the film is still at rest at that sample
            samples = self._lead_in_samples
            mean = self._lead_in_sum / samples if samples else float(reading[0])
            self._rest = _physical(self._laser, mean)
            self._rest_from = self._watched + quiet

    def _bridged(self, reading: np.ndarray) -> np.ndarray:
        """Return ``reading`` (n,) with the last one before it where the laser sees no target."""
        low, high = self._laser_ends
        sees = (reading > low) & (reading < high)
        if self._last_seen is None:
            self._last_seen = int(reading[np.argmax(sees)])
        newest = np.maximum.accumulate(np.where(sees, np.arange(reading.size), -1))
        bridged = np.where(newest >= 0, reading[newest], self._last_seen)
        self._last_seen = int(bridged[-1])
        return bridged

    def _watch_voltage(
        self, command: np.ndarray, monitor: np.ndarray, current: np.ndarray
    ) -> Iterator[Trip]:
        locks = self._locks
        watched = self._live("monitor"), self._live("breakdown") and locks.breakdown_fraction > 0.0
        if not any(watched):
            return
        # at a sample, the amplifier may still be between the previous command and this one
        now = self._command.physical(command)
        before = np.append(_physical(self._command, self._last_command), now[:-1])
        low, high = np.minimum(now, before), np.maximum(now, before)
        shown = self._monitor.physical(monitor)
        if watched[0]:
            tolerance = locks.monitor_tolerance_kV * 1e3
            at = self._broken["monitor"].first(
                (shown < low - tolerance) | (shown > high + tolerance)
            )
            if at is not None:
                yield self._trip(
                    "monitor",
                    at,
                    locks.monitor_action,
                    f"the voltage monitor read {shown[at] * 1e-3:z.2f} kV with "
                    f"{now[at] * 1e-3:z.2f} kV commanded: {locks.monitor_tolerance_kV:.3g} kV "
                    f"between them is allowed; the amplifier does not follow, or its monitor is "
                    f"not wired and scaled as the rig file says",
                )
        if watched[1]:
            # the smaller of both commands, below 0 where they differ in sign
            asked = np.maximum(low, -high)
            towards = np.where(low > 0.0, shown, -shown)
            fraction = locks.breakdown_fraction
            at = self._broken["breakdown"].first(
                (asked > locks.breakdown_above_kV * 1e3) & (towards < fraction * asked)
            )
            if at is not None:
                flowing = _physical(self._current, current[at])
                cause = (
                    "the film broke down or something arcs; look for a hole or a burn"
                    if abs(flowing) > 0.5e-3 * locks.current_max_mA
                    else "the amplifier tripped or is off, or the wire of its monitor is off"
                )
                yield self._trip(
                    "breakdown",
                    at,
                    locks.breakdown_action,
                    f"the voltage monitor read {shown[at] * 1e-3:z.2f} kV with "
                    f"{now[at] * 1e-3:z.2f} kV commanded, less than {fraction:.0%} of it, while "
                    f"{flowing * 1e3:.2f} mA flowed: {cause}",
                )

    def _watch_current(self, counts: np.ndarray) -> Iterator[Trip]:
        if not self._live("current"):
            return
        low, high = self._current_ends
        # a reading at the end of the input's range may stand for any current
        at = self._broken["current"].first((counts <= low) | (counts >= high))
        if at is not None:
            locks = self._locks
            yield self._trip(
                "current",
                at,
                locks.current_action,
                f"the current monitor read {_physical(self._current, counts[at]) * 1e3:.2f} mA, "
                f"{locks.current_max_mA:.3g} mA is allowed: the film or a lead is shorted, or "
                f"something arcs; look for a hole or a burn",
            )

    def _watch_laser(self, reading: np.ndarray) -> Iterator[Trip]:
        if not self._live("laser"):
            return
        low, high = self._laser_ends
        at = self._broken["laser"].first((reading <= low) | (reading >= high))
        if at is not None:
            yield self._trip(
                "laser",
                at,
                self._locks.laser_action,
                f"the laser read {_physical(self._laser, reading[at]) * 1e3:.4g} mm, the end of "
                f"its range of +-{self._settings.laser.range_mm:.4g} mm: it has lost its target "
                f"(alarm), or the load has fallen or swings",
            )

    def _watch_stuck(self, command: np.ndarray, reading: np.ndarray) -> Iterator[Trip]:
        locks = self._locks
        if locks.laser_stuck_s == 0.0 or not self._live("laser-stuck"):
            return
        at = self._still.first(reading, command, self._samples(locks.laser_stuck_s), self._swing)
        if at is not None:
            yield self._trip(
                "laser-stuck",
                at,
                locks.laser_action,
                f"the laser had read {_physical(self._laser, reading[at]) * 1e3:.5g} mm without "
                f"any change for {locks.laser_stuck_s:.3g} s or longer, while the command moved "
                f"by {locks.laser_stuck_swing_kV:.3g} kV or more: its output is held, or its wire "
                f"is off",
            )

    def _watch_displacement(self, reading: np.ndarray) -> Iterator[Trip]:
        if self._rest is None or not self._live("displacement"):
            return
        locks = self._locks
        if self._allowed is None:
            bounds = np.array([locks.displacement_min_mm, locks.displacement_max_mm]) * 1e-3
            self._allowed = _sorted(self._laser.counts(self._rest + bounds))
        low, high = self._allowed
        broken = (reading < low) | (reading > high)
        broken[: max(0, self._rest_from - self._watched)] = False
        at = self._broken["displacement"].first(broken)
        if at is not None:
            moved = _physical(self._laser, reading[at]) - self._rest
            yield self._trip(
                "displacement",
                at,
                locks.displacement_action,
                f"the film stood {moved * 1e3:.4g} mm from its rest state, "
                f"{locks.displacement_min_mm:.4g} to {locks.displacement_max_mm:.4g} mm is "
                f"allowed: it tore or came off, it is being pulled in, or the load swings",
            )

    def _watch_jump(self, reading: np.ndarray) -> Iterator[Trip]:
        if not self._live("jump"):
            return
        lag = self._lag
        readings = np.concatenate((self._last_readings, reading), dtype=np.int32)
        if not self._watched:  # assume that the film was at rest before
            readings = np.concatenate((np.full(2 * lag, readings[0]), readings))
        self._last_readings = readings[-2 * lag :].copy()
        # distance to the straight line through earlier readings: fast motion is not a jump
        around = readings[2 * lag :] - 2 * readings[lag:-lag] + readings[: -2 * lag]
        at = self._broken["jump"].first(np.abs(around) >= self._jump_counts)
        if at is not None:
            jump = int(around[at]) * _step(self._laser)
            yield self._trip(
                "jump",
                at,
                self._locks.displacement_action,
                f"the laser's reading jumped by {abs(jump) * 1e3:.3g} mm within "
                f"{lag / self._rate * 1e3:.3g} ms, {self._jump * 1e3:.3g} mm is allowed: the film "
                f"or the load slipped, or the laser has lost its target",
            )

    def _watch_following(self, command: np.ndarray, reading: np.ndarray) -> Iterator[Trip]:
        locks = self._locks
        if (
            self._predicted is None
            or self._rest is None
            or self._left_plan
            or locks.following_fraction == 0.0
            or not self._live("following")
        ):
            return
        predicted = self._predicted.window(self._watched, self._watched + command.size)
        planned = predicted.size
        if self._planned is not None:
            volts = self._planned.window(self._watched, self._watched + planned)
            planned = volts.size  # of a waveform that grows, only what was admitted is planned
            plan = self._command.counts(volts)
            other = np.abs(np.subtract(command[:planned], plan, dtype=np.int32)) > _PLAN_TOLERANCE
            planned = int(np.argmax(other)) if other.any() else planned
        self._left_plan = planned < command.size
        predicted = predicted[:planned]
        moved = self._laser.physical(reading[:planned]) - self._rest
        far = np.abs(predicted)
        judged = far > locks.following_above_mm * 1e-3
        judged[: max(0, self._rest_from - self._watched)] = False
        behind = np.copysign(1.0, predicted) * moved < locks.following_fraction * far
        # skip samples near 0: a fast drive returns there often, and they decide nothing
        at = self._broken["following"].first(behind[judged])
        if at is not None:
            at = int(np.flatnonzero(judged)[at])
            yield self._trip(
                "following",
                at,
                locks.following_action,
                f"the film had moved {moved[at] * 1e3:.2f} mm where the model predicts "
                f"{predicted[at] * 1e3:.2f} mm, less than {locks.following_fraction:.0%} of it: an "
                f"electrode or its lead is open, the laser is stuck, or the film is not the one in "
                f"the rig file",
            )

    def _watch_declared(self, counts: np.ndarray) -> Iterator[Trip]:
        """Check the channels that the rig file declares with limits."""
        for channel in self._settings.channel:
            interlock = f"channel {channel.name}"
            if not channel.limited or not self._live(interlock):
                continue
            row = counts[self._rows[channel.name]]
            values = self._scalings[channel.name].physical(row)
            low = -math.inf if channel.limit_min is None else channel.limit_min
            high = math.inf if channel.limit_max is None else channel.limit_max
            # a reading at the end of the input's range may stand for any value
            clipped = (row == COUNT_MIN) | (row == COUNT_MAX)
            at = self._broken[interlock].first((values < low) | (values > high) | clipped)
            if at is not None:
                yield self._trip(
                    interlock,
                    at,
                    channel.limit_action,
                    f"{channel.shown} read {values[at]:.4g} {channel.unit}, "
                    f"{channel.limits_shown} is allowed",
                )

    def _live(self, name: str) -> bool:
        return name not in self._tripped

    def _samples(self, seconds: float) -> int:
        """Return the number of sample intervals that cover ``seconds``."""
        return max(1, math.ceil(seconds * self._rate * (1.0 - 1e-9)))

    def _trip(self, name: str, at: int, action: Action, words: str) -> Trip:
        """Trip ``name`` at place ``at`` in the present block."""
        self._tripped.add(name)
        sample = self._watched + at
        return Trip(name, sample, action, f"at {sample / self._rate:.4g} s {words}")


def laser_reach(settings: RigSettings) -> float:
    """Return the reading in m, either way, from which the laser counts as without its target."""
    return settings.laser.range_mm * 1e-3 * _RANGE_END


def would_trip(
    settings: RigSettings,
    rate: float,
    voltage: Samples | np.ndarray,
    displacement: Samples | np.ndarray,
    predicted: Samples | np.ndarray | None = None,
) -> tuple[str, ...]:
    """Return the names of the interlocks that would trip in a run that goes as planned.

    At ``rate`` Hz the amplifier follows ``voltage`` (N,) V, and the film moves by ``displacement``
    (N,) m. ``predicted`` is the prediction for ``Interlocks``. The interlock for a stuck laser is
    off, because these readings have no noise.
    """
    locks = settings.interlocks.model_copy(update={"laser_stuck_s": 0.0})
    # without limits: there is no prediction for the channels that the rig file declares
    free = tuple(
        c.model_copy(update={"limit_min": None, "limit_max": None}) for c in settings.channel
    )
    settings = settings.model_copy(update={"interlocks": locks, "channel": free})
    channels = settings.channels(dict.fromkeys(settings.channel_names, _NOMINAL))
    voltage, displacement = as_samples(voltage), as_samples(displacement)
    watch = Interlocks(settings, channels, rate, predicted, voltage)
    trips: list[Trip] = []
    for start in range(0, voltage.samples, _PLANNED_BLOCK):
        volts = voltage.window(start, start + _PLANNED_BLOCK)
        shown = {
            "voltage_command": volts,
            "voltage_monitor": volts,
            "displacement": displacement.window(start, start + _PLANNED_BLOCK),
        }
        still = np.zeros(volts.size)
        counts = np.array([c.scaling.counts(shown.get(c.name, still)) for c in channels])
        trips += watch.watch(Block(start, counts))
    return tuple(trip.interlock for trip in trips)


class _Debounce:
    """Detector of a condition that holds for ``needed`` samples in a row."""

    def __init__(self, needed: int) -> None:
        self._needed = needed
        self._held = 0  # samples in a row so far

    def first(self, broken: np.ndarray) -> int | None:
        """Return the first such place in ``broken`` (n,), which continues the last one, or None."""
        if not broken.size:
            return None
        if not broken.any():
            self._held = 0
            return None
        starts = np.flatnonzero(broken & np.diff(broken, prepend=False))
        ends = np.flatnonzero(broken & np.diff(broken, append=False)) + 1
        if broken[0]:
            starts[0] -= self._held
        self._held = int(ends[-1] - starts[-1]) if broken[-1] else 0
        long = np.flatnonzero(ends - starts >= self._needed)
        return int(starts[long[0]]) + self._needed - 1 if long.size else None


class _StuckDetector:
    """Detector of a reading that does not change while the command does."""

    def __init__(self) -> None:
        self._count: int | None = None  # of the newest reading
        self._samples = 0  # since this count last changed
        self._low, self._high = COUNT_MAX, COUNT_MIN  # of the command since then

    def first(
        self, reading: np.ndarray, command: np.ndarray, needed: int, swing: int
    ) -> int | None:
        """Return where a count is ``needed`` samples old and the command moved by ``swing``."""
        edges = np.concatenate(([0], np.flatnonzero(np.diff(reading)) + 1, [reading.size]))
        if reading[0] != self._count:
            self._forget()
        lengths = np.diff(edges)
        lengths[0] += self._samples
        for row in np.flatnonzero(lengths >= needed):
            part = command[edges[row] : edges[row + 1]].astype(np.int32)
            low, high = np.minimum.accumulate(part), np.maximum.accumulate(part)
            if row == 0:
                low, high = np.minimum(low, self._low), np.maximum(high, self._high)
            stood = np.arange(part.size) + (lengths[row] - part.size + 1)
            found = (stood >= needed) & (high - low >= swing)
            if found.any():
                return int(edges[row] + np.argmax(found))
        if edges.size > 2:
            self._forget()
        newest = command[edges[-2] :]
        self._count, self._samples = int(reading[-1]), int(lengths[-1])
        self._low = min(self._low, int(newest.min()))
        self._high = max(self._high, int(newest.max()))
        return None

    def _forget(self) -> None:
        self._samples = 0
        self._low, self._high = COUNT_MAX, COUNT_MIN


def _physical(scaling: Scaling, count: float | np.integer) -> float:
    return float(scaling.physical(np.array(count)))


def _step(scaling: Scaling) -> float:
    """Return the physical value of one count, to first order."""
    return abs(scaling.gain * scaling.coefficients[1])


def _sorted(pair: np.ndarray) -> tuple[int, int]:
    """Return the lower and the upper of two counts; a negative gain reverses their order."""
    return int(pair.min()), int(pair.max())
