"""One task of a study: one recording fitted, diagnosed or validated, as a row of plain values.

A row depends on the content of the recording, the options and this version of the program alone. It
has no computing times and no paths, so that it is the same wherever it is computed.
"""

from __future__ import annotations

import hashlib
import json
import logging
import math
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

import dearig
from dearig.analysis.diagnose import diagnose_recordings
from dearig.analysis.identify import identify_recordings
from dearig.analysis.loops import cycle_edges
from dearig.analysis.validate import validate_model
from dearig.batch.numbers import errors_of, parameters_of, peaks_of, rejection_of
from dearig.config.modelfile import load_model
from dearig.config.parameterfile import Stated
from dearig.errors import InputError
from dearig.progress import Progress, quiet
from dearig.recording.content.fields import CONDITIONS, TEXTS
from dearig.recording.content.provenance import is_start_known
from dearig.recording.files import file_sha256, journal_of, one_line
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording

__all__ = [
    "KINDS",
    "FitTask",
    "OtherVersion",
    "Row",
    "StudyOptions",
    "Subject",
    "about",
    "code_digest",
    "fit_sent",
    "fit_task",
    "parameter_columns",
]

log = logging.getLogger(__name__)

#: What a study does with each recording.
KINDS = ("identify", "diagnose", "validate")
#: Row of the table of a study: plain values by the names of its columns.
Row = dict[str, Any]
#: Packages of this distribution on which the numbers depend, besides its foundations.
_SOURCES = ("analysis", "batch", "config", "drivers", "model", "recording")
_LIBRARIES = ("numpy", "scipy", "numba", "h5py")
# linear algebra is limited to one thread for the whole process: fits in it go one after the other
ONE_AT_A_TIME = threading.Lock()


class OtherVersion(Exception):  # noqa: N818  (what was found)
    """A worker has another version of this program."""


@dataclass(frozen=True)
class Subject:
    """A recording of a study: its name in the table, its file, and what is known about it.

    ``labels`` are columns of the run of a campaign: its name and its settings.
    """

    name: str
    path: Path
    labels: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class StudyOptions:
    """What is done with each recording.

    ``do`` is one of ``KINDS``, with Maxwell ``branches``, a ``spring`` (for identify) and ``drive``
    command or monitor. ``ended_early`` is keep, cut or leave-out. ``intervals``: 95 % intervals
    are computed. ``model`` is the text of the model file of a validation. ``own`` are parameters
    that each recording of a film has for itself, where its recordings are fitted together.
    ``parameters`` is what is stated of parameters, by their names with their units.
    """

    do: str
    branches: int = 3
    spring: str = "gent"
    drive: str = "command"
    ended_early: str = "keep"
    intervals: bool = True
    model: str = ""
    own: tuple[str, ...] = ()
    parameters: Stated = field(default_factory=dict)


@dataclass(frozen=True)
class FitTask:
    """One recording of a study: its ``name`` in the table, its file, and the key of its row.

    ``members`` are names and files of the recordings of the film ``name`` that are fitted together.
    """

    name: str
    path: Path
    key: str
    options: StudyOptions
    members: tuple[tuple[str, Path], ...] = ()

    @property
    def recordings(self) -> tuple[tuple[str, Path], ...]:
        """Names and files of the recordings of this task."""
        return self.members or ((self.name, self.path),)


@cache
def code_digest() -> str:
    """Return what tells this program from another version: of its sources and its libraries."""
    found = hashlib.sha256()
    for library in _LIBRARIES:
        found.update(f"{library} {metadata.version(library)}\n".encode())
    sources = [p for folder in dearig.__path__ for p in sorted(Path(folder).glob("*.py"))]
    for name in _SOURCES:
        for folder in import_module(f"dearig.{name}").__path__:
            sources += sorted(Path(folder).rglob("*.py"))
    for path in sources:
        found.update(path.name.encode() + path.read_bytes())
    return found.hexdigest()


def key_of(path: Path, name: str, options: StudyOptions) -> str:
    """Return the key of a row: of recording, journal, name, options and version.

    Raises ``OSError`` for a file that cannot be read.
    """
    found = hashlib.sha256(code_digest().encode())
    found.update(json.dumps([name, asdict(options)], sort_keys=True).encode())
    for part in (path, journal_of(path)):
        found.update(file_sha256(part).encode() if part.is_file() else b"none")
    return found.hexdigest()


