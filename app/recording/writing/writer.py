"""Write a recording during a run: counts are appended, and a kill loses nothing flushed.

One piece: the order of creating, appending, flushing and closing is what
makes a file survive, and each step relies on the ones before.

The file survives kills at any moment and at every write boundary with the library version of
``layout.LIBVER``, the whole layout created first, then SWMR mode, and flushes of the whole file.
After flushes of single datasets, channels could differ by one flush interval.
"""

from __future__ import annotations

import errno
import logging
import math
import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np

from dearig.drivers.rig import Block, Event, RigIdentity
from dearig.errors import DearigError, DiskFault, InputError
from dearig.output_state import OutputState
from dearig.recording.content.checksums import ChecksumWriter
from dearig.recording.content.layout import (
    EVENT_LEVELS,
    EVENT_TYPE,
    IDENTIFIER,
    LIBVER,
    LINEAR,
    MESSAGE_BYTES,
    WALL_CLOCK_TYPE,
    ZERO_ORDER,
    counts_name,
    counts_type,
    lay_out,
    make_own_scale,
    show_plot,
)
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.content.modelled import ModelledWriter
from dearig.recording.content.physical import Counts, Rest, write_average, write_channel
from dearig.recording.content.provenance import CONTINUES, gather, write_provenance
from dearig.recording.content.pyramid import PyramidWriter
from dearig.recording.content.run_layout import check_channels, sequence_name, write_instruments
from dearig.recording.content.safe import Refused
from dearig.recording.content.sample import write_sample
from dearig.recording.content.text import clip_text, fixed, put_text, text_of
from dearig.recording.files import (
    check_output,
    keep_permissions,
    put_back,
    set_aside,
    system_text,
)
from dearig.recording.lock import ReplacedError, create_locked
from dearig.recording.reading.environment import EnvironmentWriter
from dearig.recording.reading.opening import UNREADABLE, opened
from dearig.recording.writing.check_written import check_written
from dearig.recording.writing.disk_space import advice
from dearig.recording.writing.finish import finish
from dearig.recording.writing.lost_file import LostFile, UnsavedFile, find_loss, free_name, rescued

__all__ = ["FLUSH_INTERVAL", "RecordingWriter"]

log = logging.getLogger(__name__)

#: Least time between two flushes in s; a kill loses at most this much of a run.
FLUSH_INTERVAL = 0.25
#: Free bytes below which a run ends: HDF5 needs them for its last writes. One second is added.
ROOM_LEFT = 2**21


