"""The command for many recordings: each fitted, diagnosed or validated, in one table."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from dearig.cli.options import (
    Bounds,
    Drive,
    DriveChannel,
    EndedEarly,
    EndedEarlyOption,
    Fixed,
    Force,
    Json,
    ParameterFile,
    Priors,
    SpringKind,
    stated_by,
)
from dearig.cli.output import check_files, print_line, working, write_result
from dearig.errors import InputError, Interrupted

__all__ = ["commands"]

commands = typer.Typer()
_ROWS = 40  # rows of the table that a terminal shows


class Do(StrEnum):
    """What a study does with each recording."""

    identify = "identify"
    diagnose = "diagnose"
    validate = "validate"


@commands.command(rich_help_panel="Models")
def study(
    sources: Annotated[
        list[Path],
        typer.Argument(
            metavar="FOLDER|LIST|FILE.h5...",
            help="Folders of recordings, lists of recordings (.txt, a path on each line), or "
            "recordings.",
            show_default=False,
        ),
    ],
    do: Annotated[Do, typer.Option(help="What is done with each recording.")],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the table and the cache.")
    ] = Path("study"),
    on: Annotated[
        str,
        typer.Option(
            metavar="local|dask:ADDRESS",
            help="Where the fits are computed: in processes of this computer, or by the workers of "
            "a Dask scheduler.",
        ),
    ] = "local",
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, max=1024, help="Processes of --on local.", show_default="one for each core"
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(metavar="MODEL.toml", help="The model of --do validate."),
    ] = None,
    branches: Annotated[int, typer.Option(min=1, max=10, help="Number of Maxwell branches.")] = 3,
    spring: Annotated[SpringKind, typer.Option(help="Strain energy of --do identify.")] = "gent",
    drive: Drive = DriveChannel.command,
    intervals: Annotated[bool, typer.Option(help="Compute 95 % confidence intervals.")] = True,
    ended_early: EndedEarlyOption = EndedEarly.keep,
    own: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PARAMETER",
            help="With --do identify: fit the recordings of each film together. This parameter "
            "(mu_0, permittivity, ...; can be repeated) each recording has for itself, the others "
            "are of the film.",
            show_default=False,
        ),
    ] = None,
    parameters: ParameterFile = None,
    fix: Fixed = None,
    bound: Bounds = None,
    prior: Priors = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Fit, diagnose or validate many recordings, each separately, into one table.

    With --own the recordings of a film share parameters and are fitted together. A broken recording
    fails alone; its row says why. What was computed is kept in the cache, so that a study that was
    ended goes on where it stood. Ctrl-C ends it.
    """  # fmt: skip
    from dearig.batch.engines import engine_at
    from dearig.batch.fits import StudyOptions, fit_task
    from dearig.batch.shared_fits import fit_film
    from dearig.batch.studies import study_films, study_recordings, subjects_of, with_model
    from dearig.cli.terminal import study_rows
    from dearig.report.text.study_table import study_table_json

    check_files(force, (model, parameters, *(s for s in sources if s.is_file())), json=json)
    options = with_model(
        StudyOptions(
            do.value, branches, spring, drive.value, ended_early.value, intervals,
            own=tuple(own or ()), parameters=stated_by(parameters, fix, bound, prior),
        ),
        model,
    )  # fmt: skip
    subjects = subjects_of(sources, out)
    engine = engine_at(on, workers, fit_film if own else fit_task)
    with working(json) as (console, progress):
        try:
            study = study_films if own else study_recordings
            table = study(subjects, options, out, engine, progress=progress)
        except KeyboardInterrupt:
            raise Interrupted(
                f"interrupted: the rows that were computed are kept in {out}; the same command "
                f"goes on from there"
            ) from None
    console.print(study_rows(table, _ROWS))
    print_line(console, f"Table: {table.table}")
    if table.parquet is not None:
        print_line(console, f"Parquet: {table.parquet}")
    write_result(study_table_json(table), json)
    if table.rows and len(table.failed) == len(table.rows):
        raise InputError(
            f"none of the {len(table.rows)} recordings has a result, the first one because "
            f"{table.failed[0].get('reason', 'it failed')}; {table.table} has the reasons of all"
        )
