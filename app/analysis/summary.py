"""What a browser of recordings shows of them: a summary, curves, and how conditions differ."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.analysis.readings.compare import compare
from dearig.analysis.readings.record import Readings
from dearig.analysis.spectrum import amplitude_density
from dearig.config.modelfile import load_model
from dearig.errors import DearigError, InputError
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD
from dearig.model.readings.measures import Errors
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.progress import Progress, quiet
from dearig.recording.content.fields import CONDITIONS, TEXTS
from dearig.recording.exporters import export_recording
from dearig.recording.reading.index import Entry, glance
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import RecordedEvent, Recording
from dearig.recording.reading.summary import describe_rows
from dearig.recording.recover import recover
from dearig.units import name_and_unit, readable

__all__ = [
    "QUANTITIES",
    "Assessment",
    "Curves",
    "Difference",
    "RecordingSummary",
    "Spectra",
    "SummaryNumber",
    "assess",
    "curves",
    "differences",
    "export_file",
    "how_it_ended",
    "numbers",
    "read_entries",
    "recover_file",
    "spectra",
    "summary_of",
]

_COLUMNS = 20_000  # of a plot that can be zoomed into


@dataclass(frozen=True)
class Assessment:
    """Errors of a model against one recording.

    ``unfit`` says why there are no ``errors``; ``noise`` is the noise floor in SI units, None where
    it is unknown; ``fitted``: the model was fitted to this very recording, so its error proves
    nothing.
    """

    path: Path
    errors: Errors | None = None
    noise: float | None = None
    unfit: str = ""
    fitted: bool = False


@dataclass(frozen=True)
class RecordingSummary:
    """Summary of one file of a folder; ``trouble`` says why the file cannot be read.

    ``name`` is its path in the folder without the ending. ``started`` is ISO time, with
    ``start_is_import`` that of the import of a file that does not tell its own. ``duration`` is in
    s. ``texts`` are those of ``content.fields.TEXTS``. ``peaks`` has the largest absolute value of
    each channel, with its sign, in SI units. ``thumbnail`` are ``(time, signal)`` of a few points,
    scaled to 0 to 1. ``errors``, ``noise``, ``unfit`` and ``fitted`` are those of the
    ``Assessment``, once it is there.
    """

    path: Path
    trouble: str = ""
    name: str = ""
    kind: str = ""
    title: str = ""
    texts: Mapping[str, str] = field(default_factory=dict)
    identifier: str = ""
    started: str = ""
    start_is_import: bool = False
    duration: float = 0.0
    samples: int = 0
    complete: bool = True
    outcome: str = ""
    events: tuple[RecordedEvent, ...] = ()
    peaks: Mapping[str, float] = field(default_factory=dict)
    tags: tuple[str, ...] = ()
    thumbnail: tuple[np.ndarray, np.ndarray] = field(
        default_factory=lambda: (np.empty(0), np.empty(0))
    )
    errors: Errors | None = None
    noise: float | None = None
    unfit: str = ""
    fitted: bool = False

    @property
    def film(self) -> str:
        """The operator's name for the film, "" without one."""
        return self.texts.get("film_id", "")


