"""Results of identification, validation and diagnosis, for terminal, JSON and report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from dearig.errors import DearigError
from dearig.model.readings.noise import LEAD_IN, slow_at_rest
from dearig.model.verdict import (
    NOT_CONFIRMED,
    NOTHING_MISSING,
    PARTLY_EXPLAINED,
    STOPPED,
    TOLERANCE,
    UNEXPLAINED,
    Judgement,
    judge,
)

if TYPE_CHECKING:
    # these import SciPy, which commands that fit nothing do without
    from dearig.analysis.readings.band import PredictionBand
    from dearig.config.modelfile import ModelFile
    from dearig.model.diagnosis.events import OneTimeEvent
    from dearig.model.diagnosis.excitation import Excitation, Tested
    from dearig.model.diagnosis.results import Diagnosis
    from dearig.model.fitting import Constraint, Contribution, Estimate, Identification
    from dearig.model.fitting.channels import ChannelCurve, ChannelResult
    from dearig.model.readings.measures import Errors
    from dearig.recording.reading.early_end import EarlyEnd
    from dearig.recording.reading.origin import Origin

__all__ = [
    "BranchTrial",
    "Comparison",
    "DeterminingRecord",
    "DiagnoseOutcome",
    "Evaluation",
    "IdentifyOutcome",
    "Published",
    "SeparatingExperiment",
    "SpringCandidate",
    "ValidateOutcome",
    "budget_table",
    "constraint_table",
    "covariance_table",
    "estimate_table",
    "noise_from",
    "pooled_noise",
    "pooled_over_noise",
    "pooled_rms",
    "pooled_steady_rms",
    "save_fitted_model",
]


@dataclass(frozen=True)
class Published:
    """The thesis's own figures for one run, in per cent as printed."""

    e_rms_pct: float
    e_m_pct: float


@dataclass(frozen=True)
class Comparison:
    """One recording with a model's prediction of it.

    ``kind`` is actuator (``drive`` in V, ``measured`` and ``model`` in m) or film (``drive`` is the
    stretch, the others in Pa); all arrays are (N,) on ``time`` s, ``measured`` is NaN where a
    reading must not be used. ``noise`` is the noise floor in
    the measured unit, None where it could not be read. ``role`` is train or validation. ``table``
    is A, B, or "" for a run that is in neither of the thesis's validation tables, ``row`` its label
    there (f = 0.2 Hz). ``noise_source`` is where the noise is from, as in
    ``dearig.model.readings.noise``. ``rms_without_events`` is the error in the measured unit
    without the recording's own drift and ``events``, None where it has none of these. ``ended``
    says how the run ended if it ended early. ``quiet_count`` are the readings at rest that
    ``noise`` is from. ``origin`` says where the recording is from, None where it is not known.
    ``step`` is the converter step of ``measured``, 0.0 where it is not known; each reading is the
    mean of ``average`` conversions. ``channels`` are the electrical channels, with what the plain
    circuit and the model leave of them; ``curves`` are those that are used, over time. ``band`` is
    that of the prediction; None where the model has none.
    """

    name: str
    kind: str
    role: str
    time: np.ndarray
    drive: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    errors: Errors
    noise: float | None
    noise_source: str = LEAD_IN
    table: str = ""
    row: str = ""
    published: Published | None = None
    warnings: tuple[str, ...] = field(default=())
    rms_without_events: float | None = None
    events: tuple[OneTimeEvent, ...] = ()
    ended: EarlyEnd | None = None
    quiet_count: int = 0
    origin: Origin | None = None
    step: float = 0.0
    average: int = 1
    channels: tuple[ChannelResult, ...] = ()
    curves: tuple[ChannelCurve, ...] = ()
    band: PredictionBand | None = None

    @property
    def is_simulated(self) -> bool:
        """True if the recording is known to be from a simulated rig, or from a model."""
        return self.origin is not None and self.origin.simulated is True

    @property
    def marked_name(self) -> str:
        """The name, marked with how the run ended if it ended early."""
        return self.marked(self.name)

    def marked(self, name: str) -> str:
        """Return another ``name`` of the recording with the same mark."""
        return name if self.ended is None else f"{name} ({self.ended.mark})"

    @property
    def moves_at_rest(self) -> bool:
        """Whether the readings at rest are more of a slow motion than of noise."""
        if self.kind == "film" or self.noise is None or not self.quiet_count:
            return False
        time, rest = self.time[: self.quiet_count], self.measured[: self.quiet_count]
        good = np.isfinite(rest)
        return slow_at_rest(time[good], rest[good], self.noise) > 0.0

    @cached_property
    def misfit_p(self) -> float | None:
        """The probability that noise as that at rest leaves this residual, or None.

        Of an actuator with enough readings at rest, as ``dearig.model.fitting.rejection`` has it.
        """
        if self.kind == "film" or not self.quiet_count:
            return None
        from dearig.model.fitting.rejection import misfit_p

        return misfit_p(
            self.measured - self.model,
            self.measured[: self.quiet_count],
            averaged=self.average > 1,
        )

    @property
    def steady_rms(self) -> float:
        """The error in the measured unit, without the recording's own drift and events."""
        return self.errors.rms if self.rms_without_events is None else self.rms_without_events

    def over_noise(self, noise: float) -> float:
        """Return the error, without events where they are known, over the recording's noise.

        ``noise`` is that of the training recordings. It counts where the recording's own is not
        known, from no lead-in, or smaller. The upper bound of the noise is taken (two standard
        deviations of a standard deviation from ``quiet_count`` readings): 200 readings give it
        within 10 % only. A film's noise includes the error that its model is allowed.
        """
        error = self.steady_rms
        allowed = 0.0
        if self.kind == "film":
            from dearig.model.diagnosis.preparation import FILM_MODEL_ERROR

            allowed = FILM_MODEL_ERROR * float(np.nanmax(np.abs(self.measured)))
        bound = 1.0 + 2.0 / math.sqrt(2.0 * self.quiet_count) if self.quiet_count else 1.0
        # second differences count fast motion as noise
        own = self.noise if self.noise_source == LEAD_IN or self.kind == "film" else None
        return error / math.hypot(bound * max(own or 0.0, noise), allowed)


