"""Play the runs of a campaign one after the other, and continue it after any end.

Each run goes through ``dearig.acquisition.run.record``, as a single run does: this module sets no
voltage. Between two runs no rig is open. The journal is written before and after each step, so that
a kill at any moment leaves a campaign that can be continued where it stood.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dearig.acquisition.check import check_rig
from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.plan import plan
from dearig.acquisition.rigs import check_address, is_simulated
from dearig.acquisition.run import RunObserver, RunOptions, record
from dearig.batch.after import Compute, band_violation, compute
from dearig.batch.extremes import write_extremes
from dearig.batch.forecast import Forecast, foresee
from dearig.batch.journal import FORMAT, JOURNAL, REQUESTS, Journal, read_lines
from dearig.batch.notify import Notifier
from dearig.batch.queue import (
    DONE,
    LOST,
    REQUEST_KINDS,
    STOPPED,
    CampaignOutcome,
    Queue,
    RunState,
    sha256_of,
)
from dearig.config.campaignfile import Campaign, PlannedRun, digest_of, settings_text
from dearig.config.modelfile import load_actuator
from dearig.config.notify import Notify
from dearig.config.rigfile import RigFile
from dearig.config.safe_ends import is_safe_end
from dearig.config.sequencefile import LoadedSequence
from dearig.errors import DearigError, DiskFault, InputError, Interrupted, SafetyStop
from dearig.output_state import Known, OutputState
from dearig.printable import visible
from dearig.progress import Progress, quiet
from dearig.recording.content.text import text_of
from dearig.recording.files import write_whole
from dearig.recording.reading.opening import read_from
from dearig.recording.reading.reader import open_recording
from dearig.recording.recover import recover
from dearig.units import runs_text

__all__ = ["Arming", "CampaignOutcome", "Noted", "play_campaign"]

log = logging.getLogger(__name__)

#: Receives entries of the journal, in the thread that plays the campaign.
Noted = Callable[[Sequence[Mapping[str, Any]]], None]
#: Time in s between two looks at the requests, while nothing is played.
_POLL = 0.5


@dataclass(frozen=True)
class Arming:
    """What a person has released: so many ``runs`` within so many ``hours``; None for no limit.

    ``by`` names the person. ``acknowledged`` says what the person looked at after an interlock or
    a doubt about 0 V, "" for nothing. ``shown`` has the digests of the sequences that the person
    has seen, one for each run of the plan: others are refused; none for any.
    """

    by: str = ""
    runs: int | None = None
    hours: float | None = None
    acknowledged: str = ""
    shown: tuple[str, ...] = ()


def play_campaign(
    campaign: Campaign,
    address: str,
    rig_file: RigFile,
    folder: Path,
    options: RunOptions,
    arming: Arming,
    *,
    resume: bool = False,
    observer: RunObserver | None = None,
    ended: Callable[[CampaignOutcome], None] | None = None,
    noted: Noted | None = None,
    interrupts: Interrupts | None = None,
    computing: Compute | None = None,
    notify: Notify | None = None,
    progress: Progress = quiet,
    now: Callable[[], float] = time.time,
    clock: Callable[[], float] = time.monotonic,
    wait: Callable[[float], None] = time.sleep,
) -> CampaignOutcome:
    """Play the runs of ``campaign`` on the rig at ``address``; recordings go to ``folder``.

    With ``resume`` the campaign in ``folder`` is continued. A rig that is not simulated needs an
    ``arming`` with a number of runs, hours and a name, or what is left of an earlier one. ``now``
    and ``clock`` are Unix time and the time that has passed in s, ``wait`` waits for so many s. A
    simulated rig that is not paced has no rests. ``ended`` is called with the outcome before an
    error is raised, ``noted`` with the entries that are in the journal, then with each new one.
    ``interrupts`` lets another thread end the run and the campaign; by default ctrl-C does.
    ``computing`` stands in for ``compute`` after each run, ``notify`` for the plan's settings.

    Raises ``InputError`` before anything is played, and for a run that the gate refuses at its
    turn; ``SafetyStop``, ``InstrumentFault`` or ``NotSafe`` where a run ended so that a person must
    look; ``Interrupted`` where the operator ended it. The journal has it all.
    """
    arming = replace(arming, by=visible(arming.by), acknowledged=visible(arming.acknowledged))
    _check_folder(folder, resume)
    if not resume:
        _check_arming(arming, address, left=False)
    if not check_address(address, rig_file, options).simulated:
        # each run is refused for it too, but then there is a journal that cannot be played
        check_rig(address, rig_file).refuse_without_watchdog()

    def planning(stage: str, part: float) -> None:
        if interrupts is not None and interrupts.asked():
            raise Interrupted("interrupted while the campaign was planned; nothing was played")
        progress(stage, part)

    notifier = Notifier(campaign.notify if notify is None else notify, now)
    planning("planning", 0.0)
    forecast = foresee(campaign, rig_file, folder, options.actuator, options.film_id, planning)
    if arming.shown not in ((), forecast.digests):
        raise InputError(
            "the sequences of the campaign are not those that were armed: a file has changed since "
            "the runs were shown; look at them again, then arm them again"
        )
    if not resume:
        forecast.check_room(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder} cannot be created: {error.strerror or error}") from error
    with Journal(folder, now, clock) as journal:
        session = _Session(
            campaign, address, rig_file, folder, options, journal, observer, noted, interrupts,
            computing or compute, notifier, progress, clock, wait,
        )  # fmt: skip
        session.begin(forecast, arming)
        stop: DearigError | None
        try:
            status, reason, stop = session.play()
        except (KeyboardInterrupt, Interrupted):
            left = len(session.queue.waiting) + (session.queue.running is not None)
            stop = Interrupted(
                f"interrupted between two runs, at 0 V; {runs_text(left, 'left')}; "
                f"continue the campaign",
                option="resume",
            )
            status, reason = "interrupted", str(stop)
        except Exception as error:
            why = f"the program failed: {type(error).__name__}"
            notifier.tell_stop(session.outcome("failed", why))
            raise
        session.note("session-ended", status=status, reason=reason)
        outcome = session.outcome(status, reason)
        notifier.tell_stop(outcome)
        if ended is not None:
            ended(outcome)
        if stop is not None:
            raise stop
        return outcome


def _check_folder(folder: Path, resume: bool) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; give a folder for the campaign")
    entries = Queue.of(folder / JOURNAL) if folder.is_dir() else Queue()
    if resume and not entries.runs:
        raise InputError(
            f"{folder} has no campaign to continue; leave that out to begin one", option="resume"
        )
    if entries.runs and not resume:
        raise InputError(
            f"{folder} has the campaign {entries.name!r} with {entries.count(DONE)} of "
            f"{len(entries.runs)} runs done; continue it, or give another folder",
            option="resume",
        )
    if (
        not resume
        and folder.is_dir()
        and any(p.name not in (JOURNAL, REQUESTS) for p in folder.iterdir())
    ):
        raise InputError(f"{folder} is not empty; give another folder", option="out")


def _check_arming(arming: Arming, address: str, left: bool) -> None:
    """Refuse a real rig that no person arms for so many runs and hours.

    ``left``: there is an earlier arming, which may not be used up.
    """
    if is_simulated(address):
        return
    given = (arming.runs is not None, arming.hours is not None)
    if (all(given) and arming.by) or (left and not any(given)):
        return
    raise InputError(
        f"rig {address!r} carries high voltage while no one may be at it: say who arms "
        f"it, for how many runs, and for how long",
        option=("operator", "runs", "hours"),
    )


class _Session:
    """The runs that one process plays of a campaign."""

    def __init__(
        self,
        campaign: Campaign,
        address: str,
        rig_file: RigFile,
        folder: Path,
        options: RunOptions,
        journal: Journal,
        observer: RunObserver | None,
        noted: Noted | None,
        interrupts: Interrupts | None,
        computing: Compute,
        notifier: Notifier,
        progress: Progress,
        clock: Callable[[], float],
        wait: Callable[[float], None],
    ) -> None:
        self._campaign, self._address, self._rig_file = campaign, address, rig_file
        self._folder, self._options, self._journal = folder, options, journal
        self._observer, self._progress, self._clock, self._wait = observer, progress, clock, wait
        self._noted, self._interrupts, self._computing = noted, interrupts, computing
        self._notifier = notifier
        self._output: OutputState | None = None  # after the last run
        self._simulated = is_simulated(address)
        self._planned = {run.name: run for run in campaign.runs}
        self.queue = Queue.after(journal.entries, journal.path)
        # a session that continues another one does not know how long the film has rested
        self._rested = not any(run.attempts for run in self.queue.runs.values())
        if noted is not None:
            noted(tuple(journal.entries))

    def note(self, event: str, **facts: Any) -> None:
        """Write an entry to the journal, and change the state as it says."""
        entry = self._journal.append(event, **facts)
        self.queue.take(entry)
        if self._noted is not None:
            self._noted((entry,))

    def _check_interrupts(self) -> None:
        if self._interrupts is not None and self._interrupts.asked():
            raise Interrupted("interrupted between two runs, at 0 V")

    def outcome(self, status: str, reason: str = "") -> CampaignOutcome:
        """Return how the campaign stands."""
        return CampaignOutcome(self._campaign.name, self._folder, self.queue, status, reason)

    # ------------------------------------------------------------ begin

    def begin(self, forecast: Forecast, arming: Arming) -> None:
        """Check that the campaign is the one in the folder, settle open runs, and arm."""
        queue = self.queue
        if not queue.runs:
            self.note("planned", **self._plan_entry(forecast))
        else:
            changed = queue.changed(
                self._campaign, forecast.digests, self._address, self._options.configuration
            )
            if changed:
                raise InputError(
                    f"the campaign in {self._folder} cannot be continued: {changed}; continue it "
                    f"with what it began with, or begin another one in another folder"
                )
            seen = queue.halted
            self._settle()
            if queue.halted != seen:
                # this halt was not shown yet: the acknowledgement is of another one
                raise _halted(queue.halted)
            if arming.acknowledged and not queue.halted:
                raise InputError(
                    f"there is nothing to acknowledge in {self._folder}: leave that out",
                    option="acknowledge",
                )
            if queue.halted:
                if not arming.acknowledged:
                    raise _halted(queue.halted)
                if not arming.by:
                    raise InputError(
                        "an acknowledgement needs the name of who looked", option="operator"
                    )
            _check_arming(arming, self._address, left=queue.armed and not queue.halted)
            if queue.halted:
                self.note("acknowledged", by=arming.by, note=arming.acknowledged)
        copy = self._folder / "plan.toml"
        if not copy.exists():
            write_whole(copy, self._campaign.toml.encode())
        given = arming.runs is not None or arming.hours is not None or not queue.armed
        if given or self._simulated:
            hours = arming.hours
            self.note(
                "armed", by=arming.by, rig=self._address, runs=arming.runs,
                until=None if hours is None else self._journal.arm(3600.0 * hours),
            )  # fmt: skip
        elif queue.status:
            # what is left of the earlier arming
            self.note(
                "armed", by=arming.by, rig=self._address, runs=queue.armed_runs,
                until=queue.armed_until,
            )  # fmt: skip

    def _plan_entry(self, forecast: Forecast) -> dict[str, Any]:
        campaign = self._campaign
        return {
            "format": FORMAT,
            "name": campaign.name,
            "rig": self._address,
            "plan_folder": str(campaign.folder.absolute()),
            "plan_sha256": sha256_of(campaign.toml),
            "rig_file_sha256": sha256_of(self._options.configuration),
            "rest_s": campaign.rest,
            "repeat_lost": campaign.repeat_lost,
            "seconds": forecast.seconds,
            "bytes": forecast.size,
            "runs": [
                {
                    "name": run.name,
                    "sequence_sha256": digest,
                    "duration_s": duration,
                    "settings": dict(run.settings),
                    "warm_up": run.warm_up,
                }
                for run, digest, duration in zip(
                    campaign.runs, forecast.digests, forecast.durations, strict=True
                )
            ],
        }

    def _settle(self) -> None:
        """Settle what a kill cut off: a run is done, lost, or was not started."""
        for done in self.queue.runs.values():
            if done.state == DONE and done.extremes:
                (self._folder / done.recording).unlink(missing_ok=True)
        run = self.queue.running
        if run is None:
            return
        if run.recorded:
            self._finish(run)
            return
        path = self._folder / run.recording
        if not path.exists():
            # the file is made before the output is armed
            if not self._simulated:
                self._halt(f"the program ended while run {run.name} was about to start")
            self.note("not-started", run=run.name, reason="the program ended before the run")
            return
        whole, confirmed = _ended_well(path)
        if not self._simulated and not confirmed:
            self._halt(
                f"the program ended during run {run.name}, and whether the output is at 0 V is not "
                f"known: look at the amplifier"
            )
        if whole:
            self.note("recorded", run=run.name, recording=run.recording, output="settled later")
            self._finish(run)
            return
        with contextlib.suppress(InputError):  # killed before its first sample
            recover(path)
        self._end(run, LOST, "the program was killed during the run")

    # ------------------------------------------------------------ play

    def play(self) -> tuple[str, str, DearigError | None]:
        """Play until the end; return status, reason, and an error that the end is."""
        while True:
            self._check_interrupts()
            self._take_requests()
            queue = self.queue
            if queue.halted:
                return "halted", queue.halted, SafetyStop(queue.halted)
            if not queue.waiting:
                return "complete", "", None
            if queue.ending:
                return "ended", f"ended on request; {runs_text(len(queue.waiting), 'left')}", None
            run = queue.waiting[0]
            if queue.armed_runs is not None and queue.armed_runs <= 0:
                return "armed_runs", self._left("the armed number of runs was played"), None
            until = queue.armed_until
            if until is not None and self._journal.time() + run.duration > until:
                return "armed_time", self._left("the armed time does not last for a run"), None
            if queue.paused:
                self._progress("paused", self._part())
                self._wait(_POLL)
                continue
            if not self._rested:
                self._rest()
                continue
            ended = self._play_run(run)
            if ended is not None:
                return ended

    def _left(self, why: str) -> str:
        return f"{why}; {runs_text(len(self.queue.waiting), 'left')}: arm the rig to continue"

    def _of_run(self, state: RunState) -> Progress:
        """Return a progress that says which run of how many it is."""
        number, count = self.queue.order.index(state.name) + 1, len(self.queue.order)
        return lambda stage, part: self._progress(f"run {number} of {count}, {stage}", part)

    def _part(self) -> float:
        return 1.0 - len(self.queue.waiting) / max(len(self.queue.runs), 1)

    def _rest(self) -> None:
        """Rest at 0 V, and take requests meanwhile."""
        self._rested = True
        if self._simulated and not self._options.paced:
            return
        end = self._clock() + self._campaign.rest
        while (left := end - self._clock()) > 0.0 and not self.queue.ending:
            self._progress("resting", self._part())
            self._wait(min(left, _POLL))
            self._check_interrupts()
            self._take_requests()

    def _take_requests(self) -> None:
        entries = read_lines(self._folder / REQUESTS, tolerant=True)
        for number, entry in enumerate(entries, start=1):
            if number > self.queue.requests and entry["event"] in REQUEST_KINDS:
                self.note(
                    "request", number=number, what=entry["event"], run=str(entry.get("run", "")),
                    by=str(entry.get("by", "")),
                )  # fmt: skip

    def _play_run(self, state: RunState) -> tuple[str, str, DearigError | None] | None:
        """Play one run; return how the session ends by it, None if it goes on."""
        run = self._planned[state.name]
        attempt = state.attempts + 1
        name = f"{run.name}.h5" if attempt == 1 else f"{run.name}-attempt-{attempt}.h5"
        path = self._folder / name
        try:
            loaded = self._admit(run, path)
        except InputError as error:
            why = f"run {run.name}: {error}"
            return "refused", why, InputError(why, option=error.options, command=error.command)
        self.note("started", run=run.name, attempt=attempt, recording=name)
        try:
            result = record(
                loaded, self._address, self._rig_file, path, self._run_options(run),
                observer=self._observer, interrupts=self._interrupts, progress=self._of_run(state),
            )  # fmt: skip
        except DearigError as error:
            return self._failed(state, path, error)
        finally:
            self._rested = False
        self._output = result.output_state
        recording = result.path.name if result.path.parent == path.parent else str(result.path)
        # a halt is written before what it is about, so that no kill comes between them
        if not result.output_state.confirmed:
            self._halt(f"after run {run.name}: {result.output_state.sentence}")
        self.note(
            "recorded", run=run.name, recording=recording, samples=result.samples,
            **_output(result.output_state),
        )  # fmt: skip
        self._finish(state)
        return None

    def _admit(self, run: PlannedRun, path: Path) -> LoadedSequence:
        """Return the sequence of ``run``, which the gate admits with the film's present model."""
        if path.exists():
            raise InputError(f"{path} exists already, and the campaign did not make it")
        loaded = self._campaign.load(run)
        if digest_of(loaded) != self.queue.runs[run.name].digest:
            raise InputError("its sequence has changed since the campaign was planned")
        if self.queue.model:
            fitted = load_actuator(self._folder / self.queue.model)
            planned = plan(loaded, self._rig_file, fitted, self._options.film_id)
            try:
                planned.admitted()
            except InputError as error:
                raise InputError(
                    f"with the film's present model ({self.queue.model}), {error}; leave the run "
                    f"{run.name} out",
                    command=("campaign-queue", str(self._folder)),
                    option="skip",
                ) from error
        return loaded

    def _run_options(self, run: PlannedRun) -> RunOptions:
        about = f"campaign {self._campaign.name!r}, run {run.name}"
        if run.settings:
            about += f": {settings_text(run.settings)}"
        notes = f"{self._options.notes}; {about}" if self._options.notes else about
        position = [r.name for r in self._campaign.runs].index(run.name)
        # the noise of two runs is independent, and that of a run the same after a crash
        return replace(self._options, notes=notes[:1000], seed=self._options.seed + position)

    def _failed(
        self, state: RunState, path: Path, error: DearigError
    ) -> tuple[str, str, DearigError | None] | None:
        """Note a run that ended early; return how the session ends by it, None if it goes on."""
        if isinstance(error, InputError) and not path.exists():
            self.note("not-started", run=state.name, reason=str(error))
            reason = f"run {state.name}: {error}"
            return (
                "refused",
                reason,
                InputError(reason, option=error.options, command=error.command),
            )
        self._output = error.output_state
        # no one was there: what kept a run from its rig would keep the next one from it too
        looks = error.needs_inspection or error.output_state is None
        safe = is_safe_end(error, self._campaign.repeat_after)
        if safe and path.exists() and state.attempts <= self.queue.repeat_lost:
            looks = False
        if looks:
            self._halt(f"run {state.name}: {error}")
        if not path.exists():
            self.note("not-started", run=state.name, reason=str(error))
        else:
            how = STOPPED if isinstance(error, SafetyStop) else LOST
            self._end(state, how, str(error), tripped=looks)
        if looks:
            return "halted", self.queue.halted, error
        if safe or isinstance(error, DiskFault):
            return None
        status = "interrupted" if isinstance(error, Interrupted) else "refused"
        return status, str(error), error

    def _halt(self, reason: str) -> None:
        self.note("halted", reason=reason)

    # ------------------------------------------------------------ after a run

    def _finish(self, state: RunState) -> None:
        """Compute what the plan asks for after a run, and note that the run is done."""
        run = self._planned[state.name]
        recording = self._folder / state.recording
        if run.warm_up:
            self._end(state, DONE, "")
            return
        found = self._computing(
            self._campaign, recording, self._folder, self.queue.model, self._rig_file,
            self._of_run(state),
        )  # fmt: skip
        extremes = "" if self._campaign.is_kept(run) else self._reduce(state, recording)
        band = band_violation(self._campaign.stop_when, found.numbers)
        if band:
            self._halt(f"after run {run.name}: {band}")
        self._end(state, DONE, "; ".join(found.problems), numbers=found.numbers, model=found.model)
        if extremes:
            recording.unlink(missing_ok=True)

    def _reduce(self, state: RunState, recording: Path) -> str:
        """Write the extremes of a recording that is not kept; return their file, "" for none."""
        out = recording.with_suffix(".csv")
        try:
            write_extremes(recording, out, self._campaign.keep_cycles)
        except InputError as error:
            log.warning("%s is kept whole: %s", recording, error)
            return ""
        self.note("reduced", run=state.name, extremes=out.name)
        return out.name

    def _end(
        self, state: RunState, how: str, reason: str, tripped: bool = False, **facts: Any
    ) -> None:
        self.note(
            "ended", run=state.name, state=how, reason=reason, recording=state.recording, **facts
        )
        doubt = self._output is not None and not self._output.confirmed
        self._notifier.tell_run(
            self.outcome("running"), state, how, self._output, tripped=tripped or doubt
        )


def _halted(reason: str) -> InputError:
    return InputError(
        f"the campaign is halted: {reason}; look at the rig and the film, and then continue, and "
        f"say who looked and what was seen",
        option=("resume", "operator", "acknowledge"),
    )


def _output(state: OutputState) -> dict[str, Any]:
    return {"output": state.known.value, "monitor_V": state.monitor}


def _ended_well(path: Path) -> tuple[bool, bool]:
    """Return whether the recording is whole, and whether it says that 0 V was confirmed."""
    try:
        recording = open_recording(path)
        output = read_from(path, lambda file: text_of(file["entry"].attrs.get("output_state", "")))
    except InputError:
        return False, False
    whole = recording.complete and recording.outcome == "finished"
    return whole, output == Known.CONFIRMED.value
