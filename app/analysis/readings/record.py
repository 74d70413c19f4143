"""Records that a fit takes, made from recordings, and comparisons of recordings with a model."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import scipy  # loads its parts when they are first used, which a run may never do

from dearig.analysis.outcomes import Comparison, Published
from dearig.analysis.readings.quality import driven_by, inspect, spikes_about
from dearig.config.presets import PRESETS, VALIDATION_A, VALIDATION_B
from dearig.config.sequencefile import parse_sequence
from dearig.errors import InputError
from dearig.model.effects import EFFECTS
from dearig.model.errors import ModelError
from dearig.model.readings.denoise import reading_noise, smoothed
from dearig.model.readings.environment import CELSIUS, HUMIDITY, air_texts
from dearig.model.readings.measures import errors
from dearig.model.readings.noise import LEAD_IN, require_readings, rest_of_rounded, slow_at_rest
from dearig.model.readings.records import ActuatorRecord, FilmRecord, Record, counted, interpolated
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.excitation import Lobes
from dearig.model.simulation.strip import Strip
from dearig.recording.content.layout import SIGNALS
from dearig.recording.content.physical import resolution
from dearig.recording.content.rest_noise import MIN_QUIET, ReadingNoise
from dearig.recording.reading.early_end import early_end
from dearig.recording.reading.origin import origin_of
from dearig.recording.reading.reader import open_recording
from dearig.recording.reading.recording import Recording

__all__ = [
    "PUBLISHED_FIT",
    "Source",
    "air_texts_of",
    "as_record",
    "check_named_once",
    "compare",
    "noise_texts",
    "open_all",
    "reading_noise_of",
    "recording_drive",
    "room_texts",
]

#: A recording that was opened, or the path of one.
Source = str | Path | Recording

#: The thesis's printed errors of its identification run.
PUBLISHED_FIT = Published(2.13, 4.07)

# Tables 4 and 5 of the thesis, by preset: e_rms and e_m in per cent, as printed
_TABLE_4 = dict(
    zip(
        VALIDATION_A,
        ((5.8484, 6.9696), (8.8924, 2.4462), (5.8952, 3.8678), (8.7797, 5.8924), (5.9604, 3.8877)),
        strict=True,
    )
)
_TABLE_5 = dict(
    zip(
        VALIDATION_B,
        ((2.4729, 7.4374), (2.9408, 6.7550), (3.5766, 7.0148), (7.7592, 5.6113), (8.6652, 4.6098)),
        strict=True,
    )
)


def open_all(sources: Sequence[Source]) -> list[Recording]:
    """Return the recordings ``sources``, all of one kind; those given by path are opened.

    Raises ``InputError`` for one that cannot be read, for a mixture of kinds, and for a file given
    twice or together with a copy of it (its samples would count double).
    """
    named: set[Path] = set()
    for source in sources:
        path = _path(source)
        where = Path(os.path.realpath(path))
        if where in named:
            raise InputError(f"{path} is given twice; give each recording once")
        named.add(where)
    recordings = [s if isinstance(s, Recording) else open_recording(s) for s in sources]
    seen: dict[str, Path] = {}
    for recording in recordings:
        if recording.sha256 in seen:
            raise InputError(
                f"{recording.path} is a copy of {seen[recording.sha256]}; leave one of them out"
            )
        seen[recording.sha256] = recording.path
    kinds = {r.kind for r in recordings}
    if len(kinds) > 1:
        words = ", ".join(f"{r.path} is of {_KIND_WORDS[r.kind]}" for r in recordings)
        raise InputError(f"these recordings cannot be used together: {words}")
    return recordings


def check_named_once(train: Sequence[Source], validation: Sequence[Source]) -> None:
    """Refuse a file that is given both to fit and to validate."""
    named = {os.path.realpath(_path(source)) for source in train}
    for source in validation:
        if os.path.realpath(_path(source)) in named:
            raise InputError(
                f"{_path(source)} is given both to fit and to validate: an error on fitted data "
                f"proves nothing; leave it out of one of them"
            )


def _path(source: Source) -> Path:
    return source.path if isinstance(source, Recording) else Path(source)


_THERMOMETER = 1.0  # s over which a temperature is averaged: films do not warm faster

_KIND_WORDS = {"actuator": "an actuator (voltage)", "film": "a film (stretch)"}


def as_record(recording: Recording, drive: str = "command") -> Record:
    """Return the record that a fit takes; ``drive`` is command or monitor, for actuators.

    The noise is that of ``reading_noise_of``. Readings that must not be used (see
    ``dearig.analysis.readings.quality``) are masked, and replaced by a line across them. Coarse
    readings at rest are masked as well: all of them are rounded alike, so they say no more than
    their zero.
    """
    try:
        if recording.kind == "film":
            stretch, stress = _present(recording.stretch), _present(recording.nominal_stress)
            reading_noise_of(recording, None)  # refuses one that never changes
            valid = inspect(recording, drive).valid
            noise = reading_noise_of(recording, valid)
            stress = interpolated(recording.time, stress, valid)
            return FilmRecord(recording.name, recording.time, stretch, stress, noise.value, valid)
        displacement = _from_rest(recording)
        reading_noise_of(recording, None)
        driven = recording_drive(recording, drive)
        valid = inspect(recording, drive).valid
        displacement = interpolated(recording.time, displacement, valid)
        noise = reading_noise_of(recording, valid)
        if noise.step:
            valid = ~recording.quiet if valid is None else valid & ~recording.quiet
        return ActuatorRecord(
            recording.name,
            driven,
            displacement,
            noise.value,
            recording.displacement_delay - recording.displacement_skew,
            valid,
            _lead_in(recording),
            lag_error=recording.displacement_delay_error,
            rounding=noise.step / math.sqrt(12.0),
        )
    except ModelError as error:
        raise InputError(f"{recording.path}: {error}") from error


def reading_noise_of(recording: Recording, valid: np.ndarray | None) -> ReadingNoise:
    """Return the noise of the ``valid`` (N,) readings, from the lead-in where there is one.

    Raises ``ModelError`` for too few readings, and where none differs from its neighbours.
    """
    require_readings(recording.signal)
    noise = recording.noise if valid is None else recording.noise_of_valid(valid)
    if noise is None:
        raise ModelError(
            "the signal never changes, or on a straight line only: check that "
            "the sensor was connected and that the right column was imported"
        )
    return noise


def noise_texts(recordings: Iterable[Recording]) -> list[str]:
    """Return a sentence on each recording of an actuator whose noise is not simply that at rest.

    It is from no lead-in, or something moves there.
    """
    said = []
    for recording in recordings:
        noise = recording.noise
        if recording.kind != "actuator" or noise is None:
            continue
        if noise.source == LEAD_IN:
            at_rest = slice(0, recording.quiet_samples)
            readings = _present(recording.displacement)[at_rest]
            slow = slow_at_rest(recording.time[at_rest], readings, noise.value)
            if slow:
                fast = math.sqrt(noise.value**2 - slow**2)
                said.append(
                    f"{recording.name}: the readings at rest move slowly, by {slow * 1e6:.3g} um "
                    f"RMS in addition to a noise of {fast * 1e6:.3g} um: both count as noise, "
                    f"which hides smaller effects"
                )
        else:
            said.append(
                f"{recording.name}: the noise, {noise.value * 1e6:.3g} um, is {noise.words}; fast "
                f"motion counts in it, and the zero of displacement is known to "
                f"{'a part of a step' if noise.step else 'one reading'} only"
            )
    return said


def _from_rest(recording: Recording) -> np.ndarray:
    """Return the displacement (N,) in m from the rest state.

    Its zero is the mean of the lead-in; that of coarse readings, which rounding shifts, is the most
    probable one.
    """
    displacement, noise = _present(recording.displacement), recording.noise
    if noise is None or not noise.step or not _lead_in(recording):
        return displacement
    at_rest = displacement[: recording.quiet_samples]
    return displacement - rest_of_rounded(at_rest, noise.step, noise.value)


def _lead_in(recording: Recording) -> int:
    """Return the samples whose mean is the zero of displacement; 0 if they are too few for it."""
    return recording.quiet_samples if recording.quiet_samples >= MIN_QUIET else 0


def recording_drive(recording: Recording, drive: str) -> Drive:
    """Return the voltage of a recording: the command, or the monitor's reading.

    A voltage that was read is smoothed to remove the reading's noise. The air of the room is
    included where it was recorded: its temperature and humidity above those of the first second, as
    means over a second, and those of the first second.
    """
    voltage = driven_by(recording, drive)
    warmth, temperature = _air(recording, "temperature_degC", 1.0, CELSIUS)
    moisture, humidity = _air(recording, "relative_humidity_percent", 0.01, HUMIDITY)
    try:
        volts = _present(voltage)
        noise = reading_noise(volts)
        if noise > 0.0:
            volts = smoothed(volts, noise)
        return Drive(recording.time, volts, recording.hold, warmth, moisture, temperature, humidity)
    except ModelError as error:
        raise InputError(f"{recording.path}: {error}") from error


def _air(
    recording: Recording, name: str, scale: float, reference: float
) -> tuple[np.ndarray | None, float | None]:
    """Return ``name`` of the room above that of the first second (N,), and that less a reference.

    Each None where it was not recorded; ``scale`` makes the model's unit of the recording's.
    """
    values = recording.room(name)
    if values is None:
        return None, None
    start = recording.time < recording.time[0] + _THERMOMETER
    samples = max(int(np.count_nonzero(start)), 1)
    first = float(values[start].mean())
    changes = scipy.ndimage.uniform_filter1d(values, samples, mode="nearest") - first
    return scale * changes, scale * first - reference


def room_texts(recordings: Sequence[Recording]) -> list[str]:
    """Return a sentence with the means of temperature and humidity; none where not recorded."""
    parts = []
    for name, unit in (("temperature_degC", "°C"), ("relative_humidity_percent", "%")):
        means = [m for m in (getattr(r, name) for r in recordings) if m is not None]
        if means:
            ends = dict.fromkeys(f"{m:.1f}" for m in (min(means), max(means)))
            parts.append(f"{' to '.join(ends)} {unit}")
    return [f"the room was at {', '.join(parts)} (means of the recordings)"] if parts else []


def air_texts_of(recordings: Sequence[Recording]) -> list[str]:
    """Return why what films owe to the recorded air of the room cannot be looked for."""
    driven = [r for r in recordings if r.kind == "actuator"]
    return list(
        air_texts(
            [_air(r, "temperature_degC", 1.0, CELSIUS)[1] for r in driven],
            [_air(r, "relative_humidity_percent", 0.01, HUMIDITY)[1] for r in driven],
        )
    )


def _present(values: np.ndarray | None) -> np.ndarray:
    if values is None:
        raise ModelError("a channel that its kind needs is missing")
    return values


def compare(
    recording: Recording,
    model: Actuator | Strip,
    role: str,
    drive: str = "command",
    *,
    hashed: bool = True,
) -> Comparison:
    """Compare the recording with the prediction of ``model``.

    Not ``hashed`` leaves the hash of the file, which takes a second for each GB, out of the origin.
    Readings that must not be used are NaN and do not count in the errors. Raises ``InputError``
    where model and recording are not of one kind, or where the model cannot follow the drive.
    """
    look = inspect(recording, drive, to_fit=False)
    warnings = list(look.findings)
    signal = recording.signal if recording.kind == "film" else _from_rest(recording)
    usable = np.ones(signal.size, dtype=bool) if look.valid is None else look.valid
    if recording.kind == "film":
        if isinstance(model, Actuator):
            raise InputError(
                f"{recording.path} is of a film (stretch), and the model is of an actuator "
                f"(voltage): validate it on recordings of the actuator, or identify a film model"
            )
        if recording.kinematics != model.kinematics:
            warnings.append(
                f"the film was held {recording.kinematics}, the model's {model.kinematics}"
            )
        stretch = _present(recording.stretch)
        answer = replace(model, kinematics=recording.kinematics).simulate(recording.time, stretch)
        if not answer.ok:
            raise InputError(f"{recording.path}: the model cannot follow it: {answer.in_words}")
        try:
            reading_noise_of(recording, look.valid)
        except ModelError as error:
            raise InputError(f"{recording.path}: {error}") from error
        predicted, driven = answer.stress, stretch
        table, row, published = "", "", None
    else:
        if not isinstance(model, Actuator):
            raise InputError(
                f"{recording.path} is of an actuator (voltage), and the model is of a bare film "
                f"(stretch), which knows no load and no electrodes: validate it on recordings of "
                f"films, or identify an actuator model"
            )
        warnings += _other_rig(recording, model)
        drive_of = recording_drive(recording, drive)
        warnings += _unknown_air(model, drive_of)
        lag = recording.displacement_delay - recording.displacement_skew
        response = model.simulate(drive_of, lag)
        if not response.ok:
            raise InputError(f"{recording.path}: the model cannot follow it: {response.in_words}")
        predicted = counted(response.displacement, _lead_in(recording))
        driven = drive_of.voltage
        spiky, said = spikes_about(recording, signal - predicted, usable, driven**2)
        usable = usable & ~spiky
        warnings += said
        table, row, published = _place(recording)
    noise = recording.noise if look.valid is None else recording.noise_of_valid(look.valid)
    ended = early_end(recording)
    if ended is not None:
        warnings.append(ended.sentence)
    return Comparison(
        name=recording.name,
        kind=recording.kind,
        role=role,
        time=recording.time,
        drive=driven,
        measured=np.where(usable, signal, np.nan),
        model=predicted,
        errors=errors(signal[usable], predicted[usable]),
        noise=noise.value if noise else None,
        noise_source=noise.source if noise else LEAD_IN,
        table=table,
        row=row,
        published=published,
        warnings=tuple(warnings),
        ended=ended,
        quiet_count=noise.count if noise and noise.source == LEAD_IN else 0,
        origin=origin_of(recording, hashed),
        step=_converter_step(recording),
    )


#: Samples from which the step of imported values is read.
_STEP_SAMPLES = 100_000
#: Step as a share of the largest value, below which it is rounding; deviation from whole steps.
_ROUNDING, _OFF_STEP = 1e-9, 0.02


def _converter_step(recording: Recording) -> float:
    """Return the step of the converter in the measured unit, 0.0 where none is known.

    Imported values have no counts: theirs is the step of which all their differences are multiples.
    """
    for channel in recording.channels:
        if channel.name == SIGNALS[recording.kind]:
            return resolution(channel)
    levels = np.unique(recording.signal[:_STEP_SAMPLES])
    rises = np.diff(levels)
    if rises.size < MIN_QUIET:
        return 0.0
    step = float(rises.min())
    # a step of rounding errors, or one of which the others are no multiples, is none
    off = np.abs(rises / step - np.round(rises / step))
    is_even = step > _ROUNDING * float(np.abs(levels).max()) and float(off.max()) < _OFF_STEP
    return step if is_even else 0.0


def _unknown_air(model: Actuator, drive: Drive) -> list[str]:
    """Return sentences on effects of the room whose air the recording does not have."""
    sentences = []
    for name, _ in model.effects:
        needs = EFFECTS[name].needs
        if needs == "humidity" and drive.humidity is None:
            sentences.append(f"{name}: the humidity was not recorded, and is taken as 50 %")
        elif needs == "temperatures" and drive.temperature is None:
            sentences.append(f"{name}: the temperature was not recorded, and is taken as 23 °C")
    return sentences


def _other_rig(recording: Recording, model: Actuator) -> list[str]:
    """Return sentences on a film or load of the recording that differs from the model's."""
    sentences = []
    if recording.film is not None and recording.film != model.film:
        sentences.append("the recording was made with another film than the model's")
    if recording.load is not None and recording.load.mass != model.load.mass:
        sentences.append(
            f"the recording was made under {recording.load.mass * 1e3:g} g, the model is of "
            f"{model.load.mass * 1e3:g} g"
        )
    return sentences


