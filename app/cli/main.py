"""The command ``dearig``: what it is asked goes to one function each, what it answers to a person.

Nothing heavy is imported here: ``dearig --help`` must answer at once, so each command imports what
it needs when it runs.
"""

from __future__ import annotations

import io
import logging
import os
import re
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer.core import TyperCommand
from typer.exceptions import TyperException

from dearig.cli.docs import docs
from dearig.errors import DearigError, InputError

if TYPE_CHECKING:
    from rich.console import Console

    from dearig.progress import Progress

__all__ = ["app", "main"]

log = logging.getLogger(__name__)

app = typer.Typer(
    name="dearig",
    help="Run a dielectric-elastomer actuator rig, record it, and find out what its physical "
    "model is missing.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Json = Annotated[
    str | None,
    typer.Option(
        "--json", metavar="PATH", help="Write the result as JSON there; - for standard output."
    ),
]
Seed = Annotated[int, typer.Option(min=0, max=10**15, help="Of the simulated noise.")]
Force = Annotated[bool, typer.Option("--force", help="Replace the output if it exists.")]
RigFileOption = Annotated[
    Path | None,
    typer.Option(
        "--rig-file",
        metavar="FILE.toml",
        help="Film, load, instruments and limits. [default: the thesis's rig]",
    ),
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


class DriveChannel(StrEnum):
    """What a model is driven by."""

    command = "command"
    monitor = "monitor"


class ExportFormat(StrEnum):
    """What recordings are exported to."""

    csv = "csv"
    mat = "mat"
    parquet = "parquet"


class Kinematics(StrEnum):
    """How a film is held."""

    uniaxial = "uniaxial"
    constrained_width = "constrained-width"
    equibiaxial = "equibiaxial"


@app.callback()
def _options(
    verbose: Annotated[int, typer.Option("--verbose", "-v", count=True, help="Say more.")] = 0,
) -> None:
    level = (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    logging.basicConfig(level=level, format="%(levelname)s: %(message)s", stream=sys.stderr)
    # other packages' own news is not the operator's
    logging.getLogger("numba").setLevel(logging.WARNING)
    logging.getLogger("matplotlib").setLevel(logging.WARNING)


class _ManyToValidate(TyperCommand):
    """A command whose ``--validate`` takes all names up to the next option, as a shell's * gives.

    Otherwise the second of them would be one more recording to fit, and nobody would be told.
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


@app.command()
def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where results go.")] = Path(
        "demo"
    ),
    seed: Seed = 0,
    json: Json = None,
    force: Force = False,
) -> None:
    """Run the thesis's experiment on a simulated rig, and find what another one hides."""
    from dearig.cli.demo import run_demo
    from dearig.cli.terminal import (
        diagnosis_json,
        diagnosis_tables,
        identify_table,
        outcome_json,
        validate_tables,
        write_json,
    )

    _check_files(force, (), json=json)
    with _working(json) as (console, progress):
        result = run_demo(out, seed=seed, overwrite=force, clock=time.monotonic, progress=progress)
    console.print(identify_table(result.identified))
    console.print(validate_tables(result.validated))
    console.print(diagnosis_tables(result.diagnosed))
    _print(console, f"Recordings, models and reports lie in {out}")
    _print(console, f"Report: {result.report}")
    _print(console, f"Diagnosis: {result.diagnosis_report}")
    if json is not None:
        write_json(
            {
                "format": "dearig-demo/1",
                "report": str(result.report),
                "identification": outcome_json(result.identified),
                "validation": outcome_json(result.validated),
                "diagnosis_report": str(result.diagnosis_report),
                "diagnosis": diagnosis_json(result.diagnosed),
                "seconds": result.seconds,
            },
            json,
        )


@app.command()
def record(
    out: Annotated[Path, typer.Option("--out", metavar="FILE.h5", help="The recording.")],
    sequence: Annotated[
        str | None,
        typer.Argument(metavar="SEQUENCE", help="A TOML file or a preset.", show_default=False),
    ] = None,
    like: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.h5",
            help="Repeat that run: its sequence, rig file, simulated rig, and seed (if none is "
            "given).",
        ),
    ] = None,
    rig: Annotated[
        str,
        typer.Option(
            help="sim, sim:SEED for a rig that hides an effect, daqmx:Dev1 for a card, or "
            "daqmx:Dev1@HOST:PORT for one behind a server."
        ),
    ] = "sim",
    rig_file: RigFileOption = None,
    model: Annotated[
        Path | None,
        typer.Option(metavar="MODEL.toml", help="What the simulated rig sim is made of."),
    ] = None,
    overlay: Annotated[
        Path | None,
        typer.Option(
            metavar="MODEL.toml",
            help="A model to run in step with the data; kept in the recording.",
        ),
    ] = None,
    fsync: Annotated[
        bool, typer.Option("--fsync", help="Let what is flushed outlive a power cut too.")
    ] = False,
    paced: Annotated[bool, typer.Option("--paced", help="Simulate in real time.")] = False,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND@SECONDS",
            help="What goes wrong in a simulated rig, and when, such as arc@3.2; may be repeated.",
        ),
    ] = None,
    seed: Seed = 0,
    operator: Annotated[str, typer.Option(help="Who runs it; kept in the recording.")] = "",
    film: Annotated[str, typer.Option(help="Which film; kept in the recording.")] = "",
    notes: Annotated[str, typer.Option(help="Anything else; kept in the recording.")] = "",
    json: Json = None,
    force: Force = False,
) -> None:
    """Play a sequence on a rig and record it; ctrl-C ramps down to 0 V and keeps the recording."""
    from dearig.acquisition.overlay import OverlayModel
    from dearig.acquisition.replay import original_of
    from dearig.acquisition.run import RunOptions
    from dearig.acquisition.run import record as run
    from dearig.analysis.compatibility import of_rig
    from dearig.cli.terminal import write_json
    from dearig.config.modelfile import load_actuator
    from dearig.config.rigfile import load_rig_file
    from dearig.config.sequencefile import load_sequence
    from dearig.config.toml_input import read_text
    from dearig.sim_backend.faults import FaultPlan

    _check_files(force, (sequence, rig_file, model, overlay, like), out, json=json, recording=out)
    if (sequence is None) == (like is None):
        raise InputError(
            "give a sequence to play, or a recording to repeat with --like: one of them"
        )
    if like is not None and rig_file is not None:
        raise InputError(f"--like {like} brings its own rig file; leave --rig-file out")
    original = None if like is None else original_of(like)
    if original is None:
        settings = load_rig_file(rig_file)
        text = "" if rig_file is None else read_text(rig_file, "rig file")
        loaded = load_sequence(str(sequence))
    else:
        settings, text, loaded = original.rig_file, original.configuration, original.sequence
        rig, seed = original.on(rig), seed or original.seed
    actuator = None
    if model is not None:
        actuator = load_actuator(model)
        settings = of_rig(settings, actuator.film, actuator.load)
    if original is not None:
        original.check_film(settings)
    try:
        faults = FaultPlan.parse(fault or ())
    except ValueError as error:
        raise InputError(str(error)) from error
    in_step = None
    if overlay is not None:
        in_step = OverlayModel(
            overlay.stem, load_actuator(overlay), overlay, read_text(overlay, "model file")
        )
    with _working(json) as (console, progress):
        options = RunOptions(
            text, operator, film, notes, overwrite=force, fsync=fsync,
            seed=seed, paced=paced, actuator=actuator, faults=faults,
        )  # fmt: skip
        result = run(loaded, rig, settings, out, options, overlay=in_step, progress=progress)
    seconds = result.samples / result.rate_Hz
    _print(
        console,
        f"{result.path}: {result.samples} samples, {seconds:.1f} s at {result.rate_Hz:g} Hz, "
        f"{result.outcome}",
    )
    for margin in result.margins:
        _print(
            console,
            f"  {margin.quantity}: {margin.reached:.4g} of {margin.allowed:.4g} {margin.unit}",
        )
    for event in result.events:
        _print(console, f"  {event}")
    if json is not None:
        write_json(
            {
                "format": "dearig-run/1",
                "recording": str(result.path),
                "samples": result.samples,
                "rate_Hz": result.rate_Hz,
                "outcome": result.outcome,
                "events": list(result.events),
                "margins": [asdict(margin) for margin in result.margins],
            },
            json,
        )


