"""What a diagnosis finds: immutable values, from which reports, windows and files are made.

Quantities are in SI units: displacement in m or stress in Pa, whichever was measured.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dearig.model.actuator import Actuator
from dearig.model.film import Strip
from dearig.model.fitting import Estimate

__all__ = [
    "EXPLAINED",
    "MUCH_LEFT",
    "NOISE_RMS",
    "NOTHING_MISSING",
    "NOT_BY_CHANCE",
    "PARTLY_EXPLAINED",
    "UNEXPLAINED",
    "Candidate",
    "Dependence",
    "Diagnosis",
    "MissingStress",
    "Round",
    "Signature",
    "Stage",
    "Step",
    "Unnamed",
]

#: Residual over noise that still is noise: the noise itself is known to some per cent.
NOISE_RMS = 1.08
#: Mean square of residual over noise from which it matters what is missing, not yet by which law,
#: and what is sought shows in rough simulations, too.
MUCH_LEFT = 25.0
#: Probability below which a spectrum that noise might have by chance is called that of no noise.
NOT_BY_CHANCE = 1e-3

NOTHING_MISSING = "nothing_missing"
EXPLAINED = "explained"
PARTLY_EXPLAINED = "partly_explained"
UNEXPLAINED = "unexplained"


@dataclass(frozen=True)
class Dependence:
    """How the residual depends on one quantity: bin centres ``at`` (B,) and bin means.

    ``loading`` and ``unloading`` (B,) are the means of the residual where the quantity rises and
    where it falls (NaN where a bin is empty); ``error`` (B,) is the standard error of the bin mean
    if the residual were noise. ``explained`` is the share of the residual's variance that a
    function of this quantity alone explains, 0 to 1, beyond what noise would give.
    """

    quantity: str
    unit: str
    at: np.ndarray
    loading: np.ndarray
    unloading: np.ndarray
    error: np.ndarray
    explained: float


@dataclass(frozen=True)
class Signature:
    """What the residual of one record looks like.

    ``time``, ``residual`` (N,): measured less model, in the measured unit. ``noise`` is the floor
    of one of these samples. ``ljung_box_p`` and ``runs_p`` are the probabilities that noise alone
    would be as correlated, and change its sign as seldom. ``frequency`` Hz and ``density`` (F,)
    are its power spectral density (unit^2/Hz), ``floor_density`` that of the noise. ``words`` says
    the remarkable in sentences.
    """

    record: str
    time: np.ndarray
    residual: np.ndarray
    noise: float
    rms: float
    ljung_box_p: float
    runs_p: float
    correlation_time: float
    frequency: np.ndarray
    density: np.ndarray
    floor_density: float
    dependences: tuple[Dependence, ...]
    loading_less_unloading: float
    first_less_repeats: float
    is_noise: bool
    words: tuple[str, ...]


@dataclass(frozen=True)
class MissingStress:
    """The stress in Pa that the model lacks, sample by sample (N,), with what it may depend on.

    ``band`` is the upper frequency in Hz to which it was kept; ``scale`` the RMS of the Maxwell
    stress (or of the measured stress of a film) to compare it with. ``voltage`` is zero for films.
    """

    record: str
    time: np.ndarray
    stress: np.ndarray
    stretch: np.ndarray
    rate: np.ndarray
    voltage: np.ndarray
    band: float
    scale: float


@dataclass(frozen=True)
class Stage:
    """A fitted model and how well it does: ``cost`` is the mean square of residual over noise.

    ``train_rms``, and ``selection_rms`` and ``selection_max`` (each segment of time predicted by a
    fit to the others), are pooled over the training records, in the measured unit. ``criterion`` is
    the Bayesian information criterion, counting correlated residuals as what they are worth; only
    differences mean something. ``estimates`` are the model's numbers with their intervals.
    ``for_others`` is the model by which other recordings are predicted: the same without what
    happened in these recordings only, fitted again. ``models`` are those of the training records,
    each with the walk that it has of its own.
    """

    model: Actuator | Strip
    cost: float
    train_rms: float
    selection_rms: float
    selection_max: float
    criterion: float
    estimates: tuple[Estimate, ...] = ()
    for_others: Actuator | Strip | None = None
    models: tuple[Actuator | Strip, ...] = ()

    def of_each(self, records: int) -> tuple[Actuator | Strip, ...]:
        """The models of so many training ``records``."""
        return self.models or (self.model,) * records

    @property
    def predicting(self) -> Actuator | Strip:
        """The model by which other recordings are predicted."""
        return self.for_others or self.model


@dataclass(frozen=True)
class Candidate:
    """One effect, tried in full: the base model refitted with it.

    ``promised`` is the share of the residual's mean square that its sensitivity promises to
    first order (the score test), ``gained`` the share that the refit took away. ``gain`` is the
    fall of the information criterion against the base, ``behind`` how far it lies behind the best
    candidate of its round (0 for the best). ``verdict`` is one of chosen, indistinguishable
    (explains as much as the best, be it with more numbers), better (than nothing, but not the
    best), worthless, failed. ``note`` says why in words.
    """

    effect: str
    family: str
    acts_on: str
    stage: Stage
    promised: float
    gained: float
    gain: float
    behind: float
    verdict: str
    note: str = ""


@dataclass(frozen=True)
class Round:
    """One pass over all candidates on top of the effects ``base``; ``candidates`` best first."""

    base: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    chosen: str | None
    reason: str


@dataclass(frozen=True)
class Step:
    """One effect that the diagnosis put into the model, the model with it, and the evidence.

    ``stage`` is the model with this and all earlier steps' effects. ``estimates`` are this
    effect's own numbers with 95 % intervals in the final model. ``indistinguishable_from`` names
    the families that explain these data as well. ``evidence`` are sentences, for and against.
    """

    effect: str
    family: str
    acts_on: str
    stage: Stage
    estimates: tuple[Estimate, ...]
    indistinguishable_from: tuple[str, ...]
    evidence: tuple[str, ...]
    numbers: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Unnamed:
    """Something that no effect covers: where it acts, a formula if one was found, and its look."""

    acts_on: str
    expression: str
    signature: str


@dataclass(frozen=True)
class Diagnosis:
    """All that was found. ``verdict`` is one of the four constants of this module.

    ``rivals`` are fitted models that the data cannot tell from the final one, by family, for the
    choice of an experiment. ``interrupted`` is True where the operator ended it early: everything
    found until then is here. ``held`` is True where the records call the voltage linear between
    samples, and the data show that it stands until the next. ``notes`` are sentences for the
    operator.
    """

    verdict: str
    baseline: Stage
    rounds: tuple[Round, ...]
    steps: tuple[Step, ...]
    final: Stage
    before: tuple[Signature, ...]
    after: tuple[Signature, ...]
    missing_before: tuple[MissingStress, ...]
    missing_after: tuple[MissingStress, ...]
    unnamed: Unnamed | None
    rivals: tuple[tuple[str, Actuator | Strip], ...]
    simulations: int
    interrupted: bool = False
    held: bool = False
    notes: tuple[str, ...] = field(default=())
