"""Curves and readouts of a run in progress.

Three threads use this module without waiting for each other: the rig's thread hands over blocks, a
thread of this module converts them and advances the overlay models, and the interface thread reads
the curves.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from queue import SimpleQueue

import numpy as np

from dearig.acquisition.overlay import Overlay, OverlayModel
from dearig.acquisition.plan import Plan
from dearig.acquisition.run import RunObserver
from dearig.drivers.channels import CHANNEL_NAMES, Channel
from dearig.drivers.instruments.thermohygrometer import RoomReading
from dearig.drivers.rig import Block, Event, RigIdentity
from dearig.model.control import HoldAnswer
from dearig.model.errors import ModelError
from dearig.recording.content.rest_noise import lead_in
from dearig.window.run.traces import ErrorsSoFar, Newest, Pyramid, RunningErrors

__all__ = ["Live", "LiveEvent", "RunSnapshot"]

_SIGNALS = {
    "voltage_command": "command",
    "voltage_monitor": "monitor",
    "current_monitor": "current",
    "displacement": "displacement",
}
_READOUT = 0.01  # s, averaging time of a readout, so that it can be read
_RECENT = 1.0  # s, window of the recent RMS error
# Samples of a run that are kept, so that another model can be simulated from its start: 4.6 h at
# 1 kHz, and 130 MB of four channels
_KEPT_MAX = 2**24
_TOO_LONG = (
    "the run is too long to simulate another model from its start; choose the models before a run"
)
# Newest samples of a signal that spectra and loops are made of: 131 s at 1 kHz, 1 MB a signal
_NEWEST = 2**17
_NEWEST_OF = ("command", "displacement", "residual 0", "residual 1")
_OF_MODELS = ("model", "drawn", "residual", "rms")  # curves of each overlay model
_ANSWERS_MAX = 2**16  # of a feedback that are kept: all of 1.8 h at ten a second, then fewer
_GAP = 2**16  # samples, pushed together for a model that has no past


def _signal(channel: str) -> str:
    """Return the name of a channel's curve; empty for one that has none."""
    return _SIGNALS.get(channel, "" if channel in CHANNEL_NAMES else f"channel {channel}")


@dataclass(frozen=True)
class RunSnapshot:
    """State of a run: ``samples`` of ``total`` at ``rate`` Hz, and the means of its last 10 ms.

    ``revision`` changes whenever there is something new to draw. ``values`` are in SI units by
    signal (command, monitor, current, displacement). ``errors`` and ``words`` (why the model could
    not be simulated) have one item for each overlay model.
    """

    samples: int
    total: int
    rate: float
    values: dict[str, float]
    errors: tuple[ErrorsSoFar, ...]
    words: tuple[str, ...]
    revision: int = 0


@dataclass(frozen=True)
class LiveEvent:
    """An event of the run, and the local time ``at`` which the run recorded it."""

    event: Event
    at: datetime


