"""State of a campaign and of a running recording as another process sees them: read only."""

from __future__ import annotations

import contextlib
import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dearig.batch.journal import JOURNAL
from dearig.batch.queue import CampaignOutcome, Queue, RunState
from dearig.errors import InputError
from dearig.recording.lock import STILL_RUNNING, refuse_in_use
from dearig.recording.reading.follow import Extremes, Follower, News
from dearig.recording.reading.index import ENDINGS
from dearig.recording.reading.recording import RecordedEvent

__all__ = [
    "RECENT",
    "STALE",
    "Bins",
    "RecordingWatch",
    "Seen",
    "SourceWatch",
    "is_running",
    "newest_recording",
    "seen",
]

#: Samples that are read at one look: some 30 MB.
_MOST = 1_000_000
#: Age in s of the newest sample above which the values are not those of now: eight flushes of a
#: recording, as on the web page.
STALE = 2.0
#: Time in s of which the newest part of every channel is kept.
RECENT = 20.0
#: Bins of the newest part and of the whole run: a line of 800 ends fills the width of a screen.
_BINS = 400
_EVENTS = 20  # the last ones


def is_running(folder: Path) -> bool:
    """Return True while a process plays the campaign in ``folder``: it holds the journal's lock."""
    return _is_locked(folder / JOURNAL)


def _is_locked(path: Path) -> bool:
    try:
        refuse_in_use(path)
    except InputError:
        return True
    return False


def seen(folder: Path) -> CampaignOutcome:
    """Return how the campaign in ``folder`` stands.

    ``status`` is running or paused while a process plays it, and killed where the last session has
    no end. Raises ``InputError`` for a folder without a campaign.
    """
    queue = Queue.of(folder / JOURNAL) if folder.is_dir() else Queue()
    return _outcome(folder, queue)


def _outcome(folder: Path, queue: Queue) -> CampaignOutcome:
    if not queue.runs:
        raise InputError(f"{folder} has no campaign: there is no journal {JOURNAL}")
    status, reason = queue.status, queue.reason
    # the lock is looked at only where the journal does not say how the session ended: on some
    # systems the look itself takes it for an instant
    if not status and is_running(folder):
        run = queue.running
        status = "paused" if queue.paused and run is None else "running"
        reason = "" if run is None else f"run {run.name} is played"
        if run is not None and run.recorded:
            reason = f"results of run {run.name} are computed"
    elif not status:
        status = "killed"
        reason = "the program ended without a word; continue the campaign"
    return CampaignOutcome(queue.name, folder, queue, status, reason)


def newest_recording(folder: Path) -> Path | None:
    """Return the recording in ``folder`` that changed last, None if there is none."""
    found = []
    for path in folder.iterdir():
        # a file can be deleted between the list and the look
        with contextlib.suppress(FileNotFoundError):
            if path.suffix.lower() in ENDINGS and path.is_file():
                found.append((path.stat().st_mtime, path.name, path))
    return max(found)[2] if found else None


