"""Options and choices that several commands share."""

from __future__ import annotations

import os
import re
import shlex
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

import typer
from typer.core import TyperCommand

from dearig.command_line import WEBHOOK_OPTION
from dearig.errors import InputError
from dearig.model.spring_names import SPRINGS

if TYPE_CHECKING:
    from dearig.config.notify import Notify

__all__ = [
    "SPRING_KINDS",
    "Bounds",
    "Branches",
    "Drive",
    "DriveChannel",
    "EndedEarly",
    "EndedEarlyOption",
    "Faults",
    "FilmName",
    "Fixed",
    "Force",
    "Fsync",
    "Json",
    "Kinematics",
    "ManyToValidate",
    "Method",
    "Notes",
    "NotifyCommand",
    "NotifyOn",
    "NotifyWebhook",
    "Operator",
    "Paced",
    "ParameterFile",
    "Priors",
    "Recording",
    "Report",
    "Rig",
    "RigFileOption",
    "Seed",
    "SpringChoice",
    "SpringKind",
    "Validation",
    "notify_from",
    "stated_by",
]


class Method(StrEnum):
    """Ways to identify a model."""

    hybrid = "hybrid"
    de = "de"


#: Strain energies, the default first.
SPRING_KINDS = ("gent", *(name for name in SPRINGS if name != "gent"))
if TYPE_CHECKING:
    SpringKind: TypeAlias = str
    SpringChoice: TypeAlias = str
else:
    SpringKind = Literal[SPRING_KINDS]
    SpringChoice = Literal[(*SPRING_KINDS, "choose")]


class DriveChannel(StrEnum):
    """Channels of a recording that can drive a model."""

    command = "command"
    monitor = "monitor"


class EndedEarly(StrEnum):
    """What is done with recordings whose runs ended early."""

    keep = "keep"
    cut = "cut"
    leave_out = "leave-out"


class NotifyEvent(StrEnum):
    """What a notification can be about."""

    run_ended = "run-ended"
    tripped = "tripped"
    queue_stopped = "queue-stopped"


class Kinematics(StrEnum):
    """Ways to hold a film."""

    uniaxial = "uniaxial"
    constrained_width = "constrained-width"
    equibiaxial = "equibiaxial"


# ---------------------------------------------------------------- input

Recording = Annotated[Path, typer.Argument(metavar="FILE.h5", help="A recording.")]
Rig = Annotated[
    str,
    typer.Option(
        help="sim for the simulated rig, sim:SEED for a simulated rig with a hidden effect, "
        "daqmx:Dev1 for a card in this computer, daqmx:Dev1@HOST:PORT for a card behind a server."
    ),
]
RigFileOption = Annotated[
    Path | None,
    typer.Option(
        "--rig-file",
        metavar="FILE.toml",
        help="Film, load, instruments and limits.",
        show_default="the thesis's rig",
    ),
]
Seed = Annotated[int, typer.Option(min=0, max=10**15, help="Seed of the simulated noise.")]
Drive = Annotated[
    DriveChannel,
    typer.Option(help="Voltage that drives the model: the command or the amplifier's monitor."),
]
EndedEarlyOption = Annotated[
    EndedEarly,
    typer.Option(
        "--ended-early",
        help="Recordings whose runs ended early: keep them, cut the end that may show a fault, or "
        "leave them out.",
    ),
]
Branches = Annotated[
    str,
    typer.Option(
        metavar="N|N-M", help="Number of Maxwell branches; of a range, each number is tried."
    ),
]
Validation = Annotated[
    list[Path] | None,
    typer.Option(
        "--validate",
        metavar="FILE.h5...",
        help="Validation recordings, which the fit does not use; one or several.",
    ),
]
Faults = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KIND@SECONDS",
        help="Fault of the simulated rig and when it starts, such as arc@3.2. Can be repeated.",
    ),
]
FilmName = Annotated[str, typer.Option(help="Name of the film, kept in the recording.")]
Notes = Annotated[str, typer.Option(help="Free text, kept in the recording.")]
Fsync = Annotated[
    bool,
    typer.Option(
        "--fsync", help="Write every block through to the disk, so it survives a power cut."
    ),
]
Paced = Annotated[
    bool,
    typer.Option("--paced", help="Simulate in real time.", show_default="as fast as possible"),
]
Operator = Annotated[str, typer.Option(help="Name of the operator, kept in the recording.")]

# ---------------------------------------------------------------- what is known of parameters

ParameterFile = Annotated[
    Path | None,
    typer.Option(
        "--parameters",
        metavar="FILE.toml",
        help="What is known of parameters: fixed values, bounds, priors; a table for each.",
    ),
]
Fixed = Annotated[
    list[str] | None,
    typer.Option(
        "--fix",
        metavar="NAME=VALUE",
        help="Do not fit this parameter, as in mu_1_kPa=60. Can be repeated, as can --bound and "
        "--prior.",
    ),
]
Bounds = Annotated[
    list[str] | None,
    typer.Option(
        "--bound",
        metavar="NAME=LOW..HIGH",
        help="Fit this parameter within bounds, as in T_1_s=0.1..1; one of them may be left out.",
    ),
]
Priors = Annotated[
    list[str] | None,
    typer.Option(
        "--prior",
        metavar="NAME=MEAN+-SD",
        help="Weigh a Gaussian prior of this parameter, as in mu_0_kPa=46+-0.5.",
    ),
]

