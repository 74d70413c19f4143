"""State of a campaign as another process sees it: read only."""

from __future__ import annotations

from pathlib import Path

from dearig.batch.campaign import CampaignOutcome
from dearig.batch.journal import JOURNAL, read_lines
from dearig.batch.queue import Queue
from dearig.errors import InputError
from dearig.recording.lock import refuse_in_use

__all__ = ["is_running", "seen"]


def is_running(folder: Path) -> bool:
    """Return True while a process plays the campaign in ``folder``: it holds the journal's lock."""
    try:
        refuse_in_use(folder / JOURNAL)
    except InputError:
        return True
    return False


def seen(folder: Path) -> CampaignOutcome:
    """Return how the campaign in ``folder`` stands.

    ``status`` is running while a process plays it, and killed where the last session has no end.
    Raises ``InputError`` for a folder without a campaign.
    """
    queue = Queue.of(read_lines(folder / JOURNAL)) if folder.is_dir() else Queue()
    if not queue.runs:
        raise InputError(f"{folder} has no campaign: there is no journal {JOURNAL}")
    status, reason = queue.status, queue.reason
    if is_running(folder):
        run = queue.running
        status = "paused" if queue.paused and run is None else "running"
        reason = "" if run is None else f"run {run.name} is played"
        if run is not None and run.recorded:
            reason = f"results of run {run.name} are computed"
    elif not status:
        status = "killed"
        reason = "the program ended without a word; continue with dearig campaign --resume"
    return CampaignOutcome(queue.name, folder, queue, status, reason)
