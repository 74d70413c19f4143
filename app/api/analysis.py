"""Analysis: identify, validate, simulate and diagnose, from objects or paths to values."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from dearig.analysis.diagnose import diagnose_recordings
from dearig.analysis.identify import identify_recordings
from dearig.analysis.readings.opening import Source
from dearig.analysis.simulate import simulate_model
from dearig.analysis.validate import validate_model
from dearig.api.arguments import named_arguments
from dearig.api.models import ModelSource, as_model_file
from dearig.api.predictions import Prediction
from dearig.api.recordings import RigSource, load_rig
from dearig.api.results import DiagnoseResult, IdentifyResult, ValidateResult
from dearig.api.sequences import Sequence, SequenceSource
from dearig.config.parameterfile import Stated, load_parameter_file
from dearig.errors import InputError
from dearig.progress import Progress, quiet
from dearig.recording.reading.recording import Recording

__all__ = ["ParameterSource", "diagnose", "identify", "simulate", "stated_in", "validate"]

#: A recording or the path of one, or several.
Recordings = Source | Iterable[Source]


#: What is known of parameters: a parameter file, or a mapping of the same form.
ParameterSource = Path | str | Stated


def stated_in(parameters: ParameterSource | None) -> Stated:
    """Return what ``parameters`` state, a file or a mapping. Raises ``InputError``."""
    if parameters is None:
        return {}
    return load_parameter_file(parameters) if isinstance(parameters, Path | str) else parameters


def _listed(recordings: Recordings) -> list[Source]:
    if isinstance(recordings, str | Path | Recording):
        return [recordings]
    return list(recordings)


def _some(recordings: Recordings) -> list[Source]:
    found = _listed(recordings)
    if not found:
        raise InputError("no recording is given; give one or more")
    return found


@named_arguments
def identify(
    recordings: Recordings,
    *,
    validate: Recordings = (),
    method: str = "hybrid",
    branches: int | Iterable[int] = 3,
    spring: str = "gent",
    branch_spring: str = "",
    parameters: ParameterSource | None = None,
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
        Recordings that are fitted.
    validate : recording, path, or several
        Recordings that are read once at the end, with no part in the fit or in a choice.
    method : str
        ``hybrid``, or ``de`` for the thesis's Algorithm 1 as printed.
    branches : int or several
        Number of Maxwell branches. Of several, the one with the lowest information criterion on the
        fitted recordings is kept.
    spring : str
        Strain energy of the equilibrium spring: ``gent``, ``neo-hookean``, ``arruda-boyce``,
        ``yeoh``, ``mooney-rivlin``, ``ogden``, ``ogden-two-terms``, ``extended-tube``; or
        ``choose`` for the most probable one on the fitted recordings.
    branch_spring : str
        Strain energy of the branches. The default is ``spring`` where that is one of the first
        three, otherwise ``gent``.
    parameters : path or mapping, optional
        What is known of parameters: a parameter file, or a mapping of the same form, such as
        ``{"mu_0_kPa": {"mean": 46.0, "sd": 0.5}, "T_1_s": {"low": 0.1}}``.
    drive : str
        Voltage that drives the model: ``command`` or ``monitor``.
    rest_length_mm : float, optional
        Measured length of the film under the load in mm. The default is computed from mu_0.
    rig_file : path or mapping, optional
        Film and load, in place of those in the recordings.
    seed : int
        Seed of Algorithm 1.
    intervals : bool
        Compute 95 % intervals.
    ended_early : str
        For recordings whose runs ended early: ``keep`` them, ``cut`` the end that may show a fault,
        or ``leave-out``.
    progress : callable, optional
        Called with a stage and the fraction of it that is done (0 to 1).

    Returns
    -------
    IdentifyResult
        Model, parameters with intervals, and errors on every recording.

    Raises
    ------
    InputError
        If the recordings cannot be fitted.

    Examples
    --------
    >>> import dearig
    >>> fit = dearig.identify("train.h5", validate="other.h5")
    >>> fit.parameters["mu_0"].value  # in Pa
    >>> fit.save("model.toml")
    """
    outcome = identify_recordings(
        _some(recordings),
        validation=_listed(validate),
        method=method,
        branches=[branches] if isinstance(branches, int) else list(branches),
        spring=spring,
        branch_spring=branch_spring,
        parameters=stated_in(parameters),
        drive=drive,
        rest_length_mm=rest_length_mm,
        rig_file=None if rig_file is None else load_rig(rig_file)[0],
        seed=seed,
        intervals=intervals,
        ended_early=ended_early,
        progress=progress,
    )
    return IdentifyResult(outcome)


