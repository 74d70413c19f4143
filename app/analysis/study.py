"""A fit or a diagnosis in a folder of its own, with model, report and residuals."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dearig.analysis.diagnose import diagnose_recordings
from dearig.analysis.identify import identify_recordings
from dearig.analysis.outcomes import (
    Comparison,
    DiagnoseOutcome,
    IdentifyOutcome,
    save_fitted_model,
)
from dearig.analysis.readings.compatibility import of_rig
from dearig.analysis.readings.opening import open_all
from dearig.analysis.residual import even, spectrum
from dearig.config.parameterfile import Stated
from dearig.config.rigfile import RigFile
from dearig.errors import InputError
from dearig.model.residual import Dependence, MissingStress, Signature
from dearig.progress import Progress, quiet
from dearig.recording.reading.recording import Recording
from dearig.recording.result_folder import numbered_folder

__all__ = ["Residual", "Study", "StudyRequest", "Trace", "study"]


@dataclass(frozen=True)
class StudyRequest:
    """Settings of a study.

    ``diagnose`` or else identify, with Maxwell ``branches``, a ``spring`` (for identify) and
    ``drive`` command or monitor. ``train`` are fitted, ``validation`` read once at the end.
    ``limits`` is the rig file within whose limits an experiment is proposed; film and load are
    those of the recordings. ``ended_early`` is keep, cut or leave-out: what is done with recordings
    whose runs ended early. ``parameters`` is what is known of parameters, as in a
    parameter file.
    """

    diagnose: bool
    train: tuple[Path, ...]
    validation: tuple[Path, ...]
    branches: int = 3
    spring: str = "gent"
    drive: str = "command"
    limits: RigFile | None = None
    ended_early: str = "keep"
    parameters: Stated = field(default_factory=dict)


@dataclass(frozen=True)
class Trace:
    """A named curve in SI units."""

    name: str
    x: np.ndarray
    y: np.ndarray


@dataclass(frozen=True)
class Residual:
    """Residual of one recording, with the thesis's model and then with the effects found.

    ``over_time`` (measured less model, m or Pa) and ``density`` (its amplitude density per root Hz)
    have one trace each, or two. ``noise`` is the floor of one reading and ``floor`` its density.
    ``dependences`` and ``missing`` are of a diagnosis, before and after.
    """

    name: str
    kind: str
    noise: float | None
    floor: float | None
    over_time: tuple[Trace, ...]
    density: tuple[Trace, ...]
    dependences: tuple[tuple[Dependence, ...], ...] = ()
    missing: tuple[MissingStress, ...] = ()
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Study:
    """Result of a task: outcome, residuals of the recordings, and the files written."""

    task: StudyRequest
    outcome: IdentifyOutcome | DiagnoseOutcome
    residuals: tuple[Residual, ...]
    model: Path
    report: Path


def study(
    task: StudyRequest,
    folder: Path,
    write_report: Callable[[IdentifyOutcome | DiagnoseOutcome, Path], object],
    *,
    clock: Callable[[], float] = time.monotonic,
    progress: Progress = quiet,
) -> Study:
    """Do ``task`` in a new folder within ``folder``: study-1, study-2, ...

    ``write_report`` writes the page next to the model. The first ctrl-C during a diagnosis keeps
    what was found. Raises ``InputError`` for a task that cannot be done; the folder is made only
    after the computation, when there is something to put into it.
    """
    if not task.train:
        raise InputError("no recording was chosen to fit; choose one or more")
    if not (folder.is_dir() and os.access(folder, os.W_OK)):
        raise InputError(f"{folder} cannot be written to; choose another folder for the results")
    found: IdentifyOutcome | DiagnoseOutcome
    train = open_all(task.train)
    if task.diagnose:
        found = diagnose_recordings(
            train, validation=task.validation, branches=task.branches, drive=task.drive,
            rig_file=_rig_of(task.limits, train), parameters=task.parameters,
            ended_early=task.ended_early, clock=clock, progress=progress,
        )  # fmt: skip
    else:
        found = identify_recordings(
            train, validation=task.validation, branches=(task.branches,), spring=task.spring,
            drive=task.drive, parameters=task.parameters, ended_early=task.ended_early,
            clock=clock, progress=progress,
        )  # fmt: skip
    where = numbered_folder(folder, "study")
    model, report = where / "model.toml", where / "report.html"
    found = save_fitted_model(found, model)
    progress("report", 1.0)
    write_report(found, report)
    if isinstance(found, DiagnoseOutcome):
        return Study(task, found, _diagnosed(found), model, report)
    residuals = tuple(_compared(c) for c in (*found.train, *found.validation))
    return Study(task, found, residuals, model, report)


def _rig_of(limits: RigFile | None, train: Sequence[Recording]) -> RigFile | None:
    """Return the limits of the rig with the film and load of the recordings, if they name them."""
    if limits is None:
        return None
    for recording in train:
        if recording.film is not None and recording.load is not None:
            return of_rig(limits, recording.film, recording.load)
    return limits


def _diagnosed(outcome: DiagnoseOutcome) -> tuple[Residual, ...]:
    finding = outcome.finding
    found = []
    for before in finding.before:
        changed = bool(finding.steps)
        both = [before, *(_of(finding.after, before.record) if changed else [])]
        missing = [
            *_of(finding.missing_before, before.record),
            *(_of(finding.missing_after, before.record) if changed else []),
        ]
        found.append(
            Residual(
                name=before.record,
                kind=outcome.kind,
                noise=before.noise,
                floor=float(np.sqrt(before.floor_density)),
                over_time=tuple(Trace("", s.time, s.residual) for s in both),
                density=tuple(_density(s) for s in both),
                dependences=tuple(s.dependences for s in both),
                missing=tuple(missing),
                words=before.words,
            )
        )
    return tuple(found)


def _of(found: Sequence[Any], record: str) -> list[Any]:
    return [item for item in found if item.record == record]


def _density(signature: Signature) -> Trace:
    positive = (signature.frequency > 0.0) & (signature.density > 0.0)
    return Trace("", signature.frequency[positive], np.sqrt(signature.density[positive]))


def _compared(comparison: Comparison) -> Residual:
    good = np.isfinite(comparison.measured)
    time_ = comparison.time[good]
    left = comparison.measured[good] - comparison.model[good]
    step, evenly = even(time_, left)
    noise = comparison.noise
    return Residual(
        name=comparison.name,
        kind=comparison.kind,
        noise=noise,
        # white noise of this size at this rate
        floor=None if noise is None else noise * float(np.sqrt(2.0 * step)),
        over_time=(Trace("", time_, left),),
        density=(Trace("", *spectrum(step, evenly)),),
        words=comparison.warnings,
    )