@app.command()
def check(
    rig: Annotated[
        str,
        typer.Option(
            help="sim, sim:SEED, daqmx:Dev1 for a card, or daqmx:Dev1@HOST:PORT for one behind a "
            "server."
        ),
    ] = "sim",
    rig_file: RigFileOption = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Say what is connected, what is wrong and which limits hold, without raising a volt."""
    from dearig.acquisition.check import check_json, check_rig, check_table
    from dearig.cli.terminal import write_json
    from dearig.config.rigfile import load_rig_file
    from dearig.sim_backend.factory import is_simulated

    _check_files(force, (rig_file,), json=json)
    settings = load_rig_file(rig_file)
    with _working(json, computes=is_simulated(rig)) as (console, _):
        outcome = check_rig(rig, settings)
    console.print(check_table(outcome))
    if json is not None:
        write_json(check_json(outcome), json)
    outcome.refuse()


@app.command()
def gui(
    rig: Annotated[
        str, typer.Option(help="sim, sim:SEED, daqmx:Dev1 or daqmx:Dev1@HOST:PORT.")
    ] = "sim",
    rig_file: RigFileOption = None,
    folder: Annotated[
        Path, typer.Option(metavar="DIR", help="Where recordings go. [default: here]")
    ] = Path(),
) -> None:
    """Open the operator's window."""
    from dearig.window.main import run_window

    raise typer.Exit(run_window(rig, rig_file, folder))


@app.command("import")
def import_(
    source: Annotated[
        Path, typer.Argument(metavar="IN.csv|IN.mat|IN.tdms|IN.parquet", help="Measured data.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE.h5", help="The recording.")],
    column: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=SOURCE", help="What the file calls a column; may be repeated."),
    ] = None,
    gauge_length_mm: Annotated[
        float | None, typer.Option(help="Of a film whose displacement was measured.")
    ] = None,
    area_mm2: Annotated[
        float | None, typer.Option(help="Cross-section of a film whose force was measured.")
    ] = None,
    kinematics: Annotated[
        Kinematics | None, typer.Option(help="How the film was held. [default: uniaxial]")
    ] = None,
    rig_file: RigFileOption = None,
    film: Annotated[str, typer.Option(help="Which film; kept in the recording.")] = "",
    notes: Annotated[str, typer.Option(help="Anything else; kept in the recording.")] = "",
    json: Json = None,
    force: Force = False,
) -> None:
    """Bring in measured data that was made elsewhere (CSV, MAT, TDMS, Parquet) as a recording."""
    from dearig.cli.terminal import write_json
    from dearig.config.rigfile import load_rig_file
    from dearig.config.toml_input import read_text
    from dearig.recording.importers import import_file
    from dearig.recording.reader import open_recording
    from dearig.recording.summary import describe

    columns: dict[str, str] = {}
    for pair in column or []:
        name, _, where = pair.partition("=")
        if not (name and where):
            raise InputError(
                f"--column {pair} is not of the form NAME=SOURCE, such as voltage_kV=Voltage"
            )
        if name in columns:
            raise InputError(f"--column {name} is given twice, as {columns[name]} and as {where}")
        columns[name] = where
    _check_files(force, (source, rig_file), out, json=json, recording=out)
    settings = None if rig_file is None else load_rig_file(rig_file)
    with _working(json, computes=False) as (console, _):
        doubts = import_file(
            source,
            out,
            columns,
            gauge_length_mm=gauge_length_mm,
            area_mm2=area_mm2,
            kinematics=None if kinematics is None else kinematics.value,
            film=None if settings is None else settings.as_film(),
            load=None if settings is None else settings.as_load(),
            configuration="" if rig_file is None else read_text(rig_file, "rig file"),
            film_id=film,
            notes=notes,
            overwrite=force,
        )
    recording = open_recording(out)
    _print(
        console,
        f"{out}: {recording.samples} samples, {recording.duration:.1f} s of {recording.kind} data",
    )
    for doubt in doubts:
        _print(console, f"Look again: {doubt}", style="yellow")
    if json is not None:
        write_json({**describe(recording), "doubts": doubts}, json)