@named_arguments
def validate(
    model: ModelSource,
    recordings: Recordings,
    *,
    drive: str = "command",
    progress: Progress = quiet,
) -> ValidateResult:
    """Compare a model with recordings: error tables like the thesis's Tables 4 and 5.

    Parameters
    ----------
    model : model, result or path
        A ``Model``, a result that has one, or the path of a model file.
    recordings : recording, path, or several
        Recordings that are compared with the model.
    drive : str
        Voltage that drives the model: ``command`` or ``monitor``.
    progress : callable, optional
        Called with a stage and the fraction of it that is done (0 to 1).

    Returns
    -------
    ValidateResult
        Errors on every recording, in um or kPa and in per cent.

    Raises
    ------
    InputError
        If the model or a recording cannot be used.

    Examples
    --------
    >>> import dearig
    >>> checked = dearig.validate("model.toml", ["a04.h5", "a06.h5"])
    >>> checked.errors[0].rms  # in um
    """
    outcome = validate_model(
        as_model_file(model), _some(recordings), drive=drive, progress=progress
    )
    return ValidateResult(outcome)


@named_arguments
def simulate(
    model: ModelSource,
    drive: SequenceSource | Recording,
    *,
    rig_file: RigSource | None = None,
    voltage: str = "command",
    band: bool = True,
) -> Prediction:
    """Compute what a model predicts under a recording or a sequence.

    Parameters
    ----------
    model : model, result or path
        A ``Model``, a result that has one, or the path of a model file.
    drive : recording, sequence, path or name of a preset
        The voltage (or stretch) that drives the model. A sequence is sampled at the rate of
        ``rig_file``.
    rig_file : path or mapping, optional
        Sample rate of a sequence.
    voltage : str
        Voltage of a recording that drives the model: ``command`` or ``monitor``.
    band : bool
        Compute the 95 % band, if the model has a covariance: two simulations for each parameter.

    Returns
    -------
    Prediction
        Time in s, drive in V and displacement in m; of a film, stretch and nominal stress in Pa.

    Raises
    ------
    InputError
        If the model or the drive cannot be used.

    Examples
    --------
    >>> import dearig
    >>> predicted = dearig.simulate("model.toml", "validation-a-0.4")
    >>> predicted.response.max()  # in m
    >>> predicted.low95, predicted.high95, predicted.band.parameters
    """
    played = drive.loaded if isinstance(drive, Sequence) else drive
    settings = None if rig_file is None else load_rig(rig_file)[0]
    found = simulate_model(
        as_model_file(model), played, rig_file=settings, voltage=voltage, band=band
    )
    return Prediction(found)


@named_arguments
def diagnose(
    recordings: Recordings,
    *,
    validate: Recordings = (),
    branches: int = 3,
    spring: str = "gent",
    branch_spring: str = "",
    parameters: ParameterSource | None = None,
    drive: str = "command",
    rig_file: RigSource | None = None,
    thorough: bool = False,
    ended_early: str = "keep",
    progress: Progress = quiet,
) -> DiagnoseResult:
    """Find the effects that the thesis's model of recordings lacks.

    An interrupt of the kernel ends the search and keeps what was found; a second one raises
    ``KeyboardInterrupt``.

    Parameters
    ----------
    recordings : recording, path, or several
        Recordings that are fitted.
    validate : recording, path, or several
        Recordings that are read once at the end: errors before and after on data that no fit used.
    branches : int
        Number of Maxwell branches of the baseline.
    spring, branch_spring : str
        Strain energies of the baseline, as for ``identify``.
    parameters : path or mapping, optional
        What is known of parameters, as for ``identify``, also of effects that may be found:
        ``{"linear_drag.drag_Pa_s": {"high": 50.0}}``.
    drive : str
        Voltage that drives the model: ``command`` or ``monitor``.
    rig_file : path or mapping, optional
        Film and load in place of those in the recordings, and the limits of a proposed experiment.
    thorough : bool
        Search without a computing budget; otherwise for about a minute.
    ended_early : str
        For recordings whose runs ended early: ``keep`` them, ``cut`` the end that may show a fault,
        or ``leave-out``.
    progress : callable, optional
        Called with a stage and the fraction of all the work that is done (0 to 1).

    Returns
    -------
    DiagnoseResult
        Verdict, effects with parameters, errors before and after, and a proposed experiment.

    Raises
    ------
    InputError
        If the recordings cannot be diagnosed.

    Examples
    --------
    >>> import dearig
    >>> found = dearig.diagnose("train.h5", validate="other.h5")
    >>> found.effects
    >>> found.to_html("report.html")
    """
    outcome = diagnose_recordings(
        _some(recordings),
        validation=_listed(validate),
        branches=branches,
        spring=spring,
        branch_spring=branch_spring,
        parameters=stated_in(parameters),
        drive=drive,
        rig_file=None if rig_file is None else load_rig(rig_file)[0],
        thorough=thorough,
        ended_early=ended_early,
        progress=progress,
    )
    return DiagnoseResult(outcome)
