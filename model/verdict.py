"""Verdict of a diagnosis: what its numbers allow to say."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

__all__ = [
    "BUDGET",
    "COMPLETE",
    "CONFIRMING",
    "EXPLAINED",
    "NOTHING_MISSING",
    "NOT_CONFIRMED",
    "PARTLY_EXPLAINED",
    "REJECTED_BELOW",
    "STOPPED",
    "TOLERANCE",
    "UNEXPLAINED",
    "Judgement",
    "is_rejected",
    "judge",
    "p_text",
    "smallest_p",
]

NOTHING_MISSING = "nothing_missing"
EXPLAINED = "explained"
PARTLY_EXPLAINED = "partly_explained"
NOT_CONFIRMED = "not_confirmed"
UNEXPLAINED = "unexplained"

#: How the search ended: on its own, stopped by the operator, or at its computing budget.
COMPLETE = "complete"
STOPPED = "stopped"
BUDGET = "budget"

#: Error over noise up to which a recording counts as explained. The noise floor is known to some
#: per cent, and the fitted parameters add their own error to a prediction.
TOLERANCE = 1.15

#: Twice the logarithm of the odds, e^5, by which validation recordings have to be more probable
#: with the effects that were found than without them: as much as tells two explanations apart.
CONFIRMING = 10.0

#: Probability, of noise alone, below which a model is called rejected: that of a right model is, on
#: one recording of a thousand.
REJECTED_BELOW = 1e-3


@dataclass(frozen=True)
class Judgement:
    """A verdict, and the reasons for which it is less than what the search found.

    ``reasons`` are of: ``training`` (the error of a training recording is above its noise),
    ``selection`` (the cross-validation error rises with what was added), ``validation`` (the error
    of a validation recording is above its noise), ``excitation`` (all of that is where the training
    recordings determine nothing: edges, levels or rests that they do not have), ``rest`` (nothing
    was found, but the readings at rest move slowly, and count as noise), ``stopped`` (nothing is
    missing so far, but not everything was tried) and ``prediction`` (validation recordings above
    their noise are not predicted better with what was found than without it).
    """

    verdict: str
    reasons: tuple[str, ...] = ()


def judge(
    found: str,
    status: str,
    training: Sequence[float],
    validation: Sequence[float],
    selection: tuple[float, float],
    moves_at_rest: bool = False,
    gain: float | None = None,
    undetermined: bool = False,
    predicts_better: bool = True,
) -> Judgement:
    """Return the verdict that the numbers support, which is never more than ``found``.

    ``found`` is the verdict of the search, which sees the training recordings only; ``status`` says
    how the search ended. ``training`` and ``validation`` are the errors over the noise with the
    final model, one for each recording, without the recording's own drift and events where these
    are known; infinite where the model cannot follow the recording. ``selection`` is the
    cross-validation error over the noise, with the baseline and with the final model. With
    ``moves_at_rest`` the noise at rest of a training recording is mostly slow motion. ``gain`` is
    twice the logarithm of how much more probable the validation recordings are with the effects
    that were found, None where none was found or nothing validates it. ``undetermined`` says that
    each validation recording above its noise asks for what the training recordings do not show.
    With ``predicts_better`` the final model leaves a smaller error on all validation recordings
    together than the baseline; what is more probable on most of them may ruin the others.
    """
    beyond = any(error > TOLERANCE for error in validation)
    fails = gain is not None and (gain < CONFIRMING or not predicts_better)
    if found in (EXPLAINED, PARTLY_EXPLAINED) and fails and beyond:
        return Judgement(NOT_CONFIRMED, ("prediction",))
    if found not in (NOTHING_MISSING, EXPLAINED):
        return Judgement(found)
    before, after = selection
    doubts = {
        "training": any(error > TOLERANCE for error in training),
        "selection": found == EXPLAINED and after > before and after > TOLERANCE,
        "validation": beyond,
        "excitation": beyond and undetermined,
        "rest": found == NOTHING_MISSING and moves_at_rest,
        "stopped": found == NOTHING_MISSING and status == STOPPED,
    }
    reasons = tuple(name for name, doubtful in doubts.items() if doubtful)
    return Judgement(PARTLY_EXPLAINED if reasons else found, reasons)


def is_rejected(p: float | None) -> bool:
    """Whether the probability that noise alone leaves a residual rejects the model.

    Not where it is not known.
    """
    return p is not None and p < REJECTED_BELOW


def smallest_p(values: Iterable[float | None]) -> float | None:
    """Return the probability of the least of several independent ``values``; None for none."""
    known = [p for p in values if p is not None]
    return min(1.0, len(known) * min(known)) if known else None


def p_text(p: float) -> str:
    """Return a probability as "p = 0.02"; below the precision of a number as "p < 1e-15"."""
    return f"p = {p:.1g}" if p >= 1e-15 else "p < 1e-15"
