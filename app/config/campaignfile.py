"""Plan files of campaigns: many runs from one sequence, as grids, lists and repeats.

A plan is read and expanded here; nothing is played. Keys of a sequence are written as paths, such
as ``segment.0.amplitude_kV``: tables by name, places in lists by their number from 0.
"""

from __future__ import annotations

import difflib
import hashlib
import itertools
import json
import math
import operator
import os
import random
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath
from types import MappingProxyType
from typing import Any, Literal

from pydantic import Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from dearig.config.notify import Notify, NotifyTable
from dearig.config.parameterfile import Stated, stated_of
from dearig.config.presets import PRESETS
from dearig.config.safe_ends import SAFE_ENDS, SafeEnd
from dearig.config.sequence_paths import clean, filled, flat, with_settings
from dearig.config.sequencefile import LoadedSequence, parse_sequence
from dearig.config.toml_input import (
    NAME_MAX,
    TomlTable,
    allowed,
    meant,
    parse_toml,
    read_text,
    shown,
)
from dearig.errors import InputError

__all__ = [
    "EXAMPLE",
    "PLAN_TABLE",
    "Campaign",
    "PlannedRun",
    "StopCondition",
    "digest_of",
    "load_campaign",
    "parse_campaign",
    "settings_text",
]

#: Runs of a campaign, at most: four weeks of four-minute runs.
RUNS_MAX = 10_000
#: Characters of a run's name, at most; its attempts and the endings of its files are added.
RUN_NAME_MAX = 120
#: Characters of a sequence and of its settings that a plan may write, in all runs together.
TEXT_MAX = 2**27

#: A plan that the rig of the thesis can play.
EXAMPLE = """\
# A campaign: many unattended runs, one after the other.
name = "ageing"
sequence = "validation-b-6.0"   # a preset, or a sequence file in this folder
repeat = 2                      # times that each setting is played
rest_s = 5.0                    # time at 0 V between two runs
order = "random"                # or "as_written"
seed = 1                        # of the random order
repeat_lost = 0                 # times that a run is repeated whose recording was lost
repeat_after = []               # or "input-overflow", "output-underflow": it counts as lost
# names of the recordings: name, number, repeat, and any key of the sequence
template = "{name}-{number:04d}-{segment.0.amplitudes_kV.0}kV"

# every combination of these values is played; a key is a path in the sequence, counted from 0
[grid]
"segment.0.amplitudes_kV" = [[6.0, 6.0, 6.0, 6.0, 6.0], [7.0, 7.0, 7.0, 7.0, 7.0]]
"segment.0.periods" = [1]

# single runs in addition to the grid; each can be repeated, and can have its own sequence
# [[run]]
# sequence = "rich"
# repeat = 1
# set = {"lead_in_s" = 4.0}

# runs that bring the film to a steady state; they are recorded, and nothing is fitted to them
[warm_up]
runs = 1
# sequence = "rich"             # by default that of the campaign as it is written

# what is computed after each run
[after]
identify = false                # fit the model to the recording
validate = false                # compare the recording with the last model
diagnose = false                # find what the model lacks, which may take minutes
branches = 3                    # of the fitted model
# model = "model.toml"          # the first model of validate, in this folder
# stop_when = ["mu_0_kPa < 40"] # the campaign stops when a number leaves its band
# parameters.mu_0_kPa = {mean = 46.0, sd = 0.5}   # or fixed; or low, high: as in a parameter file

# a lifetime test: the recordings of other runs are reduced to the extremes of each cycle
[keep]
every = 1                       # keep the recording of every n-th run; 1 keeps all
every_cycle = 0                 # of the others keep every n-th cycle at full rate; 0 keeps none

# notifications, sent after a run, at 0 V
# [notify]
# command = ["python", "notify.py"]           # a program, which gets JSON on its standard input
# webhook = "env:LAB_WEBHOOK"                 # an address, or a variable that has it
# on = ["run-ended", "tripped", "queue-stopped"]
# timeout_s = 30.0                            # time for the program, and for the webhook's answer
"""


class _Run(TomlTable):
    sequence: str | None = Field(
        default=None, min_length=1, max_length=NAME_MAX,
        description="a preset, or a sequence file in the plan's folder",
    )  # fmt: skip
    repeat: int = Field(default=1, ge=1, le=RUNS_MAX, description="times that it is played")
    set: dict[str, Any] = Field(
        default_factory=dict, description="values of keys of the sequence, by their paths"
    )


