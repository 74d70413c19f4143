"""What a browser of recordings shows of them: a summary, curves, and how conditions differ."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.analysis.records import compare
from dearig.config.modelfile import load_model
from dearig.errors import DearigError, InputError
from dearig.model.actuator import Actuator
from dearig.model.film import Strip
from dearig.model.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.measures import Errors
from dearig.progress import Progress, quiet
from dearig.recording.exporters import export_recording
from dearig.recording.files import in_words
from dearig.recording.reader import open_recording
from dearig.recording.recording import RecordedEvent, Recording
from dearig.recording.recover import recover
from dearig.recording.summary import describe_rows
from dearig.units import readable

__all__ = [
    "SUFFIXES",
    "Curves",
    "Difference",
    "RecordingSummary",
    "curves",
    "differences",
    "export_file",
    "recordings_in",
    "recover_file",
    "summarise",
]

SUFFIXES = (".h5", ".hdf5", ".nxs")  #: of files that may be recordings

_THUMBNAIL = 60  # columns of a thumbnail
_COLUMNS = 20_000  # of a plot that can be zoomed into


@dataclass(frozen=True)
class RecordingSummary:
    """Summary of one file of a folder; ``trouble`` says why the file cannot be read.

    ``started`` is ISO time, ``duration`` in s. ``thumbnail`` are ``(time, signal)`` of a few points
    in SI units. ``errors`` are against the model that was asked for, ``unfit`` says why there are
    none; ``fitted``: the model was fitted to this very recording, so its error proves nothing.
    """

    path: Path
    trouble: str = ""
    kind: str = ""
    title: str = ""
    film: str = ""
    operator: str = ""
    rig: str = ""
    notes: str = ""
    started: str = ""
    duration: float = 0.0
    samples: int = 0
    complete: bool = True
    outcome: str = ""
    events: tuple[RecordedEvent, ...] = ()
    noise: float | None = None
    thumbnail: tuple[np.ndarray, np.ndarray] = field(
        default_factory=lambda: (np.empty(0), np.empty(0))
    )
    errors: Errors | None = None
    unfit: str = ""
    fitted: bool = False


@dataclass(frozen=True)
class Curves:
    """Curves of one recording for a plot: ``(time s, value)`` pairs in SI units, peaks kept.

    ``model`` and ``residual`` are None where the model does not apply, and ``unfit`` says why.
    ``about`` are (name, value) lines of its metadata. ``declared`` are label, unit and curve of the
    channels that the rig file declared.
    """

    path: Path
    name: str
    kind: str
    drive: tuple[np.ndarray, np.ndarray]
    measured: tuple[np.ndarray, np.ndarray]
    model: tuple[np.ndarray, np.ndarray] | None
    residual: tuple[np.ndarray, np.ndarray] | None
    errors: Errors | None
    events: tuple[RecordedEvent, ...]
    about: tuple[tuple[str, str], ...]
    sequence_toml: str
    unfit: str = ""
    declared: tuple[tuple[str, str, tuple[np.ndarray, np.ndarray]], ...] = ()


@dataclass(frozen=True)
class Difference:
    """A condition in which recordings differ, with its value in each."""

    what: str
    values: tuple[str, ...]


def recordings_in(folder: Path) -> dict[Path, tuple[float, int]]:
    """Return the files in ``folder`` that may be recordings, with time of last change and size.

    Raises ``InputError`` where the folder cannot be read.
    """
    found = {}
    try:
        for path in folder.iterdir():
            if path.suffix.lower() in SUFFIXES and path.is_file():
                about = path.stat()
                found[path] = (about.st_mtime, about.st_size)
    except OSError as error:
        raise InputError(f"{folder} cannot be read: {in_words(error)}") from error
    return found


def summarise(
    path: Path, model: Path | None, drive: str = "command", progress: Progress = quiet
) -> RecordingSummary:
    """Summarise the file at ``path`` with its errors against ``model`` (None is the thesis's).

    It never raises: a file that cannot be read is listed with the reason.
    """
    try:
        recording = open_recording(path)
    except DearigError as error:
        return RecordingSummary(path, trouble=str(error))
    errors, fitted, unfit = None, False, ""
    try:
        chosen, of_these = _model(model, recording)
        fitted = bool(of_these) and recording.sha256 in of_these
        errors = compare(recording, chosen, "validation", drive).errors
    except DearigError as error:
        unfit = str(error)
    progress(recording.name, 1.0)
    about = recording.provenance
    return RecordingSummary(
        path=path,
        kind=recording.kind,
        title=recording.title,
        film=recording.film_id,
        operator=str(about.get("operator", "")),
        rig=str(about.get("rig", "")),
        notes=recording.notes,
        started=str(about.get("start_time", "")),
        duration=recording.duration,
        samples=recording.samples,
        complete=recording.complete,
        outcome=recording.outcome,
        events=recording.events,
        noise=recording.noise_floor,
        thumbnail=_short(recording.time, recording.signal, _THUMBNAIL),
        errors=errors,
        unfit=unfit,
        fitted=fitted,
    )


def curves(
    path: Path, model: Path | None, drive: str = "command", progress: Progress = quiet
) -> Curves:
    """Return the curves of the recording at ``path`` and of ``model`` (None is the thesis's).

    Raises ``InputError`` where the recording cannot be read.
    """
    recording = open_recording(path)
    progress(recording.name, 0.5)
    time, measured = recording.time, recording.signal
    drawn: tuple[np.ndarray, np.ndarray] | None = None
    residual: tuple[np.ndarray, np.ndarray] | None = None
    errors, unfit = None, ""
    try:
        chosen, _ = _model(model, recording)
        compared = compare(recording, chosen, "validation", drive)
        drawn = _short(time, compared.model, _COLUMNS)
        residual = _short(time, compared.measured - compared.model, _COLUMNS)
        errors = compared.errors
    except DearigError as error:
        unfit = str(error)
    driven = recording.voltage_command if recording.kind == "actuator" else recording.stretch
    return Curves(
        path=path,
        name=recording.name,
        kind=recording.kind,
        drive=_short(time, time * 0.0 if driven is None else driven, _COLUMNS),
        measured=_short(time, measured, _COLUMNS),
        model=drawn,
        residual=residual,
        errors=errors,
        events=recording.events,
        about=tuple((what, readable(value)) for what, value in describe_rows(recording)),
        sequence_toml=recording.sequence_toml,
        unfit=unfit,
        declared=tuple(
            (label, recording.unit(name), _short(time, recording.values[name], _COLUMNS))
            for name, label in recording.declared.items()
        ),
    )


def differences(paths: Sequence[Path], progress: Progress = quiet) -> tuple[Difference, ...]:
    """Return the conditions in which the recordings at ``paths`` differ.

    Raises ``InputError`` where one cannot be read.
    """
    told: list[dict[str, str]] = []
    for i, path in enumerate(paths):
        told.append(_conditions(open_recording(path)))
        progress(path.stem, (i + 1) / len(paths))
    names = dict.fromkeys(name for conditions in told for name in conditions)
    rows = (Difference(name, tuple(c.get(name, "") for c in told)) for name in names)
    return tuple(row for row in rows if len(set(row.values)) > 1)


def recover_file(path: Path, progress: Progress = quiet) -> str:
    """Recover the recording at ``path`` and return a sentence on it. Raises ``InputError``."""
    done = recover(path)
    progress(path.stem, 1.0)
    samples = open_recording(path).samples
    if done:
        return f"{path.name} was recovered: {samples} samples can be read by any program"
    return f"{path.name} needs no recovery: its {samples} samples can be read as they are"


def export_file(path: Path, to: str, out: Path, progress: Progress = quiet) -> Path:
    """Export the recording at ``path`` as ``to`` to ``out``, which is replaced if it exists."""
    written = export_recording(path, to, out, overwrite=True)
    progress(written.name, 1.0)
    return written


def _model(path: Path | None, recording: Recording) -> tuple[Actuator | Strip, frozenset[str]]:
    """Return the model to compare with, and the checksums of the recordings it was fitted to."""
    if path is not None:
        file = load_model(path)
        return file.model, file.fitted
    film, load = recording.film or THESIS_FILM, recording.load or THESIS_LOAD
    return Actuator(film, load, TABLE_3), frozenset()


def _short(time: np.ndarray, values: np.ndarray, columns: int) -> tuple[np.ndarray, np.ndarray]:
    return decimate(time, values, columns) if time.size > 1 else (time, values)


#: Lines of a recording's description that are results, not conditions.
_RESULTS = (
    "recording",
    "noise floor",
    "displacement",
    "displacement model",
    "voltage monitor",
    "current monitor",
)


def _conditions(recording: Recording) -> dict[str, str]:
    """Return the conditions of a recording: sample, instruments, settings, sequence."""
    rows = describe_rows(recording)
    found = {what: value for what, value in rows if what not in _RESULTS and " at " not in what}
    if "start time" in found:  # two words, so that a narrow column can break it
        found["start time"] = found["start time"][:19].replace("T", " ")
    found |= {"sequence": recording.title, "events": str(len(recording.events))}
    for what, text in (
        ("rig file", str(recording.provenance.get("configuration", ""))),
        ("sequence", recording.sequence_toml),
    ):
        found |= {f"{what}: {key}": value for key, value in _flat(text).items()}
    return found


def _flat(toml: str) -> dict[str, str]:
    """Return the keys of a TOML text with their values, as ``segment 2.to_kV``."""
    try:
        data = tomllib.loads(toml)
    except tomllib.TOMLDecodeError:
        return {}  # text that is not TOML has no keys to compare
    found: dict[str, str] = {}

    def visit(value: Any, place: str) -> None:
        if isinstance(value, Mapping):
            for key, inner in value.items():
                visit(inner, f"{place}.{key}" if place else str(key))
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            for i, inner in enumerate(value):
                visit(inner, f"{place} {i + 1}")
        else:
            found[place] = str(value)

    visit(data, "")
    return found