@dataclass(frozen=True)
class Curves:
    """Curves of one recording for a plot: ``(time s, value)`` pairs in SI units, peaks kept.

    ``model`` and ``residual`` are None where the model does not apply, and ``unfit`` says why.
    ``monitor`` in V and ``current`` in A are those of the amplifier, None where they are not
    recorded. ``about`` are (name, value) lines of its metadata. ``declared`` are label, unit and
    curve of the channels that the rig file declared.
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
    monitor: tuple[np.ndarray, np.ndarray] | None = None
    current: tuple[np.ndarray, np.ndarray] | None = None


@dataclass(frozen=True)
class Difference:
    """A condition in which recordings differ, with its value in each.

    ``group`` is what it belongs to (Run, Sample, Instruments, Sequence, Rig file); ``what`` has the
    unit of the values in brackets.
    """

    group: str
    what: str
    values: tuple[str, ...]


def read_entries(
    folder: Path, names: Sequence[str], progress: Progress = quiet
) -> tuple[Entry, ...]:
    """Return the index entries of the files ``names`` in ``folder``.

    It never raises: a file that cannot be read has an entry with the reason.
    """
    entries = []
    for i, name in enumerate(names):
        path = folder / name
        try:
            size = path.stat().st_size
        except OSError:
            size = 0  # the entry says what is wrong
        entries.append(glance(path, name, size))
        progress(name, (i + 1) / len(names))
    return tuple(entries)


def summary_of(folder: Path, entry: Entry) -> RecordingSummary:
    """Return the summary of the file of ``entry``, without errors of a model."""
    path = folder / entry.path
    return RecordingSummary(
        path=path,
        trouble=entry.trouble,
        name=str(PurePosixPath(entry.path).with_suffix("")),
        kind=entry.kind,
        title=entry.title,
        texts=entry.texts,
        identifier=entry.identifier,
        started=entry.start_time,
        start_is_import=entry.start_is_import,
        duration=entry.duration_s or 0.0,
        samples=entry.samples,
        complete=entry.complete,
        outcome=entry.outcome,
        events=tuple(
            RecordedEvent(0, float(time), str(level), str(message))
            for time, level, message in entry.events
        ),
        peaks=entry.peaks,
        thumbnail=_thumbnail(entry.outline),
    )


def _thumbnail(outline: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of a line through the bins of ``outline``, least and greatest in turn."""
    try:
        values = np.frombuffer(bytes.fromhex(outline), dtype=np.uint8) / 255.0
    except ValueError:  # a cache that was edited by hand
        values = np.empty(0)
    if values.size < 4 or values.size % 2:
        return np.empty(0), np.empty(0)
    pairs = values.reshape(-1, 2).copy()
    # in the order of the slope, so that a slope is drawn as one line and not as teeth
    middle = pairs.mean(axis=1)
    falling = np.gradient(middle) < 0.0
    pairs[falling] = pairs[falling, ::-1]
    return np.linspace(0.0, 1.0, values.size), pairs.reshape(-1)


def how_it_ended(summary: RecordingSummary) -> tuple[str, str]:
    """Return how serious the end of a run is (fault, warning or ""), and the end in a few words."""
    if summary.trouble:
        reason = summary.trouble.removeprefix(str(summary.path)).lstrip(" :")
        return "fault", reason.partition(";")[0].partition(", as recordings are")[0]
    levels = {event.level for event in summary.events}
    level = next((known for known in ("fault", "warning") if known in levels), "")
    if not summary.complete:
        words = summary.outcome
        return level or "warning", words if "killed" in words else f"incomplete: {words}"
    count = sum(event.level != "info" for event in summary.events)
    words = summary.outcome or "finished"
    if words != "finished" and not level:
        level = "warning"
    if count and words == "finished":
        words = f"finished, {count} event{'' if count == 1 else 's'}"
    return level, words


@dataclass(frozen=True)
class SummaryNumber:
    """A number of a recording that can be a column or a trend: ``label`` with its unit."""

    key: str
    label: str
    tip: str


#: The numbers of a summary, in the units in which they are shown.
QUANTITIES = (
    SummaryNumber("rms_um", "RMS error (µm)", "RMS error of the chosen model"),
    SummaryNumber(
        "over_noise", "RMS error / noise", "RMS error over the noise floor; 1 is the best"
    ),
    SummaryNumber("nrmse_pct", "NRMSE (%)", "RMS error in % of the measured range"),
    SummaryNumber("max_um", "Largest error (µm)", "Largest error of the chosen model"),
    SummaryNumber("noise_um", "Noise floor (µm)", "Noise of the displacement at 0 V"),
    SummaryNumber("peak_kV", "Peak voltage (kV)", "Largest commanded voltage"),
    SummaryNumber("monitor_kV", "Peak monitor voltage (kV)", "Largest voltage that was measured"),
    SummaryNumber("peak_mm", "Peak displacement (mm)", "Largest displacement"),
    SummaryNumber(
        "mm_per_kV2", "Displacement / voltage² (mm/kV²)", "Peak values; a soft film has more"
    ),
    SummaryNumber("current_mA", "Peak current (mA)", "Largest current that was measured"),
    SummaryNumber("temperature_C", "Peak temperature (°C)", "Largest temperature"),
    SummaryNumber("stress_kPa", "Peak stress (kPa)", "Largest nominal stress of a film"),
    SummaryNumber("duration_s", "Duration (s)", "Duration of the run"),
    SummaryNumber("events", "Events", "Events that are warnings or faults"),
)


