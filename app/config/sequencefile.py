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
from dearig.config.toml_input import (
    NAME_MAX,
    TomlTable,
    allowed,
    meant,
    parse_toml,
    read_text,
    shown,
)
from dearig.drivers.samples import Computed, Samples
from dearig.errors import InputError
from dearig.input_file import open_input
from dearig.model.errors import ModelError
from dearig.model.simulation.excitation import Segment, Sequence, join

__all__ = [
    "HEAD_FIELDS",
    "HELD_SAMPLES_MAX",
    "SAMPLES_MAX",
    "LoadedSequence",
    "SequenceFault",
    "load_sequence",
    "parse_sequence",
    "read_sequence",
]

#: Samples of a run, at most: 11 days at 1 kHz, 16 min at 1 MHz. A run does not hold them, but a
#: plan computes each of them, some 10 million a second.
SAMPLES_MAX = 1_000_000_000
#: Samples that ``LoadedSequence.sample`` returns at most: 4 GB of time and voltage.
HELD_SAMPLES_MAX = 250_000_000


@dataclass(frozen=True)
class SequenceFault:
    """A fault of a sequence: a whole ``sentence``, and ``words`` to stand next to its field.

    ``row`` is the table [[segment]] from 0, ``key`` its key; both are None where the fault has
    none. A key without a row is one of the head.
    """

    sentence: str
    words: str
    row: int | None = None
    key: str | None = None


@dataclass(frozen=True)
class LoadedSequence:
    """A sequence ready to be sampled, and the TOML that a recording keeps of it.

    ``highest_frequency`` is the highest frequency of each segment, 0 for one that has none.
    ``rows`` is the table [[segment]] of each, from 0: a table with repeats makes several segments.
    """

    sequence: Sequence
    toml: str
    highest_frequency: tuple[float, ...]
    rows: tuple[int, ...]

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

    def clock_faults(self, rate: float, samples_max: int = SAMPLES_MAX) -> list[SequenceFault]:
        """Return why the sequence cannot be sampled at ``rate`` Hz, every reason."""
        sequence, count = self.sequence, self.sequence.duration * rate
        name = f"sequence {sequence.name!r}"
        if not count <= samples_max:
            words = (
                f"lasts {sequence.duration:.4g} s, which is {count:.3g} samples at {rate:g} Hz, "
                f"and at most {samples_max:,} can be played: shorten it, or lower "
                f"card.sample_rate_Hz in the rig file"
            )
            return [SequenceFault(f"{name} {words}", words)]
        found = []
        for i, segment in enumerate(sequence.segments):
            fastest, words = self.highest_frequency[i], ""
            if segment.duration * rate < 2.0:
                words = (
                    f"lasts {segment.duration:.3g} s, less than two samples at {rate:g} "
                    f"Hz: make it longer, or raise card.sample_rate_Hz in the rig file"
                )
            elif fastest > 0.5 * rate:
                words = (
                    f"reaches {fastest:g} Hz, and {rate:g} samples a second play at most "
                    f"{0.5 * rate:g} Hz: lower it, or raise card.sample_rate_Hz in the rig file"
                )
            if words:
                where = f"{name}: segment {i + 1} ({sequence.labels[i]})"
                found.append(SequenceFault(f"{where} {words}", words, self.rows[i]))
        return found

    def _check_clock(self, rate: float, samples_max: int) -> None:
        found = self.clock_faults(rate, samples_max)
        if found:
            raise InputError(found[0].sentence + _more(len(found) - 1))


class _Head(TomlTable):
    name: str = Field(min_length=1, max_length=NAME_MAX, description="title of the recording")
    lead_in_s: float = Field(
        default=2.0, ge=0.0, le=3600.0, description="time at 0 V before the segments"
    )
    tail_s: float = Field(
        default=1.0, ge=0.0, le=3600.0, description="time at 0 V after the segments"
    )


#: Keys of a sequence file besides its segments.
HEAD_FIELDS: Mapping[str, FieldInfo] = MappingProxyType(_Head.model_fields)


@cache
def _model(kinds: tuple[type[SegmentTable], ...]) -> type[TomlTable]:
    """Return the model of a sequence file with these kinds of segment."""
    one: Any = Union[kinds]  # noqa: UP007  (made at run time)
    segments: Any = list[Annotated[one, Discriminator("kind")]]
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
    loaded, faults = read_sequence(text, name, folder)
    if loaded is None:
        raise InputError(f"{name}: {faults[0].sentence}{_more(len(faults) - 1)}")
    return loaded


def read_sequence(
    text: str,
    name: str,
    folder: Path,
    kinds: Mapping[str, type[SegmentTable]] = SEGMENT_KINDS,
) -> tuple[LoadedSequence | None, list[SequenceFault]]:
    """Return the sequence in the TOML ``text``, or None with all its errors.

    ``kinds`` are the kinds of segment by name. Whether neighbouring segments join is checked only
    if each segment is valid. Raises ``InputError`` where ``text`` is not TOML.
    """
    data = parse_toml(text, name)
    try:
        file: Any = _model(tuple(kinds.values())).model_validate(data)
    except ValidationError as error:
        faults = _faults(error, data, kinds)
        wrong = {fault.row for fault in faults}
        tables = data.get("segment")
        right = {
            i: kinds[table["kind"]].model_validate(table)
            for i, table in enumerate(tables if isinstance(tables, list) else ())
            if i not in wrong
        }
        return None, faults + _Built(right, folder).faults
    built = _Built(dict(enumerate(file.segment)), folder)
    if not built.faults:
        built.join()
    if built.faults:
        return None, built.faults
    try:
        sequence = Sequence(
            file.name, tuple(built.segments), file.lead_in_s, file.tail_s, tuple(built.labels)
        )
    except ModelError as error:
        return None, [SequenceFault(str(error), str(error))]
    toml = text.rstrip("\n") + "\n" + built.attached
    return LoadedSequence(sequence, toml, tuple(built.fastest), tuple(built.rows)), []