_NUMBER = r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*"
#: Options by which a person states something of a parameter, the form of their values, their keys.
_STATEMENTS = (
    ("--fix", "NAME=VALUE", _NUMBER, ("fixed",)),
    ("--bound", "NAME=LOW..HIGH", rf"(?:{_NUMBER})?\.\.(?:{_NUMBER})?", ("low", "high")),
    ("--prior", "NAME=MEAN+-SD", rf"{_NUMBER}(?:\+-|±){_NUMBER}", ("mean", "sd")),
)


def stated_by(
    path: Path | None, fixed: list[str] | None, bounds: list[str] | None, priors: list[str] | None
) -> dict[str, dict[str, float]]:
    """Return what a file and the options state of parameters.

    Options replace what the file says of the same parameter. Raises ``InputError`` for a value that
    is not of its option's form, and for one that is given twice.
    """
    from dearig.config.parameterfile import load_parameter_file

    found: dict[str, dict[str, float]] = {}
    for given, (option, form, pattern, keys) in zip(
        (fixed, bounds, priors), _STATEMENTS, strict=True
    ):
        for text in given or []:
            name, _, value = text.partition("=")
            match = re.fullmatch(pattern, value)
            numbers = {
                key: float(number)
                for key, number in zip(keys, match.groups() if match else (), strict=False)
                if number is not None
            }
            if not (name.strip() and numbers):
                raise InputError(f"{option} {text!r} is not of the form {form}")
            table = found.setdefault(name.strip(), {})
            if table.keys() & numbers.keys():
                raise InputError(f"{option} is given twice for {name.strip()}")
            table |= numbers
    return {**({} if path is None else load_parameter_file(path)), **found}


# ---------------------------------------------------------------- notifications

NotifyCommand = Annotated[
    str | None,
    typer.Option(
        "--notify-command",
        metavar="COMMAND",
        help="Start this program, with its arguments, when a run has ended; it gets JSON on its "
        "standard input. No shell is used.",
        show_default="that of the plan, if there is one",
    ),
]
NotifyWebhook = Annotated[
    str | None,
    typer.Option(
        WEBHOOK_OPTION,
        metavar="ADDRESS",
        help="Send JSON to this address when a run has ended; env:NAME takes it from a variable.",
        show_default="that of the plan, if there is one",
    ),
]
NotifyOn = Annotated[
    list[NotifyEvent] | None,
    typer.Option(
        "--notify-on",
        help="Events to report: the end of a run, a run that a person must look at, the end of "
        "the queue. Can be repeated.",
        show_default="all",
    ),
]


def notify_from(
    command: str | None, webhook: str | None, on: list[NotifyEvent] | None, plan: Notify
) -> Notify:
    """Return the settings of notifications: the options, and for the others those of ``plan``.

    Raises ``InputError`` for a command whose quotes do not match.
    """
    from dataclasses import replace

    changes: dict[str, Any] = {}
    if command is not None:
        changes["command"] = _words(command)
    if webhook is not None:
        changes["webhook"] = webhook
    if on:
        changes["on"] = tuple(event.value for event in on)
    return replace(plan, **changes)


def _words(command: str) -> tuple[str, ...]:
    # a backslash separates folders on Windows
    try:
        words = shlex.split(command, posix=os.name != "nt")
    except ValueError as error:
        raise InputError(f"--notify-command {command!r}: a quote has no end") from error
    if os.name == "nt":
        words = [w[1:-1] if len(w) > 1 and w[0] == w[-1] == '"' else w for w in words]
    return tuple(words)


# ---------------------------------------------------------------- output


def _printable_report(path: Path | None) -> Path | None:
    """Refuse a report in PDF that no browser can print, before the work that it reports."""
    if path is not None:
        from dearig.report.pages.pdf import check_browser, is_pdf

        if is_pdf(path):
            check_browser()
    return path


Json = Annotated[
    str | None,
    typer.Option(
        "--json",
        metavar="PATH",
        help="Write the result as JSON to this file, or to standard output with -.",
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace output files that exist.")]
Report = Annotated[
    Path | None,
    typer.Option(
        metavar="OUT.html|OUT.pdf",
        help="Write a report with figures to this file; one in PDF is printed by Chromium, Chrome "
        "or Edge.",
        callback=_printable_report,
    ),
]


class ManyToValidate(TyperCommand):
    """A command whose ``--validate`` takes all file names up to the next option.

    A shell replaces ``--validate val-*.h5`` by many names. The standard parser would take the
    first and count the others as recordings to fit, without a word.
    """

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        spread: list[str] = []
        taking = False
        for argument in args:
            option = argument.startswith("-") and argument != "-"
            if taking and not option and spread[-1] != "--validate":
                spread.append("--validate")
            if option:
                taking = argument == "--validate"
            spread.append(argument)
        return super().parse_args(ctx, spread)
