"""The command that makes the film follow a displacement."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dearig.cli.options import (
    Faults,
    FilmName,
    Force,
    Json,
    Notes,
    Operator,
    Paced,
    Rig,
    RigFileOption,
    Seed,
)
from dearig.cli.output import check_files, print_line, working, write_result
from dearig.cli.rig_settings import announce_rig, rig_settings
from dearig.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from dearig.analysis.tracking import TrackOutcome

__all__ = ["commands"]

commands = typer.Typer()
_PANEL = "Rig"


@commands.command(rich_help_panel=_PANEL)
def track(
    target: Annotated[
        Path,
        typer.Argument(
            metavar="TARGET",
            help="A target file: TOML as a sequence, with mm in place of kV, or a table (CSV) with "
            "time_s and displacement_mm.",
            show_default=False,
        ),
    ],
    model: Annotated[
        Path,
        typer.Option(metavar="MODEL.toml", help="Compute the voltage with this model."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", help="Folder for recordings and the report; needed for runs."
        ),
    ] = None,
    rig: Rig = "sim",
    rig_file: RigFileOption = None,
    iterations: Annotated[
        int,
        typer.Option(
            min=0,
            max=50,
            help="Runs that learn from the one before, at most: they end once nothing more is "
            "learned. 0 plays the model's voltage.",
        ),
    ] = 5,
    compare: Annotated[
        Path | None,
        typer.Option(
            metavar="MODEL.toml",
            help="Before, play the voltage that this model asks for, such as the thesis's fitted "
            "to the same recordings, and that of a linear map. It is followed in place of the "
            "model if it predicts its run better.",
        ),
    ] = None,
    nearest: Annotated[
        bool,
        typer.Option(
            "--nearest",
            help="Follow the nearest feasible target where the film cannot follow the asked one.",
        ),
    ] = False,
    within_um: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1e6,
            help="Distance from the target that is accepted without --nearest.",
        ),
    ] = 5.0,
    check: Annotated[
        bool,
        typer.Option("--check", help="Only say what can be reached; play and write nothing."),
    ] = False,
    paced: Paced = False,
    fault: Faults = None,
    seed: Seed = 0,
    operator: Operator = "",
    film: FilmName = "",
    notes: Notes = "",
    json: Json = None,
    force: Force = False,
) -> None:
    """Make the film follow a displacement, learning from run to run.

    The voltage is computed from the model. Every run passes the gate and is recorded as by
    `dearig record`. Ctrl-C ramps the voltage down to 0 V, ends the learning, and keeps what was
    done.
    """
    from dearig.acquisition.rig_source import SOURCE, film_differences
    from dearig.acquisition.rigs import check_simulation
    from dearig.acquisition.run import RunOptions
    from dearig.analysis.track import track as follow
    from dearig.analysis.track_target import check_feasible, plan_target
    from dearig.analysis.tracking import TrackOutcome
    from dearig.config.modelfile import load_actuator, load_model
    from dearig.config.targetfile import load_target
    from dearig.report.pages.track import track_json, write_track_report

    check_files(force, (target, model, compare, rig_file), json=json)
    check_simulation(rig, seed, paced)
    loaded, (settings, text, provenance) = load_target(target), rig_settings(rig_file)
    ours = load_model(model)
    actuator = load_actuator(model)  # refuses that of a bare film
    other = film_differences(actuator.film, actuator.load, settings)
    if check:
        with working(json) as (console, _):
            announce_rig(console, rig, settings, provenance[SOURCE], other)
            found = plan_target(loaded, actuator, settings)
        outcome = TrackOutcome(loaded, ours, rig, found, within_um * 1e-6)
        write_result(track_json(outcome), json)
        check_feasible(loaded, found.unreachable, within_um * 1e-6)
        peak = found.voltage.max() * 1e-3
        print_line(console, f"{loaded.name}: the film can follow it, with up to {peak:.4g} kV")
        return
    if out is None:
        raise InputError("--out DIR is missing: recordings and the report are written there")
    options = RunOptions(
        text, operator, film, notes, overwrite=force, seed=seed, paced=paced, faults=fault or (),
        provenance=provenance,
    )  # fmt: skip
    report = out / "report.html"
    with working(json) as (console, progress):
        announce_rig(console, rig, settings, provenance[SOURCE], other)

        def finish(outcome: TrackOutcome) -> None:
            """Write and show what was done."""
            written = replace(outcome, report=write_track_report(outcome, report))
            _show(console, written)
            write_result(track_json(written), json)

        outcome = follow(
            loaded, ours, rig, settings, out, options, iterations=iterations,
            compare=None if compare is None else load_model(compare), nearest=nearest,
            within=within_um * 1e-6, ended=finish, progress=progress,
        )  # fmt: skip
        finish(outcome)


def _show(console: Console, outcome: TrackOutcome) -> None:
    """Print the errors of all runs, the summary, and where the files are."""
    from dearig.cli.terminal import track_table

    console.print(track_table(outcome))
    best = outcome.best
    if best is not None:
        print_line(
            console,
            f"To play that voltage again: dearig record {best.recording.with_suffix('.toml')}",
        )
    print_line(console, f"Report: {outcome.report}")
