"""A run: sequence, gate, rig and recording, with interlocks on every sample and 0 V at its end.

The loop that reads the rig touches no disk and no terminal: both can stall, and a voltage is up.
"""

from __future__ import annotations

import logging
import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from dearig.acquisition import ending
from dearig.acquisition.check import check_rig
from dearig.acquisition.event_log import EventLog
from dearig.acquisition.feedback import Feedback, FeedbackLoop
from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.marks import RunMarks
from dearig.acquisition.output import LastSamples, after_run, unknown
from dearig.acquisition.overlay import Overlay, OverlayModel
from dearig.acquisition.plan import plan
from dearig.acquisition.rigs import check_address, is_simulated, options_of
from dearig.acquisition.room import RoomOfRun, open_room
from dearig.acquisition.run_parts import RunObserver, RunOptions, RunResult
from dearig.clock import ClockWatch
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import LoadedSequence
from dearig.drivers.errors import AddressError, NotAtZero, RefusedWaveform, RigError
from dearig.drivers.interlocks import Interlocks, Trip
from dearig.drivers.rig import Block, Event, Rig
from dearig.drivers.row_means import RowMeans, row_channels
from dearig.errors import (
    DearigError,
    InputError,
    InstrumentFault,
    Interrupted,
    NotSafe,
    SafetyStop,
)
from dearig.model.errors import ModelError
from dearig.output_state import Known, OutputState
from dearig.progress import Progress, quiet
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.files import check_output
from dearig.recording.writing.disk_space import check_room
from dearig.recording.writing.lost_file import LostFile, UnsavedFile
from dearig.recording.writing.recorder import Recorder
from dearig.recording.writing.writer import RecordingWriter

__all__ = ["RunObserver", "RunOptions", "RunResult", "open_rig", "record"]

log = logging.getLogger(__name__)

#: Time in s at 0 V after which a message says that the program still waits for the disk.
_TELL_AFTER = 5.0
#: Number of ctrl-C after which the run stops waiting for the disk, or for the guardian.
_GIVE_UP = 2
_GUARDIAN_POLL = 0.25  # s between two looks at what the operator asks


_DEFAULT = RunOptions()


def open_rig(address: str, rig_file: RigFile, options: RunOptions = _DEFAULT) -> Rig:
    """Open the rig at ``address`` and return it.

    Only the ``options`` for a simulated rig are used. Raises ``InputError`` for an address that
    names no rig and for options that it does not take, ``InstrumentFault`` where the instruments
    are missing.
    """
    kind = check_address(address, rig_file, options)
    if not kind.simulated:
        checked = check_rig(address, rig_file)
        checked.refuse_without_watchdog()
        checked.refuse()
    wanted = replace(
        options_of(rig_file),
        actuator=options.actuator,
        seed=options.seed,
        paced=options.paced,
        faults=options.fault_plan,
    )
    try:
        rig = kind.open(address, rig_file, wanted)
    except AddressError as error:
        raise InputError(str(error)) from error
    except ValueError as error:  # a film without a rest state
        raise InputError(f"rig {address!r} with this rig file: {error}") from error
    except RigError as error:
        fault = InstrumentFault(str(error))
        if isinstance(error, NotAtZero):
            fault.output_state = unknown(monitor=error.voltage)
        raise fault from error
    if not isinstance(rig, Rig):
        raise InstrumentFault(
            f"rig {address!r}: its driver returned a {type(rig).__name__}, which is not a rig; "
            f"nothing was started"
        )
    return rig


