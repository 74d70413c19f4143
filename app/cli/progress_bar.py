"""The progress bar of a command."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from datetime import timedelta

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from dearig.acquisition.interrupts import raise_interrupt
from dearig.cli.console import PrintableConsole
from dearig.cli.lost_interrupt import raise_lost
from dearig.printable import printable

__all__ = ["progress"]


class _Times(ProgressColumn):
    """The time so far, and where it is known the time to go, each with its name after it."""

    max_refresh = 0.5

    def render(self, task: Task) -> Text:
        """Return both times."""
        past = task.finished_time if task.finished else task.elapsed
        words = [f"{_clock(past or 0.0)} so far"]
        if task.time_remaining is not None and not task.finished:
            words.append(f"about {_clock(task.time_remaining)} to go")
        return Text(", ".join(words))


def _clock(seconds: float) -> str:
    return str(timedelta(seconds=max(int(seconds), 0)))


@contextmanager
def progress(
    description: str, console: Console | None = None, whole: bool = False, computes: bool = False
) -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar on standard error while the body runs.

    Gives a callback ``(stage, fraction)`` with the fraction of that stage that is done. The bar
    restarts with every stage; the elapsed time does not. With ``whole`` the fraction is of all the
    work, and a new stage only changes the bar's text. With ``computes`` the text counts the kernels
    while any are compiled. Nothing is written where standard error is not a terminal.
    """
    raise_interrupt()  # one that an import has dropped
    console = PrintableConsole(stderr=True) if console is None else console
    if not console.is_terminal:
        yield _unseen
        return
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=None),
        TextColumn("{task.percentage:>3.0f} %", markup=False),
        _Times(),
        console=console,
        transient=True,
        expand=True,
        # rich's copies of both streams would obey control characters in what others write
        redirect_stdout=False,
        redirect_stderr=False,
    )
    task = bar.add_task(description, total=1.0)
    current = ""

    def report(stage: str, fraction: float) -> None:
        nonlocal current
        raise_lost()
        stage = printable(stage)
        done = min(max(fraction, 0.0), 1.0) if math.isfinite(fraction) else 0.0
        if stage != current and whole:
            current = stage
            bar.update(task, description=f"{description}: {stage}")
        elif stage != current:
            # the remaining time is estimated from the speed, which differs between stages
            current = stage
            began = bar.tasks[0].start_time
            bar.reset(task, total=1.0, description=f"{description}: {stage}")
            bar.tasks[0].start_time = began
        bar.update(task, completed=done)

    def compiled(ready: int, needed: int) -> None:
        words = f"compiling, kernel {ready} of {needed}" if ready < needed else current
        bar.update(task, description=f"{description}: {words}" if words else description)

    with bar, _kernels_counted(compiled) if computes else nullcontext():
        yield report


def _kernels_counted(report: Callable[[int, int], None]) -> AbstractContextManager[None]:
    from dearig.acquisition.compilation import compilation_reported

    return compilation_reported(report)


def _unseen(stage: str, fraction: float) -> None:  # noqa: ARG001
    """Show nothing."""
    raise_lost()
