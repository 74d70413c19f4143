"""Run the main job on simulated rigs: record, identify, validate, diagnose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dearig.acquisition.run import RunOptions, record
from dearig.analysis.diagnose import VALIDATION, diagnose_recordings
from dearig.analysis.identify import identify_recordings
from dearig.analysis.outcomes import (
    DiagnoseOutcome,
    IdentifyOutcome,
    ValidateOutcome,
    save_fitted_model,
)
from dearig.analysis.validate import validate_model
from dearig.config.presets import VALIDATION_A, VALIDATION_B
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence
from dearig.errors import Interrupted
from dearig.progress import Progress, quiet
from dearig.recording.result_folder import result_folder
from dearig.report.figures.export import save_png
from dearig.report.figures.recordings import overview_figure
from dearig.report.pages.diagnosis import write_diagnosis_report
from dearig.report.pages.html import write_demo_report

__all__ = ["HIDDEN", "DemoResult", "run_demo"]

#: Address of the simulated rig that is diagnosed. It hides a leakage: by the displacement alone
#: that looks like a fault of the amplifier, by the recorded voltage and current it does not.
HIDDEN = "sim:12"


@dataclass(frozen=True)
class DemoResult:
    """Results of the demonstration, and the paths of its reports."""

    identified: IdentifyOutcome
    validated: ValidateOutcome
    diagnosed: DiagnoseOutcome
    report: Path
    diagnosis_report: Path
    seconds: float


def run_demo(
    out: Path,
    *,
    seed: int = 0,
    overwrite: bool = False,
    clock: Callable[[], float],
    progress: Progress = quiet,
) -> DemoResult:
    """Record the thesis's runs, identify, validate, report; then diagnose another rig.

    Everything is written to the folder ``out``: recordings, ``model.toml``, ``report.html`` and
    ``overview.png`` of the rig that follows the model; ``hidden-*.h5``, ``improved.toml`` and
    ``diagnosis.html`` of the other. Raises ``InputError`` where the folder is not empty, unless
    ``overwrite``.
    """
    started = clock()
    result_folder(out, overwrite)
    rig_file = RigFile()
    presets = ("thesis", *VALIDATION_A, *VALIDATION_B)
    files = {preset: out / f"{preset}.h5" for preset in presets}
    for n, (preset, path) in enumerate(files.items()):
        # a seed for each run: the noise of two runs is independent
        record(
            load_sequence(preset), "sim", rig_file, path,
            RunOptions(seed=seed * len(presets) + n, overwrite=overwrite),
        )  # fmt: skip
        progress("recording 11 runs", (n + 1) / len(presets))
    identified = save_fitted_model(
        identify_recordings([files["thesis"]], clock=clock, progress=progress),
        out / "model.toml",
        overwrite,
    )
    if identified.interrupted:
        raise Interrupted("interrupted: the fit found before that was kept")
    validated = validate_model(
        out / "model.toml", [files[p] for p in presets[1:]], progress=progress
    )
    report = out / "report.html"
    progress("report", 0.0)
    write_demo_report(identified, validated, report)
    progress("report", 0.8)
    overview = overview_figure(identified.train[0], validated.comparisons)
    save_png(overview, out / "overview.png", dpi=110)
    progress("report", 1.0)
    hidden = {preset: out / f"hidden-{preset}.h5" for preset in ("thesis", *VALIDATION)}
    for n, (preset, path) in enumerate(hidden.items()):
        record(
            load_sequence(preset), HIDDEN, rig_file, path,
            RunOptions(seed=seed * len(hidden) + n, overwrite=overwrite),
        )  # fmt: skip
        progress("recording another rig", (n + 1) / len(hidden))
    diagnosed = diagnose_recordings(
        [hidden["thesis"]],
        validation=[hidden[preset] for preset in VALIDATION],
        clock=clock,
        progress=lambda _, fraction: progress("diagnosis", fraction),
    )
    diagnosed = save_fitted_model(diagnosed, out / "improved.toml", overwrite)
    page = out / "diagnosis.html"
    write_diagnosis_report(diagnosed, page)
    return DemoResult(identified, validated, diagnosed, report, page, clock() - started)
