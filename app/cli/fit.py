"""Commands on models: demo, identify, validate, diagnose, simulate, sense."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dearig.cli.options import (
    Bounds,
    Branches,
    Drive,
    DriveChannel,
    EndedEarly,
    EndedEarlyOption,
    Fixed,
    Force,
    Json,
    ManyToValidate,
    Method,
    ParameterFile,
    Priors,
    Recording,
    Report,
    RigFileOption,
    Seed,
    SpringChoice,
    SpringKind,
    Validation,
    stated_by,
)
from dearig.cli.output import (
    check_files,
    open_recordings,
    optional,
    print_line,
    working,
    write_result,
)
from dearig.errors import InputError, Interrupted

if TYPE_CHECKING:
    from dearig.analysis.outcomes import DiagnoseOutcome

__all__ = ["commands"]

commands = typer.Typer()
_PANEL = "Models"

Train = Annotated[
    list[Path], typer.Argument(metavar="TRAIN.h5...", help="Recordings to fit.", show_default=False)
]
ModelFile = Annotated[Path, typer.Argument(metavar="MODEL.toml", help="A model file.")]

BranchSpring = Annotated[
    SpringKind | None,
    typer.Option(
        help="Strain energy of the branches.",
        show_default="as --spring where it is gent, neo-hookean or arruda-boyce, else gent",
    ),
]

# ---------------------------------------------------------------- options of diagnose

OptionalTrain = Annotated[
    list[Path] | None,
    typer.Argument(metavar="TRAIN.h5...", help="Recordings to fit.", show_default=False),
]
ModelOut = Annotated[
    Path | None,
    typer.Option(metavar="MODEL.toml", help="Write the model with the effects found to this file."),
]
BaselineBranches = Annotated[
    int, typer.Option(help="Number of Maxwell branches of the baseline model.")
]
BaselineSpring = Annotated[
    SpringKind, typer.Option(help="Strain energy of the baseline's equilibrium spring.")
]
RigToRecordOn = Annotated[
    str | None,
    typer.Option(
        help="Record on this rig, such as sim:7, and run experiments that separate the "
        "remaining candidates."
    ),
]
Experiments = Annotated[
    int, typer.Option(min=0, max=20, help="Largest number of such experiments; needs --rig.")
]
ResultFolder = Annotated[
    Path,
    typer.Option("--out", metavar="DIR", help="Folder for recordings and results of --rig."),
]
Thorough = Annotated[
    bool,
    typer.Option(
        "--thorough",
        help="Search without a time budget (the default is about a minute). Use it when the "
        "report says that the search was ended early.",
    ),
]

# ---------------------------------------------------------------- commands


@commands.command(rich_help_panel=_PANEL)
def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for results.")] = Path(
        "demo"
    ),
    seed: Seed = 0,
    json: Json = None,
    force: Force = False,
) -> None:
    """Run the whole job on simulated rigs.

    Records the thesis's experiment, identifies and validates the model; then diagnoses a second
    rig, which has a hidden effect. Writes recordings, models and reports.
    """
    from dearig.cli.demo import run_demo
    from dearig.cli.terminal import diagnosis_tables, identify_table, validate_tables
    from dearig.report.as_json import result_json

    check_files(force, (), json=json)
    with working(json) as (console, progress):
        result = run_demo(out, seed=seed, overwrite=force, clock=time.monotonic, progress=progress)
    console.print(identify_table(result.identified))
    console.print(validate_tables(result.validated))
    console.print(diagnosis_tables(result.diagnosed))
    print_line(console, f"Recordings, models and reports are in {out}")
    print_line(console, f"Report: {result.report}")
    print_line(console, f"Diagnosis: {result.diagnosis_report}")
    write_result(
        lambda: {
            "format": "dearig-demo/1",
            "report": str(result.report),
            "identification": result_json(result.identified),
            "validation": result_json(result.validated),
            "diagnosis_report": str(result.diagnosis_report),
            "diagnosis": result_json(result.diagnosed),
            "seconds": result.seconds,
        },
        json,
    )


@commands.command(cls=ManyToValidate, rich_help_panel=_PANEL)
def identify(
    train: Train,
    out: Annotated[
        Path, typer.Option("--out", metavar="MODEL.toml", help="Write the model to this file.")
    ],
    method: Annotated[
        Method,
        typer.Option(help="hybrid, or de for the thesis's Algorithm 1 as printed."),
    ] = Method.hybrid,
    validate_: Validation = None,
    branches: Branches = "3",
    spring: Annotated[
        SpringChoice,
        typer.Option(
            help="Strain energy of the equilibrium spring; choose fits each and keeps the most "
            "probable one.",
        ),
    ] = "gent",
    branch_spring: BranchSpring = None,
    effects_of: Annotated[
        Path | None,
        typer.Option(
            metavar="MODEL.toml", help="Fit the effects of this model too, from its values."
        ),
    ] = None,
    parameters: ParameterFile = None,
    fix: Fixed = None,
    bound: Bounds = None,
    prior: Priors = None,
    drive: Drive = DriveChannel.command,
    rest_length_mm: Annotated[
        float | None,
        typer.Option(
            help="Measured length of the film under the load, such as 82.",
            show_default="computed from mu_0",
        ),
    ] = None,
    rig_file: RigFileOption = None,
    seed: Annotated[
        int, typer.Option(min=0, max=10**15, help="Seed of Algorithm 1's random numbers.")
    ] = 0,
    intervals: Annotated[bool, typer.Option(help="Compute 95 % confidence intervals.")] = True,
    ended_early: EndedEarlyOption = EndedEarly.keep,
    report: Report = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Fit the model to recordings.

    Gives the parameters with 95 % confidence intervals, and says which parameters the data do not
    determine.
    """
    from dearig.analysis.identify import identify_recordings
    from dearig.analysis.outcomes import save_fitted_model
    from dearig.cli.terminal import branch_table, identify_table, spring_table
    from dearig.config.modelfile import load_model
    from dearig.config.rigfile import load_rig_file
    from dearig.report.as_json import result_json

    numbers = _branches(branches)
    given = (*train, *(validate_ or []), rig_file, effects_of, parameters)
    check_files(force, given, out, *optional(report), json=json)
    stated = stated_by(parameters, fix, bound, prior)
    with working(json) as (console, progress):
        fitted, others = open_recordings(console, train, validate_ or [], ended_early.value)
        outcome = identify_recordings(
            fitted,
            validation=others,
            method=method.value,
            branches=numbers,
            spring=spring,
            branch_spring=branch_spring or "",
            effects=() if effects_of is None else load_model(effects_of).model.effects,
            parameters=stated,
            drive=drive.value,
            rest_length_mm=rest_length_mm,
            rig_file=None if rig_file is None else load_rig_file(rig_file),
            seed=seed,
            intervals=intervals,
            ended_early=ended_early.value,
            progress=progress,
        )
        outcome = save_fitted_model(outcome, out, force)
        if report is not None:
            from dearig.report.pages.html import write_identify_report

            write_identify_report(outcome, report)
    if outcome.springs:
        console.print(spring_table(outcome))
    if outcome.trials:
        console.print(branch_table(outcome))
    console.print(identify_table(outcome))
    print_line(console, f"Model: {out}")
    if report is not None:
        print_line(console, f"Report: {report}")
    write_result(lambda: result_json(outcome), json)
    if outcome.interrupted:
        raise Interrupted("interrupted: the fit found before that was kept")


