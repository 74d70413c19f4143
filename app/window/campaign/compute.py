"""Computations after a run of a campaign, in a process of their own.

The window stays at hand meanwhile, and a STOP ends them at once: the campaign does them again when
it goes on.
"""

from __future__ import annotations

import logging
import multiprocessing
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

from dearig.acquisition.interrupts import Interrupts
from dearig.batch.after import AfterRun, compute
from dearig.config.campaignfile import Campaign, load_campaign
from dearig.config.rigfile import RigFile
from dearig.drivers.processes.children import isolated_spawn
from dearig.errors import Interrupted
from dearig.progress import Progress, quiet
from dearig.window.jobs.program_errors import ErrorInProcess
from dearig.window.jobs.worker_process import Request, WorkerMessage, serve

__all__ = ["ComputeProcess"]

log = logging.getLogger(__name__)

_POLL = 0.2  # s between two looks at STOP


class ComputeProcess:
    """Stands in for ``compute``, and does it in a process that starts with the first call."""

    def __init__(self, interrupts: Interrupts) -> None:
        self._interrupts = interrupts
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None
        self._number = 0

    def __call__(
        self,
        campaign: Campaign,
        recording: Path,
        folder: Path,
        last_model: str,
        rig_file: RigFile,
        progress: Progress = quiet,
    ) -> AfterRun:
        """Compute as ``compute``; an error of the program is a problem that is noted."""
        if not (campaign.identify or campaign.validate or campaign.diagnose):
            return AfterRun()
        connection = self._started()
        self._number += 1
        given = (campaign.folder, recording, folder, last_model, rig_file)
        try:
            connection.send(Request(self._number, compute_of_folder, given))
            while True:
                if self._interrupts.asked():
                    self.close()
                    raise Interrupted("interrupted in a computation after a run, at 0 V")
                if connection.poll(_POLL):
                    answer: WorkerMessage = connection.recv()
                    if answer.kind != "progress":
                        break
                    progress(*answer.value)
        except (EOFError, OSError):
            self.close()
            log.exception("the process that computes after a run has ended")
            return AfterRun(problems=["the computation ended unexpectedly; the log has details"])
        if answer.kind == "done":
            found: AfterRun = answer.value
            return found
        words, trace = answer.value if answer.kind == "broken" else (str(answer.value), "")
        if trace:
            log.error("%s", words, exc_info=ErrorInProcess(trace))
        return AfterRun(problems=[words])

    def close(self) -> None:
        """End the process, and wait for it."""
        process, self._process = self._process, None
        connection, self._connection = self._connection, None
        if process is None or connection is None:
            return
        process.kill()
        process.join()
        connection.close()
        process.close()

    def _started(self) -> Connection:
        if self._connection is not None:
            return self._connection
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        self._process = context.Process(
            target=serve, args=(theirs,), name="dearig campaign computations", daemon=True
        )
        with isolated_spawn():
            self._process.start()
        theirs.close()
        self._connection = ours
        return ours


def compute_of_folder(
    plan_folder: Path,
    recording: Path,
    folder: Path,
    last_model: str,
    rig_file: RigFile,
    progress: Progress = quiet,
) -> AfterRun:
    """Compute as ``compute`` does for the campaign in ``folder``, whose plan is a copy there.

    A plan cannot be sent from one process to another. Files that it names are in ``plan_folder``.
    """
    plan = load_campaign(folder / "plan.toml", plan_folder)
    return compute(plan, recording, folder, last_model, rig_file, progress)
