"""The command that looks on while a run or a campaign goes on, and changes nothing."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dearig.cli.options import Force, Json
from dearig.cli.output import check_files, console_for, write_result
from dearig.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from dearig.batch.campaign import CampaignOutcome
    from dearig.batch.watching import RecordingWatch, Seen

__all__ = ["commands"]

commands = typer.Typer()

_CHANNELS = (
    ("voltage_command", "command", 1e-3, "kV", 3),
    ("voltage_monitor", "monitor", 1e-3, "kV", 3),
    ("current_monitor", "current", 1e3, "mA", 3),
    ("displacement", "displacement", 1e3, "mm", 4),
    ("displacement_model", "model", 1e3, "mm", 4),
    ("temperature", "temperature", 1.0, "degC", 2),
)
_BARS = "\u2581\u2582\u2583\u2584\u2585\u2586\u2587\u2588"
_ASCII_BARS = "_.-=*#"
_RUNS = 12  # runs of a campaign that are shown


@commands.command(rich_help_panel="Rig")
def watch(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="DIR|FILE.h5",
            help="Folder of a campaign, a folder of recordings (the newest is shown), or a "
            "recording.",
            show_default=False,
        ),
    ],
    every: Annotated[
        float, typer.Option(min=0.1, max=3600.0, help="Seconds between two looks.")
    ] = 0.5,
    once: Annotated[bool, typer.Option("--once", help="Look once, and end.")] = False,
    json: Json = None,
    force: Force = False,
) -> None:
    """Look on while a run or a campaign goes on, in this or another process.

    It only reads, and ends when the run or the campaign ends, or with ctrl-C. --json looks once.
    """
    check_files(force, (source,) if source.is_file() else (), json=json)
    view = _View(source)
    console = console_for(json)
    if once or json is not None or not console.is_terminal:
        console.print(view.look(console))
        write_result(view.json, json)
        return
    _show(view, console, every)


def _show(view: _View, console: Console, every: float) -> None:
    from rich.live import Live

    shown = view.look(console)
    try:
        # warnings and log lines are printed as they are: Live does not redirect them
        with Live(
            shown, console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False
        ) as live:
            while not view.ended:
                time.sleep(every)
                live.update(view.look(console), refresh=True)
    except KeyboardInterrupt:
        return  # the end that a watcher has


class _View:
    """What is shown of a campaign, of a recording, or of both."""

    def __init__(self, source: Path) -> None:
        from dearig.batch.journal import JOURNAL

        if not source.exists():
            raise InputError(f"{source} is not there")
        self._source = source
        self._campaign = source.is_dir() and (source / JOURNAL).exists()
        self._watch: RecordingWatch | None = None
        self._outcome: CampaignOutcome | None = None
        self.ended = False

    def look(self, console: Console) -> RenderableType:
        """Return the present state to be printed."""
        from rich.console import Group

        ascii_only = console.options.ascii_only
        parts: list[RenderableType] = []
        path: Path | None = self._source
        if self._campaign:
            path = self._look_at_campaign(parts)
        elif self._source.is_dir():
            path = self._newest()
        state = None if path is None else self._follow(path)
        if state is not None:
            parts += _recording_lines(state, ascii_only)
        if not self._campaign:
            self.ended = state is None or state.ended or self._is_over()
        return Group(*parts)

    def _look_at_campaign(self, parts: list[RenderableType]) -> Path | None:
        from dearig.batch.watching import seen
        from dearig.cli.terminal import campaign_runs

        outcome = self._outcome = seen(self._source)
        self.ended = outcome.status not in ("running", "paused")
        parts.append(campaign_runs(outcome, _RUNS))
        run = outcome.queue.running
        if run is None or run.recorded or not (self._source / run.recording).exists():
            return None
        return self._source / run.recording

    def _newest(self) -> Path:
        from dearig.batch.watching import newest_recording

        newest = newest_recording(self._source)
        if newest is None:
            raise InputError(f"{self._source} has neither a campaign nor a recording")
        return newest

    def _follow(self, path: Path) -> Seen:
        from dearig.batch.watching import RecordingWatch

        if self._watch is None or self._watch.state.path != path:
            self._watch = RecordingWatch(path)
        return self._watch.look()

    def _is_over(self) -> bool:
        """Return True if no process writes the recording any more: its run was killed."""
        from dearig.recording.lock import refuse_in_use

        assert self._watch is not None  # noqa: S101  (made by the look before)
        try:
            refuse_in_use(self._watch.state.path)
        except InputError:
            return False
        return True

    @property
    def json(self) -> dict[str, Any]:
        """The present state for programs, in SI units."""
        from dearig.report.campaign_page import campaign_json

        state = None if self._watch is None else self._watch.state
        return {
            "format": "dearig-watch/1",
            "campaign": None if self._outcome is None else campaign_json(self._outcome),
            "recording": None if state is None else {
                "path": str(state.path),
                "samples": state.samples,
                "time_s": state.time,
                "ended": state.ended,
                "now": state.now,
                "peak": state.peak,
                "events": [
                    {"time_s": e.time, "level": e.level, "message": e.message}
                    for e in state.events
                ],
                "trouble": state.trouble,
            },
        }  # fmt: skip


def _recording_lines(state: Seen, ascii_only: bool) -> Iterator[RenderableType]:
    from rich.text import Text

    from dearig.printable import printable

    ended = "ended" if state.ended else "recording"
    yield Text()
    yield Text(printable(f"{state.path}: {ended}, {state.time:.1f} s, {state.samples} samples"))
    if state.trouble:
        yield Text(printable(state.trouble), style="yellow")
    for name, label, factor, unit, digits in _CHANNELS:
        if name in state.now:
            now, peak = state.now[name] * factor, state.peak[name] * factor
            yield Text(f"  {label:13s} {now:10.{digits}f} {unit:4s}  peak {peak:10.{digits}f}")
    if state.trace.size > 1:
        yield Text(f"  last {'10 s':10s} {_bars(state, ascii_only)}")
    for event in state.events:
        yield Text(printable(f"  {event.time:8.2f} s  {event.level}: {event.message}"))


def _bars(state: Seen, ascii_only: bool) -> str:
    """Return the newest displacement as a row of bars."""
    bars = _ASCII_BARS if ascii_only else _BARS
    low, high = float(state.trace.min()), float(state.trace.max())
    span = high - low
    places = [int((v - low) / span * (len(bars) - 1) + 0.5) if span else 0 for v in state.trace]
    return "".join(bars[place] for place in places)