def record(
    loaded: LoadedSequence,
    address: str,
    rig_file: RigFile,
    out: str | Path,
    options: RunOptions = _DEFAULT,
    *,
    overlay: OverlayModel | None = None,
    observer: RunObserver | None = None,
    interrupts: Interrupts | None = None,
    marks: RunMarks | None = None,
    progress: Progress = quiet,
    clock: Callable[[], float] = time.monotonic,
    feedback: Feedback | None = None,
) -> RunResult:
    """Play ``loaded`` on the rig at ``address`` and record it to ``out``.

    ``overlay`` is a model that runs in step with the data and is recorded with them; ``observer``
    receives them. ``interrupts`` lets another thread end the run; by default ctrl-C does. ``marks``
    lets other threads set marks and notes, which are recorded as events. ``feedback`` corrects the
    voltage while it is played, see ``dearig.acquisition.feedback``.

    A room out of its limits is a ``SafetyStop`` before anything is started.

    Raises ``InputError`` before anything is changed. After the rig was made safe and the recording
    was closed, it raises ``SafetyStop`` where an interlock ended the run, ``InstrumentFault`` or
    ``DiskFault`` where an instrument or the disk failed, and ``Interrupted`` where the operator
    ended it: the first ctrl-C ramps down in the set time, the second takes the output to 0 V at
    once.
    """
    # One piece: what is opened here is closed here in the reverse order, whatever happens between.
    out = check_output(out, options.overwrite)
    planned = plan(loaded, rig_file, options.actuator, options.film_id, progress)
    waveform = planned.admitted()
    if options.waveform_digest not in ("", waveform.digest):
        raise InputError(
            f"sequence {planned.name!r} is not the one that was armed: its voltage has changed "
            f"since the plan was shown; look at the new plan, then arm it again"
        )
    loop = None
    if feedback is not None:
        loop = FeedbackLoop(
            feedback, planned, rig_file, options.actuator, options.film_id, progress
        )
        waveform = loop.gate.waveform
    if overlay is not None:
        overlay.compile()
    rig = open_rig(address, rig_file, options)
    room = RoomOfRun(None, None)
    try:
        room = open_room(address, rig_file, options.seed, options.fault_plan)
        room.check()
        if loop is not None and not getattr(rig, "plays_growing_waveforms", False):
            raise InputError(f"rig {address!r}: its driver cannot correct a run while it goes on")
        with interrupts or Interrupts() as interrupts:
            try:
                # conversions go to interlocks and feedback, rows to recording and observers
                conversion_rate = rig.load(waveform)
                waveform.check_rate(conversion_rate)  # for drivers that do not
                identity = rig.identify()
                channels = identity.channels
                rows = RowMeans(rig_file.card.average)
                rate = conversion_rate / rows.average
                identity = replace(identity, channels=row_channels(channels, rows.average))
                room.begin(rate)
                if loop is not None:
                    loop.begin(channels)
            except RefusedWaveform as error:
                raise InputError(f"the rig refuses the sequence: {error}") from error
            except RigError as error:
                raise InstrumentFault(str(error)) from error
            samples = rows.row(waveform.samples)
            if not samples:
                raise InputError(
                    f"sequence {planned.name!r} is shorter than one row of the recording, which "
                    f"is the mean of card.average = {rows.average} conversions: make it longer"
                )
            check_room(out, len(channels), rate, samples, rows.average)
            stepped = None
            if overlay is not None:
                try:
                    stepped = Overlay(
                        overlay.actuator, identity.channels, rate, average=rows.average
                    )
                except ModelError as error:
                    raise InputError(f"the overlay model: {error}") from error
            metadata = RunMetadata(
                film=rig_file.as_film(),
                load=rig_file.as_load(),
                film_id=options.film_id or rig_file.film.name,
                notes=options.notes,
                operator=options.operator,
                sequence_toml=loaded.toml,
                model_toml=overlay.toml if overlay is not None else "",
                configuration=options.configuration,
                seed=options.seed if is_simulated(address) else None,
                provenance={
                    **options.provenance,
                    **({} if loop is None else {"feedback": loop.toml()}),
                },
            )
            writer = RecordingWriter(
                out, identity, rate, samples, metadata, average=rows.average,
                overwrite=options.overwrite, fsync=options.fsync, overlay=stepped is not None,
                environment=room.exists,
            )  # fmt: skip
            observer = observer or RunObserver()
            observer.started(planned, identity, rate)
            interlocks = Interlocks(
                rig_file if loop is None else loop.watched(),
                channels,
                conversion_rate,
                planned.displacement_of_samples,
                waveform,
                laser_grace=0.0 if feedback is None else feedback.laser_loss,
            )
            recorder = Recorder(
                writer,
                ramp_s=rig_file.limits.ramp_down_s,
                model=None if stepped is None else stepped.advance,
                waits=is_simulated(address) and not options.paced,
                new_file=rig_file.recording.lost_file == "new_file",
                hurried=interrupts.asked,
                clock=clock,
            )
            with EventLog() as event_log:
                last = LastSamples(channels, rig_file.limits.zero_tolerance_kV * 1e3)
                run = _Run(
                    rig, rows, recorder, interlocks, interrupts, marks or RunMarks(), observer,
                    event_log, last, progress, clock, loop, room,
                )  # fmt: skip
                try:
                    events = run.follow(samples)
                except DearigError as error:
                    error.output_state = run.output_state
                    raise
        return RunResult(
            recorder.path, recorder.samples, rate, "finished", events,
            waveform.margins if loop is None else loop.gate.margins, run.output_state,
            None if loop is None else loop.report(), rows.average,
        )  # fmt: skip
    finally:
        try:
            ending.close(rig, sys.exc_info()[1])
        finally:
            room.close()


