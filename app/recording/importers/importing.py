"""Import of measured data from other programs as a recording."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import Event as Flag

from dearig.drivers.rig import Event
from dearig.errors import InputError, Note, hints_of
from dearig.model.film.specimen import KINEMATICS, Film, Load
from dearig.progress import Progress, part, quiet
from dearig.recording.content.assumed import ASSUMED, FILM_VALUES, assumed_of
from dearig.recording.content.layout import AVERAGE_COLUMN
from dearig.recording.content.metadata import RunMetadata
from dearig.recording.content.provenance import FROM_IMPORT, START_FROM
from dearig.recording.content.rest_noise import MIN_QUIET, lead_in, mean_beyond_noise
from dearig.recording.content.table_description import description_path, read_description
from dearig.recording.files import check_output, file_sha256
from dearig.recording.importers.columns.choose import choose
from dearig.recording.importers.columns.chosen import (
    HOLE,
    UNIT_HOLE,
    Chosen,
    import_command,
    take_channels,
)
from dearig.recording.importers.columns.plausible import plausibility_warnings
from dearig.recording.importers.columns.proposal import first_values
from dearig.recording.importers.columns.specimen import Specimen
from dearig.recording.importers.columns.start import MeasurementStart
from dearig.recording.importers.columns.values import Values, values_of
from dearig.recording.importers.exported import Exported, exported
from dearig.recording.importers.quantities.units import UnitScale
from dearig.recording.importers.registry import source_at
from dearig.recording.importers.source import NeedsOptionError, Source
from dearig.recording.writing.save import save_recording

__all__ = [
    "ImportOptions",
    "Imported",
    "Prepared",
    "UnsureError",
    "exported_from",
    "import_file",
    "prepare",
]

#: Parts of the time of an import at which the file is open, the numbers are read, and the checks
#: are done: a text of three million rows takes as long.
OPENED, READ, WRITING = 0.05, 0.7, 0.85
_EVENTS_MAX = 50  # events of rows that were left out, at most


@dataclass(frozen=True)
class ImportOptions:
    """How a file of measured data is read.

    Attributes
    ----------
    columns : mapping of str to str
        Column of the file, by the name with unit that a recording gives it: ``voltage_kV``. A
        scale may stand behind the column: ``Laser out (V)*4``. Columns whose names say what they
        are may be left out.
    gauge_length_mm, area_mm2 : float, optional
        Size of a film's specimen, to convert displacement and force.
    kinematics : str, optional
        How the film was held; uniaxial for film data by default.
    rate_Hz : float, optional
        Sample rate of a file without a column for time.
    names_line : int, optional
        Line of the names in a text file, from 1.
    skip_bad_rows : bool
        Leave out rows whose time or drive cannot be used; their places become events of the
        recording. Other readings that cannot be used are missing, and their rows stay.
    table : str, optional
        Table of a file with several: a sheet, a specimen, a group. By default the only one with
        all the columns that are needed.
    raw : mapping of str to Scale
        Scales of a rig file from volts at the card, by quantity.
    guess : bool
        Choose columns by their names too. Without it, ``columns`` are all.
    typed : tuple of (str, str or float)
        Further options of the command with their values, for the command that an error proposes.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    gauge_length_mm: float | None = None
    area_mm2: float | None = None
    kinematics: str | None = None
    rate_Hz: float | None = None
    names_line: int | None = None
    skip_bad_rows: bool = False
    raw: Mapping[str, UnitScale] = field(default_factory=dict)
    table: str | None = None
    guess: bool = True
    typed: tuple[tuple[str, str | float], ...] = ()

    def __post_init__(self) -> None:
        if self.kinematics is not None and self.kinematics not in KINEMATICS:
            known = ", ".join(KINEMATICS)
            raise InputError(f"kinematics {self.kinematics!r} is not one of {known}")
        for name, given in (("gauge length", self.gauge_length_mm), ("area", self.area_mm2)):
            if given is not None and not 0.0 < given < float("inf"):
                raise InputError(f"the {name} is {given!r}; it must be a finite number above 0")


