"""Diagnosis: the effects that the model lacks, and the errors before and after."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from dearig.acquisition.interrupts import Interrupts
from dearig.acquisition.run import RunOptions, record
from dearig.analysis.budget import diagnosis_with_budget, given_values
from dearig.analysis.cores import for_simulations
from dearig.analysis.experiment import averaging, experiment_of, with_excitation
from dearig.analysis.outcomes import (
    Comparison,
    DiagnoseOutcome,
    Evaluation,
    SeparatingExperiment,
    budget_table,
    covariance_table,
    estimate_table,
    pooled_rms,
)
from dearig.analysis.readings.band import judged_with_bands, prediction_table
from dearig.analysis.readings.compare import compare
from dearig.analysis.readings.compatibility import (
    assumed_by,
    base_model,
    check_apart,
    check_branches,
)
from dearig.analysis.readings.enough import check_enough, extrapolated, few_data
from dearig.analysis.readings.events import (
    own_of_each,
    recurring_events,
    with_events,
    without_own,
)
from dearig.analysis.readings.opening import Source, check_named_once
from dearig.analysis.readings.record import Readings, noise_texts, read_all, recordings_of
from dearig.analysis.readings.room import air_texts_of, room_texts
from dearig.config.modelfile import COVARIANCE, HELD_VOLTAGE, PREDICTION, ModelFile
from dearig.config.parameterfile import Stated, constraints_of
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import load_sequence, parse_sequence
from dearig.errors import (
    DearigError,
    DiskFault,
    InputError,
    InstrumentFault,
    Interrupted,
    NotSafe,
    SafetyStop,
)
from dearig.model.diagnosis import diagnose
from dearig.model.diagnosis.events import OneTimeEvent, Own
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.errors import ModelError
from dearig.model.fitting import Constraint, GivenValue
from dearig.model.fitting.parameters import NORMAL_95
from dearig.model.fitting.prediction import prediction_gain
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip
from dearig.model.verdict import PARTLY_EXPLAINED, UNEXPLAINED
from dearig.progress import Progress, quiet
from dearig.recording.files import check_output
from dearig.recording.reading.recording import Recording
from dearig.units import SHOWN

__all__ = ["VALIDATION", "diagnose_recordings", "diagnose_rig"]

#: Validation runs that are recorded on a rig: one of each of the thesis's tables.
VALIDATION = ("validation-a-0.6", "validation-b-7.0")

_EARLY_ENDS = (Interrupted, SafetyStop, InstrumentFault, DiskFault)  # the rig is safe


def diagnose_recordings(
    train: Sequence[Source],
    *,
    validation: Sequence[Source] = (),
    branches: int = 3,
    spring: str = "gent",
    branch_spring: str = "",
    parameters: Stated | None = None,
    drive: str = "command",
    rig_file: RigFile | None = None,
    thorough: bool = False,
    ended_early: str = "keep",
    clock: Callable[[], float] = time.monotonic,
    progress: Progress = quiet,
) -> DiagnoseOutcome:
    """Find the effects that the thesis's model of ``train`` lacks.

    The ``validation`` recordings are read last: of them the search uses the readings before the
    voltage alone, which tell the sensor's noise. ``progress`` receives the fraction of the whole
    work. ``spring`` and ``branch_spring`` are the strain energies of the baseline. ``parameters``
    are what is stated of parameters, of springs and of effects
    (``dearig.config.parameterfile``). ``ended_early`` is keep, cut or leave-out: what is done with
    recordings whose runs ended early. A search that is not ``thorough`` ends after about a minute.
    The first ctrl-C ends it and keeps what was found (``finding.interrupted``); the second raises.
    Nothing is written; ``save_fitted_model`` writes the improved model. Raises
    ``InputError`` for recordings that cannot be diagnosed.
    """
    started = clock()
    check_named_once(train, validation)
    settings = _Settings(
        branches, spring, branch_spring, drive, rig_file, thorough, ended_early, parameters
    )  # fmt: skip
    fitted, left_out = settings.read(train)
    others, also_left_out = settings.read(validation)
    base, quality = _prepared(fitted, others, settings)
    finding = _search(fitted, others, base, settings, progress)
    finding = _budgeted(finding, fitted, settings, progress)
    said = (*left_out, *also_left_out, *quality)
    with Interrupts():  # what the search has found is not lost in the seconds after it
        return _outcome(fitted, others, finding, said, settings, "", started, clock)


def diagnose_rig(
    address: str,
    out: Path,
    *,
    experiments: int = 1,
    train: Sequence[Source] = (),
    validation: Sequence[Source] = (),
    branches: int = 3,
    spring: str = "gent",
    branch_spring: str = "",
    parameters: Stated | None = None,
    drive: str = "command",
    rig_file: RigFile | None = None,
    configuration: str = "",
    seed: int = 0,
    thorough: bool = False,
    ended_early: str = "keep",
    overwrite: bool = False,
    clock: Callable[[], float] = time.monotonic,
    progress: Progress = quiet,
) -> DiagnoseOutcome:
    """Diagnose the rig at ``address``: record, diagnose, run a separating experiment, repeat.

    The first recording is the thesis's (unless ``train`` are given), then come at most
    ``experiments`` more, for as long as rivals are left; at the end ``VALIDATION`` are recorded
    (unless ``validation`` are given) and read once. All recordings go to the folder ``out``.
    ``seed`` is of a simulated rig's noise, ``parameters``, ``thorough`` and ``ended_early`` as of
    ``diagnose_recordings``. When ctrl-C, an interlock, an instrument or the disk ends a run, the
    rig is safe and no more is recorded: the results until then are kept, and ``ended`` of the
    outcome says why. Raises the error that ends the first run, and ``NotSafe`` at once.
    """
    started = clock()
    check_named_once(train, validation)
    settings = _Settings(
        branches, spring, branch_spring, drive, rig_file, thorough, ended_early, parameters
    )  # fmt: skip
    names = [*([] if train else ["thesis"]), *(_experiment_name(n) for n in range(experiments))]
    planned = [*names, *([] if validation else VALIDATION)]
    for name in planned:
        check_output(out / f"{name}.h5", overwrite)
    # a diagnosis counts two parts of the progress, all recordings together one
    parts = _Parts(progress, total=2.0 * (1 + experiments) + 1.0)
    recorder = _Recorder(
        address, out, settings.rig, RunOptions(configuration, seed=seed, overwrite=overwrite),
        parts, runs=len(planned),
    )  # fmt: skip
    files: list[Source] = [*train]
    if not files:
        recorder.run("thesis")
        files += recorder.made
    fitted, finding, performed, ended = _search_and_separate(files, experiments, settings, recorder)
    others: list[Readings] = []
    if validation:
        others, _ = settings.read(validation)
    elif not (ended or finding.interrupted):
        recorded = len(recorder.made)
        ended = recorder.run_until_ended(*VALIDATION)
        others, _ = read_all(recorder.made[recorded:], settings.drive)
    if ended is not None:
        stopped = finding.interrupted or isinstance(ended, Interrupted)
        notes = (*finding.notes, f"Recording ended before all runs were made: {ended}")
        finding = replace(finding, interrupted=stopped, notes=notes)
    _, quality = _prepared(fitted, others, settings)
    finding = _budgeted(finding, fitted, settings, progress)
    with Interrupts():
        outcome = _outcome(
            fitted, others, finding, quality, settings, address, started, clock, performed
        )
    return replace(outcome, ended=ended)


@dataclass(frozen=True)
class _Settings:
    """Settings of a diagnosis, as of ``diagnose_recordings``."""

    branches: int
    spring: str
    branch_spring: str
    drive: str
    rig_file: RigFile | None
    thorough: bool
    ended_early: str
    parameters: Stated | None

    def constraints(self, base: Actuator | Strip) -> tuple[Constraint, ...]:
        """Return what is stated of the parameters of ``base`` and of the effects it may lack."""
        return constraints_of(self.parameters, [base], with_effects=True)

    @property
    def rig(self) -> RigFile:
        """The rig file, or the thesis's rig."""
        return self.rig_file or RigFile()

    @property
    def given(self) -> list[GivenValue]:
        """The values that are given, whose uncertainties the rig file states."""
        return given_values(self.rig_file, self.drive)

    def read(self, sources: Sequence[Source | Readings]) -> tuple[list[Readings], list[str]]:
        """Return the readings of ``sources`` to use, and a sentence on each that is left out."""
        return read_all(sources, self.drive, self.ended_early)


