"""Analysis: identify, validate, simulate and diagnose, from objects or paths to values."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from dearig.analysis.diagnose import diagnose_recordings
from dearig.analysis.identify import identify_recordings
from dearig.analysis.readings.opening import Source
from dearig.analysis.simulate import simulate_model
from dearig.analysis.validate import validate_model
from dearig.api.models import ModelSource, as_model_file
from dearig.api.predictions import Prediction
from dearig.api.recordings import RigSource, load_rig
from dearig.api.results import DiagnoseResult, IdentifyResult, ValidateResult
from dearig.api.sequences import Sequence, SequenceSource
from dearig.errors import InputError
from dearig.progress import Progress, quiet
from dearig.recording.reading.recording import Recording

__all__ = ["diagnose", "identify", "simulate", "validate"]

#: A recording or the path of one, or several.
Recordings = Source | Iterable[Source]


def _listed(recordings: Recordings) -> list[Source]:
    if isinstance(recordings, str | Path | Recording):
        return [recordings]
    return list(recordings)


def _some(recordings: Recordings) -> list[Source]:
    found = _listed(recordings)
    if not found:
        raise InputError("no recording is given; give one or more")
    return found


def identify(
    recordings: Recordings,
    *,
    validate: Recordings = (),
    method: str = "hybrid",
    branches: int | Iterable[int] = 3,
    spring: str = "gent",
    branch_spring: str = "",
    drive: str = "command",
    rest_length_mm: float | None = None,
    rig_file: RigSource | None = None,
    seed: int = 0,
    intervals: bool = True,
    ended_early: str = "keep",
    progress: Progress = quiet,
) -> IdentifyResult:
    """Fit the model to recordings.

    Parameters
    ----------
    recordings : recording, path, or several
        What is fitted.
    validate : recording, path, or several
        Read once at the end, with no part in the fit or in a choice.
    method : str
        ``hybrid``, or ``de`` for the thesis's Algorithm 1 as printed.
    branches : int or several
        Number of Maxwell branches; of several the one with the lowest information criterion on the
        fitted recordings is kept.
    spring : str
        Strain energy of the equilibrium spring: ``gent``, ``neo-hookean``, ``arruda-boyce``,
        ``yeoh``, ``mooney-rivlin``, ``ogden``, ``ogden-two-terms``, ``extended-tube``; or
        ``choose`` for the most probable one on the fitted recordings.
    branch_spring : str
        Strain energy of the branches: by default as ``spring`` where that is one of the first
        three, else ``gent``.
    drive : str
        Voltage that drives the model: ``command`` or ``monitor``.
    rest_length_mm : float, optional
        Measured length of the film under the load; computed from mu_0 where it is left out.
    rig_file : path or mapping, optional
        Film and load, in place of those in the recordings.
    seed : int
        Of Algorithm 1.
    intervals : bool
        Compute 95 % intervals.
    ended_early : str
        Of recordings whose runs ended early: ``keep`` them, ``cut`` the end that may show a fault,
        or ``leave-out``.
    progress : callable, optional
        Called with a stage and the fraction of it that is done.

    Raises
    ------
    InputError
        For recordings that cannot be fitted.
    """
    outcome = identify_recordings(
        _some(recordings),
        validation=_listed(validate),
        method=method,
        branches=[branches] if isinstance(branches, int) else list(branches),
        spring=spring,
        branch_spring=branch_spring,
        drive=drive,
        rest_length_mm=rest_length_mm,
        rig_file=None if rig_file is None else load_rig(rig_file)[0],
        seed=seed,
        intervals=intervals,
        ended_early=ended_early,
        progress=progress,
    )
    return IdentifyResult(outcome)


def validate(
    model: ModelSource,
    recordings: Recordings,
    *,
    drive: str = "command",
    progress: Progress = quiet,
) -> ValidateResult:
    """Compare a model with recordings: error tables like the thesis's Tables 4 and 5.

    ``model`` is a model, a result with one, or the path of a model file. ``drive`` and ``progress``
    are as for ``identify``. Raises ``InputError``.
    """
    outcome = validate_model(
        as_model_file(model), _some(recordings), drive=drive, progress=progress
    )
    return ValidateResult(outcome)


def simulate(
    model: ModelSource,
    drive: SequenceSource | Recording,
    *,
    rig_file: RigSource | None = None,
    voltage: str = "command",
) -> Prediction:
    """Compute what a model predicts under a recording or a sequence.

    ``drive`` is a recording, a sequence, the path of either, or the name of a preset. A sequence is
    sampled at the rate of ``rig_file``; ``voltage`` of a recording is ``command`` or ``monitor``.
    Raises ``InputError``.
    """
    played = drive.loaded if isinstance(drive, Sequence) else drive
    settings = None if rig_file is None else load_rig(rig_file)[0]
    found = simulate_model(as_model_file(model), played, rig_file=settings, voltage=voltage)
    return Prediction(found)


def diagnose(
    recordings: Recordings,
    *,
    validate: Recordings = (),
    branches: int = 3,
    spring: str = "gent",
    branch_spring: str = "",
    drive: str = "command",
    rig_file: RigSource | None = None,
    thorough: bool = False,
    ended_early: str = "keep",
    progress: Progress = quiet,
) -> DiagnoseResult:
    """Find the effects that the thesis's model of recordings lacks.

    Parameters
    ----------
    recordings : recording, path, or several
        What is fitted.
    validate : recording, path, or several
        Read once at the end: errors before and after on what no fit has used.
    branches : int
        Number of Maxwell branches of the baseline.
    spring, branch_spring : str
        Strain energies of the baseline, as of ``identify``.
    drive : str
        Voltage that drives the model: ``command`` or ``monitor``.
    rig_file : path or mapping, optional
        Film and load in place of those in the recordings, and the limits of a proposed experiment.
    thorough : bool
        Search without a time budget; otherwise for about a minute.
    ended_early : str
        Of recordings whose runs ended early: ``keep`` them, ``cut`` the end that may show a fault,
        or ``leave-out``.
    progress : callable, optional
        Called with a stage and the fraction of all the work that is done.

    Raises
    ------
    InputError
        For recordings that cannot be diagnosed. An interrupt of the kernel ends the search and
        keeps what was found; a second one raises ``KeyboardInterrupt``.
    """
    outcome = diagnose_recordings(
        _some(recordings),
        validation=_listed(validate),
        branches=branches,
        spring=spring,
        branch_spring=branch_spring,
        drive=drive,
        rig_file=None if rig_file is None else load_rig(rig_file)[0],
        thorough=thorough,
        ended_early=ended_early,
        progress=progress,
    )
    return DiagnoseResult(outcome)