@dataclass(frozen=True)
class Imported:
    """What an import did: ``columns`` that were read, ``notes``, ``warnings`` to check."""

    columns: tuple[str, ...]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Prepared:
    """A recording that an import would write: ``values`` with warnings and notes, and metadata."""

    chosen: Chosen
    values: Values
    metadata: RunMetadata
    hold: bool
    average: int
    kinematics: str | None
    rest_reading: float
    events: tuple[Event, ...]
    start: MeasurementStart | None = None
    timing: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def imported(self) -> Imported:
        """What was taken for what, what was done, and what is doubtful."""
        took = tuple(pick.said for pick in self.chosen.picked.values())
        return Imported(took, tuple(self.values.notes), tuple(self.values.warnings))


def import_file(
    source: str | Path,
    out: str | Path,
    options: ImportOptions | None = None,
    *,
    metadata: RunMetadata | None = None,
    overwrite: bool = False,
    now: Callable[[], float] = time.time,
    progress: Progress = quiet,
) -> Imported:
    """Import a file of measured data as the recording ``out``.

    Time is kept as it is, even or not; a date or the time of a clock is counted from the first one,
    and gives the start of the recording. Without a date that is the moment of the import, and said.
    Displacement and voltage of an actuator are counted from their means over the lead-in at rest,
    if there is one. A recording that was exported keeps the metadata of that file: film, load,
    kinematics, sequence, and how its voltage was held. ``metadata`` has precedence; its title is
    the file's name by default. ``progress`` gets the fraction of the whole import.

    Raises ``InputError``, with nothing written, for data that cannot be a recording, and where it
    is not sure which column is which: then its ``remedy`` is the command that imports what seems
    right. An interrupt leaves nothing behind.
    """
    options = options or ImportOptions()
    path = Path(source)
    out = check_output(out, overwrite, path)
    try:
        found = prepare(path, options, metadata=metadata, progress=part(progress, 0.0, WRITING))
    except UnsureError as error:
        raise _question(error, path, out, options.columns, _typed(options)) from error
    except NeedsOptionError as error:
        more = [*_typed(options), *error.answers]
        command = import_command(path, out, options.columns, options.table, more)
        raise InputError(str(error), remedy=command) from error
    save_recording(
        out,
        found.values.kind,
        found.values.columns,
        found.metadata,
        hold=found.hold,
        average=found.average,
        kinematics=found.kinematics,
        rest_reading=found.rest_reading,
        events=found.events,
        channels=found.values.channels,
        missing=found.values.missing,
        timing=found.timing,
        started=None if found.start is None else found.start.at,
        overwrite=overwrite,
        now=now,
        progress=part(progress, WRITING, 1.0),
    )
    return found.imported


def prepare(
    path: Path,
    options: ImportOptions,
    *,
    metadata: RunMetadata | None = None,
    progress: Progress = quiet,
) -> Prepared:
    """Return the recording that the file at ``path`` would become; nothing is written.

    Raises ``UnsureError`` where it is not sure which column is which, ``NeedsOptionError`` where an
    option is missing, and other ``InputError`` as ``import_file`` does.
    """
    metadata = metadata or RunMetadata()
    progress("opening", 0.0)
    table = source_at(path, names_line=options.names_line, skip_bad_rows=options.skip_bad_rows)
    if hasattr(table, "progress"):
        reading = part(progress, OPENED, READ)
        table.progress = lambda done: reading("reading", done)
    progress("reading", OPENED)
    was, doubt = exported_from(table)
    chosen = choose(
        table, options.columns, options.raw, timed=options.rate_Hz is not None,
        table=options.table, guess=options.guess, apart={*was.channels, *was.computed},
    )  # fmt: skip
    if chosen.unsure:
        raise UnsureError(chosen)
    take_channels(chosen, was.channels)
    specimen = Specimen(options.gauge_length_mm, options.area_mm2)
    stop = Flag()
    # hashing a file takes as long as reading its numbers
    with ThreadPoolExecutor(1) as pool:
        digest = pool.submit(file_sha256, path, stop)
        try:
            values = values_of(
                chosen, specimen, options.rate_Hz, options.skip_bad_rows, was.missing
            )
        except BaseException:
            stop.set()  # of a wrong cell, or an interrupt, one hears at once
            raise
    progress("checking", READ)
    average = max(was.average, _average_of(table))
    noted = _provenance(path, digest.result(), chosen, options)
    start = values.start
    if was.started is not None:
        start = MeasurementStart(was.started, "the recording that was exported")
    noted[START_FROM] = FROM_IMPORT if start is None else start.stated_by
    noted = {**was.origin, **noted, **metadata.provenance}
    film, kinematics = metadata.film or was.film, options.kinematics or was.kinematics
    rest = 0.0
    if values.kind == "actuator":
        # a displacement that was exported is counted from its rest already
        rest = _from_rest(values) if was.rest_reading is None else was.rest_reading
        film = _of_actuator(values, film, metadata.load or was.load, kinematics, noted)
    values.warnings += [*plausibility_warnings(values.columns, film), *doubt]
    return Prepared(
        chosen,
        values,
        replace(
            metadata,
            title=metadata.title or path.stem,
            film=film,
            load=metadata.load or was.load,
            sequence_toml=metadata.sequence_toml or was.sequence,
            provenance=noted,
        ),
        hold=was.hold and values.kind == "actuator",
        average=average,
        kinematics=kinematics or (None if values.kind == "actuator" else "uniaxial"),
        rest_reading=rest,
        events=tuple(_events(values, was.events)),
        start=start,
        timing=was.timing,
    )


