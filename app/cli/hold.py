"""The command that holds a displacement."""

from __future__ import annotations

import re
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
from dearig.cli.output import check_files, print_line, print_lines, working, write_result
from dearig.cli.rig_settings import announce_rig, rig_settings
from dearig.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console

    from dearig.acquisition.run import RunObserver
    from dearig.model.control import HoldAnswer
    from dearig.model.simulation.actuator import Actuator
    from dearig.progress import Progress

__all__ = ["commands"]

commands = typer.Typer()
_PANEL = "Rig"
_UNITS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}
_TELL_EVERY = 60.0  # s between two lines, where there is no progress bar


@commands.command(rich_help_panel=_PANEL)
def hold(
    displacement: Annotated[
        float,
        typer.Argument(
            metavar="DISPLACEMENT_MM",
            help="Displacement from the loaded rest state in mm.",
            show_default=False,
        ),
    ],
    model: Annotated[
        Path,
        typer.Option(metavar="MODEL.toml", help="Compute the voltage with this model."),
    ],
    duration: Annotated[
        str, typer.Option("--for", metavar="TIME", help="How long: 90s, 15min, 1h.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE.h5", help="Write the recording to this file; needed for a run."
        ),
    ] = None,
    rig: Rig = "sim",
    rig_file: RigFileOption = None,
    authority_pct: Annotated[
        float, typer.Option(help="Largest correction, in % of the voltage, either way.")
    ] = 10.0,
    rate_pct_per_s: Annotated[
        float, typer.Option(help="Fastest change of the correction, in % of the voltage per s.")
    ] = 1.0,
    response_s: Annotated[
        float, typer.Option(help="Response time of the loop in s, in addition to its delay.")
    ] = 1.0,
    ahead_s: Annotated[
        float,
        typer.Option(help="Output in s that waits when an answer is admitted: most of the delay."),
    ] = 0.5,
    laser_loss_s: Annotated[
        float,
        typer.Option(
            help="Time in s without usable readings after which the voltage is ramped down."
        ),
    ] = 2.0,
    rise_s: Annotated[float, typer.Option(help="Time in s of the rise, and of the fall.")] = 2.0,
    check: Annotated[
        bool,
        typer.Option("--check", help="Only say whether it can be held; play and write nothing."),
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
    """Hold a displacement against creep, with feedback from the laser.

    The model's voltage is corrected while it is played. Every correction passes the gate before it
    is output. Ctrl-C ramps the voltage down to 0 V and keeps what was recorded.
    """
    from dearig.acquisition.rig_source import SOURCE, film_differences
    from dearig.acquisition.rigs import check_simulation
    from dearig.acquisition.run import RunOptions
    from dearig.analysis.hold import HoldOptions, actuator_of, check_hold, plan_hold
    from dearig.analysis.hold import hold as run
    from dearig.config.modelfile import load_model
    from dearig.report.pages.hold import hold_json, hold_summary

    length = _seconds(duration)
    written = () if out is None else (out,)
    check_files(force, (model, rig_file), *written, json=json, recording=out)
    check_simulation(rig, seed, paced)
    (settings, text, provenance), ours = rig_settings(rig_file), load_model(model)
    run_options = RunOptions(
        text, operator, film, notes, overwrite=force, seed=seed, paced=paced, faults=fault or (),
        provenance=provenance,
    )  # fmt: skip
    options = HoldOptions(
        rise_s, authority_pct / 100.0, rate_pct_per_s / 100.0, response_s, ahead_s, laser_loss_s
    )
    setpoint = displacement * 1e-3

    def announce(console: Console, actuator: Actuator) -> None:
        other = film_differences(actuator.film, actuator.load, settings)
        announce_rig(console, rig, settings, provenance[SOURCE], other)

    if check:
        with working(json) as (console, progress):
            actuator = actuator_of(ours)
            announce(console, actuator)
            planned = plan_hold(setpoint, length, actuator, settings, options)
            found = check_hold(planned, settings, run_options, progress)
        write_result({"format": "dearig-hold-check/1", **found}, json)
        print_line(
            console,
            f"{displacement:g} mm can be held, with {found['voltage_kV']:.4g} kV and up to "
            f"{found['highest_kV']:.4g} kV; delay {found['delay_s']:.3g} s, gain margin "
            f"{found['gain_margin']:.2g}",
        )
        return
    if out is None:
        raise InputError("--out FILE.h5 is missing: the recording is written there")
    with working(json, whole=True) as (console, progress):
        actuator = actuator_of(ours)
        announce(console, actuator)
        observer, shown = _live(console, progress)
        outcome = run(
            setpoint, length, ours, rig, settings, out, run_options, options, observer=observer,
            progress=shown,
        )  # fmt: skip
    print_lines(console, hold_summary(outcome))
    for said in outcome.warnings:
        print_line(console, f"Warning: {said}", "yellow")
    print_line(console, f"{outcome.recording}: {outcome.run.outcome}")
    write_result(hold_json(outcome), json)


def _seconds(text: str) -> float:
    """Return the time in s that ``text`` says. Raises ``InputError``."""
    found = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*(s|min|h)?\s*", text)
    if found is None:
        raise InputError(f"--for {text!r} is not a time: write a number with s, min or h, as 90s")
    return float(found[1]) * _UNITS[found[2] or ""]


def _live(console: Console, progress: Progress) -> tuple[RunObserver, Callable[[str, float], None]]:
    """Return what shows error and correction while the run goes on: in the bar, or line by line."""
    from dearig.acquisition.run import RunObserver

    stage = "holding"
    printed = 0.0

    class Live(RunObserver):
        def answered(self, time: float, answer: HoldAnswer) -> None:
            nonlocal stage, printed
            error = (
                "no reading" if answer.error != answer.error else f"{answer.error * 1e6:+.1f} um"
            )
            said = f"error {error}, correction {answer.correction:+.2%}"
            stage = f"{said} ({answer.state})" if answer.state != "holding" else said
            if time - printed >= _TELL_EVERY and not console.is_terminal:
                printed = time
                print_line(console, f"{time / 60.0:.0f} min: {stage}")

    def shown(name: str, fraction: float) -> None:
        progress(stage if name == "recording" else name, fraction)

    return Live(), shown
