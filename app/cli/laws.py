"""Commands on the laws of models: effects."""

from __future__ import annotations

from itertools import groupby
from typing import Annotated

import typer

from dearig.cli.options import Force, Json
from dearig.cli.output import check_files, console_for, print_line, write_result

__all__ = ["commands"]

commands = typer.Typer()
_PANEL = "Models"


@commands.command(rich_help_panel=_PANEL)
def effects(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="Effect to explain, as 'dry friction'.",
            show_default="a list of all",
        ),
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """List the effects that the diagnosis knows, or print the equations of one.

    With NAME: its equations, the meaning, unit and bounds of each parameter, and the source.
    """
    from dearig.cli.terminal import law_pieces
    from dearig.model.effects import EFFECTS
    from dearig.report.text.diagnosis import family_label
    from dearig.report.text.laws import effect_named, law_json

    check_files(force, (), json=json)
    console = console_for(json)
    if name is not None:
        effect = effect_named(name)
        console.print(law_pieces(effect))
        write_result({"format": "dearig-effects/1", "effects": [law_json(effect)]}, json)
        return
    listed = sorted(EFFECTS.values(), key=lambda e: (e.family == "unknown", e.family, e.name))
    for family, members in groupby(listed, key=lambda e: e.family):
        print_line(console, family_label(family).capitalize(), "bold")
        for effect in members:
            print_line(console, f"  {effect.name} (acts on the {effect.acts_on}): {effect.summary}")
    print_line(console, 'Equations of one: dearig effects "NAME"')
    result = {"format": "dearig-effects/1", "effects": [law_json(e) for e in listed]}
    write_result(result, json)
