"""Rig on a DAQmx card: output and inputs on one sample clock, guarded by a second process."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from dearig.drivers.command import Command
from dearig.drivers.daqmx.address import Address
from dearig.drivers.daqmx.explain import ABORTED, RESERVED, TIMEOUT, WATCHDOG_EXPIRED, explained
from dearig.drivers.daqmx.guardian import Guardian, GuardianProcess, TakeOver
from dearig.drivers.daqmx.link import Link
from dearig.drivers.daqmx.outputs import Outputs
from dearig.drivers.daqmx.tasks import ClockedTasks, identify_card
from dearig.drivers.errors import NotAtZero, RigError, RigStateError
from dearig.drivers.gate import GatedWaveform
from dearig.drivers.identity import instruments
from dearig.drivers.rig import Block, Event, RigIdentity, RigState, expect
from dearig.drivers.settings import RigSettings
from dearig.drivers.zero_reading import ZeroReading

__all__ = ["DaqmxRig", "open_daqmx_rig"]

log = logging.getLogger(__name__)

_BLOCK = 0.1  # s; the library's users recommend ten reads a second
_WAIT = 0.25  # s for samples, between two beats of the guardian
_OVERDUE = 2.0  # s without a sample while the clock should run
_UNGUARDED = "no answer from the guardian process"
# errors of a run whose tasks the guardian is about to end, or has just ended
_TAKEN = (*ABORTED, RESERVED, WATCHDOG_EXPIRED)
_REPORT_WITHIN = 0.5  # s from such an error to the guardian's report
_REPORTED_WITHIN = 0.05  # s, after any other error, for a report that has arrived


def open_daqmx_rig(
    address: str, settings: RigSettings, *, block_samples: int | None = None
) -> DaqmxRig:
    """Return the rig at ``address``, its output at 0 V, with its guardian process.

    Raises ``AddressError`` for an invalid address, ``RigError`` where the card, its driver or its
    server is missing.
    """
    where = Address.parse(address)
    return DaqmxRig(where, settings, GuardianProcess(where, settings), block_samples=block_samples)


class DaqmxRig:
    """Rig on the card at ``address``; see ``dearig.drivers.rig.Rig``. All methods are thread-safe.

    Blocks hold ``block_samples`` samples, or a tenth of a second where that is None. ``clock``
    measures the time without samples.
    """

    plays_growing_waveforms = True

    def __init__(
        self,
        address: Address,
        settings: RigSettings,
        guardian: Guardian,
        *,
        block_samples: int | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._address = address
        self._settings = settings
        self._guardian = guardian
        self._block_samples = block_samples
        self._clock = clock
        self._lock = threading.RLock()
        self._state = RigState.SAFE
        self._tasks: ClockedTasks | None = None
        self._run: _Run | None = None
        self._engaged = False  # True while what holds the card may be this rig's own
        self._watched = False  # True from ``arm`` to the end of ``make_safe``
        self._link = Link(address.server, settings)
        self._outputs = Outputs(self._link, address.device, settings)
        try:
            self._card = identify_card(self._link, address.device, settings)
            # a program that died earlier may have left a voltage; one that still runs holds the
            # card, and is not disturbed
            self._outputs.zero()
        except RigError:
            self._guardian.close()
            self._outputs.close()
            self._link.close()
            raise

    @property
    def state(self) -> RigState:
        """Return the state of the rig."""
        return self._state

    @property
    def taken_over(self) -> TakeOver | None:
        """Return what the guardian did since the rig was armed, None if it did nothing."""
        return self._guardian.report()

    @property
    def zero_reading(self) -> ZeroReading | None:
        """Return the voltage monitor's reading after 0 V was set last, None where it failed."""
        return self._outputs.zero_reading

    @property
    def ramping(self) -> bool:
        """Return True once the run has been stopped, such as for a guardian without an answer."""
        run = self._run
        return run is not None and run.stopped

    @property
    def guardian_tries(self) -> bool:
        """Return True while the guardian still tries to set 0 V, after ``make_safe`` failed."""
        return self._guardian.tries

    def await_guardian(self, within: float) -> TakeOver | None:
        """Return the outcome of these tries, waiting up to ``within`` s for it."""
        return self._guardian.outcome(within)

    @property
    def waiting(self) -> float:
        """Return the reader's delay in s: samples that were acquired and not read."""
        with self._lock, self._guardian_named():
            if self._state is not RigState.RUNNING or self._run is None or self._tasks is None:
                return 0.0
            return self._tasks.waiting() / self._run.rate

    def identify(self) -> RigIdentity:
        """Return the rig's instruments; the output does not change."""
        with self._lock:
            expect(self._state, "identify", *(s for s in RigState if s is not RigState.CLOSED))
        return RigIdentity(
            address=str(self._address),
            simulated=self._card.simulated,
            instruments=instruments(
                self._settings,
                card_model=self._card.model,
                card_serial=self._card.serial,
                unnamed="not given",
            ),
            channels=self._card.channels,
        )

    def load(self, waveform: GatedWaveform) -> float:
        """Load a waveform that has passed the gate; returns the actual sample rate in Hz.

        Raises ``RigError`` for a waveform that passed under wider limits than this rig's, or that
        the card cannot play, and ``RefusedWaveform`` where the card has only another rate.
        """
        if not isinstance(waveform, GatedWaveform):
            raise TypeError(
                f"a rig plays a GatedWaveform, which drivers.gate.admit makes, "
                f"not {type(waveform).__name__}"
            )
        with self._lock, self._guardian_named():
            expect(self._state, "load", RigState.SAFE, RigState.DONE)
            self._expect_not_taken("load")
            waveform.check_within(self._settings.limits.gate_limits(waveform.limits.film))
            self._drop_tasks()
            self._engaged = True
            tasks = ClockedTasks(self._link, self._address.device, self._settings)
            try:
                command = Command(waveform, self._card.channels[0].scaling)
                rate = tasks.prepare(command, waveform.rate)
                waveform.check_rate(rate)
            except BaseException:
                tasks.close()
                raise
            self._tasks = tasks
            self._run = _Run(command, rate)
            self._state = RigState.LOADED
            return rate

    def arm(self) -> None:
        """Prepare for a start without delay; the output is at 0 V, and guarded from now on."""
        with self._lock, self._guardian_named():
            expect(self._state, "arm", RigState.LOADED)
            self._expect_not_taken("arm")
            self._watched = True
            self._guardian.arm()
            self._loaded()[0].arm()
            self._guardian.beat()  # arming the card takes a while on a busy computer
            self._state = RigState.ARMED

    def start(self) -> None:
        """Start the sample clock."""
        with self._lock, self._guardian_named():
            expect(self._state, "start", RigState.ARMED)
            self._expect_not_taken("start")
            tasks, run = self._loaded()
            self._guardian.beat()
            if self._guardian.refused:
                refused = ", ".join(self._guardian.refused)
                run.events.append(Event(0, "info", f"the system refused the guardian: {refused}"))
            tasks.start()
            run.heard = self._clock()
            self._state = RigState.RUNNING

    def read(self) -> Block | None:
        """Wait for the next block and return it, or None after the last one.

        Raises ``RigError`` for a fault of the card, for missing samples, and, after a ramp to 0 V,
        for a guardian process that gave no answer. Raises ``RigStateError`` where the rig was made
        safe.
        """
        while True:
            # release the lock between two waits, so that other threads can make the rig safe
            with self._lock, self._guardian_named():
                if self._state is RigState.DONE:
                    return None
                expect(self._state, "read", RigState.RUNNING)
                tasks, run = self._loaded()
                guarded = self._guardian.beat()
                if not guarded and not run.unguarded:
                    run.unguarded = True
                    run.events.append(
                        Event(run.delivered, "fault", f"{_UNGUARDED}: ramping to 0 V")
                    )
                    self._stop(tasks, run)
                if run.delivered == run.total:
                    self._finish(run)
                    return None
                tasks.refill(run.delivered)
                block = self._fetch(tasks, run)
            if block is not None:
                return block

    def stop(self) -> None:
        """End the run early with a ramp to 0 V; acquired samples stay readable."""
        with self._lock, self._guardian_named():
            if self._state is RigState.DONE:
                return  # the waveform ended just before the call
            expect(self._state, "stop", RigState.RUNNING)
            self._stop(*self._loaded())

    def make_safe(self) -> None:
        """Take the output to 0 V immediately, check it on the monitor, and discard the waveform.

        A card that this rig does not use is not reset. Raises ``RigError`` where neither this
        program nor the guardian could do so.
        """
        with self._lock:
            if self._state is RigState.CLOSED:
                return
            mistake: Exception | None = None
            try:
                if not self._engaged or self._taken_down() is not None:
                    self._leave()
                else:
                    self._bring_down()
            except Exception as error:
                if not self._engaged:  # what may be on is another program's, and its guardian's
                    raise
                code = error.code if isinstance(error, RigError) else None
                try:
                    self._guardian.take_over()
                except RigError as failed:
                    raise RigError(f"{error}; {failed}", code) from error
                # only now: a log on a disk that is held must not delay the guardian
                log.warning("%s; the guardian was asked", error)
                mistake = None if isinstance(error, RigError) else error
            self._guardian.disarm()
            self._engaged = self._watched = False
            self._state = RigState.SAFE
            if mistake is not None:
                raise mistake

    def close(self) -> None:
        """Make safe and release the instruments."""
        with self._lock:
            if self._state is RigState.CLOSED:
                return
            try:
                self.make_safe()
            finally:
                self._state = RigState.CLOSED
                self._guardian.close()
                self._outputs.close()
                self._link.close()

    def _fetch(self, tasks: ClockedTasks, run: _Run) -> Block | None:
        """Return the samples that are due, or None after a short wait without any."""
        size = self._block_samples or max(1, round(_BLOCK * run.rate))
        size = min(size, run.total - run.delivered)
        # a block that takes longer than one wait is assembled from parts
        counts = tasks.read(size, _WAIT)
        if counts.shape[1] == 0:
            tasks.check_output()
            silent = self._clock() - run.heard
            if silent > _OVERDUE + size / run.rate:
                raise RigError(explained(self._address.device, TIMEOUT, ""), TIMEOUT)
            return None
        run.heard = self._clock()
        start, end = run.delivered, run.delivered + counts.shape[1]
        run.delivered = end
        due = tuple(e for e in run.events if e.sample < end or end == run.total)
        run.events = [e for e in run.events if e not in due]
        return Block(start, np.vstack((run.command.window(start, end), counts)), due)

    def _stop(self, tasks: ClockedTasks, run: _Run) -> None:
        """Leave the waveform at its present sample, and ramp to 0 V linearly."""
        if run.stopped:
            return
        run.stopped = True
        before = self._clock()
        # keep at least the first sample, which is 0 V: a recording needs one
        played = max(1, tasks.hold())
        if played < run.delivered:
            raise RigError(explained(self._address.device, ABORTED[0], ""), ABORTED[0])
        if played >= run.total:
            return
        self._expect_not_taken("stop")
        volts, samples = run.command.ramp_from(played, self._settings.limits.ramp_down_s)
        tasks.continue_from(played)
        run.events.append(
            Event(
                played,
                "info",
                f"stopped: ramping from {volts * 1e-3:.4g} kV to 0 in "
                f"{samples / run.rate:.3g} s; the sample clock stood still for "
                f"{(self._clock() - before) * 1e3:.0f} ms before",
            )
        )

    def _finish(self, run: _Run) -> None:
        self._state = RigState.DONE
        if run.unguarded:
            raise RigError(
                f"the guardian process gave no answer during the run ({self._guardian.fault()}), "
                f"which was therefore ramped to 0 V; find out what ended or stopped it before the "
                f"next run"
            )

    def _taken_down(self) -> TakeOver | None:
        """Return the guardian's take-over since ``arm`` that ended at 0 V, None without one."""
        acted = self._guardian.report() if self._watched else None
        return acted if acted is not None and acted.confirmed else None

    def _expect_not_taken(self, call: str) -> None:
        """Raise ``RigError`` where the guardian has acted since ``arm``.

        This gives the sentence. What keeps the output down is the card, where the guardian holds
        output and enable line: this process may be stopped at any place after the check.
        """
        acted = self._guardian.report() if self._watched else None
        if acted is not None:
            raise RigError(
                f"{call}: {acted.sentence}; make the rig safe and load the waveform again, which "
                f"admits it again"
            )

    @contextmanager
    def _guardian_named(self) -> Iterator[None]:
        """Name with an error of the card what the guardian did, or that it gives no answer.

        What it did comes first: the error follows from it, and names another cause.
        """
        try:
            yield
        except RigStateError:
            raise
        except RigError as error:
            late = _REPORT_WITHIN if error.code in _TAKEN else _REPORTED_WITHIN
            acted = self._guardian.report(late) if self._watched else None
            if acted is not None and acted.sentence in str(error):
                raise
            if acted is not None:
                raise RigError(f"{acted.sentence}; after that, {error}", error.code) from error
            if self._run is not None and self._run.unguarded and error.code is not None:
                raise RigError(f"{error}; {_UNGUARDED}", error.code) from error
            raise

    def _loaded(self) -> tuple[ClockedTasks, _Run]:
        if self._tasks is None or self._run is None:
            raise RigError("no waveform is loaded")
        return self._tasks, self._run

    def _leave(self) -> None:
        """Clear this rig's tasks, and set 0 V only where no other program uses the card.

        The output is at 0 V already: the guardian took it down, or nothing was loaded since. What
        holds the card now is the guardian, which ``disarm`` lets go, or another program's run,
        which a reset of the card would end.
        """
        tasks, self._tasks, self._run = self._tasks, None, None
        if tasks is not None:
            try:
                tasks.forget()
            except RigError as error:  # the guardian's reset has ended them
                log.info("%s", error)
        if self._watched:
            self._guardian.disarm()
        try:
            self._outputs.zero()
        except NotAtZero:
            raise
        except RigError as error:  # in use by another program, or not reached
            log.warning("%s; the output is not this program's, and is left alone", error)

    def _bring_down(self) -> None:
        """Set 0 V and check it on the monitor; then set the enable line low in any case."""
        tasks, self._tasks, self._run = self._tasks, None, None
        try:
            if tasks is not None:
                try:
                    tasks.release()
                except RigError as error:  # the reset aborts all tasks
                    log.warning("%s", error)
            self._outputs.zero(force=True)
        finally:
            if tasks is not None:
                try:
                    tasks.disable()
                except RigError as error:  # such as a task that the guardian's reset has ended
                    log.warning("%s; the enable line is set by a new task", error)
                    self._outputs.disable()

    def _drop_tasks(self) -> None:
        tasks, self._tasks, self._run = self._tasks, None, None
        if tasks is not None:
            tasks.close()


class _Run:
    """One waveform being played: ``command`` has the output counts."""

    def __init__(self, command: Command, rate: float) -> None:
        self.command = command
        self.rate = rate
        self.delivered = 0  # samples handed to the reader
        self.heard = 0.0  # time of the last samples, s
        self.stopped = False
        self.unguarded = False
        self.events: list[Event] = []

    @property
    def total(self) -> int:
        return self.command.samples
