"""Sequence files: from TOML or the name of a preset to the segments that the model plays."""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath
from types import MappingProxyType
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from dearig.config.presets import PRESETS
from dearig.config.toml_input import Table, allowed, meant, parse_toml, read_text, shown
from dearig.errors import InputError
from dearig.model import excitation
from dearig.model.errors import ModelError
from dearig.model.excitation import THESIS_AMPLITUDES, THESIS_FREQUENCIES, Segment, Sequence

__all__ = ["SEGMENT_KINDS", "LoadedSequence", "load_sequence", "parse_sequence"]

_KV = 1e3
#: Samples of a run, at most: 69 h at 1 kHz, 12 min at the card's full rate. A run holds some
#: 40 bytes of each, and they must fit into an ordinary memory.
SAMPLES_MAX = 250_000_000
#: Segments with their repeats, at most; the periods of thesis segments do not count.
SEGMENTS_MAX = 10_000
_Voltage = Annotated[float, Field(ge=-1e3, le=1e3)]
_Positive = Annotated[float, Field(gt=0.0)]


@dataclass(frozen=True)
class LoadedSequence:
    """A sequence ready to be sampled, and the TOML that a recording keeps of it."""

    sequence: Sequence
    toml: str

    def sample(self, rate: float) -> tuple[np.ndarray, np.ndarray]:
        """Time in s and voltage in V, (N,) each, at ``rate`` Hz.

        Raises ``InputError`` for a sequence that is too long to be played, or has a segment too
        short to be: one that fell between two samples would be left out without a word.
        """
        sequence, count = self.sequence, self.sequence.duration * rate
        name = f"sequence {sequence.name!r}"
        if not count <= SAMPLES_MAX:
            raise InputError(
                f"{name} lasts {sequence.duration:.4g} s, which is {count:.3g} samples at "
                f"{rate:g} Hz, and at most {SAMPLES_MAX:,} can be played: shorten it, or lower "
                f"card.sample_rate_Hz in the rig file"
            )
        for i, segment in enumerate(sequence.segments):
            label = f"{name}: segment {i + 1} ({sequence.labels[i]})"
            if segment.duration * rate < 2.0:
                raise InputError(
                    f"{label} lasts {segment.duration:.3g} s, less than two samples at {rate:g} "
                    f"Hz: make it longer, or raise card.sample_rate_Hz in the rig file"
                )
            fastest = _fastest(segment)
            if fastest > 0.5 * rate:
                raise InputError(
                    f"{label} reaches {fastest:g} Hz, and {rate:g} samples a second play at most "
                    f"{0.5 * rate:g} Hz: lower it, or raise card.sample_rate_Hz in the rig file"
                )
        try:
            return sequence.sample(rate)
        except ModelError as error:
            raise InputError(f"{name}: {error}") from error


def _fastest(segment: Segment) -> float:
    """Highest frequency of a segment in Hz; 0 for others, whose duration says enough."""
    if isinstance(segment, excitation.Sine):
        return segment.frequency
    if isinstance(segment, excitation.Chirp):
        return max(segment.low, segment.high)
    if isinstance(segment, excitation.Multisine):
        return max(segment.frequencies)
    if isinstance(segment, excitation.Lobes):
        return max(segment.frequencies)  # a lobe of f Hz lasts 1/f, and takes two samples as well
    return 0.0


class _Segment(Table):
    repeats: int = Field(default=1, ge=1, le=SEGMENTS_MAX, description="how often it is played")

    def build(self, folder: Path) -> Segment:
        raise NotImplementedError


class _HalfSine(_Segment):
    kind: Literal["half_sine"]
    amplitude_kV: _Voltage = Field(description="top of the lobe")
    frequency_Hz: _Positive = Field(description="the lobe lasts one over this")

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        return excitation.HalfSine(self.amplitude_kV * _KV, self.frequency_Hz)


