"""Work of the page Follow that its worker's process does: invert, learn, write the report."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from dearig.acquisition.plan import plan
from dearig.analysis.tracking import Tracking
from dearig.config.modelfile import ModelFile, load_model
from dearig.config.rigfile import RigFile
from dearig.config.targetfile import parse_target
from dearig.drivers.gate import Margin
from dearig.errors import InputError
from dearig.model.film.material import TABLE_3
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet
from dearig.recording.reading.reader import open_recording
from dearig.report.pages.track import write_track_report

__all__ = [
    "FollowRequest",
    "PlayedRun",
    "TrackingState",
    "begin_following",
    "learn_from",
    "write_report",
]


@dataclass(frozen=True)
class FollowRequest:
    """What is to be followed: the target as ``toml``, whose tables are in ``folder``.

    ``model`` is a model file, None for the thesis model. The rig is at ``address``. ``within`` in m
    is the distance from the target that is accepted.
    """

    toml: str
    folder: Path
    model: Path | None
    address: str
    rig_file: RigFile
    within: float


@dataclass(frozen=True, eq=False)
class TrackingState:
    """How far the runs of a request have come.

    ``margins`` are those of the proposed run, or ``reasons`` say why the gate refuses it.
    """

    request: FollowRequest
    tracking: Tracking
    margins: tuple[Margin, ...] = ()
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlayedRun:
    """The ``recording`` of a run; ``sequence`` is the TOML of the proposed one."""

    recording: Path
    sequence: str


def begin_following(
    request: FollowRequest, film: str = "", progress: Progress = quiet
) -> TrackingState:
    """Compute the voltage of the first run, and check it with the gate for the ``film`` by name.

    Raises ``InputError``.
    """
    target = parse_target(request.toml, "the target", request.folder)
    progress("computing the voltage", 0.0)
    if request.model is None:
        rig_file = request.rig_file
        actuator = Actuator(rig_file.as_film(), rig_file.as_load(), TABLE_3)
        model = ModelFile("thesis (Table 3)", actuator)
    else:
        model = load_model(request.model)
    tracking = Tracking(target, model, request.rig_file, iterations=None, within=request.within)
    return _checked(TrackingState(request, tracking), film, progress)


def learn_from(
    followed: TrackingState, played: PlayedRun, film: str = "", progress: Progress = quiet
) -> TrackingState | None:
    """Learn from a run, and return what is proposed next; None if it played something else.

    Raises ``InputError`` for a run from which nothing can be learned.
    """
    recording = open_recording(played.recording)
    if recording.sequence_toml != played.sequence:
        return None
    progress("learning from the run", 0.0)
    followed.tracking.add(recording, followed.margins)
    return _checked(followed, film, progress)


def write_report(followed: TrackingState, path: Path, progress: Progress = quiet) -> Path:
    """Write the report of all runs to ``path``."""
    progress("writing the report", 0.0)
    return write_track_report(followed.tracking.outcome(followed.request.address), path)


def _checked(followed: TrackingState, film: str, progress: Progress) -> TrackingState:
    """Return ``followed`` with what the gate says of the proposed run."""
    request, proposed = followed.request, followed.tracking.proposed
    if proposed is None:
        raise InputError("all runs are made")
    planned = plan(proposed.sequence(), request.rig_file, film=film, progress=progress)
    margins = () if planned.waveform is None else planned.waveform.margins
    return replace(followed, margins=margins, reasons=planned.reasons)
