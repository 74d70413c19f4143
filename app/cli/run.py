"""Commands that use a rig: record, check, gui, serve-daqmx."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
    Operator,
    Paced,
    Rig,
    RigFileOption,
    Seed,
    notify_from,
)
from dearig.cli.output import announce_compilation, check_files, print_line, working, write_result
from dearig.cli.rig_settings import announce_rig, rig_settings
from dearig.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from dearig.acquisition.plan import Plan
    from dearig.acquisition.replay import Original
    from dearig.acquisition.run import RunObserver, RunResult
    from dearig.acquisition.serve import Serving
    from dearig.config.rigfile import RigFile
    from dearig.drivers.rig import RigIdentity

__all__ = ["commands"]

commands = typer.Typer()
_PANEL = "Rig"

# ---------------------------------------------------------------- options of record

RecordingOut = Annotated[
    Path, typer.Option("--out", metavar="FILE.h5", help="Write the recording to this file.")
]
SequenceToPlay = Annotated[
    str | None,
    typer.Argument(
        metavar="SEQUENCE",
        help="A sequence file (TOML) or the name of a preset.",
        show_default=False,
    ),
]
Like = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.h5",
        help="Repeat the run of this recording: its sequence, rig file and simulated rig, and "
        "its seed unless --seed is given. On a rig that is not simulated only the sequence is "
        "repeated, with the scaling and the limits of --rig-file.",
    ),
]
SimulatedModel = Annotated[
    Path | None,
    typer.Option(metavar="MODEL.toml", help="Simulate this model in place of the thesis's."),
]
ModelInStep = Annotated[
    Path | None,
    typer.Option(
        metavar="MODEL.toml",
        help="Compute this model's prediction during the run, and record it.",
    ),
]
SeedOrThatOfLike = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=10**15,
        help="Seed of the simulated noise.",
        show_default="that of --like, else 0",
    ),
]
# ---------------------------------------------------------------- commands


@commands.command(rich_help_panel=_PANEL)
def record(
    out: RecordingOut,
    sequence: SequenceToPlay = None,
    like: Like = None,
    rig: Rig = "sim",
    rig_file: RigFileOption = None,
    model: SimulatedModel = None,
    overlay: ModelInStep = None,
    fsync: Fsync = False,
    paced: Paced = False,
    fault: Faults = None,
    seed: SeedOrThatOfLike = None,
    operator: Operator = "",
    film: FilmName = "",
    notes: Notes = "",
    notify_command: NotifyCommand = None,
    notify_webhook: NotifyWebhook = None,
    notify_on: NotifyOn = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Run a sequence on a rig and record it.

    Ctrl-C ramps the voltage down to 0 V and keeps what was recorded.
    """
    from dearig.acquisition.overlay import OverlayModel
    from dearig.acquisition.rig_source import SOURCE
    from dearig.acquisition.rigs import check_simulation, kind_of
    from dearig.acquisition.run import RunOptions
    from dearig.acquisition.run import record as run
    from dearig.analysis.readings.compatibility import of_rig
    from dearig.batch.notify import Notifier
    from dearig.config.modelfile import load_actuator
    from dearig.config.notify import Notify
    from dearig.config.sequencefile import load_sequence
    from dearig.config.toml_input import read_text

    check_files(force, (sequence, rig_file, model, overlay, like), out, json=json, recording=out)
    original = _original(sequence, like)
    if original is None:
        loaded, simulated = load_sequence(str(sequence)), False
    else:
        loaded, rig = original.sequence, original.on(rig)
        simulated = kind_of(rig).simulated
    if original is not None and simulated:
        settings, text = original.settings(rig_file), original.configuration
        provenance = {SOURCE: f"the rig file in {like}"}
    else:
        settings, text, provenance = rig_settings(rig_file)
    if original is not None:
        provenance |= {"repeats": f"{like}"}
    check_simulation(rig, seed, paced)
    if seed is None:
        seed = original.seed if original is not None and simulated else 0
    differing: tuple[str, ...] = ()
    if original is not None and not simulated:
        differing = original.differences(rig, rig_file, settings)
    actuator = None
    if model is not None:
        if original is not None and rig != "sim":
            raise InputError(
                f"{like} was recorded on {rig}, which has a film of its own and takes no model; "
                f"leave --model out"
            )
        actuator = load_actuator(model)
        settings = of_rig(settings, actuator.film, actuator.load)
    if original is not None and simulated:
        original.check_film(settings, model)
    overlaid = None
    if overlay is not None:
        overlaid = OverlayModel(
            overlay.stem, load_actuator(overlay), overlay, read_text(overlay, "model file")
        )
    options = RunOptions(
        text, operator, film, notes, overwrite=force, fsync=fsync,
        seed=seed, paced=paced, actuator=actuator, faults=fault or (), provenance=provenance,
    )  # fmt: skip
    notifier = Notifier(notify_from(notify_command, notify_webhook, notify_on, Notify()))
    with working(json) as (console, progress):

        def play() -> RunResult:
            return run(
                loaded, rig, settings, out, options, overlay=overlaid, progress=progress,
                observer=_announcer(console, settings, provenance[SOURCE], differing),
            )  # fmt: skip

        result = notifier.tell_of(out, play)
    _show_run(console, result)
    write_result(_run_json(result), json)