# ---------------------------------------------------------------- on a rig


class _Parts:
    """Progress of work in consecutive parts, whose sizes add up to ``total``."""

    def __init__(self, progress: Progress, total: float) -> None:
        self.progress = progress
        self.total = total
        self.done = 0.0

    def part(self, size: float) -> Progress:
        """Return the progress of the next part."""
        first = self.done
        self.done += size
        return lambda stage, fraction: self.progress(stage, (first + size * fraction) / self.total)


@dataclass
class _Recorder:
    """Runs on the rig at ``address``, each recorded to a file in the folder ``out``.

    ``runs`` is the number of runs that count one part of the progress together. ``made`` lists the
    files of complete runs.
    """

    address: str
    out: Path
    rig_file: RigFile
    options: RunOptions
    parts: _Parts
    runs: int
    made: list[Path] = field(default_factory=list)

    def run(self, name: str, proposed: SeparatingExperiment | None = None) -> None:
        """Record the preset ``name``, or what is ``proposed`` under that name."""
        path, rig_file, loaded = self.out / f"{name}.h5", self.rig_file, None
        if proposed is not None:
            rig_file = averaging(rig_file, proposed.average)
            loaded = parse_sequence(proposed.sequence, name, Path())
        report = self.parts.part(1.0 / self.runs)
        # each run has its own seed, so that its noise is independent of the others'
        options = replace(self.options, seed=self.options.seed * 1000 + len(self.made))
        record(
            loaded or load_sequence(name), self.address, rig_file, path, options,
            progress=lambda _, fraction: report(f"recording {name}", fraction),
        )  # fmt: skip
        self.made.append(path)

    def run_until_ended(
        self, *names: str, proposed: SeparatingExperiment | None = None
    ) -> DearigError | None:
        """Record each of ``names`` as ``run`` does; return the error that ended one early."""
        try:
            for name in names:
                self.run(name, proposed)
        except NotSafe:
            raise
        except _EARLY_ENDS as error:
            return error  # the rig is safe, and the results until here hold
        return None


