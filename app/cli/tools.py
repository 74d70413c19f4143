"""Commands that look up and set up: files to begin with, presets, laws, doctor, docs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from dearig.cli.docs import docs
from dearig.cli.options import Force, Json
from dearig.cli.output import check_files, console_for, print_line, write_result

__all__ = ["commands"]

commands = typer.Typer()
ToWrite = Annotated[Path, typer.Argument(metavar="FILE.toml", help="File to write.")]
_PANEL = "Set-up and help"
_MODELS = "Models"


@commands.command(rich_help_panel=_PANEL)
def pdf(
    report: Annotated[
        Path, typer.Argument(metavar="REPORT.html", help="A report of this program.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="OUT.pdf", help="File to write.", show_default="next to the report"
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Print a report to a PDF file, with Chromium, Chrome or Edge."""
    from dearig.report.pages.pdf import print_report

    written = report.with_suffix(".pdf") if out is None else out
    check_files(force, (report,), written, json=None)
    print_report(report, written, force)
    print_line(console_for(), str(written))


@commands.command("rig-file", rich_help_panel=_PANEL)
def rig_file_command(
    out: ToWrite,
    force: Force = False,
) -> None:
    """Write a rig file with every key, its default and its meaning."""
    from dearig.config.rigfile import write_default

    check_files(force, (), out, json=None)
    write_default(out, overwrite=force)
    print_line(console_for(), f"{out}: edit it, then give it to commands with --rig-file {out}")


@commands.command("sequence-file", rich_help_panel=_PANEL)
def sequence_file(
    out: ToWrite,
    force: Force = False,
) -> None:
    """Write a sequence file with every kind of segment, its keys and their meaning."""
    from dearig.config.sequence_example import example

    _write_example(example(), out, force, "dearig record FILE.toml --rig sim --out run.h5")
    print_line(console_for(), f"{out}: edit it, then run it with dearig record {out} --out FILE.h5")


@commands.command("target-file", rich_help_panel=_PANEL)
def target_file(
    out: ToWrite,
    force: Force = False,
) -> None:
    """Write a target file: a displacement that the film should follow."""
    from dearig.config.targetfile import EXAMPLE

    use = "dearig track TARGET.toml --model MODEL.toml --rig sim --out DIR"
    _write_example(EXAMPLE, out, force, use)
    print_line(
        console_for(),
        f"{out}: edit it, then run dearig track {out} --model MODEL.toml --out DIR",
    )


@commands.command("campaign-file", rich_help_panel=_PANEL)
def campaign_file(
    out: ToWrite,
    force: Force = False,
) -> None:
    """Write a plan file of a campaign, with every key and its meaning."""
    from dearig.config.campaignfile import EXAMPLE

    use = "dearig campaign FILE.toml --rig sim --out DIR"
    check = f"{use} --check    (says how long it takes; plays nothing)"
    _write_example(EXAMPLE, out, force, check, use)
    print_line(
        console_for(),
        f"{out}: edit it, then see with dearig campaign {out} --out DIR --check how long it takes",
    )


def _write_example(text: str, out: Path, force: bool, *commands: str) -> None:
    """Write the ``text`` of a file to begin with to ``out``, with the ``commands`` that take it."""
    from dearig.recording.files import replaced_when_done

    check_files(force, (), out, json=None)
    with replaced_when_done(out, overwrite=force) as partial:
        first, end, rest = text.partition("\n")
        then = ["# Edit it, then", *(f"#   {command}" for command in commands)]
        whole = "\n".join([first, *then]) + end + rest
        partial.write_text(whole, encoding="utf-8", newline="\n")


@commands.command(rich_help_panel=_PANEL)
def presets(json: Json = None, force: Force = False) -> None:
    """List the sequences that commands know by name."""
    from dearig.config.presets import PRESETS
    from dearig.config.sequencefile import load_sequence

    check_files(force, (), json=json)
    console = console_for(json)
    found = {name: load_sequence(name).sequence for name in PRESETS}
    for name, sequence in found.items():
        print_line(console, f"{name:18s} {sequence.duration:6.1f} s  {sequence.name}")
    listed = [
        {"name": name, "title": s.name, "duration_s": s.duration, "sequence": PRESETS[name]}
        for name, s in found.items()
    ]
    write_result({"format": "dearig-presets/1", "presets": listed}, json)


@commands.command(rich_help_panel=_MODELS)
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
    from itertools import groupby

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


@commands.command("export-model", rich_help_panel=_MODELS)
def export_model(
    model: Annotated[Path, typer.Argument(metavar="MODEL.toml", help="A model file.")],
    to: Annotated[
        Literal["latex", "python", "prony"],
        typer.Option(
            help="A page of equations with numbers; a Python file that needs NumPy alone; "
            "strain energy and Prony series for finite-element programs."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="File to write.", show_default="next to the model"
        ),
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Write a model for another program: equations, Python or finite elements."""
    from dearig.config.modelfile import load_model
    from dearig.report.model_export.write import KINDS, write_export

    written = model.with_suffix(KINDS[to]) if out is None else out
    check_files(force, (model,), written, json=json)
    write_export(load_model(model), to, written, force)
    print_line(console_for(json), str(written))
    result = {"format": "dearig-model-export/1", "model": str(model), "to": to, "out": str(written)}
    write_result(result, json)


@commands.command(rich_help_panel=_PANEL)
def doctor(json: Json = None, force: Force = False) -> None:
    """Show versions, folders, instruments' drivers and plug-ins, and what is missing."""
    from dearig.cli.doctor import doctor_json, doctor_table, examine

    check_files(force, (), json=json)
    items = examine()
    if json != "-":
        console_for().print(doctor_table(items), highlight=False)
    write_result(doctor_json(items), json)


commands.command("docs", rich_help_panel=_PANEL)(docs)
