"""Commands on recordings: import, info, export, recover, index."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dearig.cli.options import (
    FilmName,
    Force,
    Json,
    Kinematics,
    Notes,
    Recording,
    RigFileOption,
)
from dearig.cli.output import (
    check_files,
    console_for,
    optional,
    print_line,
    print_lines,
    with_hints,
    working,
    write_result,
)
from dearig.errors import InputError
from dearig.printable import MESSAGE_MAX, printable

if TYPE_CHECKING:
    from dearig.config.rigfile import RigFile

__all__ = ["commands"]

commands = typer.Typer()
_PANEL = "Recordings"


def _export_formats() -> list[str]:
    from dearig.recording.exporters import EXPORTS

    return list(EXPORTS)


def _check_export_format(to: str) -> str:
    known = _export_formats()
    if to not in known:
        raise typer.BadParameter(f"{to!r} is not one of {', '.join(map(repr, known))}.")
    return to


@commands.command("import", rich_help_panel=_PANEL)
def import_(
    source: Annotated[Path, typer.Argument(metavar="FILE", help="The measured data.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.h5", help="Write the recording here.")
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=SOURCE",
            help="Read NAME, such as voltage_kV, from the column that the file calls SOURCE, or "
            "from its third column with #3. A scale may follow: displacement_mm='Laser (V)*4'. "
            "Can be repeated.",
        ),
    ] = None,
    columns: Annotated[
        bool,
        typer.Option("--columns", help="List the columns and their first values; import nothing."),
    ] = False,
    rate: Annotated[
        float | None,
        typer.Option("--rate-Hz", help="Sample rate of a file without a column for time."),
    ] = None,
    names_line: Annotated[
        int | None, typer.Option(help="Line of the names in a text file, from 1.")
    ] = None,
    table: Annotated[
        str | None,
        typer.Option(help="Table of a file with several: a sheet, a specimen or a group."),
    ] = None,
    skip_bad_rows: Annotated[
        bool,
        typer.Option(
            "--skip-bad-rows",
            help="Leave out rows whose time or drive cannot be read, or goes back; keep rows that "
            "only lack another reading.",
        ),
    ] = False,
    gauge_length_mm: Annotated[
        float | None,
        typer.Option(help="Gauge length of a film, to convert its displacement to stretch."),
    ] = None,
    area_mm2: Annotated[
        float | None,
        typer.Option(help="Cross-section of a film, to convert its force to nominal stress."),
    ] = None,
    kinematics: Annotated[
        Kinematics | None, typer.Option(help="How the film was held.", show_default="uniaxial")
    ] = None,
    film_length_mm: Annotated[
        float | None, typer.Option(help="Length of an actuator's film along the motion.")
    ] = None,
    film_width_mm: Annotated[
        float | None, typer.Option(help="Width of an actuator's film.")
    ] = None,
    film_thickness_um: Annotated[
        float | None, typer.Option(help="Thickness of an actuator's film before it is loaded.")
    ] = None,
    permittivity: Annotated[
        float | None, typer.Option(help="Relative permittivity of an actuator's film.")
    ] = None,
    load_g: Annotated[float | None, typer.Option(help="Mass that hangs on an actuator.")] = None,
    rig_file: RigFileOption = None,
    film: FilmName = "",
    notes: Notes = "",
    json: Json = None,
    force: Force = False,
) -> None:
    """Convert measured data (text, Excel, MAT, TDMS, HDF5, JSON, Parquet) to a recording."""
    from dearig.config.imports import imported_metadata, raw_scales
    from dearig.recording.importers import ImportOptions, import_file
    from dearig.recording.reading.reader import open_recording
    from dearig.recording.reading.summary import describe

    if columns:
        _list_columns(source, names_line, json)
        return
    if out is None:
        raise InputError("name the recording with --out FILE.h5, or list the columns: --columns")
    check_files(force, (source, rig_file), out, json=json, recording=out)
    settings, configuration = _rig_file(rig_file)
    options = ImportOptions(
        _columns(column or []), gauge_length_mm, area_mm2,
        None if kinematics is None else kinematics.value, rate, names_line, skip_bad_rows,
        {} if settings is None else raw_scales(settings), table,
        typed=_given(
            film_length_mm=film_length_mm, film_width_mm=film_width_mm,
            film_thickness_um=film_thickness_um, permittivity=permittivity, load_g=load_g,
            rig_file=rig_file, film=film or None, notes=notes or None, force=force or None,
        ),
    )  # fmt: skip
    metadata = imported_metadata(
        configuration, settings, film, notes,
        length_mm=film_length_mm, width_mm=film_width_mm, thickness_um=film_thickness_um,
        permittivity=permittivity, load_g=load_g, kinematics=options.kinematics,
    )  # fmt: skip
    with working(json, computes=False, whole=True) as (console, report):
        done = import_file(
            source, out, options, metadata=metadata, overwrite=force, progress=report
        )
    recording = open_recording(out)
    print_line(
        console,
        f"{out}: {recording.samples} samples, {recording.duration:.1f} s of {recording.kind} data",
    )
    for named in done.columns:
        print_line(console, f"  {named}")
    remarks = [with_hints(note) for note in done.notes]
    questions = [with_hints(doubt) for doubt in done.warnings]
    for remark in remarks:
        print_line(console, f"Note: {remark}")
    for question in questions:
        print_line(console, f"Check this: {question}", style="yellow")
    found = {"took": list(done.columns), "notes": remarks, "doubts": questions}
    write_result({**describe(recording), **found}, json)


def _rig_file(path: Path | None) -> tuple[RigFile | None, str]:
    """Return the settings and the text of a rig file; None and "" without one."""
    if path is None:
        return None, ""
    from dearig.config.rigfile import load_rig_file
    from dearig.config.toml_input import read_text

    return load_rig_file(path), read_text(path, "rig file")


def _given(**options: str | Path | float | None) -> tuple[tuple[str, str | float], ...]:
    """Return the options that were given, with their values."""
    return tuple(
        (name, str(value) if isinstance(value, Path) else value)
        for name, value in options.items()
        if value is not None
    )


def _list_columns(source: Path, names_line: int | None, json: str | None) -> None:
    """Print the columns of a file of measured data, what they seem to be, and first values."""
    from dearig.recording.importers.listing import preview

    found = preview(source, names_line)
    console = console_for(json)
    for one in found:
        like = " or ".join(q.replace("_", " ") for q in one.quantities) or "?"
        values = ", ".join(f"{value:.6g}" for value in one.values) or "no numbers"
        unit = f" in {one.unit}" if one.unit else ""
        print_line(console, f"#{one.number} {one.name}: {like}{unit}; {one.count} values: {values}")
    write_result({"format": "dearig-columns/1", "columns": [asdict(one) for one in found]}, json)


def _columns(pairs: list[str]) -> dict[str, str]:
    """Return the source of every column of ``--column NAME=SOURCE``."""
    columns: dict[str, str] = {}
    for pair in pairs:
        name, _, source = pair.partition("=")
        if not (name and source):
            raise InputError(
                f"--column {pair} is not of the form NAME=SOURCE, such as voltage_kV=Voltage"
            )
        if name in columns:
            raise InputError(f"--column {name} is given twice, as {columns[name]} and as {source}")
        columns[name] = source
    return columns


@commands.command(rich_help_panel=_PANEL)
def info(
    path: Recording,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Check the file against its own checksums and claims; exit code 4 if one fails.",
        ),
    ] = False,
    json: Json = None,
    force: Force = False,
) -> None:
    """Show what a recording contains."""
    from rich.table import Table
    from rich.text import Text

    from dearig.recording.reading.reader import open_recording
    from dearig.recording.reading.summary import describe, describe_rows

    check_files(force, (path,), json=json)
    if verify:
        _verify(path, json)
        return
    recording = open_recording(path)
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in describe_rows(recording):
        table.add_row(
            Text(printable(name, most=MESSAGE_MAX)), Text(printable(value, most=MESSAGE_MAX))
        )
    if json != "-":
        console_for().print(table, highlight=False)
    write_result(describe(recording), json)


def _verify(path: Path, json: str | None) -> None:
    from dearig.errors import InstrumentFault
    from dearig.recording.verify import verify

    found, console = verify(path), console_for(json)
    for what in found.checked:
        print_line(console, f"checked: {what}")
    for note in found.notes:
        print_line(console, f"note: {with_hints(note)}", style="yellow")
    for fault in found.faults:
        print_line(console, f"WRONG: {fault}", style="red")
    print_line(
        console,
        f"{path}: {'every check passed' if found.sound else 'some checks failed (see WRONG)'}",
    )
    write_result(
        {
            "format": "dearig-verification/1",
            "recording": str(path),
            "sound": found.sound,
            "faults": found.faults,
            "notes": found.notes,
            "checked": found.checked,
        },
        json,
    )
    if not found.sound:
        raise typer.Exit(InstrumentFault.exit_code)


@commands.command(rich_help_panel=_PANEL)
def export(
    path: Recording,
    to: Annotated[
        str,
        typer.Option(
            metavar="csv|mat|parquet",
            help="File format; other distributions can add some.",
            autocompletion=_export_formats,
            callback=_check_export_format,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="Write to this file.",
            show_default="next to the recording",
        ),
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Convert a recording to CSV, MAT or Parquet."""
    from dearig.recording.content.table_description import description_path
    from dearig.recording.exporters import EXPORTS, export_recording

    check_files(force, (path,), *optional(out), json=json)
    written = export_recording(path, to, out, force)
    print_line(console_for(json), str(written))
    if (described := description_path(written)).exists() and not EXPORTS[to].describes:
        print_line(console_for(json), f"{described}: units, events and film, for an import")
    write_result(
        {
            "format": "dearig-export/1",
            "recording": str(path),
            "to": to,
            "out": str(written),
        },
        json,
    )