def _place(recording: Recording) -> tuple[str, str, Published | None]:
    """Return table, row and printed errors of a run that the thesis made too."""
    elsewhere = ("", recording.name, None)
    if not recording.sequence_toml:
        return elsewhere
    try:
        played = _lobes(recording.sequence_toml, recording.name)
    except InputError:
        return elsewhere  # a sequence with a CSV file that is missing: not one of the thesis's
    return elsewhere if played is None else _thesis_runs().get(played, elsewhere)


@cache
def _thesis_runs() -> Mapping[Lobes, tuple[str, str, Published | None]]:
    """Return table, row and printed errors of the thesis's runs, by one period of their lobes."""
    places: dict[str, tuple[str, str, Published | None]] = {
        "thesis": ("", "identification", PUBLISHED_FIT)
    }
    for preset, frequency in VALIDATION_A.items():
        places[preset] = ("A", f"f = {frequency:g} Hz", Published(*_TABLE_4[preset]))
    for preset, amplitude in VALIDATION_B.items():
        places[preset] = ("B", f"a = {amplitude:g} kV", Published(*_TABLE_5[preset]))
    runs = {_lobes(PRESETS[preset], preset): place for preset, place in places.items()}
    return {lobes: place for lobes, place in runs.items() if lobes is not None}


def _lobes(toml: str, name: str) -> Lobes | None:
    """Return one period of a sequence of the thesis's lobes alone; None for any other."""
    segments = parse_sequence(toml, name, Path()).sequence.segments
    if len(segments) == 1 and isinstance(segments[0], Lobes):
        # one period, so that runs of any length compare equal
        return replace(segments[0], periods=1)
    return None
