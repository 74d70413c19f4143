"""Sentences of the page Campaign: what a plan takes, how a campaign stands, what is in the way."""

from __future__ import annotations

from dearig.acquisition.rigs import is_simulated
from dearig.batch.queue import DONE, LOST, SKIPPED, STOPPED, WAITING, Queue
from dearig.config.campaignfile import Campaign
from dearig.report.pages.campaign import duration_text
from dearig.units import runs_text
from dearig.window.campaign.plan import PlanSurvey
from dearig.window.session.state import Session

__all__ = ["arming_block", "counted", "crash_text", "plan_text"]

_USED = 0.1  # of a limit: what uses less of it is not named


def plan_text(found: PlanSurvey) -> str:
    """Return time, disk and margins of a plan that was surveyed."""
    campaign, forecast = found.campaign, found.forecast
    if campaign is None:
        return ""
    if forecast is None:
        return "Checking the runs …"
    warm = sum(run.warm_up for run in campaign.runs)
    near = [m for m in forecast.margins if m.allowed and m.reached > _USED * m.allowed]
    margins = "; ".join(f"{m.quantity} {m.reached:.3g} of {m.allowed:.3g} {m.unit}" for m in near)
    return (
        f"{duration_text(forecast.seconds)} without computations"
        + (f", {runs_text(warm)} to warm up" if warm else "")
        + f" · {forecast.size / 1e6:.3g} MB of {forecast.free / 1e9:.3g} GB free"
        + _length_text(campaign)
        + (f"\nAt most {margins}" if margins else "")
    )


def _length_text(campaign: Campaign) -> str:
    """Return whom the plan tells when a run or the campaign ends."""
    notify = campaign.notify
    ways = [f"the program {notify.command[0]}"] if notify.command else []
    ways += ["a webhook"] if notify.webhook else []
    return f" · tells {' and '.join(ways)}" if ways else ""


def counted(queue: Queue) -> str:
    """Return name and counts of a campaign that was begun."""
    parts = ", ".join(
        f"{count} {what}"
        for count, what in (
            (queue.count(DONE), "done"), (queue.count(LOST, STOPPED), "failed"),
            (queue.count(SKIPPED), "left out"), (queue.count(WAITING), "waiting"),
        )
        if count
    )  # fmt: skip
    return f"{queue.name}: {runs_text(len(queue.runs))}" + (f", {parts}" if parts else "")


def crash_text(queue: Queue) -> str:
    """Return what happened to a campaign whose program was killed, and what its start does."""
    run = queue.running
    if run is None:
        return "The program ended between two runs. Arm and start the campaign to go on."
    if run.recorded:
        return (
            f"The program ended after run {run.name}, before its results were noted. They are "
            f"computed when the campaign is started again."
        )
    lost = (
        f"and is repeated, as the plan says (repeat_lost = {queue.repeat_lost})"
        if run.attempts <= queue.repeat_lost
        else f"and is not repeated (repeat_lost = {queue.repeat_lost} in the plan)"
    )
    return (
        f"The program ended during run {run.name}. When the campaign is started again, the "
        f"recording of this run is read: if it is whole, the run is done; otherwise it is lost "
        f"{lost}."
    )


def arming_block(
    session: Session, found: PlanSurvey | None, queue: Queue, begun: bool, seen: str
) -> str:
    """Return why a batch cannot be armed, "" where it can, apart from what blocks the rig.

    ``seen`` is what the operator writes after a halt.
    """
    if found is None:
        return "the runs are being checked"
    if found.trouble or found.campaign is None or found.forecast is None:
        return found.trouble or "the plan has a fault"
    if begun:
        changed = queue.changed(
            found.campaign, found.forecast.digests, session.address, session.rig_text
        )
        if changed:
            return f"the campaign cannot be continued: {changed}"
        if not queue.waiting and queue.running is None:
            return "no run waits"
    elif found.refused:
        first = next(reason for reason in found.forecast.refused if reason)
        return f"{runs_text(found.refused)} cannot be played, the first of them as {first}"
    named = bool(session.operator.strip())
    if not is_simulated(session.address) and not named:
        return "the operator has no name: write it in Operator"
    if queue.halted and not (named and seen.strip()):
        return "the campaign is halted: look at the rig, then write your name and what you saw"
    return ""
