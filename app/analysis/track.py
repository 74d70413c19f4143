"""Make the film follow a displacement: play what a tracking proposes, and let it learn.

Every run is a run of ``dearig.acquisition.run.record``: a sequence with the computed voltage passes
the gate, the interlocks and the guardian as any other, and is recorded as any other.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from dearig.acquisition.overlay import OverlayModel
from dearig.acquisition.rigs import kind_of
from dearig.acquisition.run import RunObserver, RunOptions, RunResult, record
from dearig.analysis.track_target import WITHIN, check_feasible
from dearig.analysis.tracking import Proposal, Tracking, TrackOutcome
from dearig.config.modelfile import ModelFile, model_toml
from dearig.config.rigfile import RigFile
from dearig.config.targetfile import LoadedTarget
from dearig.errors import DearigError, InputError, Interrupted
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet
from dearig.recording.reading.reader import open_recording
from dearig.recording.result_folder import result_folder
from dearig.units import runs_text

__all__ = ["track"]


def track(
    target: LoadedTarget,
    model: ModelFile,
    address: str,
    rig_file: RigFile,
    folder: Path,
    options: RunOptions,
    *,
    iterations: int = 5,
    compare: ModelFile | None = None,
    nearest: bool = False,
    within: float = WITHIN,
    observer: RunObserver | None = None,
    ended: Callable[[TrackOutcome], None] | None = None,
    progress: Progress = quiet,
) -> TrackOutcome:
    """Make the film on the rig at ``address`` follow ``target``, learning from run to run.

    The first run plays the voltage that ``model`` asks for, and up to ``iterations`` more what was
    learned; they end once nothing more is learned. With ``compare``, a linear map and that model
    are played before. Recordings and the sequences that were played are written to ``folder``. A
    target that the film misses by more than ``within`` m is refused; with ``nearest`` the nearest
    feasible one is followed. ``ended`` is called with what was done where a run ends early, before
    its error is raised.

    Raises ``InputError`` before anything is played for a target that cannot be reached, and what
    ``record`` raises.
    """
    tracking = Tracking(
        target, model, rig_file, iterations=iterations, compare=compare, within=within
    )
    if not nearest:
        check_feasible(target, tracking.inversion.unreachable, within)
    kind_of(address)  # refuses what is not a rig
    result_folder(folder, options.overwrite)
    many = iterations + 1 + (0 if compare is None else 2)

    def play(proposal: Proposal) -> RunResult:
        done = len(tracking.runs)
        progress("learning", done / many)
        wanted = _options(options, proposal, done)
        return _play(proposal, address, rig_file, folder, wanted, observer, progress)

    try:
        while (proposal := tracking.proposed) is not None:
            result = play(proposal)
            tracking.add(open_recording(result.path), result.margins)
            if tracking.settled:  # the film is spared runs that teach nothing
                break
    except (DearigError, KeyboardInterrupt) as error:
        stopped: DearigError
        if isinstance(error, DearigError):
            stopped = error
        else:
            stopped = Interrupted(
                f"interrupted between two runs, at 0 V; "
                f"{runs_text(len(tracking.runs), 'in')} {folder}"
            )
        status = "interrupted" if isinstance(stopped, Interrupted) else "stopped"
        if isinstance(stopped, InputError) and not tracking.runs:
            with contextlib.suppress(OSError):  # it may hold files of others
                folder.rmdir()
        elif ended is not None:
            ended(tracking.outcome(address, status, str(stopped)))
        if stopped is error:
            raise
        raise stopped from error
    return tracking.outcome(address, reason=tracking.settled if tracking.proposed else "")


def _options(options: RunOptions, proposal: Proposal, done: int) -> RunOptions:
    """Return the options of a run after ``done`` others."""
    notes = f"target {proposal.target!r}, {proposal.stem}"
    return replace(
        options,
        seed=options.seed + done,  # the noise of two runs is independent
        notes=f"{options.notes}; {notes}" if options.notes else notes,
    )


def _play(
    proposal: Proposal,
    address: str,
    rig_file: RigFile,
    folder: Path,
    options: RunOptions,
    observer: RunObserver | None,
    progress: Progress,
) -> RunResult:
    """Write the sequence of ``proposal`` to ``folder``, play it, and record it there."""
    model, overlay = proposal.model, None
    if model is not None and isinstance(model.model, Actuator):
        overlay = OverlayModel(
            model.name, model.model, toml=model_toml(model.name, model.model, model.history)
        )
    loaded = proposal.write(folder)
    try:
        return record(
            loaded, address, rig_file, folder / f"{proposal.stem}.h5", options, overlay=overlay,
            observer=observer, progress=progress,
        )  # fmt: skip
    except InputError:  # nothing was played
        for ending in ("csv", "toml"):
            (folder / f"{proposal.stem}.{ending}").unlink()
        raise