@app.command()
def info(
    path: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A recording.")],
    verify: Annotated[
        bool,
        typer.Option("--verify", help="Hold it against all its claims; exit code 4 if one fails."),
    ] = False,
    json: Json = None,
    force: Force = False,
) -> None:
    """Say what a recording holds."""
    from rich.table import Table
    from rich.text import Text

    from dearig.cli.terminal import write_json
    from dearig.recording.reader import open_recording
    from dearig.recording.summary import describe, describe_rows

    _check_files(force, (path,), json=json)
    if verify:
        _verify(path, json)
        return
    recording = open_recording(path)
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in describe_rows(recording):
        table.add_row(name, Text(value))
    if json != "-":
        _console().print(table, highlight=False)
    if json is not None:
        write_json(describe(recording), json)


def _verify(path: Path, json: str | None) -> None:
    from dearig.cli.terminal import write_json
    from dearig.errors import InstrumentFault
    from dearig.recording.verify import verify

    found, console = verify(path), _console(json)
    for what in found.checked:
        _print(console, f"checked: {what}")
    for note in found.notes:
        _print(console, f"note: {note}", style="yellow")
    for fault in found.faults:
        _print(console, f"WRONG: {fault}", style="red")
    _print(console, f"{path}: {'sound' if found.sound else 'not what it claims to be'}")
    if json is not None:
        write_json(
            {
                "format": "dearig-verification/1",
                "recording": str(path),
                "sound": found.sound,
                "faults": found.faults,
                "notes": found.notes,
                "checked": found.checked,
            },
            json,
        )
    if not found.sound:
        raise typer.Exit(InstrumentFault.exit_code)


