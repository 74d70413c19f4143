"""A campaign as a table of runs, as JSON for programs, and as an HTML page."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dearig.batch.queue import (
    DONE,
    LOST,
    PLAYED,
    RUNNING,
    SKIPPED,
    STOPPED,
    WAITING,
    CampaignOutcome,
    Queue,
)
from dearig.recording.content.fields import CONDITIONS
from dearig.recording.reading.origin import origins_of_files
from dearig.report.pages.head import head_of
from dearig.report.pages.html import picture, prefixes, write_page
from dearig.report.text.numbers import NO_VALUE, seconds, significant
from dearig.report.text.tables import Row, Table
from dearig.units import name_and_unit, runs_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dearig.batch.forecast import Forecast
    from dearig.batch.queue import RunState
    from dearig.config.campaignfile import Campaign

__all__ = [
    "campaign_json",
    "campaign_summary",
    "campaign_table",
    "forecast_json",
    "forecast_texts",
    "write_campaign_report",
]

#: Numbers of a run in the table, at most; all are in the JSON.
_NUMBERS = 6
#: Numbers that the page draws, at most.
_DRAWN = 8
_CAPTION = (
    "Numbers of the runs, each over the range of its own values. There are no intervals here: "
    "dearig study and dearig trends tell whether a number changes by more than its uncertainty."
)
_SHOWN_FIRST = (
    "mu_0_kPa", "fit_rms_um", "validation_rms_um", "diagnosis_rms_um",
    "peak_displacement_mm", *CONDITIONS,
)  # fmt: skip


def campaign_json(outcome: CampaignOutcome) -> dict[str, Any]:
    """Return ``outcome`` for ``--json``."""
    queue = outcome.queue
    return {
        "format": "dearig-campaign/1",
        **outcome.summary(),
        "skipped": queue.count(SKIPPED),
        "needs_acknowledgement": queue.halted or None,
        "runs": [
            {
                "name": run.name,
                "state": run.state,
                "recording": _recording(outcome.folder, run) or None,
                "extremes": str(outcome.folder / run.extremes) if run.extremes else None,
                "settings": run.settings,
                "warm_up": run.warm_up,
                "attempts": run.attempts,
                "reason": run.reason,
                "model": str(outcome.folder / run.model) if run.model else None,
                "numbers": run.numbers,
            }
            for run in queue.listed
        ],
    }


def _recording(folder: Path, run: RunState) -> str:
    """Return the recording of a run, "" where there is none or where it was reduced."""
    played = run.state in (*PLAYED, RUNNING) and not run.extremes
    return str(folder / run.recording) if run.recording and played else ""


def _recordings(outcome: CampaignOutcome) -> Iterator[Path]:
    """Yield the recordings of the runs that were played, in their order."""
    for run in outcome.queue.listed:
        if recording := _recording(outcome.folder, run):
            yield Path(recording)


def forecast_json(campaign: Campaign, forecast: Forecast) -> dict[str, Any]:
    """Return what a campaign will take for ``--json``."""
    return {
        "format": "dearig-campaign-check/1",
        "name": campaign.name,
        "planned": len(campaign.runs),
        "seconds": forecast.seconds,
        "bytes": forecast.size,
        "free_bytes": forecast.free,
        "runs": [
            {
                "name": run.name,
                "sequence": run.sequence,
                "duration_s": duration,
                "settings": dict(run.settings),
                "warm_up": run.warm_up,
                "kept": campaign.is_kept(run),
            }
            for run, duration in zip(campaign.runs, forecast.durations, strict=True)
        ],
    }


def forecast_texts(campaign: Campaign, forecast: Forecast) -> Iterator[str]:
    """Yield sentences on runs, time, disk and margins of a campaign that was not begun."""
    warm = sum(run.warm_up for run in campaign.runs)
    extra = f", of which {warm} to warm up" if warm else ""
    yield (
        f"{campaign.name}: {runs_text(len(campaign.runs))}{extra}, "
        f"{duration_text(forecast.seconds)} without computations, "
        f"{forecast.size / 1e6:.3g} MB of {forecast.free / 1e9:.3g} GB free"
    )
    for margin in forecast.margins:
        yield (
            f"  {margin.quantity}: {margin.reached:.4g} of {margin.allowed:.4g} {margin.unit} at "
            f"most"
        )


def duration_text(duration: float) -> str:
    """Return a duration in s as text: 26 s, 14 min, 3 h 20 min, 4 days 3 h."""
    minutes = round(duration / 60.0)
    if duration < 600.0:
        return seconds(duration)
    if minutes < 60:
        return f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    if hours < 48:
        return f"{hours} h {minutes} min"
    return f"{hours // 24} days {hours % 24} h"


def campaign_summary(outcome: CampaignOutcome) -> tuple[str, ...]:
    """Return sentences on how a campaign stands."""
    queue = outcome.queue
    counts = {
        "done": queue.count(DONE), "lost": queue.count(LOST),
        "stopped by an interlock": queue.count(STOPPED), "left out": queue.count(SKIPPED),
        "left": queue.count(WAITING, RUNNING),
    }  # fmt: skip
    counted = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
    found = [f"{runs_text(len(queue.runs))}: {counted}."]
    if queue.count(WAITING, RUNNING):
        found.append(f"What is left takes {duration_text(queue.time_left)}.")
    if outcome.reason:
        found.append(f"{outcome.reason[0].upper()}{outcome.reason[1:]}.")
    return tuple(found)


def numbers_shown(queue: Queue, most: int) -> list[str]:
    """Return the names of at most ``most`` numbers, those of the first interest first."""
    known = dict.fromkeys(name for run in queue.listed for name in run.numbers)
    first = [name for name in _SHOWN_FIRST if name in known]
    return [*first, *(name for name in known if name not in first)][:most]


def campaign_table(outcome: CampaignOutcome, most: int | None = None) -> Table:
    """Return the runs as a table; of more than ``most`` the last that were played and the next."""
    queue = outcome.queue
    names = numbers_shown(queue, _NUMBERS)
    runs = list(queue.listed)
    left_out = 0
    if most is not None and len(runs) > most:
        played = sum(run.state != WAITING for run in runs)
        start = min(max(played - most * 3 // 4, 0), len(runs) - most)
        left_out = len(runs) - most
        runs = runs[start : start + most]
    # a file is named only where it is not the run's name with .h5
    files = [_other_file(run) for run in runs]
    filed = any(files)
    settings = _varied(queue)
    rows = [
        Row(
            (
                run.name,
                *(_setting(run, path) for path in settings),
                run.state,
                *([file] if filed else []),
                *(_shown(run, n) for n in names),
            ),
            detail=run.reason,
            muted=run.state in (WAITING, SKIPPED),
            mark=run.state in (LOST, STOPPED),
        )
        for run, file in zip(runs, files, strict=True)
    ]
    columns = [*settings.values(), "State", *(["File"] if filed else []), *names]
    head = (("", ""), *((name, "") for name in columns))
    note = f"{left_out} more runs are not listed." if left_out else ""
    return Table("Runs", head, tuple(rows), note)


def _varied(queue: Queue) -> dict[str, str]:
    """Return the settings that differ between runs, with the heads of their columns."""
    values: dict[str, set[str]] = {}
    for run in queue.listed:
        for path in run.settings:
            values.setdefault(path, set())
    for path, found in values.items():
        found.update(_setting(run, path) for run in queue.listed)
    heads = {path: _head(path) for path, found in values.items() if len(found) > 1}
    named = list(heads.values())
    return {path: head if named.count(head) == 1 else path for path, head in heads.items()}


def _head(path: str) -> str:
    name, unit = name_and_unit(path.rpartition(".")[2])
    return f"{name} ({unit})" if unit else name


def _setting(run: RunState, path: str) -> str:
    value = run.settings.get(path)
    return NO_VALUE if value is None else json.dumps(value, default=str)


def _other_file(run: RunState) -> str:
    """Return the file of a run whose name is not that of the run, "" for one that is."""
    if run.state in (WAITING, SKIPPED):
        return ""
    file = run.extremes or run.recording
    return "" if file == f"{run.name}.h5" else file


def _shown(run: RunState, name: str) -> str:
    value = run.numbers.get(name)
    return NO_VALUE if value is None else significant(value, 4)


def write_campaign_report(outcome: CampaignOutcome, path: str | Path) -> Path:
    """Write the page of a campaign to the HTML file ``path``. Raises ``InputError``."""
    return write_page(path, "campaign.html.j2", _contents(outcome))


def _contents(outcome: CampaignOutcome) -> Callable[[], dict[str, Any]]:
    def contents() -> dict[str, Any]:
        queue = outcome.queue
        names = numbers_shown(queue, _DRAWN)
        figures = [numbers_figure(queue, names)] if names else []
        return {
            "title": outcome.name,
            "lead": "Campaign",
            "head": head_of(origins_of_files(_recordings(outcome))),
            "summary": campaign_summary(outcome),
            "warnings": [queue.halted] if queue.halted else [],
            "runs": campaign_table(outcome),
            "pictures": [picture(f, prefixes(), _CAPTION) for f in figures],
            "provenance": (
                ("Folder", (str(outcome.folder),)),
                ("Rig", (queue.rig,)),
                ("Begun", (queue.started,)),
            ),
        }

    return contents


def numbers_figure(queue: Queue, names: Sequence[str]) -> Figure:
    """Draw each number of the runs against the order of the runs, one below the other."""
    from matplotlib.ticker import MaxNLocator

    from dearig.report.figures.defaults import style
    from dearig.report.figures.style import WIDTH, blank, few_ticks

    runs = list(enumerate(queue.listed, start=1))
    with style():
        figure = blank(WIDTH, 0.8 + 1.1 * len(names))
        axes = np.atleast_1d(figure.subplots(len(names), 1, sharex=True))
        for ax, name in zip(axes, names, strict=True):
            points = [(place, run.numbers[name]) for place, run in runs if name in run.numbers]
            ax.plot(*zip(*points, strict=True), ".-", linewidth=0.8)
            ax.set_ylabel(name, fontsize="x-small")
            few_ticks(ax, y=3)
            ax.ticklabel_format(axis="y", useOffset=False)
        axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
        axes[-1].set_xlabel("Run, in the order in which they are played")
        figure.align_ylabels(list(axes))
    return figure