def exported_from(table: Source) -> tuple[Exported, list[str]]:
    """Return the metadata of the recording that ``table`` was exported from, with warnings."""
    if table.about or not description_path(table.path).is_file():
        return exported(table.about), []
    about = read_description(table.path, file_sha256(table.path))
    if about is not None:
        return exported(about), []
    return Exported(), [
        f"{description_path(table.path).name} does not describe this table as it is, "
        f"and was not used"
    ]


def _average_of(table: Source) -> int:
    """Return how many conversions each row is the mean of, as an exported table says it; else 1.

    Raises ``InputError`` for a column of that name which is not one whole number.
    """
    if AVERAGE_COLUMN not in table.names:
        return 1
    values = table.read([AVERAGE_COLUMN])[AVERAGE_COLUMN]
    first = float(values[0]) if values.size else 1.0
    if not (first >= 1.0 and first.is_integer() and (values == first).all()):
        raise InputError(
            f"{table.path}: the column {AVERAGE_COLUMN} must hold one whole number of 1 or more in "
            f"all rows: the number of conversions whose mean a row is"
        )
    return int(first)


def _typed(options: ImportOptions) -> list[tuple[str, str | float]]:
    """Return the ``options`` that are given, with their values."""
    given = [
        (name, value)
        for name in ("gauge_length_mm", "area_mm2", "kinematics", "rate_Hz", "names_line")
        if (value := getattr(options, name)) is not None
    ]
    skips = [("skip_bad_rows", True)] if options.skip_bad_rows else []
    return [*given, *skips, *options.typed]


def _provenance(
    path: Path, digest: str, chosen: Chosen, options: ImportOptions
) -> dict[str, object]:
    """Return the file, the columns and the settings that the values come from."""
    found: dict[str, object] = {
        "source": path.name,
        "source_sha256": digest,
        "columns": ", ".join(f"{name}={column}" for name, column in chosen.pairs.items()),
    }
    for name in ("gauge_length_mm", "area_mm2", "rate_Hz"):
        if (value := getattr(options, name)) is not None:
            found[name] = float(value)
    return found


def _from_rest(values: Values) -> float:
    """Count voltage and displacement from their means over the lead-in; return the latter's.

    A voltage that a monitor measured has an offset at rest, which is taken off. Changes ``values``.
    """
    columns = values.columns
    quiet = lead_in(columns["voltage_command"])
    if quiet < MIN_QUIET:
        values.warnings.append(
            "there is no quiet lead-in at 0 V: displacement is taken as it is, and its noise at "
            "rest is not known; record a second at 0 V before the voltage rises"
        )
        return 0.0
    if offset := mean_beyond_noise(columns["voltage_command"][:quiet]):
        columns["voltage_command"] = columns["voltage_command"] - offset
        values.notes.append(
            f"the voltage has an offset of {offset:.4g} V over the {quiet} samples at rest at the "
            f"start, which was taken off"
        )
    rest = mean_beyond_noise(columns["displacement"][:quiet])
    if rest:
        columns["displacement"] = columns["displacement"] - rest
        values.notes.append(
            f"displacement is counted from its mean over the {quiet} samples at 0 V at the start, "
            f"which was {rest * 1e6:.6g} um"
        )
    return rest