def _experiment_name(index: int) -> str:
    return f"experiment-{index + 1}"


def _search_and_separate(
    files: Sequence[Source], experiments: int, settings: _Settings, recorder: _Recorder
) -> tuple[list[Readings], Diagnosis, list[str], DearigError | None]:
    """Search, and while rivals are left, record a separating experiment and search again.

    Returns the readings of the last search, its result, a sentence on each experiment, and the
    error that ended an experiment early.
    """
    readings, _ = settings.read(files)
    performed: list[str] = []
    while True:
        base, _ = _prepared(readings, [], settings)
        finding = _search(readings, [], base, settings, recorder.parts.part(2.0))
        if finding.interrupted or len(performed) >= experiments:
            return readings, finding, performed, None
        noise = _noise(readings)
        left = finding.verdict in (PARTLY_EXPLAINED, UNEXPLAINED)
        experiment, words = experiment_of(finding, noise, settings.rig, left, readings)
        if experiment is None:
            return readings, finding, performed, None
        name = _experiment_name(len(performed))
        ended = recorder.run_until_ended(name, proposed=experiment)
        if ended is not None:
            return readings, finding, performed, ended
        readings, _ = settings.read([*readings, recorder.made[-1]])
        performed.append(f"{words}. It was run, and its recording, {name}.h5, was added.")


# ---------------------------------------------------------------- before


def _prepared(
    fitted: Sequence[Readings], others: Sequence[Readings], settings: _Settings
) -> tuple[Any, tuple[str, ...]]:
    """Return the baseline to fit, and sentences on the readings. Raises ``InputError``."""
    check_branches(settings.branches)
    _ = settings.given  # refused before the search, not after it
    recordings, every = recordings_of(fitted), (*fitted, *others)
    check_apart(recordings, recordings_of(others))
    base = base_model(
        recordings, settings.branches, settings.spring, None, settings.rig_file,
        settings.branch_spring,
    )  # fmt: skip
    settings.constraints(base)  # refused before the search
    for readings in fitted:
        readings.check_driven()
    said = [f"{each.name}: {sentence}" for each in every for sentence in each.quality.findings]
    said += noise_texts(every)
    said += room_texts(recordings_of(every))
    said += air_texts_of(recordings)
    said += extrapolated(fitted, others)
    films = sorted({r.film_id for r in recordings_of(every) if r.film_id})
    if len(films) > 1:
        said.append(f"the recordings name different films: {', '.join(films)}")
    check_enough(fitted)
    return base, tuple(said)


# ---------------------------------------------------------------- the search, and after


@for_simulations()
def _search(
    fitted: Sequence[Readings],
    others: Sequence[Readings],
    base: Any,
    settings: _Settings,
    progress: Progress,
) -> Diagnosis:
    records, rest = ([each.record for each in some] for some in (fitted, others))
    try:
        with Interrupts() as interrupts:
            return diagnose(
                records,
                base,
                progress=progress,
                stop=interrupts.asked,
                thorough=settings.thorough,
                others=rest,
                constraints=settings.constraints(base),
            )
    except ModelError as error:
        raise InputError(f"these recordings cannot be diagnosed: {error}") from error


