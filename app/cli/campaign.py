"""Commands for many unattended runs: campaign, campaign-queue."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dearig.cli.options import (
    Faults,
    FilmName,
    Force,
    Fsync,
    Json,
    Notes,
    NotifyCommand,
    NotifyOn,
    NotifyWebhook,
    Paced,
    Rig,
    RigFileOption,
    Seed,
    notify_from,
)
from dearig.cli.output import (
    check_files,
    console_for,
    print_line,
    print_lines,
    working,
    write_result,
)
from dearig.cli.rig_settings import announce_rig, rig_settings
from dearig.errors import InputError

if TYPE_CHECKING:
    from dearig.batch.queue import CampaignOutcome

__all__ = ["commands"]

commands = typer.Typer()
_PANEL = "Rig"

CampaignFolder = Annotated[
    Path, typer.Argument(metavar="DIR", help="Folder of a campaign.", show_default=False)
]


@commands.command(rich_help_panel=_PANEL)
def campaign(
    plan: Annotated[
        Path,
        typer.Argument(
            metavar="PLAN.toml",
            help="A plan file; dearig campaign-file writes one.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for recordings and the journal.")
    ],
    rig: Rig = "sim",
    rig_file: RigFileOption = None,
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Only check every run, and say how long they take; play nothing."
        ),
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the campaign in DIR where it stands.")
    ] = False,
    runs: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=1_000_000,
            help="Number of runs that are armed; needed on a rig that is not simulated.",
            show_default="all",
        ),
    ] = None,
    hours: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            max=8760.0,
            help="Time from now on within which runs are armed; needed on a rig that is not "
            "simulated.",
            show_default="no limit",
        ),
    ] = None,
    operator: Annotated[
        str, typer.Option(help="Name of the person who arms the rig, kept in recordings.")
    ] = "",
    acknowledge: Annotated[
        str,
        typer.Option(
            metavar="TEXT",
            help="What was seen at the rig after the campaign was halted; needs --operator.",
        ),
    ] = "",
    model: Annotated[
        Path | None,
        typer.Option(metavar="MODEL.toml", help="Simulate this model in place of the thesis's."),
    ] = None,
    fsync: Fsync = False,
    paced: Paced = False,
    fault: Faults = None,
    seed: Seed = 0,
    film: FilmName = "",
    notes: Notes = "",
    notify_command: NotifyCommand = None,
    notify_webhook: NotifyWebhook = None,
    notify_on: NotifyOn = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Play many runs, one after the other, and continue after any end.

    Every run passes the gate at its turn and is recorded as by `dearig record`. An interlock, a
    fault of an instrument or a doubt about 0 V halts the campaign until a person acknowledges it.
    Ctrl-C ramps the voltage down to 0 V and ends the campaign; --resume continues it.
    """  # fmt: skip
    from dearig.acquisition.rig_source import SOURCE
    from dearig.acquisition.rigs import check_simulation
    from dearig.acquisition.run import RunOptions
    from dearig.analysis.readings.compatibility import of_rig
    from dearig.batch.campaign import Arming, play_campaign
    from dearig.batch.forecast import foresee
    from dearig.cli.terminal import campaign_runs
    from dearig.config.campaignfile import load_campaign
    from dearig.config.modelfile import load_actuator
    from dearig.config.notify import notify_text
    from dearig.report.pages.campaign import (
        campaign_json,
        forecast_json,
        forecast_texts,
        write_campaign_report,
    )

    check_files(force, (plan, rig_file, model), json=json)
    check_simulation(rig, seed, paced)
    loaded, (settings, text, provenance) = load_campaign(plan), rig_settings(rig_file)
    actuator = None
    if model is not None:
        actuator = load_actuator(model)
        settings = of_rig(settings, actuator.film, actuator.load)
    notify = notify_from(notify_command, notify_webhook, notify_on, loaded.notify).checked()
    if check:
        with working(json) as (console, progress):
            found = foresee(loaded, settings, out, actuator, film, progress)
        found.check_room(out)
        print_lines(console, forecast_texts(loaded, found))
        write_result(forecast_json(loaded, found), json)
        return
    options = RunOptions(
        text, operator, film, notes, fsync=fsync, seed=seed, paced=paced, actuator=actuator,
        faults=fault or (), provenance=provenance,
    )  # fmt: skip
    with working(json) as (console, progress):
        announce_rig(console, rig, settings, provenance[SOURCE])
        if said := notify_text(notify):
            # a plan may be another person's: what it starts is said before anything is played
            print_line(console, f"{loaded.source}: {said}")

        def finish(outcome: CampaignOutcome) -> None:
            """Write and show what was done."""
            report = write_campaign_report(outcome, out / "report.html")
            console.print(campaign_runs(outcome))
            print_line(console, f"Report: {report}")
            write_result(campaign_json(outcome), json)

        play_campaign(
            loaded, rig, settings, out, options, Arming(operator, runs, hours, acknowledge),
            resume=resume, ended=finish, progress=progress,
            notify=notify,
        )  # fmt: skip


@commands.command("campaign-queue", rich_help_panel=_PANEL)
def campaign_queue(
    folder: CampaignFolder,
    pause: Annotated[bool, typer.Option("--pause", help="Start no run until --continue.")] = False,
    proceed: Annotated[bool, typer.Option("--continue", help="Go on after --pause.")] = False,
    end: Annotated[
        bool, typer.Option("--end", help="End the campaign after the present run.")
    ] = False,
    skip: Annotated[
        list[str] | None,
        typer.Option(metavar="RUN", help="Leave out this waiting run. Can be repeated."),
    ] = None,
    first: Annotated[
        list[str] | None,
        typer.Option(metavar="RUN", help="Play this waiting run next. Can be repeated."),
    ] = None,
    operator: Annotated[str, typer.Option(help="Name of the person who asks.")] = "",
    json: Json = None,
    force: Force = False,
) -> None:
    """Show the runs of a campaign, or change the order of those that wait.

    The running campaign reads what is asked between two runs; it never starts a run on its own that
    was not armed. A run that goes on is ended with ctrl-C where the campaign runs.
    """
    from dearig.batch.ask import ask
    from dearig.batch.watching import seen
    from dearig.cli.terminal import campaign_runs
    from dearig.report.pages.campaign import campaign_json

    check_files(force, (), json=json)
    if pause and proceed:
        raise InputError("--pause and --continue exclude each other; give one of them")
    requests = [
        *([("pause", "")] if pause else []), *([("continue", "")] if proceed else []),
        *(("skip", name) for name in skip or ()),
        # the last one that is put first is played first
        *(("first", name) for name in reversed(first or [])),
        *([("end", "")] if end else []),
    ]  # fmt: skip
    console = console_for(json)
    if requests:
        ask(folder, requests, operator)
        what = ", ".join(f"{kind} {name}".strip() for kind, name in requests)
    outcome = seen(folder)
    if requests:
        when = "when the campaign is continued" if outcome.status else "between two runs"
        print_line(console, f"{folder}: asked to {what}; it takes effect {when}")
    if not requests:
        console.print(campaign_runs(outcome))
    write_result(campaign_json(outcome), json)