def numbers(summary: RecordingSummary) -> dict[str, float]:
    """Return the numbers of a recording by the keys of ``QUANTITIES``; unknown ones are missing."""
    if summary.trouble:
        return {}
    found = {
        "duration_s": summary.duration,
        "events": float(sum(event.level != "info" for event in summary.events)),
    }
    for key, channel, factor in (
        ("peak_kV", "voltage_command", 1e-3),
        ("monitor_kV", "voltage_monitor", 1e-3),
        ("peak_mm", "displacement", 1e3),
        ("current_mA", "current_monitor", 1e3),
        ("temperature_C", "temperature", 1.0),
        ("stress_kPa", "nominal_stress", 1e-3),
    ):
        if channel in summary.peaks:
            found[key] = summary.peaks[channel] * factor
    if found.get("peak_kV") and "peak_mm" in found:
        found["mm_per_kV2"] = found["peak_mm"] / found["peak_kV"] ** 2
    actuator = summary.kind == "actuator"
    if summary.errors is not None:
        found["nrmse_pct"] = summary.errors.nrmse_pct
        if actuator:
            found |= {"rms_um": summary.errors.rms * 1e6, "max_um": summary.errors.max * 1e6}
        if summary.noise:
            found["over_noise"] = summary.errors.rms / summary.noise
    if summary.noise is not None and actuator:
        found["noise_um"] = summary.noise * 1e6
    return {key: value for key, value in found.items() if np.isfinite(value)}


def assess(
    path: Path, model: Path | None, drive: str = "command", progress: Progress = quiet
) -> Assessment:
    """Compare the recording at ``path`` with ``model`` (None is the thesis's).

    It never raises: ``unfit`` says why there are no errors.
    """
    try:
        recording = open_recording(path)
        noise = recording.noise.value if recording.noise is not None else None
    except DearigError as error:
        return Assessment(path, unfit=str(error))
    errors, fitted, unfit = None, False, ""
    try:
        chosen, of_these = _model(model, recording)
        fitted = bool(of_these) and recording.sha256 in of_these
        errors = compare(Readings(recording, drive), chosen, "validation", hashed=False).errors
    except DearigError as error:
        unfit = str(error)
    progress(recording.name, 1.0)
    return Assessment(path, errors, noise, unfit, fitted)


def curves(
    path: Path, model: Path | None, drive: str = "command", progress: Progress = quiet
) -> Curves:
    """Return the curves of the recording at ``path`` and of ``model`` (None is the thesis's).

    Raises ``InputError`` where the recording cannot be read.
    """
    recording = open_recording(path)
    progress(recording.name, 0.5)
    time, measured = recording.time, recording.measured
    drawn: tuple[np.ndarray, np.ndarray] | None = None
    residual: tuple[np.ndarray, np.ndarray] | None = None
    errors, unfit = None, ""
    try:
        chosen, _ = _model(model, recording)
        compared = compare(Readings(recording, drive), chosen, "validation", hashed=False)
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
        monitor=_of(time, recording.voltage_monitor),
        current=_of(time, recording.current_monitor),
    )


@dataclass(frozen=True)
class Spectra:
    """Amplitude densities of one recording: frequency in Hz and density in m/√Hz, (n,) each.

    ``residual`` is None where the model does not apply.
    """

    name: str
    measured: tuple[np.ndarray, np.ndarray]
    residual: tuple[np.ndarray, np.ndarray] | None


def spectra(
    path: Path, model: Path | None, drive: str = "command", progress: Progress = quiet
) -> Spectra:
    """Return the spectra of the displacement at ``path`` and of its residual to ``model``.

    Raises ``InputError`` where the recording cannot be read, is of a film driven by stretch, or has
    no sample clock: without even steps there is no spectrum.
    """
    recording = open_recording(path)
    if recording.displacement is None:
        raise InputError(f"{recording.name} has no displacement, of which to show a spectrum")
    if recording.rate is None:
        raise InputError(f"{recording.name} has no sample clock; a spectrum needs even time steps")
    progress(recording.name, 0.5)
    residual = None
    try:
        chosen, _ = _model(model, recording)
        compared = compare(Readings(recording, drive), chosen, "validation", hashed=False)
        residual = amplitude_density(compared.measured - compared.model, recording.rate)
    except DearigError:
        residual = None  # the curves say why
    measured = amplitude_density(recording.signal, recording.rate)
    return Spectra(recording.name, measured, residual)