@for_simulations()
def _budgeted(
    finding: Diagnosis, fitted: Sequence[Readings], settings: _Settings, progress: Progress
) -> Diagnosis:
    """Return ``finding`` with the uncertainties of given values, but for the operator's stop."""
    records = [(each.held() if finding.held else each).record for each in fitted]
    with Interrupts() as interrupts:
        return diagnosis_with_budget(
            finding, records, settings.given, progress, interrupts.asked,
            settings.constraints(finding.baseline.model),
        )  # fmt: skip


def _outcome(
    fitted: Sequence[Readings],
    others: Sequence[Readings],
    finding: Diagnosis,
    quality: tuple[str, ...],
    settings: _Settings,
    rig: str,
    started: float,
    clock: Callable[[], float],
    performed: Sequence[str] = (),
) -> DiagnoseOutcome:
    if finding.held:
        fitted, others = ([each.held() for each in some] for some in (fitted, others))
    failed: list[str] = []
    finding, stands, own, recurring = _evaluated(fitted, others, finding, failed)
    noise = _noise(fitted)
    stands = (*stands[:-1], judged_with_bands(stands[-1], others, finding.final, {}))
    seconds = clock() - started
    said = (*quality, *dict.fromkeys(failed))
    recordings = recordings_of(fitted)
    title = _title(recordings)
    effects = ", ".join(name for name, _ in finding.final.predicting.effects)
    name = f"{title}, with {effects}" if effects else f"{title}, nothing added"
    compared = {c.name for c in stands[-1].validation}
    may_recur = bool(recurring) or any(s.may_recur for s in finding.steps)
    outcome = DiagnoseOutcome(
        title=title,
        kind=recordings[0].kind,
        drive=settings.drive,
        model=ModelFile(name, finding.final.predicting),
        finding=finding,
        stands=stands,
        noise=noise,
        experiment=None,
        experiment_text=(
            "No experiment is proposed: the recordings are of films, which no voltage sequence "
            "drives."
        ),
        quality=said,
        seconds=seconds,
        performed=tuple(performed),
        rig=rig,
        few_data=few_data(fitted),
        assumed=assumed_by(recordings, settings.rig_file),
        not_compared=tuple(r.name for r in others if r.name not in compared),
        prediction_errors=tuple(
            NORMAL_95 * c.band.parameters_rms for c in stands[-1].validation if c.band is not None
        ),
        # what happened in the training recordings alone is for no other recording to confirm
        gain=_gain(stands, own, noise) if may_recur else None,
        recurring=recurring,
    )
    outcome = with_excitation(outcome, settings.rig)
    if outcome.kind == "actuator":
        experiment, words = experiment_of(finding, noise, settings.rig, outcome.is_rejected, fitted)
        outcome = replace(outcome, experiment=experiment, experiment_text=words)
    if not outcome.recommends_final:
        plain = ModelFile(f"{title}, nothing added", finding.baseline.predicting)
        outcome = replace(outcome, model=plain)
    history = _history(outcome, recordings)
    place = -1 if outcome.recommends_final else 0
    stage = finding.final if outcome.recommends_final else finding.baseline
    judged = list(outcome.stands)
    judged[place] = judged_with_bands(judged[place], others, stage, history)
    model = replace(outcome.model, history=history)
    return replace(outcome, model=model, stands=tuple(judged))


def _evaluated(
    fitted: Sequence[Readings], others: Sequence[Readings], finding: Diagnosis, failed: list[str]
) -> tuple[Diagnosis, tuple[Evaluation, ...], dict[str, Own | None], tuple[OneTimeEvent, ...]]:
    """Return each model on all recordings, what is the own of each, and what comes with each run.

    With the finding, whose final model predicts with what comes with each run. ``failed`` receives
    sentences on models that cannot follow a recording.
    """
    models = [finding.baseline, *(s.stage for s in finding.steps[:-1]), finding.final]
    stands = tuple(
        Evaluation(
            tuple(name for name, _ in stage.model.effects),
            _compared(fitted, stage.of_each(len(fitted)), "train", failed),
            _compared(others, [stage.predicting] * len(others), "validation", failed),
        )
        for stage in models
    )
    found = models[-1].predicting
    # that the reading drifts is for the training recordings to show: alone in another one, what is
    # slow may be a law that they do not show
    drifts = any(step.family == "drift" for step in finding.steps)
    own = own_of_each((*fitted, *others), found, drifts)
    recurring = recurring_events(own, finding)
    if recurring:
        finding = replace(finding, final=with_events(finding.final, recurring))
        models[-1], found = finding.final, finding.final.predicting
        again = _compared(others, [found] * len(others), "validation", failed)
        stands = (*stands[:-1], replace(stands[-1], validation=again))
        own = own_of_each((*fitted, *others), found, drifts)
    stands = tuple(
        without_own(stand, own) if stage.predicting == found else stand
        for stand, stage in zip(stands, models, strict=True)
    )
    return finding, stands, own, recurring


