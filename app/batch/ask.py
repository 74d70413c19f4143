"""Ask a running campaign to pause, go on, end, leave out a run or play one next."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path

from dearig.batch.journal import JOURNAL, REQUESTS, append_line
from dearig.batch.queue import WAITING, Queue
from dearig.errors import InputError
from dearig.units import counted

__all__ = ["ask"]


def ask(folder: Path, requests: Sequence[tuple[str, str]], by: str = "") -> None:
    """Append ``requests`` to the requests of the campaign in ``folder``.

    Each is one of ``REQUEST_KINDS`` and the name of a run, "" where it needs none. Raises
    ``InputError`` for a folder without a campaign, for a campaign that has no run left, and for a
    run that does not wait.
    """
    queue = Queue.of(folder / JOURNAL) if folder.is_dir() else Queue()
    if not queue.runs:
        raise InputError(f"{folder} has no campaign: there is no journal {JOURNAL}")
    for what, name in requests:
        if not name:
            if not queue.waiting and queue.running is None:
                raise InputError(
                    f"the campaign in {folder} is finished: none of its "
                    f"{counted(len(queue.runs), 'run')} waits, so there is nothing to {what}"
                )
            continue
        run = queue.runs.get(name)
        if run is None:
            near = difflib.get_close_matches(name, queue.runs, n=1)
            raise InputError(
                f"{name} is not a run of the campaign in {folder}"
                + (f"; did you mean {near[0]}?" if near else "")
            )
        if run.state != WAITING:
            raise InputError(f"run {name} is {run.state}; only a run that waits can be moved")
    for what, name in requests:
        append_line(folder / REQUESTS, {"event": what, "run": name, "by": by})
