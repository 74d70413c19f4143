"""Sequence files: a sequence read from TOML, or a preset by its name."""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Union

import numpy as np
from pydantic import Discriminator, Field, ValidationError, create_model
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from dearig.config.presets import PRESETS
from dearig.config.segments import SEGMENT_KINDS, SegmentTable
from dearig.config.segments.base import SEGMENTS_MAX
from dearig.config.toml_input import NAME_MAX, Table, allowed, meant, parse_toml, read_text, shown
from dearig.drivers.samples import Computed, Samples
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.excitation import Segment, Sequence

__all__ = [
    "HEAD_FIELDS",
    "HELD_SAMPLES_MAX",
    "SAMPLES_MAX",
    "LoadedSequence",
    "load_sequence",
    "parse_sequence",
]

#: Samples of a run, at most: 11 days at 1 kHz, 16 min at 1 MHz. A run does not hold them, but a
#: plan computes each of them, some 10 million a second.
SAMPLES_MAX = 1_000_000_000
#: Samples that ``LoadedSequence.sample`` returns at most: 4 GB of time and voltage.
HELD_SAMPLES_MAX = 250_000_000


@dataclass(frozen=True)
class LoadedSequence:
    """A sequence ready to be sampled, and the TOML that a recording keeps of it.

    ``highest_frequency`` is the highest frequency of each segment, 0 for one that has none.
    """

    sequence: Sequence
    toml: str
    highest_frequency: tuple[float, ...]

    def sample(self, rate: float) -> tuple[np.ndarray, np.ndarray]:
        """Return time in s and voltage in V, (N,) each, at ``rate`` Hz.

        Raises ``InputError`` as ``on_clock`` does, and for more than ``HELD_SAMPLES_MAX`` samples.
        """
        self._check_clock(rate, HELD_SAMPLES_MAX)
        try:
            return self.sequence.sample(rate)
        except ModelError as error:
            raise InputError(f"sequence {self.sequence.name!r}: {error}") from error

    def on_clock(self, rate: float) -> Samples:
        """Return the voltage in V at ``rate`` Hz, computed window by window.

        Raises ``InputError`` for a sequence that is too long to be played, and for a segment of
        less than two samples or with a frequency above half the rate.
        """
        self._check_clock(rate, SAMPLES_MAX)
        sequence = self.sequence
        try:
            samples = sequence.ticks(rate)
        except ModelError as error:
            raise InputError(f"sequence {sequence.name!r}: {error}") from error
        return Computed(samples, lambda start, stop: sequence.window(rate, start, stop))

    def _check_clock(self, rate: float, samples_max: int) -> None:
        sequence, count = self.sequence, self.sequence.duration * rate
        name = f"sequence {sequence.name!r}"
        if not count <= samples_max:
            raise InputError(
                f"{name} lasts {sequence.duration:.4g} s, which is {count:.3g} samples at "
                f"{rate:g} Hz, and at most {samples_max:,} can be played: shorten it, or lower "
                f"card.sample_rate_Hz in the rig file"
            )
        for i, segment in enumerate(sequence.segments):
            label = f"{name}: segment {i + 1} ({sequence.labels[i]})"
            if segment.duration * rate < 2.0:
                raise InputError(
                    f"{label} lasts {segment.duration:.3g} s, less than two samples at {rate:g} "
                    f"Hz: make it longer, or raise card.sample_rate_Hz in the rig file"
                )
            fastest = self.highest_frequency[i]
            if fastest > 0.5 * rate:
                raise InputError(
                    f"{label} reaches {fastest:g} Hz, and {rate:g} samples a second play at most "
                    f"{0.5 * rate:g} Hz: lower it, or raise card.sample_rate_Hz in the rig file"
                )