class _WarmUp(TomlTable):
    runs: int = Field(default=1, ge=0, le=1000, description="runs before the others")
    sequence: str | None = Field(
        default=None, min_length=1, max_length=NAME_MAX,
        description="a preset, or a sequence file in the plan's folder",
    )  # fmt: skip


class _After(TomlTable):
    identify: bool = Field(default=False, description="fit the model")
    validates: bool = Field(
        default=False, alias="validate", description="compare with the last model"
    )
    diagnose: bool = Field(default=False, description="find what the model lacks")
    branches: int = Field(default=3, ge=1, le=8, description="branches of the fitted model")
    model: str | None = Field(
        default=None, min_length=1, max_length=NAME_MAX,
        description="model file in the plan's folder, the first one of validate",
    )  # fmt: skip
    stop_when: list[str] = Field(
        default=[], max_length=100, examples=[["mu_0_kPa < 40"]], description="bands of numbers"
    )
    parameters: dict[str, Any] = Field(
        default_factory=dict, description="what is known of parameters, a table for each"
    )


class _Keep(TomlTable):
    every: int = Field(default=1, ge=1, le=RUNS_MAX, description="recordings that are kept whole")
    every_cycle: int = Field(
        default=0, ge=0, le=10**9, description="cycles of the others that are kept at full rate"
    )


class _File(TomlTable):
    name: str = Field(min_length=1, max_length=80, description="name of the campaign")
    sequence: str | None = Field(
        default=None, min_length=1, max_length=NAME_MAX,
        description="a preset, or a sequence file in the plan's folder",
    )  # fmt: skip
    repeat: int = Field(default=1, ge=1, le=RUNS_MAX, description="times that each is played")
    rest_s: float = Field(
        default=0.0, ge=0.0, le=86400.0, description="time at 0 V between two runs"
    )
    order: Literal["as_written", "random"] = Field(
        default="as_written", description="order of the runs"
    )
    seed: int = Field(default=0, ge=0, le=10**15, description="seed of the random order")
    repeat_lost: int = Field(
        default=0, ge=0, le=10, description="times that a lost recording is repeated"
    )
    repeat_after: list[SafeEnd] = Field(
        default_factory=list, max_length=len(SAFE_ENDS),
        description="ends at confirmed 0 V after which a run counts as lost and no one has to look",
    )  # fmt: skip
    template: str = Field(
        default="{name}-{number:04d}", min_length=1, max_length=NAME_MAX,
        description="names of the recordings",
    )  # fmt: skip
    grid: dict[str, Any] = Field(
        default_factory=dict, description="lists of values of keys of the sequence"
    )
    run: list[_Run] = Field(default_factory=list, description="one table [[run]] for each")
    warm_up: _WarmUp = Field(default=_WarmUp(runs=0), description="runs before the others")
    after: _After = Field(default=_After(), description="what is computed after each run")
    keep: _Keep = Field(default=_Keep(), description="which recordings are kept whole")
    notify: NotifyTable = Field(default=NotifyTable(), description="notifications")


#: Fields of a plan's top level, for a form.
PLAN_TABLE: type[TomlTable] = _File