class RecordingWriter:
    """Writer of one run to ``path``; a context manager.

    ``identity`` names the channels in the order of the blocks. ``rate_Hz`` is that of the rows,
    each of which holds sums of ``average`` counts. ``samples_expected`` is only stored, so that a
    reader sees how many samples are missing. Without a title in ``metadata`` the run takes the name
    of its sequence, without a seed that of the identity. With ``overlay`` every block comes with
    the displacement of an overlay model; the metadata's ``model_toml`` has its parameters. With
    ``environment`` there are readings of a thermo-hygrometer, see ``room``. ``now`` returns Unix
    time in s. With ``fsync`` every flush reaches the disk, so that flushed samples survive a power
    cut. A recording that is overwritten stays until the first flush of samples, as ``FILE.h5.old``.
    ``first_sample`` is that of a run which has begun in another file; there its ``rest`` was
    measured.

    Raises ``InputError`` before anything is changed if the file exists (unless ``overwrite``), its
    folder does not, or the sequence is not TOML. ``ValueError`` is a programming error.
    """

    def __init__(
        self,
        path: str | Path,
        identity: RigIdentity,
        rate_Hz: float,
        samples_expected: int,
        metadata: RunMetadata,
        *,
        average: int = 1,
        overwrite: bool = False,
        fsync: bool = False,
        overlay: bool = False,
        environment: bool = False,
        first_sample: int = 0,
        rest: Rest | None = None,
        now: Callable[[], float] = time.time,
    ) -> None:
        if not (math.isfinite(rate_Hz) and rate_Hz > 0.0):
            raise ValueError(f"rate_Hz = {rate_Hz!r} must be a finite number above 0")
        check_channels(identity.channels)
        name = sequence_name(metadata.sequence_toml)
        self._path = check_output(path, overwrite)
        self._identity = identity
        self._channels = identity.channels
        self._metadata = metadata
        self._expected = samples_expected
        self._overlay = overlay
        self._has_environment = environment
        self._first = first_sample
        self._rest = rest
        self._command = [c.name for c in identity.channels].index("voltage_command")
        self._at_rest: np.integer | None = None  # count of the command at the first sample
        self._driven = False  # True once the lead-in at 0 V has ended
        self._lost: LostFile | None = None
        self._size = 0  # bytes after the last flush
        self._rate, self._average = float(rate_Hz), average
        self._type = counts_type(average)
        self._now = now
        self._fsync = fsync
        self._written = self._flushed = self._recorded_events = 0
        self._dirty = False
        self._closed = False
        self._margin = int(ROOM_LEFT + self._type.itemsize * self._rate * len(identity.channels))
        self._failure: DiskFault | None = None

        started = now()
        if metadata.seed is None:
            metadata = replace(metadata, seed=identity.seed)
        provenance = gather(started, metadata)
        provenance["rig"] = identity.address
        provenance["simulated"] = identity.simulated
        with _disk_errors(self._path, InputError):
            self._old = set_aside(self._path) if overwrite else None
        try:
            with _disk_errors(self._path, InputError):
                # fails if another process has created the file since the check
                self._lock = create_locked(self._path)
                if self._old is not None:
                    keep_permissions(self._old, self._path)
            try:
                with _disk_errors(self._path, InputError):
                    self._write_layout(self._laid_out(metadata, name, provenance, started))
            except BaseException:
                self._lock.remove()
                raise
        except BaseException as error:
            if not put_back(self._old, self._path):
                raise InputError(
                    f"{self._path} was taken by another program; the recording that had this name "
                    f"is {self._old}"
                ) from error
            raise
        self._last_flush = now()

    def _laid_out(
        self, metadata: RunMetadata, name: str, provenance: Mapping[str, Any], started: float
    ) -> bytes:
        """Return the content of the file before its first sample.

        It is made in memory. HDF5 crashes when a disk refuses some of its writes, and of others it
        says nothing: the run would go on into a file that nothing can read.
        """
        with h5py.File("layout", "w", libver=LIBVER, driver="core", backing_store=False) as file:
            entry = lay_out(file, "actuator", metadata.title or name, started)
            self._identifier = text_of(entry[IDENTIFIER][()])
            put_text(entry, "sequence", metadata.sequence_toml)
            write_sample(entry, metadata)
            write_provenance(entry, provenance)
            self._lay_out_run(entry)
            self._modelled = ModelledWriter(entry, self._chunk) if self._overlay else None
            if metadata.model_toml:
                put_text(entry, "model", metadata.model_toml)
            self._note_wall_clock(started)
            file.flush()
            return bytes(file.id.get_file_image())

    def _write_layout(self, content: bytes) -> None:
        """Write ``content`` to the new file, and go on in it with HDF5."""
        rest = memoryview(content)
        while rest:
            rest = rest[os.write(self._lock.fd, rest) :]
        # the lock replaces that of HDF5, which ends with the start of SWMR mode
        self._file = h5py.File(self._path, "r+", libver=LIBVER, locking=False)
        self._descriptor = self._file.id.get_vfd_handle()
        self._closes = False
        try:
            entry = self._file["entry"]
            self._counts = [entry["data"][counts_name(c.name)] for c in self._channels]
            self._events, self._wall_clock = entry["events"], entry["wall_clock"]
            for part in (self._pyramid, self._checksums, self._modelled, self._environment):
                if part is not None:
                    part.move_to(entry)
            self._file.swmr_mode = True
            # no later write changes these bytes
            self._mark = (entry[IDENTIFIER].id.get_offset(), self._identifier.encode())
            self._flush()
        except BaseException:
            self._let_go()
            raise

    def _lay_out_run(self, entry: h5py.Group) -> None:
        data = entry["data"]
        data.attrs["rate_Hz"] = self._rate
        write_average(data, self._average, self._rate * self._average)
        data.attrs["samples_expected"] = int(self._expected)
        # about one second: every flush writes a changed chunk again
        self._chunk = chunk = int(min(max(self._rate, 1024), 65536))
        self._counts = []
        for place, channel in enumerate(self._channels):
            counts = data.create_dataset(
                counts_name(channel.name),
                shape=(0,),
                maxshape=(None,),
                chunks=(chunk,),
                dtype=self._type,
            )
            write_channel(counts, channel, place)
            if channel.name == "voltage_command":
                # between means of a voltage that moves in small steps, a line is nearer to it
                counts.attrs["hold"] = fixed(ZERO_ORDER if self._average == 1 else LINEAR)
            if channel.name == "displacement" and self._rest is not None:
                counts.attrs["rest_reading"] = self._rest.reading
                counts.attrs["rest_samples"] = self._rest.samples
            self._counts.append(counts)
        self._events = entry.create_dataset(
            "events", shape=(0,), maxshape=(None,), chunks=(32,), dtype=EVENT_TYPE
        )
        self._pyramid = PyramidWriter(entry, len(self._channels), self._rate, self._type)
        self._checksums = ChecksumWriter(entry, len(self._channels), self._rate)
        self._environment = EnvironmentWriter(entry) if self._has_environment else None
        # created last: a flush writes datasets in this order and stops where the disk refuses one,
        # so that its note is in the file only if all samples up to it are
        self._wall_clock = entry.create_dataset(
            "wall_clock", shape=(0,), maxshape=(None,), chunks=(256,), dtype=WALL_CLOCK_TYPE
        )

        make_own_scale(self._wall_clock)
        show_plot(data, "actuator", live=True)

        write_instruments(entry, self._identity)

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self._path

    @property
    def channels(self) -> int:
        """Number of channels of a block."""
        return len(self._channels)

    @property
    def count_bytes(self) -> int:
        """Bytes of one count of a block."""
        return self._type.itemsize

    @property
    def rate_Hz(self) -> float:  # noqa: N802
        """Rate of the sample clock in Hz."""
        return self._rate

    @property
    def first_sample(self) -> int:
        """Sample of the run that is the first one of this file."""
        return self._first

    @property
    def samples(self) -> int:
        """Samples appended so far."""
        return self._written

    @property
    def samples_flushed(self) -> int:
        """Samples that are safe from a kill."""
        return self._flushed

    @property
    def closed(self) -> bool:
        """True after ``close``."""
        return self._closed

    def append(self, block: Block, modelled: np.ndarray | None = None) -> None:
        """Write the next block and its events, with the displacement ``modelled`` (n,) m.

        Raises ``DiskFault`` if the disk cannot be written.
        """
        counts = block.counts
        if counts.ndim != 2 or counts.shape[0] != len(self._channels) or counts.dtype != self._type:
            raise ValueError(
                f"a block holds {self._type} counts ({len(self._channels)}, n), "
                f"not {counts.dtype} {counts.shape}"
            )
        due = self._first + self._written
        if block.start != due:
            raise ValueError(f"a block starts at sample {block.start}, not at {due}")
        if (modelled is None) != (self._modelled is None):
            raise ValueError("an overlay model is recorded from the first block to the last")
        end = self._written + counts.shape[1]
        with self._writing():
            self._check_room()
            for dataset, row in zip(self._counts, counts, strict=True):
                dataset.resize((end,))
                dataset[self._written : end] = row
            if not self._driven and counts.size:
                # a run begins at 0 V; its count is not 0 where the amplifier has an offset
                command = counts[self._command]
                first = command[0] if self._at_rest is None else self._at_rest
                self._at_rest, self._driven = first, bool((command != first).any())
            self._pyramid.add(counts)
            self._checksums.add(counts)
            if self._modelled is not None and modelled is not None:
                self._modelled.append(modelled)
            self._written = end
            self._dirty = True
            self._append_events(block.events)
            self._flush_when_due()

    def event(self, sample: int, level: str, message: str) -> None:
        """Record an event at ``sample``; ``level`` is info, warning or fault."""
        with self._writing():
            self._append_events((Event(sample, level, message),))
            self._flush_when_due()

    def room(self, sample: int, temperature: float, humidity: float) -> None:
        """Record a reading before ``sample``: degrees Celsius and per cent, NaN for no value."""
        if self._environment is None:
            raise ValueError("a recording without readings of the room cannot take one")
        with self._writing():
            at = max(sample - self._first, 0)
            self._environment.append(at, self._now(), temperature, humidity)
            self._dirty = True
            self._flush_when_due()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Guard a write to the file; after a failure nothing more is written."""
        if self._failure is not None:
            raise self._failure
        try:
            with _disk_errors(self._path):
                yield
        except LostFile as lost:
            raise self._give_up(lost) from lost
        except DiskFault as error:
            self._let_go()
            # so that the file can be recovered
            self._lock.release()
            self._written = self._flushed
            self._failure = DiskFault(
                f"{error}; the {self._flushed} samples until then are in the file, as counts: "
                f"free some space, then recover it",
                command=("recover", str(self._path)),
            )
            raise self._failure from error

    def _give_up(self, lost: LostFile) -> LostFile:
        """Write no more to a file whose content another program has changed; return the fault."""
        self._let_go()
        self._lock.release()
        try:
            with opened(self._path) as file:
                self._written = Counts(file["entry"]).samples
        except (InputError, Refused, *UNREADABLE):
            self._written = 0
        self._flushed = self._written
        left = f"{self._written} samples" if self._written else "nothing"
        self._failure = fault = LostFile(f"{lost}; {left} of what was in it can be read")
        fault.intact = False
        return fault

    def look(self) -> int:
        """Return the free bytes of the disk, and see whether the file is what and where it was.

        Raises ``LostFile`` once if it is not, and ``DiskFault`` where the disk does not answer.
        """
        folder = self._path.parent
        try:
            lost = self._newly_lost()
            if lost is None:
                self._find_rest()
            free = self._free()
        except OSError as error:
            raise DiskFault(
                f"the disk of {folder} does not answer ({system_text(error)}); check that it is "
                f"connected"
            ) from error
        if lost is not None:
            raise lost if lost.intact else self._give_up(lost)
        return free

    def _find_rest(self) -> None:
        """Measure the rest for a file that has to continue this one, while this can be read."""
        if self._rest is None and self._failure is None and self._driven:
            self._rest = Counts(self._file["entry"], self._written).measured_rest()

    def _newly_lost(self) -> LostFile | None:
        if self._lost is not None:
            return None
        self._lost = find_loss(self._lock, self._path, self._size, self._mark)
        return self._lost

    def continued(self, first_sample: int) -> RecordingWriter:
        """Return the writer of a new file next to it, for the samples from ``first_sample`` on.

        Raises ``InputError`` where no file can be created.
        """
        from_here = {CONTINUES: str(self._path), "continues_from_sample": first_sample}
        return RecordingWriter(
            free_name(self._path, "continued"),
            self._identity,
            self._rate,
            max(self._expected - (first_sample - self._first), 0),
            replace(self._metadata, provenance={**self._metadata.provenance, **from_here}),
            average=self._average,
            fsync=self._fsync,
            overlay=self._overlay,
            environment=self._has_environment,
            first_sample=first_sample,
            rest=self._rest,
            now=self._now,
        )

    def _check_room(self) -> None:
        # checked before each write: on a full disk the order of HDF5's writes is not defined
        if self._free() < self._margin:
            raise OSError(errno.ENOSPC, "no space for the next second")

    def _free(self) -> int:
        # by the open file where the system can: it may have no path any more
        at = self._lock.fd if hasattr(os, "fstatvfs") else self._path.parent
        return shutil.disk_usage(at).free

    def _let_go(self) -> None:
        """Close the file as a kill would: not another byte is written to it.

        HDF5 cannot close a file that it cannot write, and crashes the program when it exits. So its
        last writes go to the null device. A file whose close has failed is not closed again: that
        crashes the program at once.
        """
        # not to another file: the same disk or the same limit could refuse that too
        with Path(os.devnull).open("r+b") as null:
            os.dup2(null.fileno(), self._descriptor)
            if self._closes:
                return
            try:
                self._close_file()
            except (OSError, RuntimeError):
                log.debug("%s could not be closed in order", self._path)

    def _close_file(self) -> None:
        self._closes = True
        self._file.close()

    def _append_events(self, events: tuple[Event, ...]) -> None:
        if not events:
            return
        rows = np.zeros(len(events), dtype=EVENT_TYPE)
        for i, event in enumerate(events):
            if event.level not in EVENT_LEVELS:
                raise ValueError(
                    f"event level {event.level!r} is not one of {', '.join(EVENT_LEVELS)}"
                )
            sample = max(event.sample - self._first, 0)
            rows[i] = (
                sample,
                sample / self._rate,
                event.level.encode(),
                clip_text(event.message, MESSAGE_BYTES),
            )
        first = self._recorded_events
        self._events.resize((first + len(events),))
        self._events[first:] = rows
        self._recorded_events += len(events)
        self._dirty = True

    def _flush_when_due(self) -> None:
        # a negative time is due too: flushing must go on if the clock is set back
        moment = self._now()
        if self._dirty and not 0.0 <= moment - self._last_flush < FLUSH_INTERVAL:
            self._flush_all(moment)
            self._last_flush = self._now()

    def _flush_all(self, moment: float) -> None:
        self._write_pending(moment)
        self._flush()
        self._all_safe()

    def _write_pending(self, moment: float) -> None:
        self._pyramid.write()
        self._checksums.write()
        self._note_wall_clock(moment)

    def _all_safe(self) -> None:
        self._flushed = self._written
        self._dirty = False
        if self._old is not None and self._flushed:
            # from here on the new file has samples in its place
            self._old.unlink(missing_ok=True)
            self._old = None

    def _note_wall_clock(self, moment: float) -> None:
        n = self._wall_clock.shape[0]
        self._wall_clock.resize((n + 1,))
        self._wall_clock[n] = (self._written, moment)

    def _flush(self) -> None:
        if os.fstat(self._lock.fd).st_size < self._size:
            raise LostFile(f"another program cut {self._path} short during the run")
        self._file.flush()
        if self._fsync:
            os.fsync(self._file.id.get_vfd_handle())
        self._size = os.fstat(self._lock.fd).st_size

    def close(self, outcome: str = "finished", output_state: OutputState | None = None) -> None:
        """Finish the recording: physical values, end time, sample count; calling it again is fine.

        ``outcome`` is a sentence on how the run ended, ``output_state`` what was known of the rig's
        output after it. A file that is no more in its place is
        finished where it is, or as a copy; ``path`` is that one then. Raises ``DiskFault``
        if the physical values cannot be written, with the counts in the file, and if the finished
        file is not what was written; ``LostFile`` if ``look`` has not told of it.
        """
        if self._closed:
            return
        self._closed = True
        with self._lock:
            with self._writing():
                lost = self._newly_lost()
                if lost is not None and not lost.intact:
                    raise lost
            self._finish(outcome, output_state)
        if lost is not None:
            raise LostFile(f"{lost}; it is saved as {self._path}")

    def _finish(self, outcome: str, output_state: OutputState | None) -> None:
        moment = self._now()
        with self._writing():
            self._write_pending(moment)
            self._flush()
            self._close_file()
        self._all_safe()
        lock = self._lock
        if self._lost is not None:
            try:
                self._path, lock = rescued(self._lock, self._path)
            except (OSError, InputError) as error:
                clause = f"no copy could be saved ({system_text(error)}): what was recorded is lost"
                unsaved = UnsavedFile(f"{self._lost}; {clause}")
                unsaved.clause = clause
                raise unsaved from error
        try:
            with lock:
                finish(
                    self._path,
                    lock=lock,
                    identifier=self._identifier,
                    complete=True,
                    outcome=outcome,
                    output_state=output_state,
                    ended=moment,
                    fsync=self._fsync,
                )
        except ReplacedError as error:
            raise DiskFault(str(error)) from error
        except InputError as error:
            raise DiskFault(
                f"{error}; the whole run is in the file, as counts: free some space and recover it"
            ) from error
        with _disk_errors(self._path):
            check_written(self._path, self._identifier, self._written, self._checksums.values())

    def discard(self) -> None:
        """Delete the file of a run without samples, and restore the one that it would replace."""
        if not self._closed:
            self._closed = True
            if self._failure is None:
                self._let_go()
            if isinstance(self._failure, LostFile):
                return  # what is there is another program's
            self._lock.remove()
            if not put_back(self._old, self._path):
                log.warning(
                    "%s was taken by another program; the recording that had this name is %s",
                    self._path,
                    self._old,
                )

    def __enter__(self) -> RecordingWriter:
        """Return the writer."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close; a run that failed before its first sample leaves no file."""
        if error is None:
            self.close()
        elif self._failure is not None:
            self._closed = True
        elif not self._closed and self._written == 0:
            self.discard()
        else:
            self.close(f"ended early: {error or type(error).__name__}")


@contextmanager
def _disk_errors(path: Path, kind: type[DearigError] = DiskFault) -> Iterator[None]:
    """Turn an ``OSError`` or ``RuntimeError`` of HDF5 into a ``kind`` with a sentence."""
    try:
        yield
    except FileExistsError as error:
        raise InputError(f"{path} exists already; choose another name") from error
    except (OSError, RuntimeError) as error:
        raise kind(f"{path} cannot be written: {system_text(error)}; {advice(error)}") from error