class _Head(Table):
    name: str = Field(min_length=1, max_length=NAME_MAX, description="title of the recording")
    lead_in_s: float = Field(
        default=2.0, ge=0.0, le=3600.0, description="time at 0 V before the segments"
    )
    tail_s: float = Field(
        default=1.0, ge=0.0, le=3600.0, description="time at 0 V after the segments"
    )


#: Keys of a sequence file beside its segments.
HEAD_FIELDS: Mapping[str, FieldInfo] = MappingProxyType(_Head.model_fields)


@cache
def _model() -> type[Table]:
    """Return the model of a sequence file, with every kind of segment that is installed."""
    kinds: Any = Union[tuple(SEGMENT_KINDS.values())]  # noqa: UP007  (made at run time)
    segments: Any = list[Annotated[kinds, Discriminator("kind")]]
    return create_model(
        "SequenceFile",
        __base__=_Head,
        segment=(segments, Field(min_length=1, description="one table [[segment]] for each")),
    )


def load_sequence(source: str | Path) -> LoadedSequence:
    """Return the sequence in the file ``source``, or the preset of that name.

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
    """Return the sequence in the TOML ``text``.

    ``name`` is used in messages; files that segments name lie in ``folder``. Raises ``InputError``.
    """
    data = parse_toml(text, name)
    try:
        file: Any = _model().model_validate(data)
    except ValidationError as error:
        raise InputError(f"{name}: {_sentence(error, data)}") from error
    segments: list[Segment] = []
    labels: list[str] = []
    attached = ""
    fastest: list[float] = []
    tables: list[SegmentTable] = file.segment
    for i, table in enumerate(tables):
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
        fastest += [table.highest_frequency] * table.repeats
        for name_of_file in table.files:
            digest = hashlib.sha256((folder / name_of_file).read_bytes()).hexdigest()
            attached += f"# segment {i + 1}: {name_of_file} had sha256 {digest}\n"
    try:
        sequence = Sequence(file.name, tuple(segments), file.lead_in_s, file.tail_s, tuple(labels))
    except ModelError as error:
        raise InputError(f"{name}: {error}") from error
    return LoadedSequence(sequence, text.rstrip("\n") + "\n" + attached, tuple(fastest))


_NO_SEGMENTS = (
    "there is no list of segments: write [[segment]], in double brackets, above the keys of each, "
    "and at least one"
)


def _sentence(error: ValidationError, data: dict[str, Any]) -> str:
    """Return a sentence on the first fault; unknown keys come before the faults they may cause."""
    faults = error.errors(include_url=False)
    first = min(faults, key=lambda fault: fault["type"] != "extra_forbidden")
    if first["type"] == "extra_forbidden":
        # a missing key beside an unknown one is probably the key that was meant
        beside = first["loc"][:-1]
        faults = [f for f in faults if f["type"] != "missing" or f["loc"][:-1] != beside]
    more = len(faults) - 1
    tail = f" ({more} more fault{'s' if more > 1 else ''} after that)" if more else ""
    return _fault(first, data) + tail


def _fault(fault: ErrorDetails, data: dict[str, Any]) -> str:
    place, value = list(fault["loc"]), fault["input"]
    fields, where = _model().model_fields, ""
    if fault["type"] == "model_attributes_type" and place[0] == "segment":
        return f"segment {int(place[1]) + 1} is not a table: write [[segment]] and its keys below"
    if len(place) >= 2 and place[0] == "segment":
        number = int(place[1]) + 1
        where = f"segment {number}: "
        if fault["type"] in ("union_tag_not_found", "union_tag_invalid"):
            tables = data["segment"]
            kind = tables[number - 1].get("kind") if isinstance(tables[number - 1], dict) else None
            known = f"the kinds are {', '.join(SEGMENT_KINDS)}"
            if kind is None:
                return f"{where}kind is missing; {known}"
            return f"{where}kind = {shown(kind)} is not known; {known}"
        if len(place) > 2:
            kind = str(place[2])
            fields, where = SEGMENT_KINDS[kind].model_fields, f"segment {number} ({kind}): "
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