class _Thesis(_Segment):
    kind: Literal["thesis"]
    amplitudes_kV: list[_Voltage] = Field(
        default=[a / _KV for a in THESIS_AMPLITUDES], min_length=1, description="of the lobes"
    )
    frequencies_Hz: list[_Positive] = Field(
        default=list(THESIS_FREQUENCIES), min_length=1, description="of the lobes"
    )
    periods: int = Field(default=2, ge=1, le=1_000_000, description="of all lobes in turn")

    @model_validator(mode="after")
    def _pairs(self) -> Self:
        if len(self.amplitudes_kV) != len(self.frequencies_Hz):
            raise ValueError(
                f"{len(self.amplitudes_kV)} amplitudes_kV and {len(self.frequencies_Hz)} "
                f"frequencies_Hz: each lobe takes one of both"
            )
        return self

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        amplitudes = tuple(a * _KV for a in self.amplitudes_kV)
        return excitation.Lobes(amplitudes, tuple(self.frequencies_Hz), self.periods)


class _Sine(_Segment):
    kind: Literal["sine"]
    amplitude_kV: _Voltage = Field(description="about the offset")
    frequency_Hz: _Positive = Field(description="of the sine")
    cycles: _Positive = Field(default=1.0, description="how many")
    offset_kV: _Voltage = Field(default=0.0, description="middle of the sine")
    phase_deg: float = Field(default=0.0, ge=-360.0, le=360.0, description="at its start")

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        return excitation.Sine(
            self.amplitude_kV * _KV,
            self.frequency_Hz,
            self.cycles,
            self.offset_kV * _KV,
            float(np.deg2rad(self.phase_deg)),
        )


class _Triangle(_Segment):
    kind: Literal["triangle"]
    amplitude_kV: _Voltage = Field(description="top of the triangle")
    frequency_Hz: _Positive = Field(description="one triangle lasts one over this")

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        return excitation.Triangle(self.amplitude_kV * _KV, self.frequency_Hz)


class _Ramp(_Segment):
    kind: Literal["ramp"]
    to_kV: _Voltage = Field(description="where it ends")
    duration_s: _Positive = Field(description="how long it takes")
    from_kV: _Voltage | None = Field(
        default=None, description="where it starts; left out, where the segment before ends"
    )

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        origin = None if self.from_kV is None else self.from_kV * _KV
        return excitation.Ramp(self.to_kV * _KV, self.duration_s, origin)


class _Hold(_Segment):
    kind: Literal["hold"]
    duration_s: _Positive = Field(description="how long")
    voltage_kV: _Voltage | None = Field(
        default=None, description="left out, where the segment before ends"
    )

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        level = None if self.voltage_kV is None else self.voltage_kV * _KV
        return excitation.Hold(self.duration_s, level)


class _Steps(_Segment):
    kind: Literal["steps"]
    levels_kV: list[_Voltage] = Field(min_length=1, description="one after another")
    dwell_s: _Positive = Field(description="at each level, its rise included")
    rise_s: _Positive = Field(default=0.01, description="of the ramp to each level")

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        return excitation.Steps(tuple(v * _KV for v in self.levels_kV), self.dwell_s, self.rise_s)


class _Chirp(_Segment):
    kind: Literal["chirp"]
    amplitude_kV: _Voltage = Field(description="about the offset")
    from_Hz: _Positive = Field(description="at its start")
    to_Hz: _Positive = Field(description="at its end")
    duration_s: _Positive = Field(description="how long")
    offset_kV: _Voltage | None = Field(
        default=None, description="left out, where the segment before ends"
    )
    taper_s: _Positive = Field(default=0.25, description="of fading in and out")
    sweep: Literal["exponential", "linear"] = Field(default="exponential", description="how")

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        return excitation.Chirp(
            self.amplitude_kV * _KV,
            self.from_Hz,
            self.to_Hz,
            self.duration_s,
            None if self.offset_kV is None else self.offset_kV * _KV,
            self.taper_s,
            self.sweep == "linear",
        )


class _Multisine(_Segment):
    kind: Literal["multisine"]
    amplitude_kV: _Voltage = Field(description="largest excursion from the offset")
    frequencies_Hz: list[_Positive] = Field(min_length=1, description="of the sines")
    duration_s: _Positive = Field(description="how long")
    offset_kV: _Voltage | None = Field(
        default=None, description="left out, where the segment before ends"
    )
    taper_s: _Positive = Field(default=0.25, description="of fading in and out")

    def build(self, folder: Path) -> Segment:  # noqa: ARG002
        return excitation.Multisine(
            self.amplitude_kV * _KV,
            tuple(self.frequencies_Hz),
            self.duration_s,
            None if self.offset_kV is None else self.offset_kV * _KV,
            self.taper_s,
        )


