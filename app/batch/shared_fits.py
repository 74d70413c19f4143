"""One task of a study whose films share parameters: the recordings of one film, fitted together."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Sequence

from dearig.analysis.shared import identify_shared
from dearig.batch.fits import (
    ONE_AT_A_TIME,
    FitTask,
    Row,
    StudyOptions,
    Subject,
    about,
    parameter_columns,
)
from dearig.batch.numbers import errors_of, parameter_of, rejection_of
from dearig.errors import InputError
from dearig.progress import Progress, quiet
from dearig.recording.files import one_line
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording

__all__ = ["film_task", "fit_film", "rows_of"]

log = logging.getLogger(__name__)


def film_task(film: str, members: Sequence[tuple[Subject, str]], options: StudyOptions) -> FitTask:
    """Return the task of ``film``; ``members`` are its recordings with the keys of their rows."""
    ordered = sorted(members, key=lambda member: member[0].name)
    digest = hashlib.sha256("\n".join(key for _, key in ordered).encode()).hexdigest()
    named = tuple((subject.name, subject.path) for subject, _ in ordered)
    return FitTask(film, named[0][1], digest, options, named)


def fit_film(task: FitTask, progress: Progress = quiet) -> Row:
    """Return the ``rows`` of a film's recordings; one that cannot be read has no result.

    Where the others cannot be fitted together either, no recording has a result.
    """
    rows: dict[str, Row] = {}
    good: list[tuple[str, Recording]] = []
    with ONE_AT_A_TIME:
        for name, path in task.recordings:
            row: Row = {"recording": name, "state": "failed", "reason": ""}
            try:
                recording = open_recording(path)
                row |= about(recording)
                good.append((name, recording))
            except InputError as error:
                row["reason"] = str(error).replace(str(path), name)
            rows[name] = row
        done: Row = {"recording": task.name, "state": "ok", "reason": "", "sha256": task.key}
        try:
            _fit(task.options, good, rows, progress)
        except InputError as error:
            for name, recording in good:
                rows[name]["reason"] = str(error).replace(str(recording.path), name)
        except Exception as error:  # one film must not cost the rows of the others
            log.exception("unexpected error with film %s", task.name)
            for name, _ in good:
                reason = f"unexpected error ({type(error).__name__}: {one_line(error)})"
                rows[name]["reason"] = f"{name}: {reason}"
            del done["sha256"]  # such rows are not kept
    return {**done, "rows": list(rows.values())}


def _fit(
    options: StudyOptions,
    good: Sequence[tuple[str, Recording]],
    rows: dict[str, Row],
    progress: Progress,
) -> None:
    """Fit the recordings ``good`` together, and enter the results in their ``rows``."""
    if not good:
        return
    fitted = identify_shared(
        [recording for _, recording in good], options.own, branches=options.branches,
        spring=options.spring, drive=options.drive, ended_early=options.ended_early,
        progress=progress,
    )  # fmt: skip
    by_path = {outcome.path: outcome for outcome in fitted}
    for name, recording in good:
        outcome = by_path.get(recording.path)
        if outcome is None:
            rows[name]["reason"] = f"{name}: its run ended early, and such ones are left out"
            continue
        rows[name] |= {
            "state": "ok",
            "fitted_together": len(fitted),
            **parameter_columns([parameter_of(estimate) for estimate in outcome.estimates]),
            **errors_of(outcome.comparison),
            **rejection_of(outcome.comparison),
            "converged": outcome.converged,
        }


def rows_of(task: FitTask, found: Row) -> dict[str, Row]:
    """Return the rows of the recordings of ``task`` by their names, from what it gave."""
    if "rows" not in found:
        # its process died
        return {
            name: {"recording": name, "state": "failed", "reason": found["reason"]}
            for name, _ in task.recordings
        }
    return {row["recording"]: row for row in found["rows"]}
