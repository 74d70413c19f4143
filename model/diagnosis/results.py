"""Results of a diagnosis: immutable values for reports, windows and files.

Quantities are in SI units: displacement in m or stress in Pa, whichever was measured.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dearig.model.diagnosis.channels import ChannelSays, Denial
from dearig.model.effects import EFFECTS, Curve
from dearig.model.fitting import Contribution, Estimate
from dearig.model.fitting.channels import ChannelResult
from dearig.model.residual import MissingStress, Signature, Unnamed
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = [
    "Candidate",
    "Diagnosis",
    "Round",
    "Stage",
    "Step",
]


@dataclass(frozen=True)
class Stage:
    """A fitted model and its errors: ``cost`` is the mean square of residual over noise.

    ``train_rms``, and ``selection_rms`` and ``selection_max`` (each segment of time predicted by a
    fit to the others), are pooled over the training records, in the measured unit. ``criterion`` is
    the Bayesian information criterion with correlated residuals counted as fewer readings; only
    differences have a meaning. ``estimates`` are the model's parameters with their intervals,
    ``sums`` those of moduli of which the data determine the sum alone.
    ``for_others`` is the model that predicts other recordings, refitted without the effects that
    are specific to these recordings. ``models`` are those of the training records, each with its
    own drift. ``covariance`` (f, f) is that of the fitted parameters ``covariance_names``, in SI
    units. ``budget`` is what the uncertainty of each given value does to the parameters, () where
    none is known.
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
    covariance_names: tuple[str, ...] = ()
    covariance: np.ndarray = field(default_factory=lambda: np.empty((0, 0)), compare=False)
    budget: tuple[Contribution, ...] = ()
    sums: tuple[Estimate, ...] = ()

    def of_each(self, records: int) -> tuple[Actuator | Strip, ...]:
        """Return the models of so many training ``records``."""
        return self.models or (self.model,) * records

    @property
    def predicting(self) -> Actuator | Strip:
        """Model that predicts other recordings."""
        return self.for_others or self.model


@dataclass(frozen=True)
class Candidate:
    """One effect and the base model refitted with it.

    ``promised`` is the share of the residual's mean square that the score test predicts to first
    order, ``gained`` the share that the refit removed. ``gain`` is the
    decrease of the information criterion from the base, ``behind`` its distance to the best
    candidate of the round (0 for the best). ``verdict`` is one of chosen, indistinguishable
    (explains as much as the best, possibly with more parameters), better (than the base, but not
    the best), worthless, denied (by a channel), failed. ``note`` gives the reason.
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
    """One pass over all candidates besides the effects ``base``; ``candidates`` best first."""

    base: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    chosen: str | None
    reason: str


@dataclass(frozen=True)
class Step:
    """One effect that the diagnosis added to the model, the model with it, and the evidence.

    ``stage`` is the model with this and all earlier steps' effects. ``estimates`` are this
    effect's parameters with 95 % intervals in the final model. ``indistinguishable_from`` names
    the families that explain these data as well. ``evidence`` are sentences for and against.
    ``nearest`` is the best law with a name where the effect is the general law of its family.
    ``says`` is what each electrical channel says of the effect.
    """

    effect: str
    family: str
    acts_on: str
    stage: Stage
    estimates: tuple[Estimate, ...]
    indistinguishable_from: tuple[str, ...]
    evidence: tuple[str, ...]
    numbers: tuple[tuple[str, float], ...] = ()
    nearest: str = ""
    says: tuple[ChannelSays, ...] = ()

    @property
    def may_recur(self) -> bool:
        """Whether other recordings have the effect too: neither a drift nor what happened once."""
        return self.family != "drift" and EFFECTS[self.effect].is_reproducible

    @property
    def curve(self) -> Curve | None:
        """Return the form that a general law has found; None for a law with a name."""
        draw = EFFECTS[self.effect].curve
        return draw({e.name: e.value for e in self.estimates}) if draw else None


@dataclass(frozen=True)
class Diagnosis:
    """Result of a diagnosis. ``verdict`` is one of the four constants of this module.

    ``rivals`` are fitted models that these data do not distinguish from the final one, by family,
    for the choice of an experiment; ``runners_up`` are the most probable fitted models of other
    families, one of each. ``interrupted`` is True where the operator stopped the search;
    everything found until then is kept. ``held`` is True where the records declare the voltage
    linear between samples, but the data show that it is held until the next. ``notes`` are
    sentences for the operator. ``status`` is ``complete``, ``stopped`` (by the operator) or
    ``budget`` (the search took the work that it may). ``families`` are the probabilities of the
    families, of ``none`` and of ``unknown``, largest first, which add up to 1: several that
    are missing together share theirs. ``marginals`` are the probabilities that each is among what
    is missing, which do not add up to 1. ``channels`` are the electrical channels, used or not.
    ``channel_evidence`` is, of the leading families, twice the logarithm of the odds that each
    channel gives to the family's best fit over the baseline: (family, ((channel, odds), ...)).
    ``denials`` are effects that would explain the displacement, and that a channel denies.
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
    status: str = "complete"
    families: tuple[tuple[str, float], ...] = ()
    marginals: tuple[tuple[str, float], ...] = ()
    runners_up: tuple[tuple[str, Actuator | Strip], ...] = ()
    channels: tuple[ChannelResult, ...] = ()
    channel_evidence: tuple[tuple[str, tuple[tuple[str, float], ...]], ...] = ()
    denials: tuple[Denial, ...] = ()