@dataclass(frozen=True)
class BranchTrial:
    """What one number of branches did: errors (Pa or m, and per cent of peak) pooled over files.

    ``bic`` is the information criterion on the training data, by which the number is chosen;
    validation plays no part in that choice.
    """

    branches: int
    train_rms: float
    train_peak_pct: float
    validation_rms: float | None
    validation_peak_pct: float | None
    bic: float
    chosen: bool


@dataclass(frozen=True)
class SpringCandidate:
    """One strain energy with one number of branches: evidence on the training data, and errors.

    ``criterion`` is minus twice the logarithm of the evidence, above the least of all candidates;
    the probabilities of all add up to 1. Errors are RMS in Pa or m: of the fit, of each tenth of
    the training data predicted by a fit to the others, and of the validation data, which have no
    part in the choice.
    """

    spring: str
    branches: int
    free: int
    criterion: float
    probability: float
    train_rms: float
    left_out_rms: float
    validation_rms: float | None
    validation_peak_pct: float | None
    chosen: bool


@dataclass(frozen=True)
class IdentifyOutcome:
    """A finished identification: fit, training runs, and validation runs if any.

    ``model`` is the fitted model with its history; ``model_path`` is where it was saved, "" if it
    was not. ``quality`` are sentences on recordings, ``few_data`` says how few data were fitted,
    "" if there are enough. ``assumed`` says which values of the film and the load no recording
    has, "" if none. ``seconds`` is the computing time. ``interrupted`` is True where the operator
    ended it while intervals were computed: those that were left are by the curvature.
    """

    title: str
    kind: str
    method: str
    model: ModelFile
    fit: Identification
    train: tuple[Comparison, ...]
    validation: tuple[Comparison, ...]
    trials: tuple[BranchTrial, ...]
    seconds: float
    springs: tuple[SpringCandidate, ...] = ()
    model_path: str = ""
    quality: tuple[str, ...] = ()
    few_data: str = ""
    assumed: str = ""
    published_fit: Published | None = None
    interrupted: bool = False


@dataclass(frozen=True)
class ValidateOutcome:
    """A finished validation: one comparison for each recording.

    ``model_path`` is the model's file, "" for a model that is in none.
    """

    title: str
    kind: str
    model_name: str
    model_path: str
    comparisons: tuple[Comparison, ...]