class _Built:
    """Segments of the ``tables``, by their rows, and the ``faults`` in building them."""

    def __init__(self, tables: Mapping[int, SegmentTable], folder: Path) -> None:
        self.segments: list[Segment] = []
        self.labels: list[str] = []
        self.fastest: list[float] = []
        self.rows: list[int] = []
        self.attached = ""  # lines on the files that segments read
        self.faults: list[SequenceFault] = []
        for row, table in tables.items():
            self._add(row, table, folder)

    def _add(self, row: int, table: SegmentTable, folder: Path) -> None:
        where = f"segment {row + 1}"
        try:
            built = table.build(folder)
        except (InputError, ModelError) as error:
            self.faults.append(SequenceFault(f"{where}: {error}", str(error), row))
            return
        if len(self.segments) + table.repeats > SEGMENTS_MAX:
            text = (
                f"repeats = {table.repeats} makes more than {SEGMENTS_MAX:,} segments in all; play "
                f"the sequence several times"
            )
            self.faults.append(
                SequenceFault(f"{where} ({table.kind}): {text}", text, row, "repeats")
            )
            return
        self.segments += [built] * table.repeats
        self.labels += [table.kind] * table.repeats
        self.fastest += [table.highest_frequency] * table.repeats
        self.rows += [row] * table.repeats
        for name in table.files:
            with open_input(folder / name, "waveform") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            self.attached += f"# {where}: {name} had sha256 {digest}\n"

    def join(self) -> None:
        """Find the segments that do not start where the one before ends."""
        for i, sentence in join(self.segments, tuple(self.labels))[1]:
            text = sentence.removeprefix(f"segment {i + 1} ({self.labels[i]}) ")
            self.faults.append(SequenceFault(sentence, text, self.rows[i]))


def _more(count: int) -> str:
    return f" ({count} more fault{'s' if count > 1 else ''} after that)" if count else ""


_NO_SEGMENTS = (
    "there is no list of segments: write [[segment]], in double brackets, above the keys of each, "
    "and at least one"
)


def _faults(
    error: ValidationError, data: dict[str, Any], kinds: Mapping[str, type[SegmentTable]]
) -> list[SequenceFault]:
    """Return all faults; unknown keys come before the faults that they may cause."""
    found = sorted(
        error.errors(include_url=False), key=lambda fault: fault["type"] != "extra_forbidden"
    )
    # a missing key next to an unknown one is probably the key that was meant
    unknown = {f["loc"][:-1] for f in found if f["type"] == "extra_forbidden"}
    return [
        _fault(f, data, kinds)
        for f in found
        if f["type"] != "missing" or f["loc"][:-1] not in unknown
    ]


def _fault(
    fault: ErrorDetails, data: dict[str, Any], kinds: Mapping[str, type[SegmentTable]]
) -> SequenceFault:
    place = list(fault["loc"])
    fields, where, row = _model(tuple(kinds.values())).model_fields, "", None
    if len(place) >= 2 and place[0] == "segment":
        row = int(place[1])
        where = f"segment {row + 1}"
        if fault["type"] == "model_attributes_type":
            words = "is not a table: write [[segment]] and its keys below"
            return SequenceFault(f"{where} {words}", words, row)
        if fault["type"] in ("union_tag_not_found", "union_tag_invalid"):
            kind = data["segment"][row].get("kind")
            known = f"the kinds are {', '.join(kinds)}"
            said = "is missing" if kind is None else f"= {shown(kind)} is not known"
            return SequenceFault(f"{where}: kind {said}; {known}", f"kind {said}; {known}", row)
        if len(place) > 2:
            kind = str(place[2])
            fields, where = kinds[kind].model_fields, f"{where} ({kind})"
            place = place[3:]
        where += ": "
    if not place:
        words = str(fault.get("ctx", {}).get("error", fault["msg"]))
        return SequenceFault(where + words, words, row)
    key = str(place[0])
    if fault["type"] == "extra_forbidden":
        takes = f"it takes {', '.join(fields)}"
        words = f"{key} is not a key: {meant(key, fields) or takes}"
        return SequenceFault(where + words, words, row, key)
    if key == "segment":
        return SequenceFault(where + _NO_SEGMENTS, _NO_SEGMENTS)
    info, index, said, value = fields[key], "", "", fault["input"]
    if len(place) > 1 and isinstance(place[1], int):
        index, said = f"[{place[1] + 1}]", f"value {place[1] + 1}: "
    if fault["type"] == "missing":
        said, words = f"{key} is missing (", f"{info.description}, {allowed(info)})"
        return SequenceFault(where + said + words, f"is missing ({words}", row, key)
    if fault["type"] == "value_error":
        words = str(fault["ctx"]["error"])
    else:
        words = f"it takes {allowed(info, item=bool(index))} ({info.description})"
    sentence = f"{where}{key}{index} = {shown(value)} is not allowed: {words}"
    return SequenceFault(sentence, f"{said}{words}", row, key)