class Bins:
    """Minimum and maximum of a value over bins of equal width in time.

    Bins lie at multiples of their ``width`` in s, so that a picture of them does not shimmer. There
    are at most ``most`` of them: more drop the oldest or, with ``whole``, double the width.
    """

    def __init__(self, width: float, most: int, whole: bool = False) -> None:
        self.width = width
        self._most, self._whole = most, whole
        self._place = np.empty(0, dtype=np.int64)
        self._low = self._high = np.empty(0)

    def add(self, time: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        """Take minimum and maximum (n,) at ``time`` (n,) in s, which does not decrease."""
        good = np.isfinite(low) & np.isfinite(high)
        # sample times are sums of rounded numbers: a sample at the edge belongs to the right bin
        place = np.floor(time[good] / self.width + 1e-6).astype(np.int64)
        self._place = np.concatenate([self._place, place])
        self._low = np.concatenate([self._low, low[good]])
        self._high = np.concatenate([self._high, high[good]])
        self._merge()
        if self._whole:
            while self._place.size and self._place[-1] - self._place[0] >= self._most:
                self.width *= 2.0
                self._place //= 2
                self._merge()
        elif self._place.size:
            new = self._place > self._place[-1] - self._most
            self._place, self._low, self._high = self._place[new], self._low[new], self._high[new]

    def _merge(self) -> None:
        """Unite neighbours that lie in the same bin."""
        if not self._place.size:
            return
        first = np.flatnonzero(np.diff(self._place, prepend=self._place[0] - 1))
        self._low = np.minimum.reduceat(self._low, first)
        self._high = np.maximum.reduceat(self._high, first)
        self._place = self._place[first]

    @property
    def extremes(self) -> Extremes:
        """Start in s, minimum and maximum (n,) of the bins that have values."""
        return self._place * self.width, self._low, self._high

    def dense(self) -> tuple[float, np.ndarray, np.ndarray]:
        """Return the first start in s, minimum and maximum (n,) of all bins, NaN for empty ones."""
        if not self._place.size:
            return 0.0, np.empty(0), np.empty(0)
        place = self._place - self._place[0]
        low, high = np.full((2, int(place[-1]) + 1), np.nan)
        low[place], high[place] = self._low, self._high
        return float(self._place[0]) * self.width, low, high


@dataclass
class Seen:
    """What was seen of a recording so far, in SI units.

    ``time`` is that of the newest sample in s, and ``duration`` of the whole run, 0 where it is not
    known; ``now`` and ``peak`` have the newest value and the one of the largest magnitude of each
    channel, ``described`` their units and labels. ``recent`` and ``whole`` have their extremes over
    the last seconds and over the run. ``events`` are the last ones. ``ended``: no samples follow,
    and ``outcome`` says how the run ended. ``abandoned``: the run was killed. ``changed`` is the
    monotonic time in s at which the newest sample was written, and ``age`` its age in s at the
    last look, None where there is no sample.
    """

    path: Path
    samples: int = 0
    time: float = 0.0
    duration: float = 0.0
    now: dict[str, float] = field(default_factory=dict)
    peak: dict[str, float] = field(default_factory=dict)
    described: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    recent: dict[str, Bins] = field(default_factory=dict)
    whole: dict[str, Bins] = field(default_factory=dict)
    events: tuple[RecordedEvent, ...] = ()
    faults: int = 0
    simulated: bool = False
    ended: bool = False
    outcome: str = ""
    abandoned: bool = False
    trouble: str = ""
    changed: float = -math.inf
    age: float | None = None

    @property
    def live(self) -> bool:
        """True while the values are those of this moment: samples come, and the run goes on."""
        return not (self.ended or self.abandoned) and self.age is not None and self.age <= STALE


class RecordingWatch:
    """Follows the recording at ``path`` of a run in another process.

    ``now`` gives Unix time in s, ``clock`` monotonic time in s.
    """

    def __init__(
        self,
        path: Path,
        now: Callable[[], float] = time.time,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._path, self._now, self._clock = path, now, clock
        self._begin()

    def _begin(self) -> None:
        self.state = Seen(self._path)
        self._follower = Follower(self._path)
        self._identifier = ""
        self._events: deque[RecordedEvent] = deque(maxlen=_EVENTS)

    def look(self) -> Seen:
        """Return what is there now; a file that cannot be read yet is a ``trouble``."""
        try:
            news = self._follower.look(_MOST, newest=True)
            if self._identifier not in ("", news.identifier):
                # another recording has the name of this one
                self._begin()
                news = self._follower.look(_MOST, newest=True)
        except InputError as error:
            self.state.trouble = str(error)
        else:
            self._identifier = news.identifier
            self._take(news)
        changed = self.state.changed
        self.state.age = None if changed == -math.inf else self._clock() - changed
        return self.state

    def _take(self, news: News) -> None:
        state = self.state
        state.trouble, state.ended, state.outcome = "", news.ended, news.outcome
        state.simulated, state.described = news.simulated, news.described
        self._events.extend(news.events)
        state.events = tuple(self._events)
        state.faults += sum(event.level == "fault" for event in news.events)
        for name, (at, low, high) in news.passed.items():
            self._add(name, at, low, high)
        time = news.values.get("time", np.empty(0))
        if time.size:
            state.samples, state.time = news.start + time.size, float(time[-1])
            for name, values in news.values.items():
                good = values[np.isfinite(values)]
                if name != "time" and good.size:
                    self._add(name, time, values, values)
                    state.now[name] = float(good[-1])
            self._date(news.written)
        if state.samples and state.time:
            state.duration = news.expected * state.time / max(state.samples - 1, 1)
        idle = self._clock() - state.changed
        state.abandoned = not news.ended and idle > STILL_RUNNING and not _is_locked(self._path)

    def _date(self, written: float | None) -> None:
        """Note when the newest sample was written: its age is then told by this clock alone."""
        state, clock = self.state, self._clock()
        age = 0.0
        if state.changed == -math.inf and written is not None:
            # the first look: only the file knows; its clock may be that of another computer
            age = max(self._now() - written, 0.0)
        state.changed = clock - age

    def _add(self, name: str, time: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        state = self.state
        if name not in state.recent:
            state.recent[name] = Bins(RECENT / _BINS, _BINS)
            state.whole[name] = Bins(RECENT / _BINS, _BINS, whole=True)
        state.recent[name].add(time, low, high)
        state.whole[name].add(time, low, high)
        values = np.concatenate([low, high]) if low is not high else low
        values = values[np.isfinite(values)]
        if values.size:
            largest = float(values[np.argmax(np.abs(values))])
            if abs(largest) >= abs(state.peak.get(name, 0.0)):
                state.peak[name] = largest


class SourceWatch:
    """Watches ``source``: the folder of a campaign, a folder of recordings, or a recording.

    After each look ``outcome`` is how the campaign stands, None where there is none, ``recording``
    the recording that is shown, None where there is none yet, and ``ended`` True where nothing
    more is to be expected. Raises ``InputError`` for a source that is not there.
    """

    def __init__(self, source: Path) -> None:
        if not source.exists():
            raise InputError(f"{source} is not there")
        self.source = source
        self.outcome: CampaignOutcome | None = None
        self.recording: Seen | None = None
        self.ended = False
        self._watch: RecordingWatch | None = None
        self._queue = Queue()
        self._journal: tuple[int, int] | None = None

    def look(self) -> None:
        """Look once. Raises ``InputError`` for a folder without a campaign and recordings."""
        path: Path | None = self.source
        if self.source.is_dir():
            if (self.source / JOURNAL).exists():
                path = self._look_at_campaign()
            else:
                self.outcome = None
                path = newest_recording(self.source)
                if path is not None and not self._is_inside(path):
                    raise InputError(f"{path} is a link out of the folder, and is not followed")
                if path is None:
                    self.recording = None
                    raise InputError(f"{self.source} has neither a campaign nor a recording")
        if path is None:
            self.recording = self._watch = None
        else:
            if self._watch is None or self._watch.state.path != path:
                self._watch = RecordingWatch(path)
            self.recording = self._watch.look()
        if self.outcome is not None:
            self.ended = self.outcome.status not in ("running", "paused")
        else:
            state = self.recording
            # a file that cannot be read and that no run writes does not become readable
            self.ended = state is None or state.ended or not _is_locked(state.path)

    def _look_at_campaign(self) -> Path | None:
        """Read the journal, and return the recording to show: that of the last run begun."""
        journal = self.source / JOURNAL
        about = journal.stat()
        if (about.st_size, about.st_mtime_ns) != self._journal:
            self._queue = Queue.of(journal)
            self._journal = about.st_size, about.st_mtime_ns
        self.outcome = _outcome(self.source, self._queue)
        run = _last_begun(self._queue)
        if run is None or run.extremes or not run.recording:
            return None
        path = self.source / run.recording
        return path if path.exists() and self._is_inside(path) else None

    def _is_inside(self, path: Path) -> bool:
        """Return True if ``path`` lies in the watched folder, also where it is a link."""
        return path.resolve().is_relative_to(self.source.resolve())


def _last_begun(queue: Queue) -> RunState | None:
    """Return the run that is played, or else the last one that was."""
    if queue.running is not None:
        return queue.running
    return next((run for run in reversed(queue.listed) if run.attempts), None)