@dataclass(frozen=True)
class Evaluation:
    """One model with its ``effects`` on all recordings.

    ``train`` were fitted; ``validation`` were not used by any fit or choice.
    """

    effects: tuple[str, ...]
    train: tuple[Comparison, ...]
    validation: tuple[Comparison, ...]


@dataclass(frozen=True)
class SeparatingExperiment:
    """The sequence under which rival models differ most.

    ``rivals`` are the labels of the models, ``separates`` their families. ``separation`` is the
    smallest RMS difference between the predictions of any two of them, in noise floors; ``closest``
    names those two. ``tried`` are all sequences with that number and their duration in s.
    ``average`` is the number of conversions in a row that it is to be recorded with. ``by_channel``
    are the RMS differences of the closest two in each channel, in its own noise.
    """

    name: str
    sequence: str
    rivals: tuple[str, ...]
    separates: tuple[str, ...]
    separation: float
    closest: tuple[str, str]
    seconds: float
    tried: tuple[tuple[str, float, float], ...]
    average: int = 1
    by_channel: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class DeterminingRecord:
    """The shortest sequence that would show what the validation recordings ask for.

    With it, the training recordings would leave no more open than ``open_rms`` noises.
    """

    name: str
    sequence: str
    seconds: float
    open_rms: float


