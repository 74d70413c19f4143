"""State of a campaign and of a running recording as another process sees them: read only."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dearig.batch.campaign import CampaignOutcome
from dearig.batch.journal import JOURNAL
from dearig.batch.queue import Queue
from dearig.errors import InputError
from dearig.recording.follow import Follower
from dearig.recording.index import ENDINGS
from dearig.recording.lock import refuse_in_use
from dearig.recording.recording import RecordedEvent

__all__ = ["RecordingWatch", "Seen", "is_running", "newest_recording", "seen"]

#: Samples that are read at one look: some 30 MB.
_MOST = 1_000_000
#: Time in s of which the newest part of the displacement is kept, and its bins.
_TRACE_S, _BINS = 10.0, 60
_EVENTS = 5  # the last ones, shown below the trace


def is_running(folder: Path) -> bool:
    """Return True while a process plays the campaign in ``folder``: it holds the journal's lock."""
    try:
        refuse_in_use(folder / JOURNAL)
    except InputError:
        return True
    return False


def seen(folder: Path) -> CampaignOutcome:
    """Return how the campaign in ``folder`` stands.

    ``status`` is running or paused while a process plays it, and killed where the last session has
    no end. Raises ``InputError`` for a folder without a campaign.
    """
    running = folder.is_dir() and is_running(folder)
    queue = Queue.of(folder / JOURNAL) if folder.is_dir() else Queue()
    if not queue.runs:
        raise InputError(f"{folder} has no campaign: there is no journal {JOURNAL}")
    status, reason = queue.status, queue.reason
    if running and not status:
        run = queue.running
        status = "paused" if queue.paused and run is None else "running"
        reason = "" if run is None else f"run {run.name} is played"
        if run is not None and run.recorded:
            reason = f"results of run {run.name} are computed"
    elif not status:
        status = "killed"
        reason = "the program ended without a word; continue with dearig campaign --resume"
    return CampaignOutcome(queue.name, folder, queue, status, reason)


def newest_recording(folder: Path) -> Path | None:
    """Return the recording in ``folder`` that changed last, None if there is none."""
    found = [p for p in folder.iterdir() if p.suffix.lower() in ENDINGS and p.is_file()]
    return max(found, key=lambda p: (p.stat().st_mtime, p.name), default=None)


@dataclass
class Seen:
    """What was seen of a recording so far, in SI units.

    ``time`` is that of the newest sample in s; ``now`` and ``peak`` have the newest value and the
    one of the largest magnitude of each channel. ``trace`` is the displacement of the last seconds
    in a few bins. ``events`` are the last ones. ``ended``: no samples follow.
    """

    path: Path
    samples: int = 0
    time: float = 0.0
    now: dict[str, float] = field(default_factory=dict)
    peak: dict[str, float] = field(default_factory=dict)
    trace: np.ndarray = field(default_factory=lambda: np.empty(0))
    events: tuple[RecordedEvent, ...] = ()
    ended: bool = False
    trouble: str = ""


class RecordingWatch:
    """Follows the recording at ``path`` of a run in another process."""

    def __init__(self, path: Path) -> None:
        self.state = Seen(path)
        self._follower = Follower(path)
        self._time: np.ndarray = np.empty(0)
        self._signal: np.ndarray = np.empty(0)
        self._events: deque[RecordedEvent] = deque(maxlen=_EVENTS)

    def look(self) -> Seen:
        """Return what is there now; a file that cannot be read yet is a ``trouble``."""
        state = self.state
        try:
            news = self._follower.look(_MOST)
        except InputError as error:
            state.trouble = str(error)
            return state
        state.trouble, state.ended = "", news.ended
        self._events.extend(news.events)
        state.events = tuple(self._events)
        time = news.values.get("time", np.empty(0))
        if not time.size:
            return state
        state.samples, state.time = news.start + time.size, float(time[-1])
        for name, values in news.values.items():
            good = values[np.isfinite(values)]
            if name == "time" or not good.size:
                continue
            state.now[name] = float(good[-1])
            largest = float(good[np.argmax(np.abs(good))])
            if abs(largest) >= abs(state.peak.get(name, 0.0)):
                state.peak[name] = largest
        self._keep(time, news.values.get("displacement", np.full(time.size, np.nan)))
        return state

    def _keep(self, time: np.ndarray, signal: np.ndarray) -> None:
        self._time = np.concatenate([self._time, time])
        self._signal = np.concatenate([self._signal, signal])
        new = self._time >= self._time[-1] - _TRACE_S
        self._time, self._signal = self._time[new], self._signal[new]
        bins = np.array_split(self._signal, min(_BINS, self._signal.size))
        means = [float(b[np.isfinite(b)].mean()) for b in bins if np.isfinite(b).any()]
        self.state.trace = np.array(means)
