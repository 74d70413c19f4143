"""State of a watched source as the page draws it: texts, numbers and lines."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from dearig.batch.queue import DONE, LOST, RUNNING, SKIPPED, STOPPED, WAITING, CampaignOutcome
from dearig.batch.watching import RECENT, Bins, Seen, SourceWatch
from dearig.errors import InputError
from dearig.printable import printable
from dearig.report.pages.campaign import campaign_summary, campaign_table, duration_text
from dearig.report.pages.watch_state import WatchedChannel, in_order, shown_channel

__all__ = ["look"]

#: Runs of a campaign in the table.
_RUNS = 30
#: Plots, at most; further channels are shown as values.
_PLOTS = 12
#: Events with the level "fault" that are shown as alarms.
_ALARMS = 3
#: Characters of one text, at most.
_TEXT = 600
#: Channels that share a plot with another one.
_WITH = {"voltage_monitor": "voltage_command", "displacement_model": "displacement"}
_TITLES = {"voltage_command": "voltage"}


def look(watch: SourceWatch) -> tuple[dict[str, Any], float | None]:
    """Look once at what is watched.

    Returns the state for the page, and the monotonic time in s at which the newest sample was
    written, None where there is none.
    """
    trouble = ""
    try:
        watch.look()
    except (InputError, OSError) as error:
        trouble = str(error)
    state, outcome = watch.recording, watch.outcome
    changed = None if state is None or not math.isfinite(state.changed) else state.changed
    return {
        "format": "dearig-watch-page/1",
        "source": _text(watch.source.resolve().name),
        "trouble": _text(trouble),
        "alarms": [_text(alarm) for alarm in _alarms(state, outcome)],
        "campaign": None if outcome is None else _campaign(outcome),
        "recording": None if state is None else _recording(state),
    }, changed


def _text(text: str) -> str:
    return printable(text, most=_TEXT)


def _alarms(state: Seen | None, outcome: CampaignOutcome | None) -> Iterator[str]:
    if outcome is not None:
        if outcome.queue.halted:
            yield f"Campaign halted: {outcome.queue.halted}"
        elif outcome.status == "killed":
            yield f"Campaign killed: {outcome.reason}"
    if state is not None:
        if state.abandoned:
            yield (
                "The run was killed: its recording has no end. Look at the amplifier: whether the "
                "output is at 0 V is not known here."
            )
        faults = [event for event in state.events if event.level == "fault"]
        yield from (f"At {event.time:.2f} s: {event.message}" for event in faults[-_ALARMS:])


def _campaign(outcome: CampaignOutcome) -> dict[str, Any]:
    queue = outcome.queue
    table = campaign_table(outcome, _RUNS)
    done = queue.count(DONE, LOST, STOPPED, SKIPPED)
    return {
        "name": _text(outcome.name),
        "status": outcome.status,
        "rig": _text(queue.rig),
        "summary": [_text(sentence) for sentence in campaign_summary(outcome)],
        "part": done / max(len(queue.runs), 1),
        "counts": {
            "done": queue.count(DONE), "failed": queue.count(LOST, STOPPED),
            "waiting": queue.count(WAITING, RUNNING), "skipped": queue.count(SKIPPED),
        },
        "time_left": duration_text(queue.time_left) if queue.count(WAITING) else "",
        "head": [_text(name) for name, _ in table.head],
        "runs": [
            {
                "cells": [_text(str(cell)) for cell in row.cells], "detail": _text(row.detail),
                "muted": row.muted, "mark": row.mark,
            }
            for row in table.rows
        ],
        "note": _text(table.note),
    }  # fmt: skip


def _recording(state: Seen) -> dict[str, Any]:
    names = in_order(state)
    shown = {name: shown_channel(name, state.described) for name in names}
    return {
        "name": _text(state.path.name),
        "status": "ended" if state.ended else "killed" if state.abandoned else "recording",
        "outcome": _text(state.outcome),
        "simulated": state.simulated,
        "time_s": round(state.time, 3),
        "duration_s": round(max(state.duration, state.time), 3),
        "samples": state.samples,
        "trouble": _text(state.trouble),
        "recent_s": RECENT,
        "channels": [_channel(state, name, shown[name]) for name in names],
        "plots": _plots(state, shown),
        "events": [
            {"time_s": round(e.time, 3), "level": e.level, "message": _text(e.message)}
            for e in state.events
        ],
    }


def _channel(state: Seen, name: str, shown: WatchedChannel) -> dict[str, Any]:
    return {
        "label": _text(shown.label), "unit": _text(shown.unit),
        "value": shown.text(state.now[name]), "peak": shown.text(state.peak[name]),
    }  # fmt: skip


def _plots(state: Seen, shown: dict[str, WatchedChannel]) -> list[dict[str, Any]]:
    """Return a plot for each quantity: a command with its monitor, a measurement with its model."""
    groups: dict[str, list[str]] = {}
    for name in shown:
        first = _WITH.get(name, name)
        groups.setdefault(first if first in shown else name, []).append(name)
    return [
        {
            "title": _text(_TITLES.get(first, shown[first].label)),
            "unit": _text(shown[first].unit),
            "lines": [
                {
                    "name": name if name in _WITH or name in _TITLES else "",
                    "label": _text(shown[name].label),
                    "recent": _line(state.recent[name], shown[name]),
                    "whole": _line(state.whole[name], shown[name]),
                }
                for name in names
            ],
        }
        for first, names in list(groups.items())[:_PLOTS]
    ]


def _line(bins: Bins, shown: WatchedChannel) -> dict[str, Any]:
    """Return start and width of the bins in s, and their ends; null where a bin has no value."""
    start, low, high = bins.dense()
    low, high = low * shown.factor, high * shown.factor
    largest = float(np.nanmax(np.abs([low, high]), initial=0.0)) if low.size else 0.0
    # between 1e-5 and 1e-4 of the largest value: at most a fiftieth of a pixel where a plot, which
    # is 170 pixels high, begins at 0
    digits = 5 - math.ceil(math.log10(largest)) if largest else 0
    return {
        "start": round(start, 6),
        "width": bins.width,
        "low": _values(low, digits),
        "high": _values(high, digits),
    }


def _values(values: np.ndarray, digits: int) -> list[float | None]:
    found = np.round(values, digits).tolist()
    return [None if math.isnan(value) else value for value in found]