@dataclass(frozen=True)
class DiagnoseOutcome:
    """A finished (or interrupted) diagnosis, with its errors on training and validation recordings.

    ``model`` is the model that predicts better, the final one or the baseline, with its history;
    ``model_path`` is where it was saved, "" if it was not. ``stands`` are the baseline, the model
    after each step, and last the final one. ``noise`` is the pooled noise floor of the training
    recordings in m or Pa. ``experiment`` separates explanations that the data do not separate;
    ``experiment_text`` describes it, or says why there is none. ``performed`` describes the
    experiments that were run on a rig, one sentence each. ``quality`` are sentences on recordings.
    ``ended`` is the error that ended the recording on the rig early, None if none did.
    ``not_compared`` names validation recordings that the final model cannot follow. ``few_data``
    says how few data were fitted, "" if there are enough. ``assumed`` says which values of the film
    and the load no recording has, "" if none. ``prediction_errors`` are, of each validation
    recording, the part in m or Pa that the errors of the fitted parameters alone may make (95 %
    bound), () where that is not known. ``gain`` is twice the logarithm of the odds that the
    validation recordings give to what was found, without what happened in one of them alone: None
    where nothing was found or nothing validates it, minus infinity where the final model cannot
    follow one of them. ``excitation`` is what each validation recording asks beyond the training
    recordings, ``tested`` how far all of them test the model (() and None of films);
    ``determining`` would show what is not determined, None where nothing asks for it or no sequence
    does. ``recurring`` are events that all recordings have at one moment, so that predictions have
    them. ``seconds`` is the computing time.
    """

    title: str
    kind: str
    drive: str
    model: ModelFile
    finding: Diagnosis
    stands: tuple[Evaluation, ...]
    noise: float
    experiment: SeparatingExperiment | None
    experiment_text: str
    quality: tuple[str, ...]
    seconds: float
    model_path: str = ""
    performed: tuple[str, ...] = ()
    rig: str = ""
    ended: DearigError | None = None
    not_compared: tuple[str, ...] = ()
    few_data: str = ""
    assumed: str = ""
    prediction_errors: tuple[float, ...] = ()
    gain: float | None = None
    recurring: tuple[OneTimeEvent, ...] = ()
    excitation: tuple[Excitation, ...] = ()
    tested: Tested | None = None
    determining: DeterminingRecord | None = None

    @property
    def status(self) -> str:
        """How the search ended: ``complete``, ``stopped`` or ``budget``."""
        # an experiment on a rig can be stopped after a search that came to its end
        return STOPPED if self.finding.interrupted else self.finding.status

    @property
    def verdict(self) -> str:
        """One of the constants of ``dearig.model.verdict``, as of ``judgement``."""
        return self.judgement.verdict

    @property
    def is_rejected(self) -> bool:
        """Whether the final model leaves more than noise: intervals hold only if it is right."""
        return self.verdict in (PARTLY_EXPLAINED, NOT_CONFIRMED, UNEXPLAINED)

    @property
    def _comparable(self) -> tuple[tuple[Comparison, Comparison], ...]:
        """Validation recordings with the baseline and with the final model.

        () where the final model cannot follow one that the baseline follows.
        """
        last = {c.name: c for c in self.after.validation}
        if any(c.name not in last for c in self.before.validation):
            return ()
        return tuple((c, last[c.name]) for c in self.before.validation)

    @property
    def recommends_final(self) -> bool:
        """Whether the final model predicts untouched recordings better than the baseline does.

        True where none was given. The model that predicts better is the one to be written and used.
        """
        if not self.finding.steps or not self.before.validation:
            return True
        before, after = ([pair[i] for pair in self._comparable] for i in (0, 1))
        return bool(after) and pooled_rms(after) < pooled_rms(before)

    @property
    def families(self) -> tuple[tuple[str, float], ...]:
        """The probabilities of the families, largest first, with what validation says of them.

        Where it does not confirm what was found, or not to the noise, the part of the error above
        the noise that is left on untouched recordings is of no known family.
        """
        return self._confirmed(self.finding.families)

    @property
    def marginals(self) -> dict[str, float]:
        """The probability of each family that it is among what is missing, as of ``families``.

        Empty where the search did not say.
        """
        known = self.finding.marginals
        return dict(self._confirmed(known)) if known else {}

    def _confirmed(self, families: tuple[tuple[str, float], ...]) -> tuple[tuple[str, float], ...]:
        reasons = self.judgement.reasons
        doubted = "validation" in reasons and "excitation" not in reasons
        if not (self.finding.steps and (doubted or self.verdict == NOT_CONFIRMED)):
            return families
        left = 1.0
        if self.recommends_final and self._comparable:
            above = [
                max(pooled_steady_rms(some) ** 2 - (pooled_noise(some) or self.noise) ** 2, 0.0)
                for some in ([pair[i] for pair in self._comparable] for i in (0, 1))
            ]
            left = above[1] / above[0] if above[0] > 0.0 else 1.0
        # what does not recur in other recordings is not theirs to deny
        once = {s.family for s in self.finding.steps if not s.may_recur}
        found = {f: p if f in once else p * (1.0 - left) for f, p in families}
        denied = 1.0 - min(sum(p for f, p in families if f in once), 1.0)
        found["unknown"] = found.get("unknown", 0.0) + left * denied
        return tuple(sorted(found.items(), key=lambda item: -item[1]))

    @property
    def _within_parameters(self) -> list[float]:
        """The errors on validation over the noise and the parameters' own error in prediction."""
        return [
            c.over_noise(self.noise) / math.hypot(1.0, own / self.noise)
            for c, own in zip(self.after.validation, self.prediction_errors, strict=True)
        ]

    @property
    def undetermined(self) -> tuple[Excitation, ...]:
        """What validation recordings above their noise ask, if the training recordings lack it.

        () unless that explains each of them: the error lies where training shows too little, or is
        within what the uncertainty of the fitted parameters allows.
        """
        own = self._within_parameters if self.prediction_errors else ()
        beyond = [
            (asked, bool(own) and own[i] <= TOLERANCE)
            for i, (c, asked) in enumerate(
                zip(self.after.validation, self.excitation, strict=False)
            )
            if c.over_noise(self.noise) > TOLERANCE
        ]
        if self.not_compared or not all(asked.cause or within for asked, within in beyond):
            return ()
        return tuple(asked for asked, _ in beyond)

    @cached_property
    def judgement(self) -> Judgement:
        """The verdict that all numbers support, with the reasons against a better one."""
        finding = self.finding
        untouched = [c.over_noise(self.noise) for c in self.after.validation]
        if finding.verdict == NOTHING_MISSING and self.prediction_errors:
            # what the parameters' own error explains is not a missing effect
            untouched = self._within_parameters
        # of a film with the error that its model is allowed
        noise = math.sqrt(sum(s.noise**2 for s in finding.after) / len(finding.after))
        return judge(
            finding.verdict,
            self.status,
            [s.rms / s.noise for s in finding.after],
            [*untouched, *(math.inf for _ in self.not_compared)],
            (finding.baseline.selection_rms / noise, finding.final.selection_rms / noise),
            any(c.moves_at_rest for c in self.after.train),
            self.gain,
            bool(self.undetermined),
            self.recommends_final,
        )

    @property
    def before(self) -> Evaluation:
        """The baseline."""
        return self.stands[0]

    @property
    def after(self) -> Evaluation:
        """The final model."""
        return self.stands[-1]