class Live(RunObserver):
    """Looks on at one run. ``close`` ends its thread, after everything that came was taken in."""

    def __init__(self, overlays: Sequence[OverlayModel] = (), drive: str = "command") -> None:
        self._lock = threading.Lock()
        self._inbox: SimpleQueue[Block | tuple[tuple[OverlayModel, ...], str] | None] = (
            SimpleQueue()
        )
        self._wanted = (tuple(overlays), drive)
        self._run: _Run | None = None
        self._events: list[LiveEvent] = []
        self._answers: list[tuple[float, float, float]] = []  # time, error and correction
        self._answered, self._stride = 0, 1  # answers that came; every so many are kept
        self.last_answer: HoldAnswer | None = None  #: of a feedback
        self._room: tuple[float, RoomReading] | None = None
        self._thread: threading.Thread | None = None

    # called from the rig's thread

    def started(self, planned: Plan, identity: RigIdentity, rate: float) -> None:
        run = _Run(planned.rows, identity.channels, rate, planned.average)
        run.follow(*self._wanted)
        self._run = run
        self._thread = threading.Thread(target=self._work, name="live", daemon=True)
        self._thread.start()

    def block(self, block: Block) -> None:
        self._inbox.put(block)

    def event(self, event: Event) -> None:
        with self._lock:
            self._events.append(LiveEvent(event, datetime.now().astimezone()))

    def answered(self, time: float, answer: HoldAnswer) -> None:
        with self._lock:
            self.last_answer = answer
            if self._answered % self._stride == 0:
                self._answers.append((time, answer.error, answer.correction))
            self._answered += 1
            if len(self._answers) > _ANSWERS_MAX:
                self._answers, self._stride = self._answers[::2], 2 * self._stride

    def room(self, time: float, reading: RoomReading) -> None:
        with self._lock:
            self._room = time, reading

    # called from the interface thread

    def answers(self) -> np.ndarray:
        """Return the answers of a feedback, (n, 3): time in s, error in m, and correction."""
        with self._lock:
            rows = self._answers.copy()
        return np.array(rows, dtype=np.float64).reshape(-1, 3)

    def follow(self, overlays: Sequence[OverlayModel], drive: str) -> None:
        """Use other overlay models; they are simulated from the start of the run."""
        self._wanted = (tuple(overlays), drive)
        self._inbox.put(self._wanted)

    def newest_room(self) -> tuple[float, RoomReading] | None:
        """Return the newest reading of the room and its time in the run in s; None without one."""
        with self._lock:
            return self._room

    def take_events(self) -> list[LiveEvent]:
        """Return the events since the last call."""
        with self._lock:
            taken, self._events = self._events, []
        return taken

    def now(self) -> RunSnapshot | None:
        """Return the present state; None before the run has started."""
        if self._run is None:
            return None
        with self._lock:
            return self._run.now()

    def view(self, name: str, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
        """Return time in s and values in SI units of a signal, (m,) each, ``first`` to ``last`` s.

        ``name`` is command, monitor, current, displacement, channel with the name of a declared one
        (``channel load_cell``), or model, drawn (its current), residual, rms with the number of the
        model (``model 0``).
        Unknown names give empty arrays.
        """
        run = self._run
        if run is None:
            return np.empty(0), np.empty(0)
        with self._lock:
            pyramid = run.curves.get(name)
            if pyramid is None:
                return np.empty(0), np.empty(0)
            begin, end = int(first * run.rate), int(np.ceil(last * run.rate)) + 1
            samples, values = pyramid.view(begin, end)
        return samples / run.rate, values

    def newest(self, name: str, seconds: float) -> np.ndarray:
        """Return all samples (n,) in SI units of the newest ``seconds`` of a signal.

        They are fewer where the run is shorter, or where 2**17 samples are. ``name`` is command,
        displacement, or residual with the number of the model; others give no samples.
        """
        run = self._run
        if run is None:
            return np.empty(0)
        with self._lock:
            ring = run.newest.get(name)
            return np.empty(0) if ring is None else ring.last(round(seconds * run.rate))

    def close(self) -> None:
        """Convert the waiting blocks, and end the thread."""
        if self._thread is not None:
            self._inbox.put(None)
            self._thread.join()
            self._thread = None

    def _work(self) -> None:
        run = self._run
        while run is not None and (item := self._inbox.get()) is not None:
            if isinstance(item, Block):
                taken = run.convert(item)
                with self._lock:
                    run.show(taken)
                continue
            # a new model is simulated from the start of the run, on curves of its own
            fresh = run.with_models(*item)
            with self._lock:
                self._run = run = fresh


@dataclass(frozen=True)
class _Converted:
    values: dict[str, np.ndarray]
    models: tuple[tuple[np.ndarray, np.ndarray], ...]  # displacement and current


class _Model:
    """One overlay model."""

    def __init__(self, overlay: Overlay | None, words: str, rate: float) -> None:
        self.overlay = overlay
        self._words = words
        self.running = RunningErrors(round(_RECENT * rate))

    @property
    def words(self) -> str:
        return self._words if self.overlay is None else self.overlay.failure

    def advance(self, block: Block) -> tuple[np.ndarray, np.ndarray]:
        if self.overlay is None:
            none = np.full(block.counts.shape[1], np.nan)
            return none, none
        return self.overlay.advance(block), self.overlay.current


class _Run:
    """Curves and models of one run; ``show`` and readers are called under the lock."""

    def __init__(
        self, total: int, channels: tuple[Channel, ...], rate: float, average: int
    ) -> None:
        self.average = average
        self.total = total
        self.channels = channels
        self.rate = rate
        self._signals = {c.name: signal for c in channels if (signal := _signal(c.name))}
        self.curves = {signal: Pyramid(total) for signal in self._signals.values()}
        self.newest = {name: Newest(_NEWEST) for name in _NEWEST_OF}
        self._blocks: list[Block] | None = []  # None once there are too many to keep
        self._kept = 0  # samples
        self._models: tuple[_Model, ...] = ()
        self._followed: tuple[tuple[OverlayModel, ...], str] = ((), "")
        self._rest = _RestReference()
        self._newest: dict[str, float] = {}
        self.revision = 0

    def follow(self, overlays: tuple[OverlayModel, ...], drive: str) -> None:
        models = []
        for i, chosen in enumerate(overlays):
            overlay, words = None, ""
            try:
                overlay = Overlay(chosen.actuator, self.channels, self.rate, drive, self.average)
            except (ModelError, ValueError) as error:
                words = str(error)
            models.append(_Model(overlay, words, self.rate))
            for name in _OF_MODELS:
                self.curves[f"{name} {i}"] = Pyramid(self.total)
        self._models = tuple(models)
        self._followed = (overlays, drive)

    def with_models(self, overlays: tuple[OverlayModel, ...], drive: str) -> _Run:
        """Return the same run so far with other models.

        In a run of which the first blocks are no longer kept, only models that are simulated
        already go on.
        """
        fresh = _Run(self.total, self.channels, self.rate, self.average)
        fresh.revision = self.revision + 1
        if self._blocks is not None:
            fresh.follow(overlays, drive)
            for block in self._blocks:
                fresh.show(fresh.convert(block))
            return fresh
        for signal in self._signals.values():
            fresh.curves[signal] = self.curves[signal]
        for name in ("command", "displacement"):
            fresh.newest[name] = self.newest[name]
        fresh._blocks, fresh._rest, fresh._newest = None, self._rest, self._newest
        fresh._go_on(self, overlays, drive)
        return fresh

    def _go_on(self, before: _Run, overlays: tuple[OverlayModel, ...], drive: str) -> None:
        """Use the models that ``before`` has already; others have no values."""
        past = self.curves["command"].samples
        self._followed = (overlays, drive)
        known = before._followed[0] if before._followed[1] == drive else ()
        models = []
        for i, chosen in enumerate(overlays):
            there = known.index(chosen) if chosen in known else None
            models.append(
                _Model(None, _TOO_LONG, self.rate) if there is None else before._models[there]
            )
            for name in _OF_MODELS:
                if there is not None:
                    self.curves[f"{name} {i}"] = before.curves[f"{name} {there}"]
                    if name == "residual":
                        self.newest[f"residual {i}"] = before.newest[f"residual {there}"]
                    continue
                curve = self.curves[f"{name} {i}"] = Pyramid(self.total)
                for start in range(0, past, _GAP):
                    curve.push(np.full(min(_GAP, past - start), np.nan))
        self._models = tuple(models)

    def convert(self, block: Block) -> _Converted:
        """Convert a block to SI units and advance the models; the slow part."""
        self._kept += block.counts.shape[1]
        if self._kept > _KEPT_MAX:
            self._blocks = None
        if self._blocks is not None:
            self._blocks.append(block)
        values = {
            self._signals[c.name]: c.scaling.physical(block.counts[i])
            for i, c in enumerate(self.channels)
            if c.name in self._signals
        }
        if "displacement" in values:
            step = abs(self.channels[0].scaling.gain * self.channels[0].scaling.coefficients[1])
            values["displacement"] = self._rest.from_rest(
                values["displacement"], lead_in(values["command"], step)
            )
        return _Converted(values, tuple(model.advance(block) for model in self._models))

    def show(self, taken: _Converted) -> None:
        self.revision += 1
        for name, values in taken.values.items():
            self.curves[name].push(values)
            if name in self.newest:
                self.newest[name].push(values)
            last = values[-max(1, round(_READOUT * self.rate)) :]
            self._newest[name] = float(last[-1] if name == "command" else last.mean())
        measured = taken.values.get("displacement")
        for i, (model, (moved, drawn)) in enumerate(zip(self._models, taken.models, strict=True)):
            self.curves[f"model {i}"].push(moved)
            self.curves[f"drawn {i}"].push(drawn)
            if measured is None:
                continue
            model.running.push(measured, moved)
            left = measured - moved
            self.curves[f"residual {i}"].push(left)
            self.newest[f"residual {i}"].push(left)
            recent = model.running.now().recent
            self.curves[f"rms {i}"].push(np.full(moved.size, recent))

    def now(self) -> RunSnapshot:
        return RunSnapshot(
            self.curves["command"].samples,
            self.total,
            self.rate,
            dict(self._newest),
            tuple(model.running.now() for model in self._models),
            tuple(model.words for model in self._models),
            self.revision,
        )


class _RestReference:
    """Displacement from the mean reading over the lead-in, as far as the lead-in is read."""

    def __init__(self) -> None:
        self._sum = 0.0
        self._count = 0
        self._over = False

    def from_rest(self, reading: np.ndarray, quiet: int) -> np.ndarray:
        if not self._over:
            if not self._count:
                quiet = max(quiet, 1)  # a run without a lead-in starts from its first reading
            self._sum += float(reading[:quiet].sum())
            self._count += min(quiet, reading.size)
            self._over = quiet < reading.size
        return reading - self._sum / self._count