def _branches(text: str) -> list[int]:
    """Return the numbers that ``3`` or ``1-4`` stands for."""
    from dearig.analysis.readings.compatibility import BRANCHES_MAX

    found = re.fullmatch(r"\s*([0-9]{1,9})\s*(?:-\s*([0-9]{1,9}))?\s*", text)
    if not found:
        raise InputError(f"--branches {text!r} is neither a number nor a range such as 1-4")
    low, high = int(found[1]), int(found[2] or found[1])
    if low > high:
        raise InputError(f"--branches {text} goes from more to fewer; write {high}-{low}")
    if high > BRANCHES_MAX:
        raise InputError(
            f"--branches {text}: a model has from 1 to {BRANCHES_MAX} branches, a film also 0; "
            f"write such a number, or a range such as 1-4"
        )
    return list(range(low, high + 1))


@commands.command(rich_help_panel=_PANEL)
def validate(
    model: ModelFile,
    paths: Annotated[
        list[Path], typer.Argument(metavar="FILE.h5...", help="Recordings to compare with.")
    ],
    drive: Drive = DriveChannel.command,
    report: Report = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Compare a model with recordings: error tables like the thesis's Tables 4 and 5."""
    from dearig.analysis.validate import validate_model
    from dearig.cli.terminal import validate_tables
    from dearig.report.as_json import result_json

    check_files(force, (model, *paths), *optional(report), json=json)
    with working(json) as (console, progress):
        outcome = validate_model(model, paths, drive=drive.value, progress=progress)
        if report is not None:
            from dearig.report.pages.html import write_validate_report

            write_validate_report(outcome, report)
    console.print(validate_tables(outcome))
    if report is not None:
        print_line(console, f"Report: {report}")
    write_result(lambda: result_json(outcome), json)


@commands.command(cls=ManyToValidate, rich_help_panel=_PANEL)
def diagnose(
    train: OptionalTrain = None,
    validate_: Validation = None,
    report: Report = None,
    model_out: ModelOut = None,
    branches: BaselineBranches = 3,
    spring: BaselineSpring = "gent",
    branch_spring: BranchSpring = None,
    parameters: ParameterFile = None,
    fix: Fixed = None,
    bound: Bounds = None,
    prior: Priors = None,
    drive: Drive = DriveChannel.command,
    rig_file: RigFileOption = None,
    rig: RigToRecordOn = None,
    experiments: Experiments = 1,
    out: ResultFolder = Path("diagnosis"),
    thorough: Thorough = False,
    ended_early: EndedEarlyOption = EndedEarly.keep,
    seed: Seed = 0,
    json: Json = None,
    force: Force = False,
) -> None:
    """Find effects that the model lacks.

    Adds the effects found to the model and compares the errors before and after.
    """
    from dearig.acquisition.interrupts import Interrupts
    from dearig.analysis.diagnose import diagnose_recordings, diagnose_rig
    from dearig.analysis.outcomes import save_fitted_model
    from dearig.cli.terminal import diagnosis_tables
    from dearig.config.rigfile import load_rig_file
    from dearig.config.toml_input import read_text
    from dearig.recording.result_folder import result_folder
    from dearig.report.as_json import result_json
    from dearig.report.pages.diagnosis import write_diagnosis_report

    given, others = train or [], validate_ or []
    if rig is None and not given:
        raise InputError(
            "give recordings to diagnose, or a rig to record on with --rig; dearig diagnose --help "
            "shows both"
        )
    check_files(
        force, (*given, *others, rig_file, parameters), *optional(report), *optional(model_out),
        json=json,
    )  # fmt: skip
    stated = stated_by(parameters, fix, bound, prior)
    settings = None if rig_file is None else load_rig_file(rig_file)
    of_branches = branch_spring or ""
    if rig is not None:
        result_folder(out, force)
        report, model_out = report or out / "report.html", model_out or out / "model.toml"
    with working(json, whole=True) as (console, progress):
        fitted, untouched = open_recordings(console, given, others, ended_early.value)
        if rig is None:
            outcome = diagnose_recordings(
                fitted, validation=untouched, branches=branches, spring=spring,
                branch_spring=of_branches, parameters=stated, drive=drive.value, rig_file=settings,
                thorough=thorough, ended_early=ended_early.value, progress=progress,
            )  # fmt: skip
        else:
            outcome = diagnose_rig(
                rig, out, experiments=experiments, train=fitted, validation=untouched,
                branches=branches, spring=spring, branch_spring=of_branches,
                parameters=stated, drive=drive.value, rig_file=settings,
                configuration="" if rig_file is None else read_text(rig_file, "rig file"),
                seed=seed, thorough=thorough, ended_early=ended_early.value, overwrite=force,
                progress=progress,
            )  # fmt: skip
        with Interrupts():  # the first ctrl-C does not leave files out
            if model_out is not None:
                outcome = save_fitted_model(outcome, model_out, force)
            if report is not None:
                progress("report", 1.0)
                write_diagnosis_report(outcome, report)
    with Interrupts():
        console.print(diagnosis_tables(outcome))
        for label, path in (("Model", model_out), ("Report", report)):
            if path is not None:
                print_line(console, f"{label}: {path}")
        write_result(lambda: result_json(outcome), json)
    _raise_early_end(outcome)


def _raise_early_end(outcome: DiagnoseOutcome) -> None:
    """Raise the error that ended the runs or the search early, if one did."""
    if outcome.ended is not None and not isinstance(outcome.ended, Interrupted):
        ended = outcome.ended
        raise type(ended)(f"{ended}; the results found before that were kept") from ended
    if outcome.finding.interrupted:
        raise Interrupted("interrupted: the results found before that were kept")


@commands.command(rich_help_panel=_PANEL)
def simulate(
    model: ModelFile,
    drive: Annotated[
        str,
        typer.Option(
            metavar="FILE.h5|SEQUENCE.toml", help="A recording, a sequence file or a preset."
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", metavar="OUT.h5|OUT.csv", help="Write the prediction to this file."),
    ],
    voltage: Annotated[
        DriveChannel,
        typer.Option(help="Voltage of a recording that drives the model."),
    ] = DriveChannel.command,
    band: Annotated[
        bool,
        typer.Option(
            help="Compute the 95 % band by the errors of parameters, readings and law; two "
            "simulations for each parameter."
        ),
    ] = True,
    rig_file: RigFileOption = None,
    report: Report = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Compute what a model predicts under a recorded or planned drive, with its 95 % band."""
    from dearig.acquisition.rig_source import film_differences
    from dearig.analysis.simulate import save_prediction, simulate_model
    from dearig.config.rigfile import load_rig_file
    from dearig.model.simulation.actuator import Actuator
    from dearig.report.text.bands import NO_BAND, band_json, band_texts
    from dearig.report.text.sentences import pull_in_text

    check_files(force, (model, drive, rig_file), out, *optional(report), json=json)
    settings = None if rig_file is None else load_rig_file(rig_file)
    with working(json) as (console, _):
        prediction = simulate_model(
            model,
            drive,
            rig_file=settings,
            voltage=voltage.value,
            band=band,
        )
        written = save_prediction(prediction, out, force)
        if report is not None:
            from dearig.api.predictions import Prediction

            Prediction(prediction).to_html(report)
    print_line(console, str(written))
    simulated = prediction.model.model
    if settings is not None and isinstance(simulated, Actuator):
        for text in film_differences(simulated.film, simulated.load, settings):
            print_line(console, text, "yellow")
    if report is not None:
        print_line(console, f"Report: {report}")
    if prediction.band is not None:
        for text in band_texts(prediction.band, prediction.kind):
            print_line(console, text)
    elif band:
        print_line(console, NO_BAND)
    if prediction.field_max is not None:
        print_line(
            console,
            f"true field up to {prediction.field_max * 1e-6:.3g} MV/m; static pull-in: "
            f"{pull_in_text(prediction)}",
        )
    write_result(
        {
            "format": "dearig-simulation/1",
            "model": str(model),
            "drive": drive,
            "out": str(written),
            "true_field_max_V_per_m": prediction.field_max,
            "pull_in_voltage_V": prediction.pull_in,
            "locking_limits_not_determined": list(prediction.open_limits),
            "band": band_json(prediction.band, prediction.kind),
        },
        json,
    )


@commands.command(rich_help_panel=_PANEL)
def sense(
    recording: Recording,
    model: Annotated[
        Path, typer.Option(metavar="MODEL.toml", help="Model of the film that was recorded.")
    ],
    drive: Annotated[
        DriveChannel, typer.Option(help="Voltage: the command or the amplifier's monitor.")
    ] = DriveChannel.command,
    gain: Annotated[
        float,
        typer.Option(
            help="Charge over that of the model, as the laser of another recording of this rig "
            "gave it."
        ),
    ] = 1.0,
    gain_error: Annotated[
        float | None,
        typer.Option(
            help="Relative standard uncertainty of the gain.",
            show_default="what the rig file states of the scales, else 1 % for each",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="OUT.csv", help="Write a row for each time to this file."),
    ] = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Compute the displacement from voltage and current alone.

    Gives its standard error, and compares it with the laser. Takes rows that are means ([card]
    average) and a voltage that comes back to 0 V.
    """
    from dearig.analysis.readings.sense import save_sensed, sense_recording
    from dearig.report.sensed import sense_json, sensed_texts

    check_files(force, (recording, model), *optional(out), json=json)
    with working(json) as (console, _):
        outcome = sense_recording(
            recording,
            model,
            drive=drive.value,
            gain=gain,
            gain_error=gain_error,
        )
        if out is not None:
            save_sensed(outcome, out, force)
    for text in sensed_texts(outcome):
        print_line(console, text)
    if out is not None:
        print_line(console, f"Table: {out}")
    write_result(sense_json(outcome), json)