def _title(recordings: Sequence[Recording]) -> str:
    titles = list(dict.fromkeys(r.title or r.name for r in recordings))
    return ", ".join(titles) if len(titles) <= 3 else f"{titles[0]} and {len(titles) - 1} more"


def _compared(
    readings: Sequence[Readings], models: Sequence[Any], role: str, failed: list[str]
) -> tuple[Comparison, ...]:
    found = []
    for each, model in zip(readings, models, strict=True):
        try:
            found.append(compare(each, model, role))
        except InputError as error:
            # a long search must not be lost because a model cannot follow one drive
            failed.append(f"{each.name} is left out of the {role} errors: {error}")
    return tuple(found)


def _gain(stands: Sequence[Evaluation], own: dict[str, Own | None], noise: float) -> float | None:
    """Return twice the log of the odds that validation gives to the final model, over the first.

    None where nothing validates it, minus infinity where it cannot follow what the first one can.
    """
    last = {c.name: c for c in stands[-1].validation}
    first = stands[0].validation
    if any(c.name not in last for c in first):
        return -math.inf
    gains = []
    for one in first:
        two, found = last[one.name], own.get(one.name)
        alone = found.signal if found is not None and found.signal.size == one.time.size else 0.0
        gains.append(
            prediction_gain(
                one.measured - one.model - alone,
                two.measured - two.model - alone,
                one.noise or noise,
            )
        )
    return sum(gains) if gains else None


def _noise(readings: Sequence[Readings]) -> float:
    """Return the noise of the training recordings, RMS over all samples, m or Pa."""
    records = [each.record for each in readings]
    samples = sum(r.measured.size for r in records)
    return math.sqrt(sum(r.noise**2 * r.measured.size for r in records) / samples)


def _history(outcome: DiagnoseOutcome, recordings: Sequence[Recording]) -> dict[str, Any]:
    """Return the origin of the model, for its file."""
    finding, stands = outcome.finding, outcome.stands
    stage = finding.final if outcome.recommends_final else finding.baseline
    judged = stands[-1] if outcome.recommends_final else stands[0]
    shown = SHOWN[outcome.kind]

    def rms(comparisons: Sequence[Comparison]) -> float | None:
        return pooled_rms(comparisons) * shown.error_factor if comparisons else None

    def errors(stand: Evaluation) -> dict[str, Any]:
        return {
            f"train_rms_{shown.suffix}": rms(stand.train),
            f"validation_rms_{shown.suffix}": rms(stand.validation),
        }

    return {
        "method": "diagnosis",
        "drive": outcome.drive,
        "seconds": outcome.seconds,
        "simulations": finding.simulations,
        "verdict": outcome.verdict,
        "status": outcome.status,
        "interrupted": finding.interrupted,
        HELD_VOLTAGE: finding.held,
        "recommended": "final" if outcome.recommends_final else "baseline",
        "mean_square_over_noise": stage.cost,
        f"noise_floor_{shown.suffix}": outcome.noise * shown.error_factor,
        "notes": [*finding.notes, *outcome.quality],
        "before": errors(stands[0]),
        "after": errors(stands[-1]),
        "train": [{"name": r.name, "sha256": r.sha256} for r in recordings],
        "validation": [{"name": c.name} for c in stands[-1].validation],
        "step": [
            {
                "effect": s.effect,
                "family": s.family,
                "acts_on": s.acts_on,
                "indistinguishable_from": list(s.indistinguishable_from),
                "evidence": list(s.evidence),
            }
            for s in (finding.steps if outcome.recommends_final else ())
        ],
        "estimate": estimate_table(stage.estimates),
        COVARIANCE: covariance_table(stage.covariance_names, stage.covariance),
        PREDICTION: prediction_table(judged.train, judged.validation, outcome.noise),
        "uncertainty_budget": budget_table(stage.budget),
    }