def _of_actuator(
    values: Values,
    film: Film | None,
    load: Load | None,
    kinematics: str | None,
    noted: dict[str, object],
) -> Film | None:
    """Return the film of an actuator, held as ``kinematics`` says, and say what is assumed.

    Changes ``noted``, the provenance: values of the film that no one gave are named there.
    """
    if kinematics is not None:
        if film is None:
            # imports the effects and their compiler, which other commands do without
            from dearig.model.film.material import THESIS_FILM

            film = THESIS_FILM
            noted[ASSUMED] = ", ".join(FILM_VALUES)
        film = replace(film, kinematics=kinematics)
        left = str(noted.pop(ASSUMED, "")).split(", ")
        if names := [name for name in left if name and name != "kinematics"]:
            noted[ASSUMED] = ", ".join(names)
    if assumed := assumed_of(film, load, noted):
        values.notes.append(
            Note(
                f"fits of these data take {' and '.join(assumed)} of the thesis: give yours",
                option=("rig_file", "film_length_mm", "film_width_mm", "film_thickness_um",
                        "permittivity", "kinematics", "load_g"),
            )
        )  # fmt: skip
    return film


def _events(values: Values, exported_before: tuple[Event, ...]) -> list[Event]:
    """Return the events of the recording: what was done, what is doubtful, which rows are left.

    Those ``exported_before`` are those of the recording that the file was exported from.
    """
    last = values.columns["time"].size - 1
    found = [replace(event, sample=min(event.sample, last)) for event in exported_before]
    found += [Event(0, "info", str(sentence)) for sentence in values.notes]
    found += [Event(0, "warning", str(sentence)) for sentence in values.warnings]
    for sample, places in sorted(values.left.items())[:_EVENTS_MAX]:
        shown = ", ".join(places[:5]) + (f" and {len(places) - 5} more" if len(places) > 5 else "")
        found.append(Event(min(sample, last), "warning", f"left out before this sample: {shown}"))
    return sorted(found, key=lambda event: event.sample)


_TABLE_HOLE, _FACTOR = "TABLE", "*FACTOR"


class UnsureError(InputError):
    """It is not sure which columns are ``chosen`` for what."""

    def __init__(self, chosen: Chosen) -> None:
        super().__init__(
            f"{chosen.source.path}: it is not sure what its columns are "
            f"({'; '.join(chosen.unsure)})",
            option=[o for why in chosen.unsure for hint in hints_of(why) for o in hint.options],
        )
        self.chosen = chosen


def _question(
    error: UnsureError,
    path: Path,
    out: Path,
    given: Mapping[str, str],
    more: Sequence[tuple[str, str | float]],
) -> InputError:
    """Return the error to show for ``error``: what is not sure, first values, and the command.

    ``given`` are the columns that the user named, ``more`` further options with their values.
    """
    chosen = error.chosen
    if chosen.table_choices:
        command = import_command(path, out, given, _TABLE_HOLE, more)
        return InputError(str(error), remedy=replace(command, holes=(_TABLE_HOLE,)))
    pairs = chosen.template
    holes = tuple(
        hole for hole, is_there in (
            (HOLE, HOLE in pairs.values()),
            (UNIT_HOLE, any(name.endswith(f"_{UNIT_HOLE}") for name in pairs)),
            (_FACTOR[1:], any(column.endswith(_FACTOR) for column in pairs.values())),
        ) if is_there
    )  # fmt: skip
    command = import_command(path, out, pairs, chosen.table, more)
    if not holes:
        return InputError(str(error), remedy=replace(command, is_guess=True))
    return InputError(
        f"{path}: the columns begin with {first_values(chosen)}. It is not sure what they are "
        f"({'; '.join(chosen.unsure)})",
        remedy=replace(command, holes=holes),
    )