_Fitted = TypeVar("_Fitted", bound=IdentifyOutcome | DiagnoseOutcome)


def constraint_table(constraint: Constraint | None) -> dict[str, float] | None:
    """Return what was stated of a parameter, in SI units; None where nothing was."""
    if constraint is None:
        return None
    found = {key: getattr(constraint, key) for key in ("fixed", "low", "high", "mean", "sd")}
    return {key: float(value) for key, value in found.items() if value is not None}


def estimate_table(estimates: Sequence[Estimate]) -> list[dict[str, Any]]:
    """Return ``estimates`` in SI units for a model's history; an open end is None."""

    def end(e: Estimate, value: float) -> float | None:
        return None if e.is_fixed or value == 0.0 or not math.isfinite(value) else value

    return [
        {
            "name": e.name,
            "unit": e.unit,
            "value": e.value,
            "low95": end(e, e.low),
            "high95": end(e, e.high),
            "determined": e.determined,
            "at_bound": e.at_bound,
            "systematic": e.systematic,
            "note": e.note,
            "stated": constraint_table(e.constraint),
        }
        for e in estimates
    ]


def save_fitted_model(outcome: _Fitted, path: str | Path, overwrite: bool = False) -> _Fitted:
    """Write the model of ``outcome`` to ``path``; return the outcome, which then names the file.

    Raises ``InputError`` where the file may not be written.
    """
    from dearig.config.modelfile import save_model

    model = outcome.model
    written = save_model(path, model.name, model.model, model.history, overwrite)
    return replace(outcome, model_path=str(written))


def pooled_rms(comparisons: Sequence[Comparison]) -> float:
    """RMS over all samples of all recordings, in m or Pa."""
    return _pooled(comparisons, [c.errors.rms for c in comparisons])


def pooled_steady_rms(comparisons: Sequence[Comparison]) -> float:
    """As ``pooled_rms``, without each recording's own drift and events."""
    return _pooled(comparisons, [c.steady_rms for c in comparisons])


def _pooled(comparisons: Sequence[Comparison], errors: Sequence[float]) -> float:
    samples = [c.errors.samples for c in comparisons]
    squares = sum(e**2 * n for e, n in zip(errors, samples, strict=True))
    return math.sqrt(squares / sum(samples))


def pooled_noise(comparisons: Sequence[Comparison]) -> float | None:
    """RMS of the noise floors that are known, over all samples, in m or Pa; None where none is."""
    known = [c for c in comparisons if c.noise is not None]
    return _pooled(known, [c.noise or 0.0 for c in known]) if known else None


def pooled_over_noise(comparisons: Sequence[Comparison]) -> float | None:
    """Return ``pooled_rms`` over ``pooled_noise``: the error in every text, table and file.

    None where the noise is not known.
    """
    noise = pooled_noise(comparisons)
    return pooled_rms(comparisons) / noise if noise else None


def covariance_table(names: Sequence[str], covariance: np.ndarray) -> dict[str, Any] | None:
    """Return ``covariance`` (f, f) of parameters ``names`` in SI units as plain values.

    None where there is none. It comes from the curvature of the likelihood at the optimum.
    """
    if covariance.size == 0 or not np.isfinite(covariance).all():
        return None
    return {"names": list(names), "matrix": covariance.tolist()}


def budget_table(budget: Sequence[Contribution]) -> list[dict[str, Any]]:
    """Return the contributions to an uncertainty budget as plain values, in SI units."""
    return [
        {
            "given": c.given.name,
            "relative_uncertainty": c.given.relative,
            "shifts": dict(zip(c.names, c.shifts, strict=True)),
        }
        for c in budget
    ]


def noise_from(comparisons: Sequence[Comparison]) -> str | None:
    """Return where the noise is from: lead-in, second differences, or both; None if not known."""
    sources = {c.noise_source for c in comparisons if c.noise is not None}
    return ", ".join(sorted(sources)) or None