@app.command()
def export(
    path: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A recording.")],
    to: Annotated[ExportFormat, typer.Option(help="Format.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="[default: beside the recording]")
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Hand a recording on as CSV, MAT or Parquet."""
    from dearig.cli.terminal import write_json
    from dearig.recording.exporters import export_recording

    _check_files(force, (path,), *([] if out is None else [out]), json=json)
    written = export_recording(path, to.value, out, force)
    _print(_console(json), str(written))
    if json is not None:
        write_json(
            {
                "format": "dearig-export/1",
                "recording": str(path),
                "to": to.value,
                "out": str(written),
            },
            json,
        )


@app.command()
def recover(
    path: Annotated[Path, typer.Argument(metavar="FILE.h5", help="A recording of a killed run.")],
    json: Json = None,
    force: Force = False,
) -> None:
    """Mend the recording of a run that was killed, so that any program can read it."""
    from dearig.cli.terminal import write_json
    from dearig.recording.reader import open_recording
    from dearig.recording.recover import recover as mend
    from dearig.recording.summary import describe

    _check_files(force, (path,), json=json)
    mended = mend(path)
    recording = open_recording(path)
    what = "recovered" if mended else "nothing to recover"
    _print(
        _console(json), f"{path}: {what}; {recording.samples} samples, {recording.duration:.1f} s"
    )
    if json is not None:
        write_json({**describe(recording), "recovered": mended}, json)


@app.command("index")
def index_(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Of recordings.")],
    json: Json = None,
    force: Force = False,
) -> None:
    """List the recordings in a folder and the folders in it, oldest first."""
    from dearig.cli.terminal import progress, write_json
    from dearig.recording.index import index_folder, lines

    _check_files(force, (), json=json)
    with progress("dearig") as report:
        found = index_folder(folder, lambda part: report("looking", part))
    found.sort(key=lambda entry: (entry.start_time, entry.path))
    if json != "-":
        _print(_console(), "\n".join(lines(found)))
    if json is not None:
        listed = [asdict(entry) for entry in found]
        write_json({"format": "dearig-index/1", "folder": str(folder), "recordings": listed}, json)


@app.command(cls=_ManyToValidate)
def identify(
    train: Annotated[list[Path], typer.Argument(metavar="TRAIN.h5...", help="Recordings to fit.")],
    out: Annotated[Path, typer.Option("--out", metavar="MODEL.toml", help="The model.")],
    method: Annotated[
        Method, typer.Option(help="hybrid, or the thesis's Algorithm 1 as printed (de).")
    ] = Method.hybrid,
    validate_: Annotated[
        list[Path] | None,
        typer.Option(
            "--validate",
            metavar="FILE.h5...",
            help="Untouched recordings, read once at the end; one or several.",
        ),
    ] = None,
    branches: Annotated[
        str, typer.Option(metavar="N|N-M", help="Maxwell branches; a range tries each.")
    ] = "3",
    spring: Annotated[SpringKind, typer.Option(help="Strain energy.")] = SpringKind.gent,
    drive: Annotated[
        DriveChannel, typer.Option(help="Voltage that drives.")
    ] = DriveChannel.command,
    rest_length_mm: Annotated[
        float | None,
        typer.Option(help="Measured length under the load (82); left out, mu_0 gives it."),
    ] = None,
    rig_file: RigFileOption = None,
    seed: Annotated[int, typer.Option(min=0, max=10**15, help="Of Algorithm 1.")] = 0,
    intervals: Annotated[bool, typer.Option(help="95 % intervals.")] = True,
    report: Annotated[
        Path | None, typer.Option(metavar="OUT.html", help="A report with figures.")
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Fit the model to recordings, with intervals and a word on what the data do not determine."""
    from dearig.analysis.identify import identify_recordings
    from dearig.cli.terminal import branch_table, identify_table, outcome_json, write_json
    from dearig.config.rigfile import load_rig_file

    numbers = _branches(branches)
    _check_files(force, (*train, *(validate_ or []), rig_file), out, *_given(report), json=json)
    with _working(json) as (console, progress):
        outcome = identify_recordings(
            train,
            out,
            validation=validate_ or [],
            method=method.value,
            branches=numbers,
            spring=spring.value,
            drive=drive.value,
            rest_length_mm=rest_length_mm,
            rig_file=None if rig_file is None else load_rig_file(rig_file),
            seed=seed,
            intervals=intervals,
            overwrite=force,
            clock=time.monotonic,
            progress=progress,
        )
        if report is not None:
            from dearig.report.html import write_identify_report

            write_identify_report(outcome, report)
    if outcome.trials:
        console.print(branch_table(outcome))
    console.print(identify_table(outcome))
    for label, path in (("Model", out), ("Report", report)):
        if path is not None:
            _print(console, f"{label}: {path}")
    if json is not None:
        write_json(outcome_json(outcome), json)


@app.command()
def validate(
    model: Annotated[Path, typer.Argument(metavar="MODEL.toml", help="A model file.")],
    paths: Annotated[list[Path], typer.Argument(metavar="FILE.h5...", help="Recordings.")],
    drive: Annotated[
        DriveChannel, typer.Option(help="Voltage that drives.")
    ] = DriveChannel.command,
    report: Annotated[
        Path | None, typer.Option(metavar="OUT.html", help="A report with figures.")
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Compare a model with recordings: error tables like the thesis's Tables 4 and 5."""
    from dearig.analysis.validate import validate_model
    from dearig.cli.terminal import outcome_json, validate_tables, write_json

    _check_files(force, (model, *paths), *_given(report), json=json)
    with _working(json) as (console, progress):
        outcome = validate_model(model, paths, drive=drive.value, progress=progress)
        if report is not None:
            from dearig.report.html import write_validate_report

            write_validate_report(outcome, report)
    console.print(validate_tables(outcome))
    if report is not None:
        _print(console, f"Report: {report}")
    if json is not None:
        write_json(outcome_json(outcome), json)


@app.command(cls=_ManyToValidate)
def diagnose(
    train: Annotated[
        list[Path] | None,
        typer.Argument(metavar="TRAIN.h5...", help="Recordings to fit.", show_default=False),
    ] = None,
    validate_: Annotated[
        list[Path] | None,
        typer.Option(
            "--validate",
            metavar="VAL.h5...",
            help="Untouched recordings, read once at the end; one or several.",
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="OUT.html", help="A report with figures.")
    ] = None,
    model_out: Annotated[
        Path | None, typer.Option(metavar="MODEL.toml", help="The model with what was found.")
    ] = None,
    branches: Annotated[int, typer.Option(help="Maxwell branches of the baseline.")] = 3,
    drive: Annotated[
        DriveChannel, typer.Option(help="Voltage that drives.")
    ] = DriveChannel.command,
    rig_file: RigFileOption = None,
    rig: Annotated[
        str | None,
        typer.Option(help="Record on this rig (sim:SEED), and run the separating experiments."),
    ] = None,
    experiments: Annotated[
        int, typer.Option(min=0, max=20, help="With --rig: how many, at most.")
    ] = 1,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="With --rig: where everything goes.")
    ] = Path("diagnosis"),
    thorough: Annotated[
        bool,
        typer.Option(
            "--thorough",
            help="Search on for as long as it takes, not for about a minute: helps where the "
            "report says that the search was ended.",
        ),
    ] = False,
    seed: Seed = 0,
    json: Json = None,
    force: Force = False,
) -> None:
    """Find what the model lacks, put it in, and compare the error before and after."""
    from dearig.analysis.diagnose import diagnose_recordings, diagnose_rig
    from dearig.cli.terminal import diagnosis_json, diagnosis_tables, write_json
    from dearig.config.rigfile import load_rig_file
    from dearig.config.toml_input import read_text
    from dearig.errors import Interrupted
    from dearig.recording.result_folder import result_folder
    from dearig.report.diagnosis_page import write_diagnosis_report

    given, others = train or [], validate_ or []
    if rig is None and not given:
        raise InputError(
            "give recordings to diagnose, or a rig to record on with --rig; dearig diagnose --help "
            "says more"
        )
    _check_files(force, (*given, *others, rig_file), *_given(report), *_given(model_out), json=json)
    settings = None if rig_file is None else load_rig_file(rig_file)
    if rig is not None:
        result_folder(out, force)
        report, model_out = report or out / "report.html", model_out or out / "model.toml"
    with _working(json, whole=True) as (console, progress):
        if rig is None:
            outcome = diagnose_recordings(
                given, validation=others, model_out=model_out, branches=branches,
                drive=drive.value, rig_file=settings, thorough=thorough, overwrite=force,
                clock=time.monotonic, progress=progress,
            )  # fmt: skip
        else:
            outcome = diagnose_rig(
                rig, out, experiments=experiments, train=given, validation=others,
                model_out=model_out, branches=branches, drive=drive.value, rig_file=settings,
                configuration="" if rig_file is None else read_text(rig_file, "rig file"),
                seed=seed, thorough=thorough, overwrite=force, clock=time.monotonic,
                progress=progress,
            )  # fmt: skip
        if report is not None:
            progress("report", 1.0)
            write_diagnosis_report(outcome, report)
    console.print(diagnosis_tables(outcome))
    for label, path in (("Model", model_out), ("Report", report)):
        if path is not None:
            _print(console, f"{label}: {path}")
    if json is not None:
        write_json(diagnosis_json(outcome), json)
    if outcome.ended is not None and not isinstance(outcome.ended, Interrupted):
        raise type(outcome.ended)(f"{outcome.ended}; what had been found until then was kept")
    if outcome.finding.interrupted:
        raise Interrupted("interrupted: what had been found until then was kept")


@app.command()
def simulate(
    model: Annotated[Path, typer.Argument(metavar="MODEL.toml", help="A model file.")],
    drive: Annotated[
        str, typer.Option(metavar="FILE.h5|SEQUENCE.toml", help="Recording, sequence or preset.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="OUT.h5|OUT.csv", help="The prediction.")],
    voltage: Annotated[DriveChannel, typer.Option(help="Of a recording.")] = DriveChannel.command,
    rig_file: RigFileOption = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Write what a model predicts under a recorded or planned drive."""
    from dearig.analysis.simulate import simulate_model
    from dearig.cli.terminal import write_json
    from dearig.config.rigfile import load_rig_file

    _check_files(force, (model, drive, rig_file), out, json=json)
    with _working(json) as (console, _):
        prediction = simulate_model(
            model,
            drive,
            out,
            rig_file=load_rig_file(rig_file),
            voltage=voltage.value,
            overwrite=force,
        )
    _print(console, str(prediction.path))
    if prediction.field_max is not None:
        limit = "no static pull-in: the springs stiffen first"
        if prediction.pull_in is not None:
            limit = f"static pull-in at {prediction.pull_in * 1e-3:.3g} kV"
        _print(console, f"true field up to {prediction.field_max * 1e-6:.3g} MV/m; {limit}")
    if json is not None:
        write_json(
            {
                "format": "dearig-simulation/1",
                "model": str(model),
                "drive": drive,
                "out": str(prediction.path),
                "true_field_max_V_per_m": prediction.field_max,
                "pull_in_voltage_V": prediction.pull_in,
            },
            json,
        )


@app.command("serve-daqmx")
def serve_daqmx(
    rig: Annotated[
        str, typer.Option(help="sim, or sim:SEED for a rig that hides an effect.")
    ] = "sim",
    rig_file: RigFileOption = None,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes any that is free.")
    ] = 0,
    anywhere: Annotated[
        bool, typer.Option("--anywhere", help="Allow a --host that other computers can reach.")
    ] = False,
    paced: Annotated[
        bool, typer.Option("--paced/--fast", help="In real time, or as fast as it is read.")
    ] = True,
    fault: Annotated[
        list[str] | None,
        typer.Option(metavar="KIND@SECONDS", help="What goes wrong, and when; may be repeated."),
    ] = None,
    client_timeout: Annotated[
        float,
        typer.Option(
            min=0.1,
            max=3600.0,
            metavar="SECONDS",
            help="Silence of a client with a voltage at the film that takes the output to 0 V.",
        ),
    ] = 1.0,
    link_timeout: Annotated[
        float,
        typer.Option(
            min=0.2,
            max=3600.0,
            metavar="SECONDS",
            help="The same for a link that is cut; a busy computer may need longer than 0.5.",
        ),
    ] = 1.0,
    client_tracking: Annotated[
        bool,
        typer.Option(
            "--client-tracking/--no-client-tracking",
            help="Make safe when a client is gone; NI's own server does not.",
        ),
    ] = True,
    laser: Annotated[
        bool,
        typer.Option("--laser", help="Serve the laser's controller too, at a serial port."),
    ] = False,
    seed: Seed = 0,
) -> None:
    """Serve a simulated card to NI's Python library over NI's network protocol, until ctrl-C."""
    from dearig.acquisition.serve import Serving, serve
    from dearig.config.rigfile import load_rig_file

    settings = load_rig_file(rig_file)

    def told(serving: Serving) -> None:
        # at once, also into a pipe: who started it waits for the port
        sys.stdout.write(
            f"simulated card at {serving.host}:{serving.port}; use it with --rig {serving.rig}; "
            f"ctrl-C ends it\n"
        )
        if serving.laser:
            sys.stdout.write(f'laser controller: port = "{serving.laser}" in [laser]\n')
        sys.stdout.flush()

    serve(
        rig, settings, told=told, host=host, port=port, anywhere=anywhere, paced=paced,
        faults=fault or (), client_timeout=client_timeout if client_tracking else None,
        link_timeout=link_timeout, seed=seed,
        laser=laser,
    )  # fmt: skip


@app.command("rig-file")
def rig_file_command(
    out: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Where to write it.")],
) -> None:
    """Write a rig file with every key, its default and what it means, to be edited."""
    from dearig.config.rigfile import write_default

    write_default(out)
    _print(_console(), f"{out}: edit it, and give it to commands as --rig-file {out}")


@app.command()
def presets(json: Json = None, force: Force = False) -> None:
    """List the sequences that are known by name."""
    from dearig.config.presets import PRESETS
    from dearig.config.sequencefile import load_sequence

    _check_files(force, (), json=json)
    console = _console(json)
    found = {name: load_sequence(name).sequence for name in PRESETS}
    for name, sequence in found.items():
        _print(console, f"{name:18s} {sequence.duration:6.1f} s  {sequence.name}")
    if json is not None:
        from dearig.cli.terminal import write_json

        listed = [
            {"name": name, "title": s.name, "duration_s": s.duration, "sequence": PRESETS[name]}
            for name, s in found.items()
        ]
        write_json({"format": "dearig-presets/1", "presets": listed}, json)


app.command("docs")(docs)


def _branches(text: str) -> list[int]:
    """``3`` or ``1-4`` as numbers."""
    from dearig.analysis.compatibility import BRANCHES_MAX

    found = re.fullmatch(r"\s*([0-9]{1,9})\s*(?:-\s*([0-9]{1,9}))?\s*", text)
    if not found:
        raise InputError(f"--branches {text!r} is neither a number nor a range such as 1-4")
    low, high = int(found[1]), int(found[2] or found[1])
    if low > high:
        raise InputError(f"--branches {text} goes from more to fewer; write {high}-{low}")
    if not (low >= 1 and high <= BRANCHES_MAX):
        raise InputError(
            f"--branches {text}: a model has from 1 to {BRANCHES_MAX} branches; write such a "
            f"number, or a range such as 1-4"
        )
    return list(range(low, high + 1))


def _given(path: Path | None) -> list[Path]:
    return [] if path is None else [path]


def _check_files(
    force: bool,
    sources: Iterable[str | Path | None],
    *outputs: Path,
    json: str | None,
    recording: Path | None = None,
) -> None:
    """Refuse, before any work, outputs that may not be written: that of an hour would be lost.

    ``sources`` are read, and never overwritten even by force (a preset's name is none of them).
    ``recording`` is the output that will be a recording.
    """
    from dearig.recording.files import check_output

    read = [source for source in sources if source is not None]
    written = [*outputs, *([] if json in (None, "-") else [Path(str(json))])]
    for i, path in enumerate(written):
        check_output(path, force, *read)
        if any(path.resolve() == other.resolve() for other in written[:i]):
            raise InputError(f"{path} is named for two outputs; give each a name of its own")
    if recording is not None and recording.suffix.lower() not in (".h5", ".hdf5", ".nxs"):
        raise InputError(
            f"{recording} would be a recording, which is an HDF5 file: let its name end in .h5 "
            f"(dearig export makes CSV, MAT and Parquet of it)"
        )


def _console(json: str | None = None) -> Console:
    """Where words go: with JSON on standard output, to standard error; a pipe gets JSON alone."""
    from rich.console import Console

    return Console(stderr=json == "-")


def _print(console: Console, text: str, style: str | None = None) -> None:
    """A line as it stands: names of files and columns may hold [brackets], and are not wrapped."""
    console.print(text, style=style, markup=False, highlight=False, emoji=False, soft_wrap=True)


@contextmanager
def _working(
    json: str | None, computes: bool = True, whole: bool = False
) -> Iterator[tuple[Console, Progress]]:
    """A console for results and a progress bar on standard error while the body works.

    ``computes``: the body uses the compiled kernels. ``whole``: it tells of all its work as one.
    """
    from dearig.cli.terminal import progress

    if computes:
        _tell_of_compiling()
    with progress("dearig", whole=whole) as report:
        yield _console(json), report


def _tell_of_compiling() -> None:
    from dearig.model.jit import is_compiled

    if not is_compiled():
        sys.stderr.write("Compiling the numerical kernels, once: this takes some twenty seconds.\n")


def main() -> None:
    """Run the command line; errors become one sentence and an exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # a name that the terminal's encoding lacks is shown by its code, and ends nothing
            stream.reconfigure(errors="backslashreplace")
    try:
        status: object = app(prog_name="dearig", standalone_mode=False)
        if status == _INTERRUPTED:  # as which typer returns a KeyboardInterrupt
            _say("interrupted")
        sys.stdout.flush()
    except DearigError as error:
        if isinstance(error.__cause__, BrokenPipeError):
            status = _pipe_gone()
        else:
            _say(str(error))
            status = error.exit_code
    except TyperException as error:
        _say(_usage(error))
        status = InputError.exit_code
    except KeyboardInterrupt:
        _say("interrupted")
        status = _INTERRUPTED
    except (BrokenPipeError, SystemExit):
        # both rich and typer make a SystemExit of a broken pipe; nothing else here raises one
        status = _pipe_gone()
    sys.exit(status if isinstance(status, int) else 0)


_INTERRUPTED = 130


def _pipe_gone() -> int:
    """The reader of a pipe has left (head, less): no more can be said, and that is no error."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _usage(error: TyperException) -> str:
    """Typer's complaint about the command line as a sentence."""
    context = getattr(error, "ctx", None)
    command = "dearig" if context is None else context.command_path
    # words of the library that checks the values
    words = error.format_message().replace("Value error, ", "").strip().rstrip(".")
    words = re.sub(r"(.*): Input should be ", r"\1: it must be ", words)
    return f"{words}; {command} --help says what it takes" if words else f"try {command} --help"


def _say(message: str) -> None:
    sys.stderr.write(f"dearig: {message}\n")


if __name__ == "__main__":
    main()
