"""Commands that look up, set up and hand on: files to begin with, reports, laws, doctor, docs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from dearig.cli.docs import docs
from dearig.cli.options import Force, Json
from dearig.cli.output import check_files, console_for, print_line, working, write_result

__all__ = ["commands"]

commands = typer.Typer()
ToWrite = Annotated[Path, typer.Argument(metavar="FILE.toml", help="File to write.")]
_PANEL = "Set-up and help"
_MODELS = "Models"
_REPORTS = "Reports"
Result = Annotated[
    Path,
    typer.Argument(
        metavar="REPORT",
        help="A report (HTML) of identify, validate, diagnose or demo, or the JSON of such a "
        "result.",
    ),
]


@commands.command(rich_help_panel=_REPORTS)
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


@commands.command(rich_help_panel=_REPORTS)
def report(
    result: Result,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="HTML or PDF to write.")],
    force: Force = False,
) -> None:
    """Write a report again from its JSON, as this version of the program shows it."""
    from dearig.report.again import write_again

    check_files(force, (result,), out, json=None)
    with working(None, computes=False) as (console, progress):
        progress("report", 0.0)
        write_again(result, out, force)
    print_line(console, str(out))


@commands.command(rich_help_panel=_REPORTS)
def figures(
    result: Result,
    to: Annotated[
        Literal["pdf", "svg", "png"],
        typer.Option(help="PDF with TrueType fonts, SVG with text as text, or PNG at 600 dpi."),
    ],
    columns: Annotated[
        int,
        typer.Option(min=1, max=2, help="Width in columns of a journal: 89 mm or 183 mm."),
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", help="Folder to write to.", show_default="next to the report"
        ),
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Draw the figures of a report for print, with their captions in a text file."""
    from dearig.recording.result_folder import result_folder
    from dearig.report.again import read_result, write_figures

    check_files(force, (result,), json=json)
    read = read_result(result)  # before a folder is made
    folder = result_folder(out or result.with_name(f"{result.stem}-figures"), force)
    with working(json, computes=False, whole=True) as (console, progress):
        written, captions = write_figures(read, to, columns, folder, progress)
    for figure in written:
        print_line(console, f"{figure.path}: {figure.caption}")
    print_line(console, f"Captions: {captions}")
    found = [{"number": f.number, "file": str(f.path), "caption": f.caption} for f in written]
    write_result({"format": "dearig-figures/1", "columns": columns, "figures": found}, json)


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
    from dearig.report.text.laws import effect_named, law_json, place_text

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
            print_line(
                console, f"  {effect.name} (acts {place_text(effect.acts_on)}): {effect.summary}"
            )
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
