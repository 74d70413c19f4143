"""Identification of a model from recordings, into a model file."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import InputError
from app.modelfile import save_model
from app.outcomes import BranchTrial, Comparison, IdentifyOutcome
from app.progress import Progress, quiet
from app.recording.files import check_output
from app.recording.recording import Recording
from app.records import PUBLISHED_FIT, as_record, compare, open_all
from app.rigfile import RigFile
from model.actuator import Actuator
from model.errors import ModelError
from model.fitting import Identification, add_intervals, identify
from model.material import Branch, Film, Load, Network, Spring
from model.records import Record

__all__ = ["BRANCHES_MAX", "identify_recordings"]

#: Maxwell branches of a model, at most: no data of this kind determine more.
BRANCHES_MAX = 8


def identify_recordings(
    train: Sequence[str | Path],
    out: str | Path,
    *,
    validation: Sequence[str | Path] = (),
    method: str = "hybrid",
    branches: Sequence[int] = (3,),
    spring: str = "gent",
    drive: str = "command",
    rest_length_mm: float | None = None,
    rig_file: RigFile | None = None,
    seed: int = 0,
    intervals: bool = True,
    overwrite: bool = False,
    clock: Callable[[], float],
    progress: Progress = quiet,
) -> IdentifyOutcome:
    """Fit the recordings ``train`` and write the model to ``out``.

    With several numbers of ``branches`` each is fitted, and the one with the least information
    criterion on the training data is kept; the ``validation`` recordings are read once, at the end,
    and play no part in the choice. Film and load come from the recordings, else from ``rig_file``.
    ``clock`` gives seconds. Raises ``InputError`` for everything that cannot be fitted, before
    anything is written.
    """
    check_output(out, overwrite, *train, *validation)
    for path in validation:
        if any(Path(path).resolve() == Path(t).resolve() for t in train):
            raise InputError(
                f"{path} is given both to fit and to validate: an error on fitted data proves "
                f"nothing; leave it out of one of them"
            )
    started = clock()
    recordings = open_all(train)
    others = open_all(validation)
    _check_apart(recordings, others)
    records = [as_record(r, drive) for r in recordings]
    kind = recordings[0].kind
    kinematics = recordings[0].kinematics
    for count in branches:
        if not 1 <= count <= BRANCHES_MAX:
            raise InputError(
                f"{count} branches cannot be fitted; give a number from 1 to {BRANCHES_MAX}"
            )
    counts = sorted(set(branches))
    alone = len(counts) == 1
    fits: list[Identification] = []
    smaller: Network | None = None
    for i, count in enumerate(counts):
        base = _base(recordings, count, spring, rest_length_mm, rig_file)

        def report(stage: str, fraction: float, done: int = i) -> None:
            if alone:
                progress(stage, fraction)
            else:
                progress(f"{counts[done]} branches", (done + fraction) / len(counts))

        try:
            fit = identify(
                records, base, method, kinematics, seed, intervals and alone, smaller,
                progress=report,
            )  # fmt: skip
        except ModelError as error:
            raise InputError(f"these recordings cannot be fitted: {error}") from error
        smaller = fit.model.network if isinstance(fit.model, Actuator) else fit.model
        fits.append(fit)
    # one count of independent samples for all, from the fit that left the least structure behind
    correlation = max(1.0, min(fit.correlation for fit in fits))
    scores = [_bic(fit, records, correlation) for fit in fits]
    best = int(np.argmin(scores))
    count, fit = counts[best], fits[best]
    trials: list[BranchTrial] = []
    if not alone:
        trials = [
            _trial(n, candidate, recordings, others, kinematics, drive, score, chosen=n == count)
            for n, candidate, score in zip(counts, fits, scores, strict=True)
        ]
        if intervals and method == "hybrid":
            fit = add_intervals(records, fit, kinematics, progress=progress)
    compared = [compare(r, fit.model, kinematics, "train", drive) for r in recordings]
    validated = [compare(r, fit.model, kinematics, "validation", drive) for r in others]
    seconds = clock() - started
    title = recordings[0].title or recordings[0].name
    name = f"{title}, {count} branches" if count != 1 else f"{title}, 1 branch"
    history = _history(fit, recordings, compared, validated, spring, drive, seconds)
    path = save_model(out, name, fit.model, kinematics, history, overwrite)
    is_thesis_run = kind == "actuator" and any(c.row == "identification" for c in compared)
    return IdentifyOutcome(
        title=name,
        kind=kind,
        method=method,
        fit=fit,
        train=tuple(compared),
        validation=tuple(validated),
        trials=tuple(trials),
        model_path=str(path),
        seconds=seconds,
        published_fit=PUBLISHED_FIT if is_thesis_run else None,
    )


def _base(
    recordings: Sequence[Recording],
    branches: int,
    spring: str,
    rest_length_mm: float | None,
    rig_file: RigFile | None,
) -> Actuator | Network:
    """What to fit: its structure matters, its numbers do not."""
    limit = {"neo-hookean": math.inf, "gent": 1e4, "arruda-boyce": 1e4}.get(spring)
    if limit is None:
        raise InputError(f"spring {spring!r} is not one of neo-hookean, gent, arruda-boyce")
    one = Spring(1e5, limit, spring)
    network = Network(one, tuple(Branch(one, 1.0) for _ in range(branches)))
    if recordings[0].kind == "film":
        held = {r.kinematics for r in recordings}
        if len(held) > 1:
            raise InputError(
                f"films held in different ways ({', '.join(sorted(held))}) are fitted one by one"
            )
        if rest_length_mm is not None:
            raise InputError("a rest length is of an actuator; these recordings are of films")
        return network
    films = {r.film for r in recordings if r.film is not None}
    loads = {r.load for r in recordings if r.load is not None}
    if len(films) > 1 or len(loads) > 1:
        raise InputError(_differing(recordings))
    default = rig_file or RigFile()
    film = films.pop() if films and rig_file is None else default.as_film()
    load = loads.pop() if loads and rig_file is None else default.as_load()
    if rest_length_mm is not None:
        # not (>), so that NaN is refused too
        if not film.length * 1e3 < rest_length_mm < 1e4:
            raise InputError(
                f"a rest length of {rest_length_mm:g} mm is not above the film's own "
                f"{film.length * 1e3:g} mm, or beyond 10 m: under its load the film is longer than "
                f"before"
            )
        try:
            load = Load(load.mass, rest_length_mm / 1e3)
        except ModelError as error:
            raise InputError(f"a rest length of {rest_length_mm:g} mm: {error}") from error
    return Actuator(film, load, network)


def _check_apart(train: Sequence[Recording], validation: Sequence[Recording]) -> None:
    """Refuse data that would be both fitted and validated, and kinds that do not go together."""
    fitted = {r.sha256: r.path for r in train}
    for recording in validation:
        if recording.sha256 in fitted:
            raise InputError(
                f"{recording.path}, to validate, is a copy of {fitted[recording.sha256]}, to fit: "
                f"an error on fitted data proves nothing; leave it out of one of them"
            )
        if recording.kind != train[0].kind:
            raise InputError(
                f"{recording.path}, to validate, is of kind {recording.kind}, and "
                f"{train[0].path}, to fit, of kind {train[0].kind}: give data of one kind"
            )


def _differing(recordings: Sequence[Recording]) -> str:
    """Which two recordings are not of one film and load."""
    first = next(r for r in recordings if r.film is not None or r.load is not None)
    for other in recordings:
        for what, one, two in (
            ("films", first.film, other.film),
            ("loads", first.load, other.load),
        ):
            if one is not None and two is not None and one != two:
                return (
                    f"{first.path} and {other.path} are of different {what} "
                    f"({_apart(one, two)}, in SI units); fit them one by "
                    f"one, or say with --rig-file what holds for all"
                )
    return "these recordings are of different films or loads; fit them one by one"


def _apart(one: Film | Load, two: Film | Load) -> str:
    """The numbers in which two films or two loads differ."""
    pairs = ((f.name, getattr(one, f.name), getattr(two, f.name)) for f in fields(one))
    return ", ".join(f"{name.replace('_', ' ')} {a} and {b}" for name, a, b in pairs if a != b)


def _bic(fit: Identification, records: Sequence[Record], correlation: float) -> float:
    """Bayesian information criterion that counts correlated residuals as what they are worth."""
    samples = sum(r.measured.size for r in records) / correlation
    free = sum(e.free for e in fit.estimates)
    return float(samples * math.log(fit.cost) + free * math.log(max(samples, 2.0)))


def _trial(
    count: int,
    fit: Identification,
    train: Sequence[Recording],
    validation: Sequence[Recording],
    kinematics: str,
    drive: str,
    bic: float,
    chosen: bool,
) -> BranchTrial:
    fitted = [compare(r, fit.model, kinematics, "train", drive) for r in train]
    checked = [compare(r, fit.model, kinematics, "validation", drive) for r in validation]
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
    """RMS over all files, each file counting the same."""
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
    """Where the model comes from, for its file."""
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
        "mean_square_over_noise": fit.cost,
        "residual_correlation_samples": fit.correlation,
        "warnings": list(fit.warnings),
        "train": [
            {**figures(c), "sha256": r.sha256} for c, r in zip(train, recordings, strict=True)
        ],
        "validation": [figures(c) for c in validation],
        "estimate": [
            {
                "name": e.name,
                "unit": e.unit,
                "value": e.value,
                "low95": e.low if e.low > 0.0 else None,
                "high95": e.high if math.isfinite(e.high) else None,
                "determined": e.determined,
                "note": e.note,
            }
            for e in fit.estimates
        ],
    }
