"""The command for what many recordings say together: trends over the table of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dearig.cli.options import Force, Json
from dearig.cli.output import check_files, print_line, working, write_result

__all__ = ["commands"]

commands = typer.Typer()


@commands.command(rich_help_panel="Models")
def trends(
    table: Annotated[
        Path,
        typer.Argument(
            metavar="STUDY|TABLE",
            help="Folder of a study, or its table (.csv, .parquet).",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder for the tables and the report.",
            show_default="next to the table",
        ),
    ] = None,
    number: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COLUMN",
            help="Number whose trend is wanted; can be repeated.",
            show_default="all parameters and errors",
        ),
    ] = None,
    against: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COLUMN",
            help="Column that may change the numbers; can be repeated.",
            show_default="temperature, humidity, cycles, days, settings, rig",
        ),
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Find what drives parameter changes across recordings: in all films, in one, and when.

    Each number is fitted by a mixed model with a random intercept of each film.
    """
    from dearig.batch.table_file import read_table
    from dearig.batch.trends import find_trends, table_of, write_trends
    from dearig.cli.terminal import trend_tables
    from dearig.report.pages.trends import write_trends_report
    from dearig.report.text.trends import trends_json

    source = table_of(table)
    folder = source.parent if out is None else out
    report = folder / "trends.html"
    # a folder that is not there has no report yet
    check_files(force, (source,), *([report] if folder.exists() else []), json=json)
    with working(json, computes=False) as (console, progress):
        found = find_trends(
            read_table(source), source=source, numbers=number or (), against=against or (),
            progress=progress,
        )  # fmt: skip
        written = write_trends(found, folder)
        write_trends_report(found, f"Trends of {source.parent.name or source.name}", report)
    written["report"] = report
    console.print(trend_tables(found))
    for what, path in written.items():
        if path is not None:
            print_line(console, f"{what.capitalize()}: {path}")
    write_result(trends_json(found, source, written), json)
