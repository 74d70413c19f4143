"""One criterion for every choice of a diagnosis: minus twice the logarithm of the evidence.

    C = n ln(c + delta^2 (c0 - c)) + k ln n + log det(drift)            (8)

c is the mean square of the whitened residuals over the noise, c0 that of the baseline, k the number
of fitted parameters. No law is true to more than delta of what it explains. Electrical channels add
a term each, (12). n counts independent samples: the readings over the least correlation time of any
fit so far, one n for the whole diagnosis. (Schwarz, Annals of Statistics 6, 461 (1978); the scale
of the noise is marginalised.)
Numbers of equations are those of ``app/docs/explanation/diagnosis.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.diagnosis.channels import ChannelEvidence
from dearig.model.diagnosis.fits import DRIFT, Fit
from dearig.model.diagnosis.preparation import at_rest
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.effects import EFFECTS
from dearig.model.fitting.channels import Channels
from dearig.model.fitting.intervals import correlation_time, has_spectrum_of, is_flat
from dearig.model.readings.noise import REST_MIN
from dearig.model.readings.records import ActuatorRecord
from dearig.model.simulation.actuator import Actuator

__all__ = ["Evidence", "Judge", "family_of"]

#: Twice the logarithm of odds that nothing outweighs: of an effect that a recorded channel denies.
_DENIED = 1e6


def family_of(member: str) -> str:
    """Return the family of an effect, or of ``DRIFT``."""
    return "drift" if member == DRIFT else EFFECTS[member].family


def _coloured_rest(baseline: Fit) -> tuple[np.ndarray, ...]:
    """Return each record's readings before its voltage, where they are not white; else ().

    Means of conversions share readings of a sensor that averages too: they are never taken for
    white.
    """
    rest = [
        part[at_rest(record)]
        for part, record in zip(baseline.by_record(), baseline.problem.records, strict=True)
    ]
    if min(part.size for part in rest) < REST_MIN:
        return ()
    averaged = any(
        isinstance(record, ActuatorRecord) and record.average > 1
        for record in baseline.problem.records
    )
    if not averaged and all(map(is_flat, rest)):
        return ()
    return tuple(rest)


@dataclass(frozen=True)
class Evidence:
    """Value of the criterion for one fit, and its parts."""

    misfit: float
    size: float

    @property
    def criterion(self) -> float:
        """Minus twice the logarithm of the evidence, but for a constant."""
        return self.misfit + self.size


class Judge:
    """Compares fits to the same records; ``see`` it every fit that may count."""

    def __init__(
        self, settings: DiagnosisSettings, baseline: Fit, channels: Channels | None = None
    ) -> None:
        self.settings = settings
        self.readings = baseline.problem.samples
        self.base_cost = baseline.cost
        self._correlation = max(1.0, baseline.correlation)
        self._rest = _coloured_rest(baseline) if self._sensed(baseline) else ()
        #: what the electrical channels say; None where none is used
        self.channels: ChannelEvidence | None = None
        if channels and isinstance(baseline.model, Actuator):
            self.channels = ChannelEvidence(channels, settings, baseline.model)

    def see(self, fits: Iterable[Fit]) -> None:
        """Take account of the correlation times of ``fits``."""
        for fit in fits:
            self._correlation = max(1.0, min(self._correlation, fit.correlation))
            if self.channels and isinstance(fit.model, Actuator):
                self.channels.see(fit.model)

    @property
    def samples(self) -> float:
        """Number n of independent samples."""
        return self.readings / self._correlation

    def evidence(self, fit: Fit) -> Evidence:
        """Return the evidence for ``fit``, that of electrical channels included."""
        own = self.of_displacement(fit)
        return replace(own, misfit=own.misfit + self._of_channels(fit))

    def of_displacement(self, fit: Fit) -> Evidence:
        """Return the evidence for ``fit`` from the displacement alone."""
        s, n = self.settings, self.samples
        loss = fit.cost + s.form_error**2 * max(self.base_cost - fit.cost, 0.0)
        drift = fit.problem.noise_drift
        return Evidence(
            n * math.log(max(loss, 1e-12)),
            fit.free * math.log(max(n, 2.0)) + (drift.log_det if drift else 0.0),
        )

    def _of_channels(self, fit: Fit) -> float:
        """Return what the electrical channels add to C; much where one denies an effect."""
        model = fit.seen
        if self.channels is None or not isinstance(model, Actuator):
            return 0.0
        veto = _DENIED if self.is_denied(fit) else 0.0
        return self.channels.total(model) + veto + fit.handicap

    def is_denied(self, fit: Fit) -> bool:
        """Whether a channel denies an effect of ``fit``."""
        model = fit.seen
        if self.channels is None or not isinstance(model, Actuator):
            return False
        return self.channels.denied(model) is not None

    def unseen(self, fit: Fit, name: str, best: Fit) -> Fit:
        """Return ``fit`` with its effect ``name`` as one that no channel shows.

        It is no more probable than ``best``, which no channel speaks against, times the odds that
        such a fault is not shown: the forms of two laws decide little between them.
        """
        found = replace(fit, unseen=name)
        ahead = max(self.criterion(best) - self.criterion(found), 0.0)
        odds = 2.0 * self.settings.tempering * math.log(1.0 / self.settings.unseen_share)
        return replace(found, handicap=ahead + odds)

    def demanded(self, parent: Fit, fit: Fit) -> bool:
        """Whether an electrical channel supports ``fit`` over ``parent`` decisively."""
        if self.channels is None:
            return False
        before, after = parent.model, fit.model
        if not (isinstance(before, Actuator) and isinstance(after, Actuator)):
            return False
        return self.channels.demands(before, after)

    def criterion(self, fit: Fit) -> float:
        """Return C; the smallest is the most probable."""
        return self.evidence(fit).criterion

    def gain(self, over: Fit, fit: Fit) -> float:
        """Return by how much C of ``fit`` is below that of another."""
        return self.criterion(over) - self.criterion(fit)

    def ranked(self, fits: Iterable[Fit]) -> list[Fit]:
        """Return ``fits``, the most probable first."""
        return sorted(fits, key=self.criterion)

    def is_noise(self, fit: Fit) -> bool:
        """Whether the residual is as small as the noise, within what the lead-in knows of it."""
        return fit.cost < self.settings.noise_margin**2

    def is_settled(self, fit: Fit) -> bool:
        """Whether nothing is left that any effect could explain.

        The residual is white, or as coloured as the reading at rest, or so small a part of what is
        explained that it may be the form of a law. A fit with a branch at the shortest time of the
        search is not settled: that branch may imitate a faster effect.
        """
        if not self.is_noise(fit):
            return False
        if not self._sensed(fit):
            return True
        if self.channels and isinstance(fit.model, Actuator) and self.channels.is_open(fit.model):
            return False
        if fit.has_fastest_branch:
            return False
        return self._is_like_rest(fit) or fit.cost - 1.0 < self.settings.form_share * (
            self.base_cost - fit.cost
        )

    def _is_like_rest(self, fit: Fit) -> bool:
        """Whether the residual is white, or has the spectrum of the reading at rest."""
        margin = self.settings.white_correlation
        if not self._rest:
            return fit.correlation <= margin and fit.is_flat
        return all(
            has_spectrum_of(part, rest)
            and correlation_time(part) <= margin * max(correlation_time(rest), 1.0)
            for part, rest in zip(fit.by_record(), self._rest, strict=True)
        )

    @staticmethod
    def _sensed(fit: Fit) -> bool:
        """Whether the noise is that of a sensor: the tolerance of a film's model is not white."""
        return hasattr(fit.problem.layout.base, "load")

    def justifies(self, parent: Fit, fit: Fit) -> bool:
        """Whether ``fit`` explains decisively more than ``parent``, which has fewer effects."""
        s = self.settings
        left = max(parent.cost - 1.0, 1e-9)
        enough = not parent.members or (parent.cost - fit.cost) / left > s.share
        explains = parent.cost - fit.cost > s.form_error and enough
        return self.gain(parent, fit) > s.odds and (explains or self.demanded(parent, fit))

    def probabilities(self, fits: Sequence[Fit], sought: Iterable[str] = ()) -> dict[str, float]:
        """Return the share of each family in the probability of what is missing; they add up to 1.

        A fit with several families shares its probability out among them, so that two that are both
        certain have a half each. ``none`` is the baseline, ``unknown`` what no fit explains.
        """
        found: dict[str, float] = {}
        for weight, families in self._weighted(fits, sought):
            for family in families:
                found[family] = found.get(family, 0.0) + weight / len(families)
        return found

    def marginals(self, fits: Sequence[Fit], sought: Iterable[str] = ()) -> dict[str, float]:
        """Return the probability of each family that it is among what is missing.

        They do not add up to 1: several families may be missing together.
        """
        found: dict[str, float] = {}
        for weight, families in self._weighted(fits, sought):
            for family in families:
                found[family] = found.get(family, 0.0) + weight
        return found

    def _weighted(
        self, fits: Sequence[Fit], sought: Iterable[str]
    ) -> list[tuple[float, list[str]]]:
        """Return the probability of each fit, and its families.

        Weighs each by exp(-C/2t), with prior odds of e^(-odds/2) an effect, with the
        tempering t of the settings. A family that was ``sought``, and of which there is no fit
        next to the baseline alone, is taken for one effect of one number that explains nothing:
        that a record does not show it does not exclude it.
        """
        if not fits:
            return [(1.0, ["none"])]
        s = self.settings
        scores = [
            (self.criterion(f) + s.odds * len(f.members), {family_of(m) for m in f.members})
            for f in fits
        ]
        alone = {next(iter(families)) for _, families in scores if len(families) == 1}
        unseen = s.odds + math.log(max(self.samples, 2.0))
        scores += [
            (score + unseen, {family})
            for score, families in scores
            if not families
            for family in set(sought) - alone
        ]
        # (9), relative to the largest term
        least = min(score for score, _ in scores)
        weights = [math.exp(-0.5 * (score - least) / s.tempering) for score, _ in scores]
        total = sum(weights)
        return [
            (weight / total, sorted(families or ["none"]))
            for weight, (_, families) in zip(weights, scores, strict=True)
        ]