class _Csv(_Segment):
    kind: Literal["csv"]
    file: str = Field(min_length=1, description="beside the sequence, with time_s and voltage_kV")

    def build(self, folder: Path) -> Segment:
        from dearig.recording.importers.csv_file import CsvFile
        from dearig.recording.importers.source import listing
        from dearig.recording.timestamps import not_forward

        # a sequence may come from anybody, in a recording too: it reads nothing but what lies by it
        place = PurePath(self.file)
        if place.is_absolute() or place.drive or ".." in place.parts:
            raise InputError(
                f"file = {shown(self.file)} leads out of the sequence's folder; put the waveform "
                f"beside the sequence, and name it without a path"
            )
        source = CsvFile(folder / place)
        scale = next((k for k in ("voltage_kV", "voltage_V") if k in source.names), None)
        if scale is None or "time_s" not in source.names:
            raise InputError(
                f"{source.path} has the columns {listing(source.names)}; a waveform takes time_s "
                f"and voltage_kV or voltage_V"
            )
        for column in ("time_s", scale):
            source.check(column)
        columns = source.read(["time_s", scale])
        time = columns["time_s"]
        if time.size < 2:
            raise InputError(f"{source.path} has one line of data; a waveform takes at least 2")
        if (back := not_forward(time)) is not None:
            at, how = back
            raise InputError(
                f"{source.path}, {source.row(at)}: time {how}, from {time[at - 1]:.9g} s to "
                f"{time[at]:.9g} s; a step takes two lines with a little time between them"
            )
        voltages = columns[scale] * (_KV if scale == "voltage_kV" else 1.0)
        return excitation.Sampled(time, voltages)


_KINDS: dict[str, type[_Segment]] = {
    "half_sine": _HalfSine,
    "sine": _Sine,
    "triangle": _Triangle,
    "ramp": _Ramp,
    "hold": _Hold,
    "chirp": _Chirp,
    "steps": _Steps,
    "multisine": _Multisine,
    "thesis": _Thesis,
    "csv": _Csv,
}


#: Every kind of segment with the keys that it takes.
SEGMENT_KINDS: Mapping[str, type[Table]] = MappingProxyType(_KINDS)


class _File(Table):
    name: str = Field(min_length=1, description="what the recording will be called")
    lead_in_s: float = Field(default=2.0, ge=0.0, le=3600.0, description="quiet, at 0 V, before")
    tail_s: float = Field(default=1.0, ge=0.0, le=3600.0, description="quiet, at 0 V, after")
    segment: list[
        Annotated[
            _HalfSine | _Sine | _Triangle | _Ramp | _Hold | _Chirp | _Steps | _Multisine | _Thesis
            | _Csv,
            Discriminator("kind"),
        ]
    ] = Field(min_length=1, description="one table [[segment]] for each")  # fmt: skip


def load_sequence(source: str | Path) -> LoadedSequence:
    """The sequence in file ``source``, or the preset of that name.

    Raises ``InputError`` with one sentence: file, segment, key, value, and what is allowed.
    """
    if str(source) in PRESETS:
        return parse_sequence(PRESETS[str(source)], f"preset {source}", Path())
    path = Path(source)
    try:
        there = path.exists()
    except OSError:  # a name too long to be one
        there = False
    if not there and path.suffix != ".toml":
        near = difflib.get_close_matches(str(source), PRESETS, n=1)
        raise InputError(
            f"sequence {source} is neither a file nor a preset"
            + (f" (did you mean {near[0]}?)" if near else "")
            + f"; the presets are {', '.join(PRESETS)}"
        )
    return parse_sequence(read_text(path, "sequence"), f"sequence {path}", path.parent)