def _original(sequence: str | None, like: Path | None) -> Original | None:
    """Return the run to repeat, or None where a sequence was given instead."""
    from dearig.acquisition.replay import original_of

    if sequence is None and like is None:
        raise InputError("give a sequence to play, or a recording to repeat with --like FILE.h5")
    if sequence is not None and like is not None:
        raise InputError(
            f"both a sequence ({sequence}) and a recording to repeat (--like {like}) are given; "
            f"give one of them"
        )
    return None if like is None else original_of(like)


def _announcer(
    console: Console, settings: RigFile, source: str, differing: tuple[str, ...]
) -> RunObserver:
    """Return an observer that says, before a run, what applies on a rig that is not simulated."""
    from dearig.acquisition.run import RunObserver

    class Announcer(RunObserver):
        def started(self, planned: Plan, identity: RigIdentity, rate: float) -> None:  # noqa: ARG002
            at, simulated = identity.address, identity.simulated
            announce_rig(console, at, settings, source, differing, simulated)

    return Announcer()


def _show_run(console: Console, result: RunResult) -> None:
    seconds = result.samples / result.rate_Hz
    means = f" in means of {result.average} conversions" if result.average > 1 else ""
    print_line(
        console,
        f"{result.path}: {result.samples} samples, {seconds:.1f} s at {result.rate_Hz:g} Hz"
        f"{means}, {result.outcome}",
    )
    for margin in result.margins:
        print_line(
            console,
            f"  {margin.quantity}: {margin.reached:.4g} of {margin.allowed:.4g} {margin.unit}",
        )
    for event in result.events:
        print_line(console, f"  {event}")


def _run_json(result: RunResult) -> dict[str, Any]:
    return {
        "format": "dearig-run/1",
        "recording": str(result.path),
        "samples": result.samples,
        "rate_Hz": result.rate_Hz,
        "average": result.average,
        "outcome": result.outcome,
        "events": list(result.events),
        "margins": [asdict(margin) for margin in result.margins],
    }


