"""The recording of a run on a thread of its own: a disk that stalls does not delay the run.

The loop that reads the rig and checks its interlocks only puts blocks into a queue. The thread
takes them out, writes them, looks at the disk every second, and closes the file at the end. HDF5's
lock is held while a write stalls, so the loop must make no call of h5py.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dearig.drivers.rig import Block, Event
from dearig.errors import DearigError, DiskFault, InstrumentFault
from dearig.output_state import OutputState
from dearig.progress import Progress, quiet
from dearig.recording.writing.lost_file import LostFile
from dearig.recording.writing.writer import RecordingWriter

__all__ = ["HOLDS", "LOOK_INTERVAL", "Recorder", "is_writing"]

#: Samples that wait for the disk, in s of the run: a stall of 10 s, and what waited before it (a
#: flush is due every quarter of a second) and comes before the disk has caught up.
HOLDS = 12.0
#: s of the run that are kept beyond that, besides its ramp to 0 V: the reader's last blocks.
LAST_BLOCKS = 1.0
#: s between two looks at the disk.
LOOK_INTERVAL = 1.0
#: s between two calls of ``progress`` and ``given_up`` while the run waits for the disk at 0 V.
POLL = 0.1

_THREAD = "recording"


def is_writing() -> bool:
    """Return True while a recorder's thread lives, also one whose end no one waits for any more.

    Python and HDF5 wait for it when they exit, which does not end on a disk that does not answer.
    """
    return any(thread.name == _THREAD for thread in threading.enumerate())


@dataclass(frozen=True)
class _Room:
    """A reading of a thermo-hygrometer before ``sample``: degrees Celsius and per cent."""

    sample: int
    temperature: float
    humidity: float


@dataclass(frozen=True)
class _End:
    outcome: str
    event: str
    level: str


class Recorder:
    """Writes a run with ``writer``; the methods are called by the run's loop, and are quick.

    ``ramp_s`` is the time in s of a ramp to 0 V, which is recorded too after the disk has fallen
    behind. ``model`` returns the displacement (n,) m of an overlay model for each block. With
    ``waits`` the rig waits for its reader, as a simulated rig without a real clock: a full queue
    then delays ``append`` while the disk takes data and ``hurried`` is False. ``clock`` returns s.
    With ``new_file`` a file that another program deletes, replaces, moves or overwrites is no
    fault: the recording goes on in a new one next to it.
    """

    def __init__(
        self,
        writer: RecordingWriter,
        *,
        ramp_s: float = 0.0,
        model: Callable[[Block], np.ndarray] | None = None,
        waits: bool = False,
        new_file: bool = False,
        hurried: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._writer = writer
        self._earlier: list[RecordingWriter] = []  # those whose file was lost
        self._new_file = new_file
        self._model = model
        self._waits = waits
        self._hurried = hurried
        self._clock = clock
        second = writer.count_bytes * writer.channels * writer.rate_Hz
        self._bytes_max = int(second * HOLDS)
        self._bytes_last = int(second * (HOLDS + ramp_s + LAST_BLOCKS))
        self._looked = clock()
        # the thread and the loop share what follows, under this lock
        self._changed = threading.Condition()
        self._queue: deque[Block | Event | _Room] = deque()
        self._bytes = 0
        self._next = 0  # sample to be written
        self._received = 0
        self._fault: BaseException | None = None
        self._dropping = False
        self._free: int | None = None
        self._notices: deque[Event] = deque()
        self._end: _End | None = None
        self._ended = False
        self._end_fault: BaseException | None = None
        self._given_up: DiskFault | None = None
        self._modelling = False
        #: what is known of the rig's output after the run; kept with the recording by ``close``
        self.output_state: OutputState | None = None
        self._thread = threading.Thread(target=self._work, name=_THREAD, daemon=True)
        self._thread.start()

    @property
    def path(self) -> Path:
        """Path of the recording."""
        return self._writer.path

    @property
    def rate(self) -> float:
        """Rate of the sample clock in Hz."""
        return self._writer.rate_Hz

    @property
    def received(self) -> int:
        """Samples that ``append`` has taken."""
        return self._received

    @property
    def samples(self) -> int:
        """Samples of the run up to which they are written.

        After the end of the wait for a disk only those count that survive the end of the program.
        """
        writer = self._writer
        safe = writer.samples if self._given_up is None else writer.samples_flushed
        return writer.first_sample + safe

    @property
    def left_text(self) -> str:
        """What the end of the recording waits for: the overlay model or the disk."""
        left = self._received - self.samples
        if self._modelling:
            return (
                f"the overlay model is still computed for {left} of {self._received} samples, "
                f"which are then written to {self.path}"
            )
        what = f"{left} of {self._received} samples are" if left else "the file's end is"
        return f"{what} still being written to {self.path}"

    def notices(self) -> list[Event]:
        """Return the events of the recording itself since the last call; it has them already."""
        return [self._notices.popleft() for _ in range(len(self._notices))]

    @property
    def closed(self) -> bool:
        """True from the first call of ``close`` on."""
        return self._end is not None

    @property
    def fault(self) -> BaseException | None:
        """Why the recording cannot go on, None while it can; ``append`` then drops samples."""
        return self._fault

    def check(self) -> None:
        """Raise ``fault``, if there is one."""
        if self._fault is not None:
            raise self._fault

    def free_bytes(self) -> int | None:
        """Return the free bytes of the disk if they were looked at since the last call."""
        free, self._free = self._free, None
        return free

    def append(self, block: Block) -> None:
        """Take the next block and its events.

        Raises ``InstrumentFault`` if samples before it are missing or come a second time, and
        records an event. A failure of the disk is in ``fault``.
        """
        if block.start != self._received:
            raise self._out_of_step(block.start)
        # a copy: a driver may use its array again
        counts = np.array(block.counts)
        with self._changed:
            if self._waits:
                self._wait_for_room(counts.nbytes)
            self._received += counts.shape[1]
            if self._bytes and self._bytes + counts.nbytes > self._bytes_max:
                self._fault = self._fault or DiskFault(self._behind())
            if self._bytes + counts.nbytes > max(self._bytes_last, counts.nbytes):
                self._dropping = True  # later blocks too: a recording has no gaps
            if self._dropping:
                return
            self._queue.append(Block(block.start, counts, block.events))
            self._bytes += counts.nbytes
            self._changed.notify_all()

    def event(self, sample: int, level: str, message: str) -> None:
        """Take an event at ``sample``; ``level`` is info, warning or fault."""
        with self._changed:
            if not self._dropping:
                self._queue.append(Event(sample, level, message))
                self._changed.notify_all()

    def room(self, sample: int, temperature: float, humidity: float) -> None:
        """Take a reading of the room before ``sample``: degrees Celsius and per cent, or NaN."""
        with self._changed:
            if not self._dropping:
                self._queue.append(_Room(sample, temperature, humidity))
                self._changed.notify_all()

    def _out_of_step(self, start: int) -> InstrumentFault:
        lost = start - self._received
        what = f"{lost} samples are missing" if lost > 0 else f"{-lost} samples came twice"
        self.event(self._received, "fault", f"{what} from here on; the run was ended")
        return InstrumentFault(
            f"a block of the rig starts at sample {start}, expected sample {self._received}: "
            f"{what}; the rig cannot keep up, record again at a lower rate"
        )

    def _wait_for_room(self, size: int) -> None:
        began = self._clock()
        while self._bytes + size > max(self._bytes_max, size) and not self._dropping:
            if self._hurried() or self._clock() - began > HOLDS:
                return
            self._changed.wait(POLL)

    def _behind(self) -> str:
        rate = self._writer.rate_Hz
        late = self._bytes / (self._writer.count_bytes * self._writer.channels * rate)
        if self._modelling:
            return (
                f"the overlay model is {late:.3g} s behind the run, and no more samples fit into "
                f"memory: this computer is too slow for it; record without it, or at a lower rate"
            )
        return (
            f"the disk of {self._writer.path.absolute().parent} is {late:.3g} s behind the run, "
            f"and no more samples fit into memory: it does not answer, or it is too slow; see that "
            f"it is connected, or record to another disk"
        )

    # ------------------------------------------------------------ at the end of the run, at 0 V

    def drain(
        self, given_up: Callable[[], bool] = lambda: False, progress: Progress = quiet
    ) -> None:
        """Wait until the disk has taken all samples, or cannot.

        ``progress`` is called meanwhile, and so is ``given_up``: where it returns True this
        raises ``DiskFault``, and so does every later call.
        """
        self._wait(lambda: not self._queue and not self._bytes, given_up, progress)

    def close(
        self,
        outcome: str,
        event: str = "",
        level: str = "warning",
        *,
        given_up: Callable[[], bool] = lambda: False,
        progress: Progress = quiet,
    ) -> None:
        """Write what waits, then ``event`` at the last sample, and finish the recording.

        Without a sample there is no recording: its file is deleted. Raises what kept the disk from
        finishing it. ``given_up`` and ``progress`` are those of ``drain``. Calling it again is
        fine.
        """
        with self._changed:
            if self._end is None:
                self._end = _End(outcome, event, level)
                self._changed.notify_all()
        self._wait(lambda: self._ended, given_up, progress)
        self._thread.join()
        fault, self._end_fault = self._end_fault, None
        if fault is not None:
            raise fault

    def _wait(
        self, done: Callable[[], bool], given_up: Callable[[], bool], progress: Progress
    ) -> None:
        if self._given_up is not None:
            raise self._given_up
        while True:
            with self._changed:
                if self._changed.wait_for(done, POLL):
                    return
            progress("writing", self.samples / max(self._received, 1))
            if given_up():
                writer = self._writer
                safe = writer.first_sample + writer.samples_flushed
                last = f"the last {self._received - safe} of {self._received} samples"
                what = f"the disk of {writer.path.absolute().parent} had not taken {last}"
                if self._modelling:
                    what = f"the overlay model had not been computed for {last}"
                self._given_up = DiskFault(
                    f"{what} when the operator stopped waiting for it; recover the file to "
                    f"finish it",
                    command=("recover", str(writer.path)),
                )
                raise self._given_up

    # ------------------------------------------------------------ the thread

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._queue or self._end, LOOK_INTERVAL)
                item = self._queue[0] if self._queue else None
                end = self._end
            if item is None and end is not None:
                break
            try:
                if item is not None:
                    self._write(item)
                self._look_when_due()
            except Exception as error:  # noqa: BLE001  (the loop raises it)
                self._fail(error)
            with self._changed:
                if item is not None and self._queue:
                    self._queue.popleft()
                    self._bytes -= item.counts.nbytes if isinstance(item, Block) else 0
                self._changed.notify_all()
        try:
            self._finish(end)
        except Exception as error:  # noqa: BLE001  (``close`` raises it)
            self._end_fault = error
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _write(self, item: Block | Event | _Room) -> None:
        modelled = None
        if isinstance(item, Block) and self._model is not None:
            self._modelling = True
            try:
                modelled = self._model(item)
            finally:
                self._modelling = False
        try:
            self._put(item, modelled)
        except LostFile as lost:
            self._go_on(lost)
            if self._fault is None:
                self._put(item, modelled)

    def _put(self, item: Block | Event | _Room, modelled: np.ndarray | None) -> None:
        if isinstance(item, Event):
            self._writer.event(item.sample, item.level, item.message)
        elif isinstance(item, _Room):
            self._writer.room(item.sample, item.temperature, item.humidity)
        else:
            self._writer.append(item, modelled)
            self._next = item.start + item.counts.shape[1]

    def _go_on(self, lost: LostFile) -> None:
        """Go on in a new file, or until the ramp has ended in the one that has lost its place."""
        if not self._new_file:
            self._fault = self._fault or lost
            if not lost.intact:
                self._fail(lost)
            return
        try:
            writer = self._writer.continued(self._next)
        except DearigError as error:
            raise DiskFault(f"{lost}; no new file could be begun: {error}") from error
        self._earlier.append(self._writer)
        message = f"{lost}; the recording goes on in {writer.path} from sample {self._next}"
        self._writer = writer
        writer.event(self._next, "warning", message)
        self._notices.append(Event(self._next, "warning", message))

    def _fail(self, error: Exception) -> None:
        with self._changed:
            self._fault = self._fault or error
            self._dropping = True
            self._queue.clear()
            self._bytes = 0

    def _look_when_due(self) -> None:
        now = self._clock()
        if now - self._looked < LOOK_INTERVAL:
            return
        self._looked = now
        try:
            self._free = self._writer.look()
        except LostFile as lost:
            self._go_on(lost)

    def _finish(self, end: _End) -> None:
        troubles: list[DearigError] = []
        if end.event and self._writer.samples:
            last = self._writer.first_sample + self._writer.samples - 1
            try:
                self._writer.event(last, end.level, end.event)
            except DearigError as error:
                troubles.append(error)
        if not self._writer.samples:
            self._writer.discard()
            if self._earlier:
                self._writer = self._earlier.pop()
        for writer in (*self._earlier, self._writer):
            try:
                writer.close(end.outcome, self.output_state)
            except LostFile as lost:
                if not (lost.intact and self._new_file):
                    troubles.append(lost)
                self._tell(str(lost))
            except DearigError as error:
                troubles.append(error)
            else:
                if writer is not self._writer:
                    first = writer.first_sample
                    self._tell(
                        f"samples {first} to {first + writer.samples - 1} are in {writer.path}"
                    )
        if troubles:
            raise troubles[0]

    def _tell(self, message: str) -> None:
        self._notices.append(Event(max(self._next - 1, 0), "warning", message))