def parse_sequence(text: str, name: str, folder: Path) -> LoadedSequence:
    """The sequence in TOML ``text``, called ``name`` in messages; CSV files lie in ``folder``."""
    data = parse_toml(text, name)
    try:
        file = _File.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{name}: {_sentence(error, data)}") from error
    segments: list[Segment] = []
    labels: list[str] = []
    attached = ""
    for i, table in enumerate(file.segment):
        kind = table.kind
        try:
            built = table.build(folder)
        except (InputError, ModelError) as error:
            raise InputError(f"{name}: segment {i + 1}: {error}") from error
        if len(segments) + table.repeats > SEGMENTS_MAX:
            raise InputError(
                f"{name}: segment {i + 1} ({kind}): repeats = {table.repeats} makes more than "
                f"{SEGMENTS_MAX:,} segments in all; play the sequence several times"
            )
        segments += [built] * table.repeats
        labels += [kind] * table.repeats
        if isinstance(table, _Csv):
            digest = hashlib.sha256((folder / table.file).read_bytes()).hexdigest()
            attached += f"# segment {i + 1}: {table.file} had sha256 {digest}\n"
    try:
        sequence = Sequence(file.name, tuple(segments), file.lead_in_s, file.tail_s, tuple(labels))
    except ModelError as error:
        raise InputError(f"{name}: {error}") from error
    return LoadedSequence(sequence, text.rstrip("\n") + "\n" + attached)


_NO_SEGMENTS = (
    "there is no list of segments: write [[segment]], in double brackets, above the keys of each, "
    "and at least one"
)


def _sentence(error: ValidationError, data: dict[str, Any]) -> str:
    """One sentence for the first fault; a wrong name before the wrong values it may have caused."""
    faults = error.errors(include_url=False)
    first = min(faults, key=lambda fault: fault["type"] != "extra_forbidden")
    if first["type"] == "extra_forbidden":
        # what is missing beside a wrong name is what was meant by it
        beside = first["loc"][:-1]
        faults = [f for f in faults if f["type"] != "missing" or f["loc"][:-1] != beside]
    more = len(faults) - 1
    tail = f" ({more} more fault{'s' if more > 1 else ''} after that)" if more else ""
    return _fault(first, data) + tail


def _fault(fault: ErrorDetails, data: dict[str, Any]) -> str:
    place, value = list(fault["loc"]), fault["input"]
    fields, where = _File.model_fields, ""
    if fault["type"] == "model_attributes_type" and place[0] == "segment":
        return f"segment {int(place[1]) + 1} is not a table: write [[segment]] and its keys below"
    if len(place) >= 2 and place[0] == "segment":
        number = int(place[1]) + 1
        where = f"segment {number}: "
        if fault["type"] in ("union_tag_not_found", "union_tag_invalid"):
            tables = data["segment"]
            kind = tables[number - 1].get("kind") if isinstance(tables[number - 1], dict) else None
            known = f"the kinds are {', '.join(_KINDS)}"
            if kind is None:
                return f"{where}kind is missing; {known}"
            return f"{where}kind = {shown(kind)} is not known; {known}"
        if len(place) > 2:
            kind = str(place[2])
            fields, where = _KINDS[kind].model_fields, f"segment {number} ({kind}): "
            place = place[3:]
    if not place:
        return where + str(fault.get("ctx", {}).get("error", fault["msg"]))
    key = str(place[0])
    if fault["type"] == "extra_forbidden":
        hint = meant(key, fields)
        takes = f"it takes {', '.join(fields)}"
        return f"{where}{key} is not a key: {hint or takes}"
    if key == "segment":
        return f"{where}{_NO_SEGMENTS}"
    if fault["type"] == "missing":
        info = fields[key]
        return f"{where}{key} is missing ({info.description}, {allowed(info)})"
    info = fields[key]
    index = f"[{int(place[1]) + 1}]" if len(place) > 1 and isinstance(place[1], int) else ""
    if fault["type"] == "value_error":
        return f"{where}{key}{index} = {shown(value)} is not allowed: {fault['ctx']['error']}"
    takes = allowed(info, item=bool(index))
    return (
        f"{where}{key}{index} = {shown(value)} is not allowed: it takes {takes} "
        f"({info.description})"
    )