def differences(paths: Sequence[Path], progress: Progress = quiet) -> tuple[Difference, ...]:
    """Return the conditions in which the recordings at ``paths`` differ.

    Raises ``InputError`` where one cannot be read.
    """
    stated: list[dict[tuple[str, str], str]] = []
    for i, path in enumerate(paths):
        stated.append(_conditions(open_recording(path)))
        progress(path.stem, (i + 1) / len(paths))
    names = dict.fromkeys(name for conditions in stated for name in conditions)
    rows = [Difference(*name, tuple(c.get(name, "") for c in stated)) for name in names]
    rows.sort(key=lambda row: GROUPS.index(row.group))
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


def _of(time: np.ndarray, values: np.ndarray | None) -> tuple[np.ndarray, np.ndarray] | None:
    return None if values is None else _short(time, values, _COLUMNS)


def _short(time: np.ndarray, values: np.ndarray, columns: int) -> tuple[np.ndarray, np.ndarray]:
    return decimate(time, values, columns) if time.size > 1 else (time, values)


#: Lines of a recording's description that are results, or conditions of which the mean is shown.
_RESULTS = (
    "recording",
    "noise floor",
    "displacement",
    "displacement model",
    "voltage monitor",
    "current monitor",
    "room",
    "temperature",
)


#: Groups of conditions, in the order in which they are shown.
GROUPS = ("Run", "Sample", "Sequence", "Rig file", "Instruments")
_SAMPLE = (
    "load",
    "kinematics",
    *(field.label.lower() for field in TEXTS.values() if not field.in_provenance),
)


def _conditions(recording: Recording) -> dict[tuple[str, str], str]:
    """Return the conditions of a recording by group and name."""
    instruments = {instrument.role for instrument in recording.instruments}
    found: dict[tuple[str, str], str] = {}
    for what, value in describe_rows(recording):
        if (
            what in _RESULTS
            or what == "feedback"
            or " at " in what
            or what in recording.declared.values()
        ):
            continue
        group = "Instruments" if what in instruments else "Sample" if what in _SAMPLE else "Run"
        # without the offset from UTC, which is the same for all
        found[group, what] = value[:19] if what == "start time" else readable(value)
    for name, mean in recording.conditions.items():
        condition = CONDITIONS[name]
        found["Run", f"{condition.label} ({condition.unit})"] = f"{mean:.1f}"
    found["Run", "events"] = str(len(recording.events))
    found["Sequence", "name"] = recording.title
    for group, text in (
        ("Rig file", str(recording.provenance.get("configuration", ""))),
        ("Sequence", recording.sequence_toml),
        ("Feedback", str(recording.provenance.get("feedback", ""))),
    ):
        for key, value in _flat(text).items():
            found.setdefault((group, key), value)
    return found


def _flat(toml: str) -> dict[str, str]:
    """Return the keys of a TOML text in words, with their values: ``segment 2: amplitude (kV)``."""
    try:
        data = tomllib.loads(toml)
    except tomllib.TOMLDecodeError:
        return {}  # text that is not TOML has no keys to compare
    found: dict[str, str] = {}

    def visit(value: Any, place: str, key: str) -> None:
        inside = f"{place}, {key}" if place and key else place or key
        if isinstance(value, Mapping):
            for inner_key, inner in value.items():
                visit(inner, inside, str(inner_key))
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            for i, inner in enumerate(value):
                visit(inner, place, f"{key} {i + 1}")
        else:
            name, unit = name_and_unit(key)
            label = f"{name} ({unit})" if unit else name
            found[f"{place}: {label}" if place else label] = _shown(value)

    visit(data, "", "")
    return found


def _shown(value: Any) -> str:
    """Return a value of a TOML file for people."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return "; ".join(_shown(item) for item in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)
