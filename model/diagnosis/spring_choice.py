"""Choose the strain energy that is most probable by the records: the criterion of a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dearig.model.diagnosis.evidence import Judge
from dearig.model.diagnosis.fits import Fit, Fitter, fit_of
from dearig.model.diagnosis.settings import DiagnosisSettings
from dearig.model.errors import ModelError
from dearig.model.film.material import Network
from dearig.model.fitting.identify import fit_globally
from dearig.model.fitting.left_out import left_out
from dearig.model.fitting.levenberg import descend
from dearig.model.fitting.parameters import Constraint
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator
from dearig.model.simulation.strip import Strip

__all__ = ["SpringTrial", "choose_springs"]


@dataclass(frozen=True)
class SpringTrial:
    """One candidate, fitted to the records that all candidates are compared on.

    ``kind`` is the strain energy of its equilibrium spring, as it was asked for.
    ``criterion`` is that of ``diagnosis.evidence``, less the least one of all candidates.
    ``probability`` is by the criterion, with equal prior odds; over all candidates they add up to
    1. ``free`` counts the fitted parameters. ``rms`` and ``left_out_rms`` are errors of the
    readings, in m or Pa: of the fit, and of each tenth of the readings predicted by a fit to the
    others.
    """

    kind: str
    model: Actuator | Strip
    criterion: float
    probability: float
    free: int
    rms: float
    left_out_rms: float


def choose_springs(
    records: Sequence[Record],
    candidates: Sequence[Actuator | Strip],
    settings: DiagnosisSettings | None = None,
    workers: int = 2,
    progress: Callable[[str, float], None] = lambda *_: None,
    constraints: Sequence[Constraint] = (),
) -> tuple[SpringTrial, ...]:
    """Return a trial of each of ``candidates`` that can follow ``records``, in their order.

    Candidates are models whose structure counts: kinds of springs, number of branches. The same
    prior, the same noise and the same number of independent samples hold for all, and the same
    ``constraints``, where a candidate has the parameter. Raises ``ModelError`` where none can
    follow the records.
    """
    settings = settings or DiagnosisSettings()
    fits: list[Fit] = []
    kinds: list[str] = []
    refused: list[ModelError] = []
    for i, candidate in enumerate(candidates):

        def report(_: str, part: float, i: int = i) -> None:
            progress("springs", (i + part) / len(candidates))

        try:
            fitter = Fitter(records, candidate, settings, workers, constraints=constraints)
            fits.append(_with_free_shape(fitter, _beside(candidate, fits), report))
            kinds.append(candidate.network.equilibrium.kind)
        except ModelError as error:
            refused.append(error)
    if not fits:
        raise refused[0]
    # over the candidate that explains least: the error of a law's form counts for all alike
    judge = Judge(settings, max(fits, key=lambda f: f.cost))
    judge.see(fits)
    criteria = np.array([judge.criterion(f) for f in fits])
    criteria -= criteria.min()
    weights = np.exp(-0.5 * criteria / settings.tempering)
    return tuple(
        SpringTrial(kind, fit.model, float(c), float(w / weights.sum()), fit.free, *_errors(fit))
        for kind, fit, c, w in zip(kinds, fits, criteria, weights, strict=True)
    )


def _beside(candidate: Actuator | Strip, fits: Sequence[Fit]) -> Network | None:
    """Return a start of a ``candidate``: its equilibrium spring next to the best branches so far.

    With it a law with more parameters, or more branches, does not fit worse by its starts alone.
    """
    network = candidate.network
    known = [
        f
        for f in fits
        if len(f.model.network.branches) <= len(network.branches)
        and all(
            a.spring.kind == b.spring.kind
            for a, b in zip(f.model.network.branches, network.branches, strict=False)
        )
    ]
    if not known:
        return None
    best = min(known, key=lambda f: f.cost).model.network
    if best.equilibrium.kind == network.equilibrium.kind:
        return best
    first = replace(network.equilibrium, modulus=best.equilibrium.modulus)
    return Network(first, best.branches)


def _with_free_shape(
    fitter: Fitter, nested: Network | None, progress: Callable[[str, float], None]
) -> Fit:
    """Return the fitted model, the shape of its equilibrium spring too; ``nested`` is one start.

    The criterion charges for each parameter, so the shape is not held where it explains little. At
    an actuator's strain the shapes of the branches are not determined, and are held.
    """
    if not fitter.of_actuator:
        problem = fitter.problem(fitter.base)
        found, fixed = fit_globally(problem, nested, progress)
        return fit_of(problem, fixed, found)
    held = fitter.baseline(progress)
    problem = held.problem
    fixed = np.array([q.is_shape and q.index > 0 for q in problem.layout.quantities])
    fixed |= problem.layout.fixed
    return fit_of(problem, fixed, descend(problem, held.x, fixed))


def _errors(fit: Fit) -> tuple[float, float]:
    """Return the RMS of the readings' errors, in m or Pa: fitted, and left out."""
    problem = fit.problem
    sigma = problem.sigma
    known = np.isfinite(sigma)
    jacobian = problem.jacobian(fit.x, ~fit.fixed)
    reach = problem.layout.reach(fit.x)[~fit.fixed]
    without = left_out(fit.residuals, jacobian, reach)

    def rms(residuals: np.ndarray) -> float:
        return math.sqrt(float(np.mean((residuals[known] * sigma[known]) ** 2)))

    return rms(fit.residuals), rms(without)
