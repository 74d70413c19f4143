"""The main job on the simulated rig: the thesis's experiment from excitation to error tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from app.errors import InputError
from app.identify import identify_recordings
from app.outcomes import IdentifyOutcome, ValidateOutcome
from app.presets import VALIDATION_A, VALIDATION_B
from app.progress import Progress, quiet
from app.report.figures import overview_figure, save_png
from app.report.html import write_demo_report
from app.rigfile import RigFile
from app.run import record
from app.sequencefile import load_sequence
from app.validate import validate_model

__all__ = ["DemoResult", "run_demo"]


@dataclass(frozen=True)
class DemoResult:
    """What the demonstration found, and where its report lies."""

    identified: IdentifyOutcome
    validated: ValidateOutcome
    report: Path
    seconds: float


def run_demo(
    out: Path,
    *,
    seed: int = 0,
    overwrite: bool = False,
    clock: Callable[[], float],
    progress: Progress = quiet,
) -> DemoResult:
    """Record the identification run and the ten validation runs, identify, validate, report.

    Everything goes into the folder ``out``: recordings, ``model.toml``, ``report.html``,
    ``overview.png``. Raises ``InputError`` where the folder holds something, unless ``overwrite``.
    """
    started = clock()
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; give a folder for the results")
    if out.is_dir() and any(out.iterdir()) and not overwrite:
        raise InputError(f"{out} is not empty; give another folder with --out, or --force")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out} cannot be made: {error.strerror or error}") from error
    rig_file = RigFile()
    presets = ("thesis", *VALIDATION_A, *VALIDATION_B)
    files = {preset: out / f"{preset}.h5" for preset in presets}
    for n, (preset, path) in enumerate(files.items()):
        # another seed a run: the noise of two runs has nothing in common
        record(
            load_sequence(preset), "sim", rig_file, "", path,
            seed=seed * len(presets) + n, overwrite=overwrite,
        )  # fmt: skip
        progress("recording 11 runs", (n + 1) / len(presets))
    identified = identify_recordings(
        [files["thesis"]],
        out / "model.toml",
        overwrite=overwrite,
        clock=clock,
        progress=progress,
    )
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
    return DemoResult(identified, validated, report, clock() - started)