@commands.command(rich_help_panel=_PANEL)
def check(
    rig: Rig = "sim",
    rig_file: RigFileOption = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Check the instruments and limits of a rig at 0 V.

    Says what is connected, what is wrong and which limits apply. The output stays at 0 V.
    """
    from dearig.acquisition.check import check_json, check_rig, check_table
    from dearig.acquisition.rigs import is_simulated
    from dearig.config.rigfile import load_rig_file

    check_files(force, (rig_file,), json=json)
    settings = load_rig_file(rig_file)
    with working(json, computes=is_simulated(rig)) as (console, _):
        outcome = check_rig(rig, settings)
    console.print(check_table(outcome))
    write_result(check_json(outcome), json)
    outcome.refuse()


@commands.command(rich_help_panel=_PANEL)
def gui(
    rig: Rig = "sim",
    rig_file: RigFileOption = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for recordings.",
            show_default="that of the last session, at first the current folder",
        ),
    ] = None,
    fresh: Annotated[
        bool,
        typer.Option(
            "--fresh", help="Restore no folder, sequence or overlay model of the last session."
        ),
    ] = False,
) -> None:
    """Open the operator's window, with what it had in the last session."""
    from dearig.window.main import run_window

    raise typer.Exit(run_window(rig, rig_file, folder, fresh))


@commands.command("serve-daqmx", rich_help_panel=_PANEL)
def serve_daqmx(
    rig: Annotated[
        str,
        typer.Option(
            help="sim for the simulated rig, sim:SEED for a simulated rig with a hidden effect."
        ),
    ] = "sim",
    rig_file: RigFileOption = None,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 chooses a free one.")
    ] = 0,
    anywhere: Annotated[
        bool,
        typer.Option(
            "--anywhere",
            help="Allow a --host that other computers can reach; needs the three TLS options.",
        ),
    ] = False,
    tls_cert: Annotated[
        Path | None,
        typer.Option("--tls-cert", metavar="FILE.pem", help="Certificate of the server."),
    ] = None,
    tls_key: Annotated[
        Path | None,
        typer.Option("--tls-key", metavar="FILE.pem", help="Private key of --tls-cert."),
    ] = None,
    tls_client_ca: Annotated[
        Path | None,
        typer.Option(
            "--tls-client-ca",
            metavar="FILE.pem",
            help="Accept only clients with a certificate that this authority signed.",
        ),
    ] = None,
    paced: Annotated[
        bool,
        typer.Option(
            "--paced/--fast", help="Simulate in real time, or as fast as samples are read."
        ),
    ] = True,
    fault: Faults = None,
    client_timeout: Annotated[
        float,
        typer.Option(
            min=0.1,
            max=3600.0,
            metavar="SECONDS",
            help="Set the output to 0 V when a client with a voltage at the film makes no call "
            "for this long.",
        ),
    ] = 1.0,
    link_timeout: Annotated[
        float,
        typer.Option(
            min=0.2,
            max=3600.0,
            metavar="SECONDS",
            help="Set the output to 0 V when the network connection is silent for this long; a "
            "busy computer may need more than 0.5.",
        ),
    ] = 1.0,
    client_tracking: Annotated[
        bool,
        typer.Option(
            "--client-tracking/--no-client-tracking",
            help="Set the output to 0 V when the client is gone; NI's own server does not.",
        ),
    ] = True,
    laser: Annotated[
        bool,
        typer.Option("--laser", help="Serve the laser's controller too, at a serial port."),
    ] = False,
    sine: Annotated[
        bool,
        typer.Option(
            "--sine",
            help="Let the inputs read a sine within their limits and the digital lines a count, as "
            "NI's own simulated devices do, instead of the rig.",
        ),
    ] = False,
    signal: Annotated[
        list[str] | None,
        typer.Option(
            "--signal",
            metavar="TERMINAL=SIGNAL",
            help="Put a signal on a digital terminal, several times: PFI8='1 kHz, 25 %' or "
            "PFI3=PFI12. Without any the card has its default signals.",
        ),
    ] = None,
    seed: Seed = 0,
) -> None:
    """Serve a simulated card over NI's network protocol until ctrl-C.

    NI's Python library (nidaqmx) reaches it as it reaches a real card behind NI's gRPC device
    server.
    """
    from dearig.acquisition.serve import TlsFiles, serve
    from dearig.config.rigfile import load_rig_file

    settings = load_rig_file(rig_file)
    announce_compilation()
    serve(
        rig, settings, announce=_announce, host=host, port=port, anywhere=anywhere,
        tls=TlsFiles(tls_cert, tls_key, tls_client_ca),
        paced=paced, faults=fault or (),
        client_timeout=client_timeout if client_tracking else None, link_timeout=link_timeout,
        seed=seed, laser=laser, sine=sine, signals=signal,
    )  # fmt: skip


def _announce(serving: Serving) -> None:
    """Print the addresses of the simulated instruments."""
    sys.stdout.write(
        f"simulated card at {serving.host}:{serving.port}; use it with --rig {serving.rig}; "
        f"{serving.security}ctrl-C ends it\n"
    )
    if serving.laser:
        sys.stdout.write(f'laser controller: port = "{serving.laser}" in [laser]\n')
    sys.stdout.flush()  # a program that started the server reads the port from a pipe