class _Run:
    """One run of a loaded rig: playing, checking and recording."""

    def __init__(
        self,
        rig: Rig,
        rows: RowMeans,
        recorder: Recorder,
        interlocks: Interlocks,
        interrupts: Interrupts,
        marks: RunMarks,
        observer: RunObserver,
        event_log: EventLog,
        last: LastSamples,
        progress: Progress,
        clock: Callable[[], float],
        loop: FeedbackLoop | None,
        room: RoomOfRun,
    ) -> None:
        self._rig = rig
        self._rows = rows
        self._room = room
        self._loop = loop
        self._recorder = recorder
        self._interlocks = interlocks
        self._interrupts = interrupts
        self._marks = marks
        self._observer = observer
        self._event_log = event_log
        self._last = last
        self.output_state = unknown()  # until it is at 0 V
        self._unknown_since: float | None = None
        self._progress = progress
        self._clock = clock
        self._clock_watch = ClockWatch()
        self._unread = 0.0  # s of samples that wait for this program
        self._events: list[str] = []
        self._trip: Trip | None = None  # the first one; later ones follow from it
        self._waiting_since: float | None = None  # for the disk, at 0 V
        self._asked_before = 0  # calls to end the run before it waited for the disk

    def follow(self, samples: int) -> tuple[str, ...]:
        """Play and record; every exit takes the rig to 0 V first and then closes the file."""
        recorder = self._recorder
        try:
            played = False
            try:
                self._play(samples)
                played = self._trip is None and not self._interrupts.asked()
            except RigError:
                # setting 0 V may take seconds on a link that is lost: the last reading is old
                self._show_output(unknown())
                raise
            finally:
                # 0 V first: a disk that is slow or full must not keep the voltage up
                self._interrupts.close()
                try:
                    self._bring_to_zero(played)
                finally:
                    self._note_events(self._marks.close())
                    self._report_feedback()
            if self._trip is not None:
                kept = self._end(f"stopped by an interlock: {self._trip.message}")
                raise SafetyStop(
                    f"{self._trip.message}; {_DONE[self._trip.action]} to 0 V, and {kept}"
                )
            if self._interrupts.at_once():
                raise self._ended_at_once()
            if self._interrupts.asked():
                kept = self._end(f"interrupted {self._interrupts.reason}; ramped down to 0 V")
                raise self._interrupted(f"the voltage was ramped down to 0 V, and {kept}")
            recorder.drain(self._given_up, self._progress)
            recorder.check()
            if recorder.samples == 0:
                raise InstrumentFault(f"the rig gave no samples; {self._end('no samples')}")
            recorder.close("finished", given_up=self._given_up, progress=self._progress)
            self._tell_notices()
        except KeyboardInterrupt as error:
            raise self._ended_at_once() from error
        except RigError as error:
            kept = self._end(f"instrument fault: {error}", f"instrument fault: {error}", "fault")
            raise InstrumentFault(f"{error}; the rig was made safe, and {kept}") from error
        except DearigError as error:
            if recorder.closed:
                raise
            kept = self._end(f"ended early: {error}", f"ended early: {error}", "fault", error)
            safe = "" if isinstance(error, NotSafe) else "the rig was made safe, and "
            raise type(error)(f"{error}; {safe}{kept}") from error
        finally:
            # only an unexpected exception reaches this with an open file
            self._end("ended early by a fault of the program")
        return tuple(self._events)

    def _ended_at_once(self) -> Interrupted:
        how = f"interrupted {self._interrupts.reason}"
        kept = self._end(how, f"{how}: 0 V at once")
        return self._interrupted(f"the output was taken to 0 V at once, and {kept}")

    def _interrupted(self, done: str) -> Interrupted:
        interrupts = self._interrupts
        why = "" if interrupts.by_operator else f" {interrupts.reason}"
        return Interrupted(f"interrupted{why}: {done}")

    def _play(self, samples: int) -> None:
        rig, recorder, interrupts = self._rig, self._recorder, self._interrupts
        self._progress("recording", 0.0)  # a display is made ready before there is a voltage
        rig.arm()
        if interrupts.asked():
            return
        rig.start()
        self._marks.reach(0)
        try:
            stopping = False
            while (block := rig.read()) is not None:
                if not stopping and getattr(rig, "ramping", False):
                    self._observer.ramping()
                self._take(block)
                self._progress("recording", recorder.received / samples)
                trip = self._watch(block)
                if (trip is not None and trip.action == "at once") or interrupts.at_once():
                    return
                if stopping:
                    continue
                trip = trip or self._correct(block)
                if (fault := recorder.fault) is not None:
                    what = fault if isinstance(fault, DearigError) else "an error of the program"
                    self._note(recorder.received, "fault", f"{what}: ramping down to 0 V")
                elif interrupts.asked() and trip is None:
                    self._note(
                        recorder.received,
                        "warning",
                        f"interrupted {interrupts.reason}: ramping down to 0 V",
                    )
                elif trip is None:
                    continue
                stopping = True
                rig.stop()
                self._observer.ramping()
        except (RigError, KeyboardInterrupt):
            raise
        except BaseException:
            # the instruments work: after an error of the program the voltage is ramped down
            ending.ramp_down(rig)
            raise

    def _take(self, block: Block) -> None:
        self._last.take(block)
        rows = self._rows.take(block)
        if rows.counts.shape[1]:
            self._recorder.append(rows)
            self._observer.block(rows)
            for event in rows.events:
                self._tell(event)
        else:
            self._note_events(list(rows.events))
        self._note_events(self._marks.reach(self._recorder.received))

    def _watch(self, block: Block) -> Trip | None:
        """Return the interlock that trips now, if any; every one is recorded as an event."""
        self._tell_notices()
        if change := self._clock_watch.change():
            self._note(self._recorder.received, "warning", change)
        free = self._recorder.free_bytes()
        # every conversion is checked, not the mean of a row
        trips = [self._in_rows(trip) for trip in self._interlocks.watch(block)]
        self._unread = self._rig.waiting
        late = self._interlocks.late(self._unread)
        full = None if free is None else self._interlocks.disk(free)
        trips += [trip for trip in (late, full) if trip is not None]
        trips += self._look_at_room()
        for trip in trips:
            self._note_trip(trip)
        if not trips:
            return None
        # the stronger action is taken
        return next((trip for trip in trips if trip.action == "at once"), trips[0])

    def _look_at_room(self) -> list[Trip]:
        """Record and show a new reading of the room; return the interlocks that it trips."""
        readings, events, trips = self._room.take(self._recorder.received)
        for sample, reading in readings:
            self._recorder.room(sample, reading.temperature, reading.humidity)
            self._observer.room(sample / self._recorder.rate, reading)
        self._note_events(events)
        return trips

    def _correct(self, block: Block) -> Trip | None:
        """Let the feedback answer ``block``; return a trip where the run must end."""
        if self._loop is None:
            return None
        answers, events, trip = self._loop.take(block, self._unread)
        for at, answer in answers:
            self._observer.answered(at, answer)
        for event in events:
            self._note(self._rows.row(event.sample), event.level, event.message)
        if trip is not None:
            trip = self._in_rows(trip)
            self._note_trip(trip)
        return trip

    def _in_rows(self, trip: Trip) -> Trip:
        """Return ``trip``, which counts in conversions, at its row."""
        return replace(trip, sample=self._rows.row(trip.sample))

    def _report_feedback(self) -> None:
        """Record what the feedback did, whatever ended the run."""
        if self._loop is not None and self._recorder.received:
            self._note(self._recorder.received - 1, "info", self._loop.report().sentence)

    def _note_trip(self, trip: Trip) -> None:
        self._note(trip.sample, "fault", f"interlock {trip.interlock}: {trip.message}")
        self._trip = self._trip or trip

    def _note(self, sample: int, level: str, message: str) -> None:
        event = Event(sample, level, message)
        self._recorder.event(sample, level, message)
        self._tell(event)

    def _note_events(self, events: list[Event]) -> None:
        for event in events:
            self._note(event.sample, event.level, event.message)

    def _end(
        self,
        outcome: str,
        event: str = "",
        level: str = "warning",
        said: DearigError | None = None,
    ) -> str:
        """Close the recording of a run that ended early, and return a clause that names its file.

        A disk that fails here too is reported with it, and must not hide what ended the run.
        ``said`` is an error that the caller reports.
        """
        recorder = self._recorder
        if recorder.closed:
            return f"what was recorded is in {recorder.path}"
        trouble = recorder.fault
        try:
            recorder.close(outcome, event, level, given_up=self._given_up, progress=self._progress)
        except DearigError as error:
            trouble = error
        if isinstance(trouble, UnsavedFile):
            return trouble.clause if isinstance(said, LostFile) else str(trouble)
        if recorder.samples == 0:
            none = f"none of the samples is in {recorder.path}"
            where = none if recorder.received else "nothing was recorded"
        else:
            where = f"what was recorded is in {recorder.path} ({recorder.samples} samples)"
        return where if trouble is None or trouble is said else f"{where}; {trouble}"

    def _given_up(self) -> bool:
        """Return whether the operator stops waiting for the disk: has asked for it twice."""
        asked = self._interrupts.count
        if self._waiting_since is None:
            self._waiting_since, self._asked_before = self._clock(), asked
        elif self._clock() - self._waiting_since > _TELL_AFTER:
            self._waiting_since = math.inf
            log.warning(
                "the output is at 0 V; %s; press ctrl-C twice to stop waiting",
                self._recorder.left_text,
            )
        return asked - self._asked_before >= _GIVE_UP

    def _bring_to_zero(self, played: bool) -> None:
        """Take the rig to 0 V, and record what is known of its output then.

        ``played`` is True for a waveform that was played to its end. Raises ``NotSafe`` where 0 V
        could not be set, and ``InstrumentFault`` where the guardian alone could.
        """
        rig, failure = self._rig, None
        try:
            ending.make_safe(rig)
        except NotSafe as error:
            failure = error
            self._show_output(unknown(rig))
            self._await_guardian()
        acted = getattr(rig, "taken_over", None)
        at = max(self._recorder.received - 1, 0)
        if acted is not None:
            self._note(at, "fault", acted.sentence)
        state = after_run(rig, self._last, failed=failure is not None)
        self._show_output(state)
        state = self.output_state  # with the time that was shown
        event = Event(at, _LEVELS[state.known], f"output: {state.sentence}")
        if played and state.confirmed:
            self._event_log.add(event)  # the recording has it as attributes
        else:
            self._note(event.sample, event.level, event.message)
        if failure is not None:
            if not state.confirmed:
                raise failure
            raise InstrumentFault(f"{failure.__cause__}; {state.sentence}") from failure

    def _show_output(self, state: OutputState) -> None:
        if state.known is Known.UNKNOWN and state.monitor is None:
            # what is unknown has been so since it was first: one time for everything that says it
            if self._unknown_since is None:
                self._unknown_since = state.at
            state = replace(state, at=self._unknown_since)
        self.output_state = self._recorder.output_state = state
        self._observer.output(state)

    def _await_guardian(self) -> None:
        """Wait for a guardian that goes on trying, until the operator has asked for the end twice.

        Its outcome belongs in the recording, which is closed after this.
        """
        rig, asked = self._rig, self._interrupts.count
        if not getattr(rig, "guardian_tries", False):
            return
        log.warning(
            "0 V IS NOT CONFIRMED: switch the amplifier's high voltage off by hand; waiting for "
            "the guardian; press ctrl-C twice to stop waiting for it"
        )
        while rig.guardian_tries and self._interrupts.count - asked < _GIVE_UP:  # type: ignore[attr-defined]
            rig.await_guardian(_GUARDIAN_POLL)  # type: ignore[attr-defined]

    def _tell_notices(self) -> None:
        for event in self._recorder.notices():
            self._tell(event)

    def _tell(self, event: Event) -> None:
        self._events.append(f"{event.level}: {event.message}")
        self._event_log.add(event)
        self._observer.event(event)


_LEVELS = {Known.CONFIRMED: "info", Known.COMMANDED: "warning", Known.UNKNOWN: "fault"}
_DONE = {"ramp": "the voltage was ramped down", "at once": "the output was taken at once"}
