"""Options and choices that several commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperCommand

__all__ = [
    "Branches",
    "Drive",
    "DriveChannel",
    "EndedEarly",
    "EndedEarlyOption",
    "Faults",
    "FilmName",
    "Force",
    "Fsync",
    "Json",
    "Kinematics",
    "ManyToValidate",
    "Method",
    "Notes",
    "Operator",
    "Paced",
    "Recording",
    "Report",
    "Rig",
    "RigFileOption",
    "Seed",
    "SpringChoice",
    "SpringKind",
    "Validation",
]


class Method(StrEnum):
    """Ways to identify a model."""

    hybrid = "hybrid"
    de = "de"


class SpringKind(StrEnum):
    """Strain energies."""

    gent = "gent"
    neo_hookean = "neo-hookean"
    arruda_boyce = "arruda-boyce"
    yeoh = "yeoh"
    mooney_rivlin = "mooney-rivlin"
    ogden = "ogden"
    ogden_two_terms = "ogden-two-terms"
    extended_tube = "extended-tube"


class SpringChoice(StrEnum):
    """Strain energies, and their choice by the evidence."""

    gent = "gent"
    neo_hookean = "neo-hookean"
    arruda_boyce = "arruda-boyce"
    yeoh = "yeoh"
    mooney_rivlin = "mooney-rivlin"
    ogden = "ogden"
    ogden_two_terms = "ogden-two-terms"
    extended_tube = "extended-tube"
    choose = "choose"


class DriveChannel(StrEnum):
    """Channels of a recording that can drive a model."""

    command = "command"
    monitor = "monitor"


class EndedEarly(StrEnum):
    """What is done with recordings whose runs ended early."""

    keep = "keep"
    cut = "cut"
    leave_out = "leave-out"


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

# ---------------------------------------------------------------- output

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
    typer.Option(metavar="OUT.html", help="Write a report with figures to this file."),
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
