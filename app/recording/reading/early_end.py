"""How a run ended that did not reach its end, and what that means for its use."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from dearig.recording.reading.recording import RecordedEvent, Recording

__all__ = ["FAULT_BEFORE", "EarlyEnd", "cut_end", "early_end"]

#: s before an interlock that may show the fault: interlocks trip after debounce times and delays of
#: up to some tenths of a second.
FAULT_BEFORE = 0.5

_INTERLOCK = re.compile(r"interlock ([^:]+): ")
#: Short names of the interlocks. Those of the second table do not come from the film.
_CAUSES = {
    "monitor": "the monitor did not follow the command",
    "breakdown": "arc or breakdown",
    "current": "current too high, short or arc",
    "laser": "laser at the end of its range",
    "laser-stuck": "laser stuck",
    "displacement": "displacement out of its limits",
    "jump": "jump of the laser reading",
    "following": "the film did not follow the prediction",
}
_NOT_OF_THE_FILM = {"late": "samples came late", "disk": "disk almost full"}


class _Ended(Protocol):
    """What a recording and its summary have in common."""

    @property
    def outcome(self) -> str: ...
    @property
    def complete(self) -> bool: ...
    @property
    def duration(self) -> float: ...
    @property
    def events(self) -> tuple[RecordedEvent, ...]: ...


@dataclass(frozen=True)
class EarlyEnd:
    """End of a run before its sequence was over.

    ``kind`` is interlock, stopped, fault or incomplete; ``time`` in s; ``cause`` in a few words.
    ``doubtful_from`` is the time in s from which the samples may show the fault and not the film;
    None where all of them can be used. ``is_cut``: those samples are left out.
    """

    kind: str
    time: float
    cause: str
    doubtful_from: float | None
    is_cut: bool = False

    @property
    def mark(self) -> str:
        """The end in one word, to stand behind a name."""
        return "killed" if self.kind == "incomplete" else self.kind

    @property
    def sentence(self) -> str:
        """The end and what it means, to stand behind a name."""
        at = f"at {self.time:.2f} s"
        if self.kind == "interlock":
            said = f"ended in an interlock {at} ({self.cause})"
        elif self.kind == "stopped":
            said = f"was stopped {at} ({self.cause})"
        elif self.kind == "fault":
            said = f"ended early {at} ({self.cause})"
        else:
            said = f"is incomplete: the run was killed {at}"
        if self.is_cut:
            return f"{said}: what follows {self.doubtful_from:.2f} s is left out"
        if self.doubtful_from is None:
            return f"{said}: it does not hold the whole sequence"
        return f"{said}: the last {FAULT_BEFORE:g} s may show the fault, not the film"


def early_end(run: _Ended) -> EarlyEnd | None:
    """Return how ``run``, a recording or its summary, ended early; None if it did not."""
    end = _end(run)
    if end is None or end.doubtful_from is None:
        return end
    # a recording that was cut ends before the samples that may show the fault
    return replace(end, is_cut=run.duration <= end.doubtful_from < end.time)


def _end(run: _Ended) -> EarlyEnd | None:
    outcome, end = run.outcome, run.duration
    for event in run.events:
        if event.level == "fault" and (found := _INTERLOCK.match(event.message)):
            name = found[1]
            cause = _CAUSES.get(name) or _NOT_OF_THE_FILM.get(name) or name
            return _faulty("interlock", event.time, cause, name not in _NOT_OF_THE_FILM)
    if outcome.startswith("stopped by an interlock"):
        return _faulty("interlock", end, "its cause was not recorded")
    if not run.complete or outcome.startswith("killed"):
        return EarlyEnd("incomplete", end, "killed", None)
    if outcome.startswith("interrupted"):
        asked = [e.time for e in run.events if e.message.startswith("interrupted")]
        by = outcome.removeprefix("interrupted").partition(";")[0].strip() or "by the operator"
        return EarlyEnd("stopped", min(asked, default=end), by, None)
    if outcome.startswith(("instrument fault", "ended early", "no samples")):
        return _faulty("fault", end, outcome.partition(": ")[2] or outcome)
    return None


def _faulty(kind: str, time: float, cause: str, of_film: bool = True) -> EarlyEnd:
    return EarlyEnd(kind, time, cause, max(time - FAULT_BEFORE, 0.0) if of_film else None)


def cut_end(recording: Recording) -> Recording:
    """Return ``recording`` without the samples that may show a fault; itself if it has none."""
    end = early_end(recording)
    if end is None or end.doubtful_from is None:
        return recording
    return recording.until(end.doubtful_from)
