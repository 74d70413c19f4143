"""State of a campaign: what its journal says of every run, and what is played next."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dearig.batch.journal import FORMAT, read_lines
from dearig.config.campaignfile import Campaign
from dearig.config.toml_input import shown
from dearig.errors import InputError

__all__ = ["LOST", "PLAYED", "REQUEST_KINDS", "CampaignOutcome", "Queue", "RunState", "sha256_of"]

#: States of a run whose voltage was played, or may have been.
DONE, LOST, STOPPED = "done", "lost", "stopped"
PLAYED = (DONE, LOST, STOPPED)
WAITING, RUNNING, SKIPPED = "waiting", "running", "skipped"

#: What another program may ask of a campaign: pause and continue it, end it after the present run,
#: leave a run out, and play a run next.
REQUEST_KINDS = ("pause", "continue", "end", "skip", "first")


@dataclass
class RunState:
    """What is known of one run.

    ``state`` is waiting, running, done, lost (without a whole recording), stopped (by an
    interlock) or skipped. ``recording`` is the last file, relative to the campaign's folder.
    ``attempts`` counts the recordings. ``recorded`` is True while the computation after the run is
    not done.
    """

    name: str
    digest: str = ""
    duration: float = 0.0
    settings: dict[str, Any] = field(default_factory=dict)
    warm_up: bool = False
    state: str = WAITING
    attempts: int = 0
    recorded: bool = False
    recording: str = ""
    reason: str = ""
    numbers: dict[str, float] = field(default_factory=dict)
    model: str = ""
    extremes: str = ""


@dataclass
class Queue:
    """State of a campaign, made by ``take`` from the entries of its journal in their order.

    ``plan_folder`` is where the files lay that the plan names, "" where the journal does not say.
    ``order`` has the names of all runs as they are played. ``halted`` says why a person must look
    before anything is played, "" if nothing is in the way. ``status`` is how the last session
    ended, "" while one goes on. ``armed_until`` is Unix time in s, None for no limit, and
    ``armed_runs`` how many runs may still be started, None for no limit.
    """

    repeat_lost: int = 0
    name: str = ""
    rig: str = ""
    plan: str = ""
    plan_folder: str = ""
    rig_file: str = ""
    rest: float = 0.0
    runs: dict[str, RunState] = field(default_factory=dict)
    order: list[str] = field(default_factory=list)
    halted: str = ""
    paused: bool = False
    ending: bool = False
    requests: int = 0
    armed: bool = False
    armed_until: float | None = None
    armed_runs: int | None = None
    status: str = ""
    reason: str = ""
    started: str = ""

    @classmethod
    def of(cls, path: Path) -> Queue:
        """Return the state that the journal at ``path`` leads to; an empty one without a file.

        Raises ``InputError`` for a file that is not a journal.
        """
        return cls.after(read_lines(path), path)

    @classmethod
    def after(cls, entries: Iterable[Mapping[str, Any]], path: Path) -> Queue:
        """Return the state that the ``entries`` of the journal at ``path`` lead to."""
        queue = cls()
        for i, entry in enumerate(entries):
            try:
                queue.take(entry)
            except InputError as error:
                raise InputError(f"{path}: {error}") from error
            except (KeyError, TypeError, AttributeError, ValueError, OverflowError) as error:
                raise InputError(
                    f"{path}, entry {i + 1} is not complete or wrong: the file was changed by hand"
                ) from error
        return queue

    def take(self, entry: Mapping[str, Any]) -> None:
        """Change the state as ``entry`` says."""
        match entry["event"]:
            case "planned":
                self._plan(entry)
            case "armed":
                self.armed, self.status, self.reason = True, "", ""
                self.ending = False
                until, runs = entry["until"], entry["runs"]
                self.armed_until = None if until is None else float(until)
                self.armed_runs = None if runs is None else int(runs)
            case "request":
                self._request(entry)
            case "started":
                run = self.runs[entry["run"]]
                run.state, run.recording, run.reason = RUNNING, _name(entry["recording"]), ""
                run.attempts = int(entry["attempt"])
                if self.armed_runs is not None:
                    self.armed_runs -= 1
            case "not-started":
                run = self.runs[entry["run"]]
                run.state, run.recording, run.reason = WAITING, "", str(entry["reason"])
                run.attempts -= 1
                if self.armed_runs is not None:
                    self.armed_runs += 1
            case "recorded":
                run = self.runs[entry["run"]]
                run.recorded, run.recording = True, _name(entry["recording"])
            case "reduced":
                self.runs[entry["run"]].extremes = _name(entry["extremes"])
            case "ended":
                self._end(entry)
            case "halted":
                self.halted = str(entry["reason"])
            case "acknowledged":
                self.halted = ""
            case "session-ended":
                self.status, self.reason = str(entry["status"]), str(entry["reason"])

    def _plan(self, entry: Mapping[str, Any]) -> None:
        if entry["format"] != FORMAT:
            raise InputError(
                f"it has the format {shown(entry['format'])}, and this version reads {FORMAT}"
            )
        self.name, self.rig = str(entry["name"]), str(entry["rig"])
        self.plan, self.rig_file = str(entry["plan_sha256"]), str(entry["rig_file_sha256"])
        self.plan_folder = str(entry.get("plan_folder", ""))
        self.repeat_lost, self.rest = int(entry["repeat_lost"]), float(entry["rest_s"])
        self.started = str(entry["at"])
        for run in entry["runs"]:
            name = str(run["name"])
            self.runs[name] = RunState(
                name, str(run["sequence_sha256"]), float(run["duration_s"]),
                dict(run["settings"]), bool(run["warm_up"]),
            )  # fmt: skip
        self.order = list(self.runs)

    def _request(self, entry: Mapping[str, Any]) -> None:
        self.requests = int(entry["number"])
        name = entry.get("run", "")
        match entry["what"]:
            case "pause":
                self.paused = True
            case "continue":
                self.paused = False
            case "end":
                self.ending = True
            case "skip" if name in self.runs and self.runs[name].state == WAITING:
                self.runs[name].state = SKIPPED
                self.runs[name].reason = "left out on request"
            case "first" if name in self.runs and self.runs[name].state == WAITING:
                self.order.remove(name)
                at = next(
                    (i for i, n in enumerate(self.order) if self.runs[n].state == WAITING),
                    len(self.order),
                )
                self.order.insert(at, name)

    def _end(self, entry: Mapping[str, Any]) -> None:
        run = self.runs[entry["run"]]
        if entry["state"] not in PLAYED:
            raise ValueError(entry["state"])
        run.state, run.reason, run.recorded = entry["state"], str(entry["reason"]), False
        run.recording = _name(entry["recording"])
        run.numbers = {str(n): float(v) for n, v in dict(entry.get("numbers") or {}).items()}
        run.model = _name(entry.get("model", ""))
        if run.state == LOST and run.attempts <= self.repeat_lost:
            run.state = WAITING

    def changed(
        self, campaign: Campaign, digests: Sequence[str], address: str, configuration: str
    ) -> str:
        """Return what has changed since the campaign began, "" where it can be continued.

        ``digests`` are those of the sequences of all runs, ``configuration`` is the rig file.
        """
        if self.plan != sha256_of(campaign.toml):
            return "the plan has changed since (plan.toml in its folder is the one it began with)"
        if self.rig != address:
            return f"it began on the rig {self.rig}, not on {address}"
        if self.rig_file != sha256_of(configuration):
            return "the rig file has changed since"
        for run, digest in zip(campaign.runs, digests, strict=True):
            known = self.runs.get(run.name)
            if known is None or known.digest != digest:
                return f"the sequence of run {run.name} has changed since"
        return ""

    @property
    def listed(self) -> Sequence[RunState]:
        """All runs in the order in which they are played."""
        return [self.runs[name] for name in self.order]

    @property
    def waiting(self) -> Sequence[RunState]:
        """Runs that are still to be played, in their order."""
        return [run for run in self.listed if run.state == WAITING]

    @property
    def running(self) -> RunState | None:
        """The run that was started and has no end in the journal."""
        return next((run for run in self.runs.values() if run.state == RUNNING), None)

    @property
    def time_left(self) -> float:
        """Time in s that the waiting runs take, with the rests between them."""
        waiting = self.waiting
        return sum(run.duration for run in waiting) + self.rest * max(len(waiting) - 1, 0)

    def count(self, *states: str) -> int:
        """Return the number of runs in one of ``states``."""
        return sum(run.state in states for run in self.runs.values())

    @property
    def model(self) -> str:
        """File of the last fitted model, relative to the folder, "" for none."""
        return next((run.model for run in reversed(self.listed) if run.model), "")


@dataclass(frozen=True)
class CampaignOutcome:
    """State of a campaign at the end of a session.

    ``status`` is complete, ended (on request), armed_runs or armed_time (all armed runs
    are played, or the armed time is over), band (a number has left its band), halted (a person
    must look), refused (a run was not admitted) or interrupted; ``reason`` is a sentence, "" for
    complete.
    """

    name: str
    folder: Path
    queue: Queue
    status: str
    reason: str

    def summary(self) -> dict[str, Any]:
        """Return name, folder, status and numbers of runs, as reports and notifications have it."""
        queue = self.queue
        return {
            "name": self.name,
            "folder": str(self.folder),
            "status": self.status,
            "reason": self.reason,
            "planned": len(queue.runs),
            "done": queue.count(DONE),
            "failed": queue.count(LOST, STOPPED),
            "waiting": queue.count(WAITING, RUNNING),
        }


def _name(value: Any) -> str:
    """Return the name of a file of a campaign. Raises ``ValueError`` for what is none."""
    if not isinstance(value, str) or "\0" in value:
        raise ValueError(value)
    return value


def sha256_of(text: str) -> str:
    """Return the SHA-256 of ``text``, by which a changed plan or rig file is recognised."""
    return hashlib.sha256(text.encode()).hexdigest()
