"""A campaign in a thread of its own: the engine of the command, and what it tells the window."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.plan import Plan
from dearig.acquisition.run import RunObserver, RunOptions
from dearig.batch.campaign import Arming, play_campaign
from dearig.batch.queue import CampaignOutcome
from dearig.config.campaignfile import Campaign
from dearig.config.rigfile import RigFile
from dearig.drivers.rig import Block, Event, RigIdentity
from dearig.errors import DearigError
from dearig.output_state import Known, OutputState
from dearig.window.campaign.compute import ComputeProcess
from dearig.window.run.live import Live
from dearig.window.run.runner import PROGRAM_FAULT, Play, PlayThread, RunEnd, headline_of

__all__ = ["CampaignRequest", "CampaignThread"]

_HEADLINES = {
    "complete": "Finished",
    "ended": "Ended",
    "armed_runs": "The batch is played",
    "armed_time": "The armed time is over",
    "halted": "Halted",
    "refused": "Refused",
    "interrupted": "Stopped",
}


@dataclass(frozen=True)
class CampaignRequest:
    """Everything that ``play_campaign`` needs; ``resume`` continues the campaign in ``folder``."""

    campaign: Campaign
    address: str
    rig_file: RigFile
    folder: Path
    options: RunOptions
    arming: Arming
    resume: bool


class CampaignThread(PlayThread):
    """Plays a campaign.

    ``noted`` carries the entries of the journal and whether they are older ones; ``stage`` what is
    done at present. ``live`` looks on at the present run, or at the last one.
    """

    noted = Signal(object, bool)
    stage = Signal(str)
    began = Signal(object)  #: what looks on at a run that has begun

    def __init__(
        self, request: CampaignRequest, overlays: tuple[OverlayModel, ...], drive: str,
        parent: QObject,
    ) -> None:  # fmt: skip
        super().__init__(parent)
        self._request = request
        self._overlays, self._drive = overlays, drive
        self._announced = False
        self._stage = ""
        self.live: Live | None = None
        self._looking: Live | None = None  # whose thread has not ended
        self.output: OutputState | None = None
        self.end = RunEnd("Ended", PROGRAM_FAULT, None, None, play=Play.CAMPAIGN)

    def run(self) -> None:
        request = self._request
        outcome: list[CampaignOutcome] = []
        computing = ComputeProcess(self.interrupts)
        try:
            play_campaign(
                request.campaign, request.address, request.rig_file, request.folder,
                request.options, request.arming, resume=request.resume,
                observer=CampaignObserver(self), ended=outcome.append, noted=self._note,
                interrupts=self.interrupts, computing=computing, progress=self._progress,
            )  # fmt: skip
        except DearigError as error:
            self.end = self._early_end(error, outcome[-1] if outcome else None)
        except BaseException:
            # an error of the program may leave a voltage
            known = self.output or OutputState(Known.UNKNOWN, time.time())
            self.end = RunEnd(
                "Ended", PROGRAM_FAULT, None, known, alarming=True, play=Play.CAMPAIGN
            )
            raise
        else:
            self.end = RunEnd(
                _HEADLINES[outcome[-1].status], _left(outcome[-1]), None, self.output,
                play=Play.CAMPAIGN,
            )  # fmt: skip
        finally:
            computing.close()
            self.follow(None)

    def follow(self, live: Live | None) -> None:
        """Look on with ``live`` from now on; None ends the look at the last run."""
        if self._looking is not None:
            self._looking.close()
        self._looking = live
        if live is not None:
            self.live = live
            self.began.emit(live)

    def new_live(self) -> Live:
        """Return what looks on at the next run, with the overlay models of the page Run."""
        return Live(self._overlays, self._drive)

    def _note(self, entries: Sequence[Mapping[str, Any]]) -> None:
        if self._announced and entries[-1]["event"] == "started":
            self.live = None  # the readings of the last run are no longer those of this moment
        self.noted.emit(entries, not self._announced)
        self._announced = True

    def _progress(self, stage: str, part: float) -> None:  # noqa: ARG002
        if stage != self._stage:
            self._stage = stage
            self.stage.emit(stage)

    def _early_end(self, error: DearigError, outcome: CampaignOutcome | None) -> RunEnd:
        """Describe a campaign that ``error`` ended, before it began without an ``outcome``."""
        headline = headline_of(error)
        sentence = str(error)
        if outcome is not None:
            headline = _HEADLINES.get(outcome.status, headline)
            sentence = outcome.reason
            if outcome.status == "interrupted":
                sentence = _left(outcome)
        output = error.output_state or self.output
        # an error between two runs says nothing of the output after the last one
        alarming = error.needs_inspection or (output is not None and not output.confirmed)
        return RunEnd(headline, sentence, None, output, alarming=alarming, play=Play.CAMPAIGN)


def _left(outcome: CampaignOutcome) -> str:
    """Return how many runs of a campaign wait, as a sentence without its end."""
    left = len(outcome.queue.waiting) + (outcome.queue.running is not None)
    if not left:
        return "all runs were played"
    return f"{left} run{'s wait' if left > 1 else ' waits'}; arm and start again to go on"


class CampaignObserver(RunObserver):
    """Hands what comes from each run to a ``Live`` of its own."""

    def __init__(self, thread: CampaignThread) -> None:
        self._thread = thread

    def started(self, planned: Plan, identity: RigIdentity, rate: float) -> None:
        live = self._thread.new_live()
        live.started(planned, identity, rate)
        self._thread.follow(live)

    def block(self, block: Block) -> None:
        if self._thread.live is not None:
            self._thread.live.block(block)

    def event(self, event: Event) -> None:
        if self._thread.live is not None:
            self._thread.live.event(event)

    def ramping(self) -> None:
        self._thread.ramping.emit()

    def output(self, state: OutputState) -> None:
        self._thread.output = state
        self._thread.output_known.emit(state)
