"""Feedback within a run: readings are answered by corrections, which pass the gate before output.

The loop works on the sample clock. Readings of one block are answered by the block that follows
those that wait for output; how many wait is set before the run. The delay between the two is
therefore the same for every answer, however busy the computer is. A computer that is too slow for
it leaves less waiting: ``late`` ramps the run down, and a card without samples ends it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import tomli_w

from dearig.acquisition.plan import Plan, correctable
from dearig.config.rigfile import RigFile
from dearig.drivers.channels import Channel, Scaling
from dearig.drivers.errors import RefusedWaveform
from dearig.drivers.gate import BlockGate
from dearig.drivers.interlocks import Trip, laser_reach
from dearig.drivers.rig import Block, Event
from dearig.errors import InputError
from dearig.model.control import HoldAnswer, HoldController, HoldSettings
from dearig.model.errors import ModelError
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet

__all__ = ["Feedback", "FeedbackLoop", "FeedbackReport"]

_TELL_AGAIN = 10.0  # s between two events about the same state, so that none fills the recording
_LATE_PART = 0.5  # of the waiting output: a reader that is later than this ramps the run down


@dataclass(frozen=True)
class Feedback:
    """Feedback that holds a displacement during a run, in SI units.

    Attributes
    ----------
    setpoint, sensitivity : float
        Displacement in m from the loaded rest state, and in m per unit of the correction.
    lead_in : float
        Time in s at 0 V, in which the rest state is read.
    start, stop : float
        Times in s of the run between which the displacement is held.
    authority, rate_limit : float
        Largest correction as a part of the planned voltage, and its largest change in 1/s. The
        gate enforces both.
    response : float
        Response time in s of the loop, besides its delay.
    ahead : float
        Time in s of the output that waits when an answer is admitted.
    laser_loss : float
        Time in s without usable readings, during which the correction stays as it is. Then the
        voltage is ramped down.
    block : float
        Time in s of the readings that are answered together.
    """

    setpoint: float
    sensitivity: float
    lead_in: float
    start: float
    stop: float
    authority: float
    rate_limit: float
    response: float
    ahead: float
    laser_loss: float
    block: float = 0.1

    def __post_init__(self) -> None:
        for name in ("block", "ahead", "laser_loss"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"feedback: {name} = {value!r} s must be finite and above 0")


@dataclass(frozen=True)
class FeedbackReport:
    """What a feedback did in a run, in SI units.

    ``delay`` in s is that of every answer, counted on the sample clock from the middle of the
    readings to the middle of the block that answers them. ``waiting`` in s is the least output that
    waited when an answer was admitted. ``lowest``, ``highest`` and ``last`` are corrections.
    ``frozen`` and ``limited`` are times in s without usable readings, and at the authority.
    ``gain_margin`` and ``phase_margin`` (deg) are those of the loop with the model's sensitivity.
    """

    answers: int
    delay: float
    waiting: float
    lowest: float
    highest: float
    last: float
    frozen: float
    limited: float
    gain_margin: float
    phase_margin: float

    @property
    def sentence(self) -> str:
        """The report as a sentence."""
        return (
            f"feedback: {self.answers} answers, each {self.delay:.3g} s after its readings, with "
            f"{self.waiting:.3g} s of output or more waiting; correction {self.lowest:+.2%} to "
            f"{self.highest:+.2%}, at its limit for {self.limited:.3g} s, frozen for "
            f"{self.frozen:.3g} s"
        )


class FeedbackLoop:
    """The ``feedback`` of one run as ``planned``; ``gate.waveform`` is what the rig plays.

    ``model`` and ``film`` are those of the plan. Raises ``InputError`` where the limits leave no
    room for the correction, and for settings that make no loop.
    """

    def __init__(
        self,
        feedback: Feedback,
        planned: Plan,
        rig_file: RigFile,
        model: Actuator | None = None,
        film: str = "",
        progress: Progress = quiet,
    ) -> None:
        self.feedback = feedback
        rate = planned.rate
        self.gate: BlockGate = correctable(
            planned, rig_file, model, film, block=max(1, round(feedback.block * rate)),
            authority=feedback.authority, rate_limit=feedback.rate_limit, progress=progress,
        )  # fmt: skip
        self._rate, self._block = rate, self.gate.waveform.block
        # the readings of one block are complete while the next ones are output
        waiting = math.ceil(feedback.ahead * rate / self._block) + 1
        self._rig_file = rig_file
        self._lead_in = round(feedback.lead_in * rate)
        self._start, self._stop = round(feedback.start * rate), round(feedback.stop * rate)
        period = self._block / rate
        try:
            self.settings = HoldSettings(
                setpoint=feedback.setpoint,
                sensitivity=feedback.sensitivity,
                period=period,
                delay=waiting * period,
                response=feedback.response,
                authority=feedback.authority,
                rate_limit=feedback.rate_limit,
                resolution=rig_file.laser.mm_per_V
                * 1e-3
                * rig_file.card.range_displacement_V
                / 2**15,
            )
        except ModelError as error:
            raise InputError(str(error)) from error
        self._controller = HoldController(self.settings)
        for _ in range(waiting):
            if not self.gate.complete:
                self.gate.admit(0.0)
        self._laser: tuple[int, Scaling] | None = None  # row in a block, and what counts mean
        self._readings = np.empty(0, dtype=np.int16)  # counts that are not answered yet
        self._taken = 0  # samples answered
        self._rest_sum, self._rest_samples = 0.0, 0
        self._state = ""
        self._reported: dict[str, int] = {}  # sample of the last event about each state
        self._answers = 0
        self._least = math.inf  # samples that waited for output
        self._lowest = self._highest = 0.0
        self._seconds = {"frozen": 0.0, "limited": 0.0}

    @property
    def late(self) -> float:
        """Time in s of unread samples after which the run is ramped down."""
        return min(self._rig_file.interlocks.late_s, _LATE_PART * self.feedback.ahead)

    def begin(self, channels: Sequence[Channel]) -> None:
        """Take readings from blocks of these ``channels``."""
        names = [channel.name for channel in channels]
        row = names.index("displacement")
        self._laser = row, channels[row].scaling

    def watched(self) -> RigFile:
        """Return the rig file for the interlocks of a run with this feedback."""
        locks = self._rig_file.interlocks.model_copy(update={"late_s": self.late})
        return self._rig_file.model_copy(update={"interlocks": locks})

    def toml(self) -> str:
        """Return the settings as TOML, as a recording keeps them."""
        f, s = self.feedback, self.settings
        values = {
            "setpoint_mm": f.setpoint * 1e3,
            "from_s": f.start,
            "to_s": f.stop,
            "authority_pct": f.authority * 100.0,
            "rate_limit_pct_per_s": f.rate_limit * 100.0,
            "response_s": f.response,
            "block_s": s.period,
            "delay_s": s.delay,
            "laser_loss_s": f.laser_loss,
            "sensitivity_mm": s.sensitivity * 1e3,
            "gain_per_mm_s": s.gain * 1e-3,
            "gain_margin": s.gain_margin,
            "phase_margin_deg": s.phase_margin,
        }
        return tomli_w.dumps({key: float(f"{value:.6g}") for key, value in values.items()})

    def take(
        self, block: Block, waiting: float
    ) -> tuple[list[tuple[float, HoldAnswer]], list[Event], Trip | None]:
        """Answer the readings of ``block``.

        ``waiting`` is the reader's delay in s. Returns the answers with the time in s of their
        readings, events, and a trip where the run must end.
        """
        if self._laser is None:
            raise RuntimeError("a feedback takes blocks after begin")
        row, scaling = self._laser
        self._readings = np.concatenate((self._readings, block.counts[row]))
        answers: list[tuple[float, HoldAnswer]] = []
        events: list[Event] = []
        received = block.start + block.counts.shape[1] + waiting * self._rate
        while self._readings.size >= self._block:
            counts, self._readings = np.split(self._readings, [self._block])
            meters = scaling.physical(counts)
            start, self._taken = self._taken, self._taken + self._block
            answer = self._answer(start, meters)
            if answer is not None:
                answers.append(((start + 0.5 * self._block) / self._rate, answer))
                events += self._events(start, answer)
                if self._controller.blind >= self.feedback.laser_loss:
                    return answers, events, self._blind(start)
            if self.gate.complete:
                continue
            self._least = min(self._least, self.gate.waveform.admitted - received)
            try:
                self.gate.admit(self._controller.correction)
            except RefusedWaveform as error:
                at = start / self._rate
                message = f"at {at:.4g} s the gate refused the correction: {error}"
                return answers, events, Trip("gate", start, "ramp", message)
        return answers, events, None

    def report(self) -> FeedbackReport:
        """Return what the feedback did so far."""
        return FeedbackReport(
            answers=self._answers,
            delay=self.settings.delay,
            waiting=self._least / self._rate if math.isfinite(self._least) else math.nan,
            lowest=self._lowest,
            highest=self._highest,
            last=self._controller.correction,
            frozen=self._seconds["frozen"],
            limited=self._seconds["limited"],
            gain_margin=self.settings.gain_margin,
            phase_margin=self.settings.phase_margin,
        )

    def _answer(self, start: int, meters: np.ndarray) -> HoldAnswer | None:
        """Return the answer to readings (n,) m from sample ``start`` on, None outside the hold."""
        usable = np.abs(meters) < laser_reach(self._rig_file)
        rest = usable.copy()
        rest[max(0, self._lead_in - start) :] = False
        if rest.any():
            self._rest_sum += float(meters[rest].sum())
            self._rest_samples += int(rest.sum())
        plays_from = self.gate.waveform.admitted
        if start < self._start or plays_from >= self._stop:
            return None
        at_rest = self._rest_sum / self._rest_samples if self._rest_samples else math.nan
        answer = self._controller.answer(meters - at_rest, usable)
        self._answers += 1
        self._lowest = min(self._lowest, answer.correction)
        self._highest = max(self._highest, answer.correction)
        if answer.state in self._seconds:
            self._seconds[answer.state] += self.settings.period
        return answer

    def _events(self, start: int, answer: HoldAnswer) -> list[Event]:
        """Return the event of a change of state, unless it was told a moment ago."""
        before, self._state = self._state, answer.state
        if answer.state == before:
            return []
        reported = self._reported.get(answer.state)
        if reported is not None and start - reported < _TELL_AGAIN * self._rate:
            return []
        self._reported[answer.state] = start
        level, words = _STATES[answer.state]
        correction = f"{answer.correction:+.2%}"
        held = f"{self.feedback.setpoint * 1e3:.6g} mm"
        said = words.format(correction=correction, held=held)
        return [Event(start, level, f"feedback: {said}")]

    def _blind(self, start: int) -> Trip:
        sample = start + self._block
        return Trip(
            "laser lost",
            sample,
            self._rig_file.interlocks.laser_action,
            f"at {sample / self._rate:.4g} s the feedback had had no usable reading for "
            f"{self._controller.blind:.3g} s: the laser has lost its target, or its output is held",
        )


_STATES = {
    "holding": ("info", "{held} are held, correction {correction}"),
    "limited": (
        "warning",
        "the correction stands at its limit, {correction}: the displacement is not held; a model "
        "that fits better, or a larger authority, is needed",
    ),
    "frozen": (
        "warning",
        "the readings cannot be used (out of range, or without any change); the correction stays "
        "at {correction}",
    ),
}
