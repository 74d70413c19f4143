"""Identification of a model from recordings."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dearig.acquisition.interrupts import Interrupts
from dearig.analysis.budget import given_values
from dearig.analysis.cores import for_simulations
from dearig.analysis.outcomes import (
    BranchTrial,
    Comparison,
    IdentifyOutcome,
    SpringCandidate,
    budget_table,
    covariance_table,
    estimate_table,
    pooled_noise,
    pooled_over_noise,
)
from dearig.analysis.readings.band import prediction_table, with_bands
from dearig.analysis.readings.compare import compare
from dearig.analysis.readings.compatibility import (
    assumed_by,
    base_model,
    check_apart,
    check_branches,
)
from dearig.analysis.readings.enough import few_data
from dearig.analysis.readings.opening import Source, check_named_once
from dearig.analysis.readings.record import Readings, noise_texts, read_all, recordings_of
from dearig.analysis.readings.room import room_texts
from dearig.analysis.thesis_runs import PUBLISHED_FIT
from dearig.config.modelfile import COVARIANCE, PREDICTION, ModelFile
from dearig.config.parameterfile import Stated, constraints_of
from dearig.config.rigfile import RigFile
from dearig.errors import InputError
from dearig.model.diagnosis.spring_choice import choose_springs
from dearig.model.effects import EffectValues
from dearig.model.errors import ModelError
from dearig.model.film.material import Network
from dearig.model.fitting import (
    Constraint,
    GivenValue,
    Identification,
    add_intervals,
    identify,
    with_budget,
)
from dearig.model.readings.records import Record
from dearig.model.springs import SPRINGS
from dearig.progress import Progress, quiet
from dearig.recording.reading.recording import Recording

__all__ = ["CHOOSE", "identify_recordings"]

#: In place of a strain energy: the most probable one.
CHOOSE = "choose"

_INTERRUPTED = (
    "interrupted: intervals that were not finished are from the curvature at the optimum, and "
    "uncertainties of given values may be left out"
)


@for_simulations()
def identify_recordings(
    train: Sequence[Source],
    *,
    validation: Sequence[Source] = (),
    method: str = "hybrid",
    branches: Sequence[int] = (3,),
    spring: str = "gent",
    branch_spring: str = "",
    effects: EffectValues = (),
    parameters: Stated | None = None,
    drive: str = "command",
    rest_length_mm: float | None = None,
    rig_file: RigFile | None = None,
    seed: int = 0,
    intervals: bool = True,
    ended_early: str = "keep",
    clock: Callable[[], float] = time.monotonic,
    progress: Progress = quiet,
) -> IdentifyOutcome:
    """Fit the model to the recordings ``train``.

    With several numbers of ``branches`` each is fitted, and the one with the lowest information
    criterion on the training data is kept; the ``validation`` recordings are read once, at the end,
    and play no part in the choice. Film and load come from the recordings, else from ``rig_file``.
    ``spring`` is the strain energy of the equilibrium spring; with ``choose`` each one is fitted
    with each number of branches, and the most probable on the training data is kept
    (``choose_springs``). ``branch_spring`` is that of the branches, "" for the usual one.
    ``effects`` are fitted too, from these values. ``parameters`` are what is stated of parameters
    (``dearig.config.parameterfile``); models with fewer branches leave out what they lack.
    ``ended_early`` is keep, cut or leave-out: what is done with recordings whose runs ended early.
    ``clock`` gives seconds. While intervals are computed, the first ctrl-C ends them and keeps the
    fit (``interrupted``); the second raises. Nothing is written; ``save_fitted_model`` writes the
    model. Raises ``InputError`` for everything that cannot be fitted.
    """
    check_named_once(train, validation)
    started = clock()
    given = given_values(rig_file, drive)
    fitted, left_out = read_all(train, drive, ended_early)
    others, also_left_out = read_all(validation, drive, ended_early)
    recordings = recordings_of(fitted)
    check_apart(recordings, recordings_of(others))
    records = [each.record for each in fitted]
    for count in branches:
        check_branches(count, least=0 if recordings[0].kind == "film" else 1)
    counts = sorted(set(branches))

    def base_of(count: int, spring: str) -> Any:
        base = base_model(recordings, count, spring, rest_length_mm, rig_file, branch_spring)
        try:
            return replace(base, effects=effects)
        except ModelError as error:
            raise InputError(f"these recordings cannot be fitted: {error}") from error

    springs: tuple[SpringCandidate, ...] = ()
    start: Network | None = None
    kinds = SPRINGS if spring == CHOOSE else (spring,)
    stated = constraints_of(parameters, [base_of(n, k) for n in counts for k in kinds])
    if spring == CHOOSE:
        springs, start = _spring_candidates(
            records, fitted, others, base_of, counts, stated, progress
        )
        spring, counts = springs[0].spring, [springs[0].branches]
    alone = len(counts) == 1

    fits = _fits(
        records, lambda n: base_of(n, spring), counts, method, seed, start, stated, progress
    )
    # one number of independent samples for all, from the fit with the least structured residual
    correlation = max(1.0, min(fit.correlation for fit in fits))
    scores = [_bic(fit, records, correlation) for fit in fits]
    best = int(np.argmin(scores))
    count, fit = counts[best], fits[best]
    trials: list[BranchTrial] = []
    if not alone:
        trials = [
            _trial(n, candidate, fitted, others, score, chosen=n == count)
            for n, candidate, score in zip(counts, fits, scores, strict=True)
        ]
    profiled = intervals and method == "hybrid"
    fit, interrupted = _with_uncertainties(records, fit, given, profiled, progress)
    compared = [compare(r, fit.model, "train") for r in fitted]
    title = recordings[0].title or recordings[0].name
    name = f"{title}, {count} branches" if count != 1 else f"{title}, 1 branch"
    covariance = covariance_table(fit.covariance_names, fit.covariance)
    model = ModelFile(name, fit.model, {COVARIANCE: covariance})
    validated = with_bands([compare(r, fit.model, "validation") for r in others], others, model)
    seconds, kind = clock() - started, recordings[0].kind
    history = _history(fit, recordings, compared, validated, spring, drive, seconds)
    model = replace(model, history=history)
    is_thesis_run = kind == "actuator" and any(c.row == "identification" for c in compared)
    return IdentifyOutcome(
        title=name,
        kind=kind,
        method=method,
        model=model,
        fit=fit,
        train=tuple(compared),
        validation=with_bands(validated, others, model),
        trials=tuple(trials),
        springs=springs,
        seconds=seconds,
        quality=(
            *left_out,
            *also_left_out,
            *_without_part(stated, fit),
            *([_INTERRUPTED] if interrupted else []),
            *noise_texts((*fitted, *others)),
            *room_texts(recordings_of((*fitted, *others))),
        ),
        few_data=few_data(fitted),
        assumed=assumed_by(recordings, rig_file),
        published_fit=PUBLISHED_FIT if is_thesis_run else None,
        interrupted=interrupted,
    )


def _with_uncertainties(
    records: Sequence[Record],
    fit: Identification,
    given: Sequence[GivenValue],
    profiled: bool,
    progress: Progress,
) -> tuple[Identification, bool]:
    """Return ``fit`` with intervals, if ``profiled``, and the budget of ``given`` values.

    The first ctrl-C leaves out what is not done; the second value says whether it came.
    """
    with Interrupts() as interrupts:
        stop = interrupts.asked
        if profiled:
            fit = add_intervals(records, fit, progress=progress, ended=stop)
        fit = with_budget(records, fit, given, progress=progress, stop=stop)
    return fit, interrupts.asked()


def _without_part(stated: Sequence[Constraint], fit: Identification) -> list[str]:
    """Return a sentence on each of ``stated`` whose parameter the fitted model lacks."""
    has = {e.name for e in fit.estimates}
    return [
        f"what is stated of {c.name} has no part: the model that was chosen lacks it"
        for c in stated
        if c.name not in has
    ]


def _spring_candidates(
    records: Sequence[Record],
    train: Sequence[Readings],
    others: Sequence[Readings],
    base_of: Callable[[int, str], Any],
    counts: Sequence[int],
    stated: Sequence[Constraint],
    progress: Progress,
) -> tuple[tuple[SpringCandidate, ...], Network]:
    """Return every strain energy with every number of branches, the most probable first.

    And the network of the most probable one, as it was fitted.
    ``others`` are read here too, but for each candidate's error alone.
    """
    kinds = [(kind, count) for kind in SPRINGS for count in counts]
    try:
        trials = choose_springs(
            records, [base_of(n, k) for k, n in kinds], progress=progress, constraints=stated
        )
    except ModelError as error:
        raise InputError(f"these recordings cannot be fitted: {error}") from error
    found: list[SpringCandidate] = []
    ranked = sorted(trials, key=lambda t: t.criterion)
    for trial in ranked:
        checked = [compare(r, trial.model, "validation") for r in others]
        fitted = [compare(r, trial.model, "train") for r in train]
        found.append(
            SpringCandidate(
                spring=trial.kind,
                branches=len(trial.model.network.branches),
                free=trial.free,
                criterion=trial.criterion,
                probability=trial.probability,
                train_rms=_pooled(fitted),
                left_out_rms=trial.left_out_rms,
                validation_rms=_pooled(checked) if checked else None,
                validation_peak_pct=_mean_peak(checked) if checked else None,
                chosen=not found,
            )
        )
    return tuple(found), ranked[0].model.network


def _fits(
    records: Sequence[Record],
    base_of: Callable[[int], Any],
    counts: Sequence[int],
    method: str,
    seed: int,
    smaller: Network | None,
    stated: Sequence[Constraint],
    progress: Progress,
) -> list[Identification]:
    """Return the fit for each number of branches in ``counts``, which rise.

    Each fit starts from the network of the one before too, the first from ``smaller``. ``base_of``
    gives the model to fit.
    """
    fits: list[Identification] = []
    for i, count in enumerate(counts):
        base = base_of(count)

        def report(stage: str, fraction: float, done: int = i) -> None:
            if len(counts) == 1:
                progress(stage, fraction)
            else:
                progress(f"{counts[done]} branches", (done + fraction) / len(counts))

        try:
            fit = identify(
                records, base, method, seed, False, smaller, progress=report, constraints=stated
            )
        except ModelError as error:
            raise InputError(f"these recordings cannot be fitted: {error}") from error
        smaller = fit.model.network
        fits.append(fit)
    return fits


def _bic(fit: Identification, records: Sequence[Record], correlation: float) -> float:
    """Return the Bayesian information criterion, for the number of independent residuals."""
    samples = sum(r.measured.size for r in records) / correlation
    free = sum(e.free for e in fit.estimates)
    misfit = samples * math.log(fit.cost) + fit.prior_chi2
    return float(misfit + free * math.log(max(samples, 2.0)))


def _trial(
    count: int,
    fit: Identification,
    train: Sequence[Readings],
    validation: Sequence[Readings],
    bic: float,
    chosen: bool,
) -> BranchTrial:
    fitted = [compare(r, fit.model, "train") for r in train]
    checked = [compare(r, fit.model, "validation") for r in validation]
    return BranchTrial(
        branches=count,
        train_rms=_pooled(fitted),
        train_peak_pct=_mean_peak(fitted),
        validation_rms=_pooled(checked) if checked else None,
        validation_peak_pct=_mean_peak(checked) if checked else None,
        bic=bic,
        chosen=chosen,
    )


def _pooled(comparisons: Sequence[Comparison]) -> float:
    """Return the RMS over all files, with equal weights."""
    return math.sqrt(float(np.mean([c.errors.rms**2 for c in comparisons])))


def _mean_peak(comparisons: Sequence[Comparison]) -> float:
    return float(np.mean([c.errors.peak_pct for c in comparisons]))


def _history(
    fit: Identification,
    recordings: Sequence[Recording],
    train: Sequence[Comparison],
    validation: Sequence[Comparison],
    spring: str,
    drive: str,
    seconds: float,
) -> dict[str, Any]:
    """Return the origin of the model, for its file."""
    over_noise = pooled_over_noise(train)
    unit, scale = ("um", 1e6) if train[0].kind == "actuator" else ("kPa", 1e-3)

    def figures(comparison: Comparison) -> dict[str, Any]:
        return {
            "name": comparison.name,
            f"rms_{unit}": comparison.errors.rms * scale,
            "nrmse_pct": comparison.errors.nrmse_pct,
        }

    return {
        "method": fit.method,
        "spring": spring,
        "drive": drive,
        "seconds": seconds,
        "simulations": fit.simulations,
        "mean_square_over_noise": None if over_noise is None else over_noise**2,
        "residual_correlation_samples": fit.correlation,
        "warnings": list(fit.warnings),
        "train": [
            {**figures(c), "sha256": r.sha256} for c, r in zip(train, recordings, strict=True)
        ],
        "validation": [figures(c) for c in validation],
        "estimate": estimate_table(fit.estimates),
        COVARIANCE: covariance_table(fit.covariance_names, fit.covariance),
        PREDICTION: prediction_table(train, validation, pooled_noise(train) or 0.0),
        "uncertainty_budget": budget_table(fit.budget),
    }