_COMPARISONS: Mapping[str, Callable[[float, float], bool]] = MappingProxyType(
    {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
)
_BAND = re.compile(r"\s*([A-Za-z_][\w.-]*)\s*(<=|>=|<|>)\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*")


@dataclass(frozen=True)
class StopCondition:
    """A condition on the number ``name`` of a run that ends the campaign: ``mu_0_kPa < 40``."""

    name: str
    comparison: str
    limit: float

    def left_by(self, value: float) -> bool:
        """Return True where ``value`` meets the condition."""
        return _COMPARISONS[self.comparison](value, self.limit)

    def __str__(self) -> str:
        return f"{self.name} {self.comparison} {self.limit:g}"


@dataclass(frozen=True)
class PlannedRun:
    """One run of a plan.

    ``number`` counts from 1 in the order of the plan, and ``name`` is that of its recording without
    the ending. ``settings`` are values of the sequence by their paths. ``repeat`` counts from 1.
    """

    number: int
    name: str
    sequence: str
    settings: Mapping[str, Any]
    repeat: int
    warm_up: bool = False


@dataclass(frozen=True)
class Campaign:
    """A plan as read from ``toml``, with its ``runs`` in the order in which they are played.

    ``source`` names it in messages. ``branches`` is the number of Maxwell branches of what is
    fitted, ``parameters`` what is known of it. ``model`` is the file of the first model of
    ``validate``, None for none. Of ``keep_every`` runs one recording is kept whole, of the others
    one of ``keep_cycles`` cycles, 0 for none. ``sequences`` has the TOML of each by its name.
    ``notify`` are the settings of notifications.
    """

    name: str
    source: str
    toml: str
    folder: Path
    runs: tuple[PlannedRun, ...]
    rest: float
    repeat_lost: int
    repeat_after: tuple[SafeEnd, ...]
    identify: bool
    validate: bool
    diagnose: bool
    branches: int
    parameters: Stated
    model: Path | None
    stop_when: tuple[StopCondition, ...]
    keep_every: int
    keep_cycles: int
    sequences: Mapping[str, str]
    notify: Notify

    def load(self, run: PlannedRun) -> LoadedSequence:
        """Return the sequence of ``run``. Raises ``InputError`` for one that is not valid."""
        where = f"{self.source}: run {run.name}, sequence {run.sequence}"
        text = with_settings(self.sequences[run.sequence], run.settings, where)
        return parse_sequence(text, where, self.folder)

    def is_kept(self, run: PlannedRun) -> bool:
        """Return True if the recording of ``run`` is kept whole."""
        return run.warm_up or (run.number - 1) % self.keep_every == 0


def digest_of(loaded: LoadedSequence) -> str:
    """Return what tells the sequence from another one, with the files that it reads."""
    return hashlib.sha256(loaded.toml.encode()).hexdigest()


def load_campaign(path: str | Path, folder: Path | None = None) -> Campaign:
    """Return the plan in the file ``path``; files that it names lie in ``folder``, or next to it.

    Raises ``InputError`` with one sentence: file, key, value, and what is allowed.
    """
    path = Path(path)
    return parse_campaign(read_text(path, "plan"), f"plan {path}", folder or path.parent)


def parse_campaign(text: str, name: str, folder: Path) -> Campaign:
    """Return the plan in the TOML ``text``.

    ``name`` is used in messages; files that the plan names lie in ``folder``. Raises
    ``InputError``.
    """
    data = parse_toml(text, name)
    after = data.get("after")
    if isinstance(after, dict) and isinstance(after.get("stop_when"), str):
        after["stop_when"] = [after["stop_when"]]
    try:
        file = _File.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{name}: {_sentence(error)}") from error
    try:
        return _Expansion(file, name, text, folder).campaign()
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


# ---------------------------------------------------------------- expansion


class _Expansion:
    """The runs of a plan."""

    def __init__(self, file: _File, source: str, text: str, folder: Path) -> None:
        self._file, self._source, self._text, self._folder = file, source, text, folder
        self._sequences: dict[str, str] = {}
        self._parsed: dict[str, dict[str, Any]] = {}

    def campaign(self) -> Campaign:
        file = self._file
        settings = list(self._settings())
        if file.order == "random":
            random.Random(file.seed).shuffle(settings)  # noqa: S311  (an order, no secret)
        runs = [*self._warm_up(), *self._named(settings)]
        self._check_size(runs)
        _check_names(runs)
        model = None
        if file.after.model is not None:
            model = _beside(self._folder, file.after.model, "after.model")
        if file.after.validates and model is None and not file.after.identify:
            raise InputError("after.validate has no model: name after.model, or set after.identify")
        return Campaign(
            name=file.name,
            source=self._source,
            toml=self._text,
            folder=self._folder,
            runs=tuple(runs),
            rest=file.rest_s,
            repeat_lost=file.repeat_lost,
            repeat_after=tuple(file.repeat_after),
            identify=file.after.identify,
            validate=file.after.validates,
            diagnose=file.after.diagnose,
            branches=file.after.branches,
            parameters=stated_of(file.after.parameters),
            model=model,
            stop_when=tuple(self._bands()),
            keep_every=file.keep.every,
            keep_cycles=file.keep.every_cycle,
            sequences=MappingProxyType(self._sequences),
            notify=file.notify.settings(),
        )

    def _settings(self) -> Iterator[tuple[str, dict[str, Any], int]]:
        """Yield sequence, settings and repeat of each run, as written."""
        file = self._file
        count = 0
        for sequence, settings, repeats in self._groups():
            count += repeats
            if count > RUNS_MAX:
                raise InputError(
                    f"it makes more than {RUNS_MAX:,} runs; write several plans, and play them one "
                    f"after the other"
                )
            text = self._read(sequence)
            for repeat in range(repeats):
                yield sequence, settings, repeat + 1
            with_settings(text, settings, "the plan", self._parsed[sequence])
        if not count:
            raise InputError(
                "there is no run: give a sequence, or tables [[run]]"
                if file.sequence is None
                else "there is no run"
            )

    def _groups(self) -> Iterator[tuple[str, dict[str, Any], int]]:
        file = self._file
        grid = dict(flat(file.grid))
        for key, values in grid.items():
            if not isinstance(values, list) or not values:
                raise InputError(
                    f"grid.{key} = {shown(values)} is not a list of values, such as [6.0, 7.0]"
                )
        if math.prod(len(values) for values in grid.values()) > RUNS_MAX:
            raise InputError(f"the grid has more than {RUNS_MAX:,} combinations")
        if file.sequence is None and (grid or not file.run):
            raise InputError("sequence is missing: it is a preset or a sequence file")
        if file.sequence is not None and (grid or not file.run):
            for values in itertools.product(*grid.values()):
                yield file.sequence, dict(zip(grid, values, strict=True)), file.repeat
        for i, run in enumerate(file.run):
            sequence = run.sequence or file.sequence
            if sequence is None:
                raise InputError(
                    f"run[{i + 1}]: sequence is missing, and the plan has none for all runs"
                )
            yield sequence, dict(flat(run.set)), run.repeat

    def _warm_up(self) -> Iterator[PlannedRun]:
        warm_up = self._file.warm_up
        if not warm_up.runs:
            return
        sequence = warm_up.sequence or self._file.sequence
        if sequence is None:
            raise InputError("warm_up.sequence is missing: it is a preset or a sequence file")
        self._read(sequence)
        for i in range(warm_up.runs):
            name = clean(f"{self._file.name}-warm-up-{i + 1:02d}")
            yield PlannedRun(i + 1, name, sequence, MappingProxyType({}), i + 1, warm_up=True)

    def _named(self, settings: list[tuple[str, dict[str, Any], int]]) -> Iterator[PlannedRun]:
        for i, (sequence, values, repeat) in enumerate(settings):
            fields = {"name": self._file.name, "number": i + 1, "repeat": repeat}
            name = filled(self._file.template, fields, values, self._parsed[sequence])
            if not name.strip(".-"):
                raise InputError(f"template: the name of run {i + 1} would be empty")
            if len(name) > RUN_NAME_MAX:
                raise InputError(
                    f"template: {name[:40]}... has {len(name)} characters; a name has at most "
                    f"{RUN_NAME_MAX}"
                )
            yield PlannedRun(i + 1, name, sequence, MappingProxyType(values), repeat)

    def _read(self, sequence: str) -> str:
        """Return the TOML of ``sequence``, a preset or a file next to the plan."""
        if sequence in self._sequences:
            return self._sequences[sequence]
        if sequence in PRESETS:
            text = PRESETS[sequence]
        else:
            path = _beside(self._folder, sequence, "sequence")
            if not path.is_file():
                near = difflib.get_close_matches(sequence, PRESETS, n=1)
                raise InputError(
                    f"sequence = {shown(sequence)} is neither a preset nor a file next to the plan"
                    + (f" (did you mean {near[0]}?)" if near else "")
                    + f"; the presets are {', '.join(PRESETS)}"
                )
            text = read_text(path, "sequence")
        self._parsed[sequence] = parse_toml(text, f"sequence {sequence}")
        self._sequences[sequence] = text
        return text

    def _check_size(self, runs: list[PlannedRun]) -> None:
        """Refuse a plan whose sequences cannot be written for every run in acceptable time."""
        total = sum(len(self._sequences[run.sequence]) for run in runs)
        if total > TEXT_MAX:
            raise InputError(
                f"its {len(runs):,} runs have {total:,} characters of sequences in all, and "
                f"{TEXT_MAX:,} are read at most: write fewer runs, or shorter sequences"
            )

    def _bands(self) -> Iterator[StopCondition]:
        after = self._file.after
        known = _numbers(after)
        for text in after.stop_when:
            found = _BAND.fullmatch(text)
            try:
                limit = float(found[3]) if found else math.nan
            except ValueError:
                limit = math.nan
            if found is None or not math.isfinite(limit):
                raise InputError(
                    f"after.stop_when = {shown(text)} is not a condition such as "
                    f'"mu_0_kPa < 40": a number of a run, <, <=, > or >=, and its limit'
                )
            if found[1] not in known and not (after.diagnose and "." in found[1]):
                raise InputError(
                    f"after.stop_when = {shown(text)}: {found[1]} is not a number of a run; with "
                    f"this plan they are {', '.join(known)}"
                )
            yield StopCondition(found[1], found[2], limit)


#: Numbers that each step after a run gives, besides the parameters of the model.
ERRORS = ("rms_um", "nrmse_pct", "max_um")
#: Numbers that each recording gives without any step; those of the room where they are measured.
MEASURED = ("peak_displacement_mm", "temperature_degC", "relative_humidity_percent")


def _numbers(after: _After) -> list[str]:
    """Return the names of the numbers that are computed after each run."""
    found = [*MEASURED]
    if after.identify:
        found += ["mu_0_kPa", "J_0"]
        for i in range(1, after.branches + 1):
            found += [f"mu_{i}_kPa", f"J_{i}", f"T_{i}_s"]
        found += [f"fit_{name}" for name in ERRORS]
    if after.validates:
        found += [f"validation_{name}" for name in ERRORS]
    if after.diagnose:
        found += [f"diagnosis_{name}" for name in ERRORS]
    return found


#: Names of devices on Windows, which no file can have there.
_DEVICES = re.compile(r"(?i)(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?")


def _check_names(runs: list[PlannedRun]) -> None:
    """Refuse two runs of one name, also where a disk does not tell capitals."""
    seen: dict[str, PlannedRun] = {}
    for run in runs:
        if _DEVICES.fullmatch(run.name):
            raise InputError(f"template: {run.name} is the name of a device on Windows")
        other = seen.setdefault(run.name.lower(), run)
        if other is not run:
            raise InputError(
                f"template: run {other.number} and run {run.number} would both be named "
                f"{run.name}; put {{number}} into the template"
            )


def _beside(folder: Path, name: str, key: str) -> Path:
    """Return the path of a file next to the plan. Raises ``InputError`` for one elsewhere."""
    place = PurePath(name)
    if place.is_absolute() or place.drive or ".." in place.parts:
        raise InputError(
            f"{key} = {shown(name)} leads out of the plan's folder; put the file next to the plan, "
            f"and name it without a path"
        )
    path = folder / place
    if "\0" in name:
        raise InputError(f"{key} = {shown(name)} has a character that no name may have")
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise InputError(
            f"{key} = {shown(name)} is a link that leads out of the plan's folder; put the file "
            f"itself next to the plan"
        )
    if len(place.parts) > 1:
        raise InputError(
            f"{key} = {shown(name)} is in another folder; put the file next to the plan"
        )
    return path


# ---------------------------------------------------------------- messages

_TABLES: Mapping[str, type[TomlTable]] = MappingProxyType(
    {"run": _Run, "warm_up": _WarmUp, "after": _After, "keep": _Keep, "notify": NotifyTable}
)


def _keys(table: type[TomlTable]) -> dict[str, FieldInfo]:
    return {info.alias or name: info for name, info in table.model_fields.items()}


def _sentence(error: ValidationError) -> str:
    """Return a sentence on the first fault; unknown keys come before the faults they may cause."""
    faults = error.errors(include_url=False)
    first = min(faults, key=lambda fault: fault["type"] != "extra_forbidden")
    more = len(faults) - 1
    tail = f" ({more} more fault{'s' if more > 1 else ''} after that)" if more else ""
    return _fault(first) + tail


def _fault(fault: ErrorDetails) -> str:
    place = list(fault["loc"])
    known, where = _keys(_File), ""
    if str(place[0]) in _TABLES and len(place) > 1:
        known, where = _keys(_TABLES[str(place[0])]), str(place[0])
        place = place[1:]
        if isinstance(place[0], int):
            where += f"[{place[0] + 1}]"
            place = place[1:]
        where += "."
    value = fault["input"]
    if not place:
        return f"{where.rstrip('.')} = {shown(value)} is not a table: write [[run]] and its keys"
    key = str(place[0])
    if fault["type"] == "extra_forbidden":
        hint = meant(key, known) or f"it takes {', '.join(known)}"
        return f"{where}{key} is not a key: {hint}"
    info = known[key]
    what = _allowed(info)
    if fault["type"] == "missing":
        return f"{where}{key} is missing: it is {what} ({info.description})"
    return f"{where}{key} = {shown(value)} is not allowed, but {what} ({info.description})"


def _allowed(info: FieldInfo) -> str:
    if info.annotation is bool:
        return "true or false"
    if info.annotation == list[_Run]:
        return "tables [[run]]"
    return allowed(info)


def settings_text(settings: Mapping[str, Any]) -> str:
    """Return the settings of a run as a line: ``segment.0.amplitude_kV = 6.0``."""
    return ", ".join(
        f"{path} = {json.dumps(value, default=str)}" for path, value in settings.items()
    )
