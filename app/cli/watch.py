"""The command that looks on while a run or a campaign goes on, and changes nothing."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dearig.cli.last_words import output_failure
from dearig.cli.options import Force, Json
from dearig.cli.output import check_files, console_for, print_line, write_result
from dearig.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from dearig.batch.watching import Seen, SourceWatch

__all__ = ["commands"]

commands = typer.Typer()

_BARS = "\u2581\u2582\u2583\u2584\u2585\u2586\u2587\u2588"
_ASCII_BARS = "_.-=*#"
_RUNS = 12  # runs of a campaign that are shown
_EVENTS = 5  # the last ones, below the values
_COLUMNS = 60  # bars of the newest displacement


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
    port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            help="Show it as a web page at this port, to be opened in a browser; 0 takes a free "
            "one.",
            show_default="no page",
        ),
    ] = None,
    host: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Address of this computer at which the page can be reached from others; they need "
            "the token in the printed address.",
            show_default="127.0.0.1",
        ),
    ] = None,
    token_file: Annotated[
        Path | None,
        typer.Option(
            "--token-file",
            metavar="FILE",
            help="Take the token from this file, so that the page keeps its address.",
            show_default="a new token each time",
        ),
    ] = None,
    every: Annotated[
        float | None,
        typer.Option(
            min=0.05,
            max=3600.0,
            help="Seconds between two looks.",
            show_default="0.5, and 0.1 for the page",
        ),
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="Print one snapshot and exit.")] = False,
    json: Json = None,
    force: Force = False,
) -> None:
    """Look on while a run or a campaign goes on, in this or another process.

    It only reads, and ends when the run or the campaign ends, or with ctrl-C. --json looks once.
    --port shows a web page until ctrl-C, which takes the extra "web".
    """
    from dearig.batch.watching import SourceWatch

    check_files(force, (source,) if source.is_file() else (), json=json)
    if port is None and (host is not None or token_file is not None):
        raise InputError("--host and --token-file belong to the web page: give its --port too")
    if port is not None and (once or json is not None):
        raise InputError("--once and --json look once, and --port shows a page: give one of them")
    view = SourceWatch(source)
    if port is not None:
        _serve(view, port, host, token_file, every or 0.1)
        return
    from dearig.report.pages.watch_state import watch_json

    console = console_for(json)
    if once or json is not None or not console.is_terminal:
        console.print(_look(view, console))
        write_result(watch_json(view), json)
        return
    _show(view, console, every or 0.5)


def _serve(
    view: SourceWatch, port: int, host: str | None, token_file: Path | None, every: float
) -> None:
    from dearig.web.server import serve_watch, token_from

    token = None if token_file is None else token_from(token_file)
    console = console_for(None)

    def started(address: str, shared: bool) -> None:
        """Tell where the page is."""
        print_line(console, f"{view.source} is shown at {address} until ctrl-C")
        if shared:
            print_line(
                console,
                "Everyone who has this address can watch; no one can change anything. "
                "The connection is not encrypted.",
            )

    serve_watch(view, port, host, token, every, started)


def _show(view: SourceWatch, console: Console, every: float) -> None:
    from rich.live import Live

    shown = _look(view, console)
    try:
        # warnings and log lines are printed as they are: Live does not redirect them
        with Live(
            shown, console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False
        ) as live:
            while not view.ended and output_failure() is None:
                time.sleep(every)
                live.update(_look(view, console), refresh=True)
    except KeyboardInterrupt:
        return  # the end that a watcher has


def _look(view: SourceWatch, console: Console) -> RenderableType:
    """Return the present state to be printed."""
    from rich.console import Group

    from dearig.cli.terminal import campaign_runs

    view.look()
    parts: list[RenderableType] = []
    if view.outcome is not None:
        parts.append(campaign_runs(view.outcome, _RUNS))
    if view.recording is not None:
        parts += _recording_lines(view.recording, console.options.ascii_only)
    return Group(*parts)


def _recording_lines(state: Seen, ascii_only: bool) -> Iterator[RenderableType]:
    from rich.text import Text

    from dearig.batch.watching import RECENT
    from dearig.printable import printable
    from dearig.report.pages.campaign import duration_text
    from dearig.report.pages.watch_state import in_order, shown_channel

    how = "ended" if state.ended else "killed" if state.abandoned else "recording"
    if how == "recording" and state.age is not None and not state.live:
        age = duration_text(state.age) if state.age > 600.0 else f"{state.age:.0f} s"
        how = f"no new data for {age}"
    simulated = ", simulated" if state.simulated else ""
    yield Text()
    yield Text(
        printable(f"{state.path}: {how}, {state.time:.1f} s, {state.samples} samples{simulated}")
    )
    if state.trouble:
        yield Text(printable(state.trouble), style="yellow")
    if state.now and not state.live:
        look = "" if state.ended else "; look at the amplifier: its voltage now is not known here"
        yield Text(f"  not live, these are the last samples{look}", style="yellow")
    for name in in_order(state):
        shown = shown_channel(name, state.described)
        now, peak = shown.text(state.now[name]), shown.text(state.peak[name])
        text = f"  {shown.label:13s} {now:>10s} {shown.unit:4s}  peak {peak:>10s}"
        if ascii_only:
            text = text.replace("\u00b0", "deg").encode("ascii", "replace").decode()
        yield Text(printable(text))
    if "displacement" in state.recent:
        yield Text(f"  last {f'{RECENT:g} s':10s} {_bars(state, ascii_only)}")
    for event in state.events[-_EVENTS:]:
        yield Text(printable(f"  {event.time:8.2f} s  {event.level}: {event.message}"))


def _bars(state: Seen, ascii_only: bool) -> str:
    """Return the newest displacement as a row of bars."""
    import numpy as np

    bars = _ASCII_BARS if ascii_only else _BARS
    _, lows, highs = state.recent["displacement"].extremes
    trace = [float(part.mean()) for part in np.array_split(0.5 * (lows + highs), _COLUMNS)
             if part.size]  # fmt: skip
    low, high = min(trace), max(trace)
    span = high - low
    places = [int((v - low) / span * (len(bars) - 1) + 0.5) if span else 0 for v in trace]
    return "".join(bars[place] for place in places)