@commands.command(rich_help_panel=_PANEL)
def recover(
    path: Annotated[
        Path, typer.Argument(metavar="FILE.h5", help="The recording of a run that was killed.")
    ],
    json: Json = None,
    force: Force = False,
) -> None:
    """Repair the recording of a run that was killed, so that any program can read it."""
    from dearig.recording.reading.reader import open_recording
    from dearig.recording.reading.summary import describe
    from dearig.recording.recover import recover as repair

    check_files(force, (path,), json=json)
    repaired = repair(path)
    recording = open_recording(path)
    what = "recovered" if repaired else "nothing to recover"
    print_line(
        console_for(json),
        f"{path}: {what}; {recording.samples} samples, {recording.duration:.1f} s",
    )
    write_result({**describe(recording), "recovered": repaired}, json)


@commands.command("index", rich_help_panel=_PANEL)
def index_(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder to search, with its subfolders.")
    ],
    json: Json = None,
    force: Force = False,
) -> None:
    """List the recordings in a folder and its subfolders, oldest first."""
    from dearig.recording.reading.index import index_folder, lines

    check_files(force, (), json=json)
    with working(json, computes=False) as (_, progress):
        found = index_folder(folder, lambda part: progress("reading", part))
    found.sort(key=lambda entry: (entry.start_time, entry.path))
    if json != "-":
        print_lines(console_for(), lines(found))
    listed = [entry.as_json() for entry in found]
    write_result({"format": "dearig-index/1", "folder": str(folder), "recordings": listed}, json)