def fit_task(task: FitTask, progress: Progress = quiet) -> Row:
    """Return the row of ``task``; what is wrong with its recording is in the row."""
    name, path = task.name, task.path
    row: Row = {"recording": name, "state": "failed", "reason": ""}
    with ONE_AT_A_TIME:
        try:
            recording = open_recording(path)
            row |= about(recording)
            row |= _computed(recording, task.options, progress)
            row["state"] = "ok"
        except InputError as error:
            row["reason"] = str(error).replace(str(path), name)
        except Exception as error:  # one recording must not cost the rows of the others
            log.exception("unexpected error with %s", path)
            reason = f"unexpected error ({type(error).__name__}: {one_line(error)})"
            # without a checksum: such a row is not kept
            return {"recording": name, "state": "failed", "reason": f"{name}: {reason}"}
    return row


def fit_sent(
    work: Callable[[FitTask], Row],
    task: tuple[str, str, StudyOptions],
    sent: Sequence[tuple[str, Sequence[tuple[str, bytes]]]],
    digest: str,
) -> Row:
    """Return what ``work`` gives of a task whose recordings were sent.

    ``task`` is its name, key and options; ``sent`` has the name of each recording, and its file and
    journal as names and contents. ``digest`` is the sender's ``code_digest``; raises
    ``OtherVersion`` where it differs.
    """
    if digest != code_digest():
        raise OtherVersion("a worker has another version of dearig or of its libraries")
    name, key, options = task
    with tempfile.TemporaryDirectory(prefix="dearig-study-") as folder:
        members = []
        for i, (recording, files) in enumerate(sent):
            place = Path(folder, str(i))
            place.mkdir()
            for file, content in files:
                (place / file).write_bytes(content)
            members.append((recording, place / files[0][0]))
        return work(FitTask(name, members[0][1], key, options, tuple(members)))


def about(recording: Recording) -> Row:
    """Return the columns that describe the recording: hash, start, film, rig, duration, ..."""
    noted = recording.provenance
    return {
        "sha256": recording.sha256,
        # the moment of an import says nothing of the film's age
        "started": str(noted.get("start_time", "")) if is_start_known(noted) else "",
        **{f.column: recording.texts.get(key, "") for key, f in TEXTS.items() if f.column},
        "title": recording.title,
        **{name: recording.conditions.get(name) for name in CONDITIONS},
        "duration_s": recording.duration,
        "samples": recording.samples,
        "complete": recording.complete,
        "cycles": _cycles(recording),
        **peaks_of(recording),
    }


def _cycles(recording: Recording) -> int | None:
    """Return the number of cycles of the commanded voltage, valley to valley; None for a film."""
    voltage = recording.voltage_command
    return None if voltage is None else max(len(cycle_edges(voltage)) - 1, 0)


def _computed(recording: Recording, options: StudyOptions, progress: Progress) -> Row:
    if options.do == "validate":
        with tempfile.TemporaryDirectory(prefix="dearig-study-") as folder:
            model = Path(folder, "model.toml")
            model.write_text(options.model, "utf-8", newline="\n")
            loaded = load_model(model)
        validated = validate_model(loaded, [recording], drive=options.drive, progress=progress)
        only = validated.comparisons[0]
        return errors_of(only) | rejection_of(only)
    if options.do == "identify":
        fitted = identify_recordings(
            [recording], branches=(options.branches,), spring=options.spring, drive=options.drive,
            intervals=options.intervals, ended_early=options.ended_early,
            parameters=options.parameters, progress=progress,
        )  # fmt: skip
        if fitted.interrupted:
            raise KeyboardInterrupt
        return {
            **parameter_columns(parameters_of(fitted)),
            **errors_of(fitted.train[0]),
            **rejection_of(fitted.train[0]),
            "converged": bool(fitted.fit.converged),
        }
    found = diagnose_recordings(
        [recording], branches=options.branches, drive=options.drive,
        ended_early=options.ended_early, parameters=options.parameters, progress=progress,
    )  # fmt: skip
    if found.finding.interrupted:
        # a person's ctrl-C is not a result that could be kept
        raise KeyboardInterrupt
    return {
        "verdict": found.verdict,
        "effects": ", ".join(step.effect for step in found.finding.steps),
        **parameter_columns(parameters_of(found)),
        **errors_of(found.after.train[0]),
        **rejection_of(found.after.train[0]),
        **{f"{name}_before": value for name, value in errors_of(found.before.train[0]).items()},
    }


def parameter_columns(found: list[dict[str, Any]]) -> Row:
    """Return the columns of parameters as ``parameters_of`` has them."""
    row: Row = {}
    for parameter in found:
        name = parameter["name"]
        row[name] = parameter["value"]
        for end in ("low95", "high95"):
            row[f"{name}_{end}"] = parameter[end]
        row[f"{name}_determined"] = parameter["determined"]
    return {n: None if isinstance(v, float) and not math.isfinite(v) else v for n, v in row.items()}
