"""What is computed after each run of a campaign: fit, validation, diagnosis, bands."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from dearig.analysis.diagnose import diagnose_recordings
from dearig.analysis.identify import identify_recordings
from dearig.analysis.outcomes import save_fitted_model
from dearig.analysis.validate import validate_model
from dearig.batch.numbers import conditions_of, numbers_of
from dearig.config.campaignfile import Campaign, StopCondition
from dearig.config.modelfile import ModelFile, load_model
from dearig.config.rigfile import RigFile
from dearig.errors import InputError, Interrupted
from dearig.progress import Progress, quiet
from dearig.recording.reading.reader import open_recording

__all__ = ["AfterRun", "Compute", "band_violation", "compute"]

log = logging.getLogger(__name__)

#: Folder for fitted models, in the campaign's.
MODELS = "models"


@dataclass
class AfterRun:
    """What was computed after a run: numbers by name, the fitted model's file, and problems."""

    numbers: dict[str, float] = field(default_factory=dict)
    model: str = ""
    problems: list[str] = field(default_factory=list)


#: What computes after a run, with the parameters of ``compute``.
Compute = Callable[[Campaign, Path, Path, str, RigFile, Progress], AfterRun]


def compute(
    campaign: Campaign,
    recording: Path,
    folder: Path,
    last_model: str,
    rig_file: RigFile,
    progress: Progress = quiet,
) -> AfterRun:
    """Do what the plan of ``campaign`` asks for after a run.

    Peak displacement, temperature and humidity of the room are read in any case. The recording is
    first compared with ``last_model`` (a file in ``folder``), which it has not been fitted to, and
    then fitted. What cannot be computed is a problem that is noted; the campaign goes on. Raises
    ``Interrupted`` for a diagnosis that the operator ended.
    """
    found = AfterRun()

    def validate() -> None:
        model = _model(campaign, folder, last_model)
        if model is not None:
            outcome = validate_model(model, [recording], progress=progress)
            found.numbers |= numbers_of(outcome)

    def identify() -> None:
        outcome = identify_recordings(
            [recording], branches=(campaign.branches,), rig_file=rig_file,
            parameters=campaign.parameters, progress=progress,
        )  # fmt: skip
        if outcome.interrupted:
            raise Interrupted("interrupted during the fit after a run, at 0 V")
        found.numbers |= numbers_of(outcome)
        path = folder / MODELS / f"{recording.stem}.toml"
        path.parent.mkdir(exist_ok=True)
        # written again where a kill came before the journal named it
        save_fitted_model(outcome, path, overwrite=True)
        found.model = path.relative_to(folder).as_posix()

    def diagnose() -> None:
        outcome = diagnose_recordings(
            [recording], branches=campaign.branches, rig_file=rig_file,
            parameters=campaign.parameters, progress=progress,
        )  # fmt: skip
        if outcome.finding.interrupted:
            raise Interrupted("interrupted during the diagnosis after a run, at 0 V")
        found.numbers |= numbers_of(outcome)

    def look() -> None:
        found.numbers |= conditions_of(open_recording(recording))

    steps: tuple[tuple[str, bool, Callable[[], None]], ...] = (
        ("peak and room", True, look),
        ("validate", campaign.validate, validate),
        ("identify", campaign.identify, identify),
        ("diagnose", campaign.diagnose, diagnose),
    )
    for name, wanted, step in steps:
        if wanted:
            try:
                step()
            except InputError as error:
                log.warning("%s after %s: %s", name, recording.name, error)
                found.problems.append(f"{name}: {error}")
    return found


def _model(campaign: Campaign, folder: Path, last_model: str) -> ModelFile | None:
    if last_model:
        return load_model(folder / last_model)
    return None if campaign.model is None else load_model(campaign.model)


def band_violation(bands: tuple[StopCondition, ...], numbers: dict[str, float]) -> str:
    """Return a sentence on the first band that a number has left, "" if none has.

    A parameter that the data do not determine is not among the numbers, and leaves no band.
    """
    for band in bands:
        value = numbers.get(band.name)
        if value is not None and band.left_by(value):
            return f"{band.name} is {value:.6g}, and the plan stops when {band}"
    return ""
