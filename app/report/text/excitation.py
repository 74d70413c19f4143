"""Sentences on what validation recordings ask of a model, and training recordings show of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from dearig.model.verdict import EXPLAINED, NOTHING_MISSING
from dearig.report.text.numbers import significant
from dearig.report.text.sentences import listed

if TYPE_CHECKING:
    from dearig.analysis.outcomes import DiagnoseOutcome
    from dearig.model.diagnosis.excitation import FrequencyBand

__all__ = ["bands_text", "tested_texts", "undetermined_texts"]


def undetermined_texts(outcome: DiagnoseOutcome) -> Iterator[str]:
    """Yield sentences on what validation asks and training does not show, and on what would."""
    from dearig.model.diagnosis.excitation import BANDS, LEVELS

    for asked in outcome.undetermined:
        bands = asked.undetermined
        if asked.cause == BANDS:
            yield (
                f"{asked.name} asks for motion that the training recordings do not determine, "
                f"{bands_text(bands)}: {significant(100.0 * asked.share, 2)} % of its error above "
                f"the noise lies there."
            )
        elif asked.cause == LEVELS:
            yield (
                f"{asked.name} goes to voltages or displacements that the training recordings do "
                f"not reach: {significant(100.0 * asked.above, 2)} % of its error above the noise "
                f"lies there."
            )
        else:
            yield (
                f"The error of {asked.name} is within what the uncertainty of the fitted "
                f"parameters allows."
            )
    if outcome.determining is not None:
        yield (
            f"A recording of {outcome.determining.name!r} "
            f"({outcome.determining.seconds:.0f} s) for training would show it."
        )


def bands_text(bands: Sequence[FrequencyBand]) -> str:
    """Return ``bands`` of rising frequency as "at 0.1 to 0.4 Hz and 50 to 100 Hz"."""
    joined: list[list[float]] = []
    for band in bands:
        if joined and joined[-1][1] == band.low:
            joined[-1][1] = band.high
        else:
            joined.append([band.low, band.high])
    return "at " + listed(f"{significant(a, 2)} to {significant(b, 2)} Hz" for a, b in joined)


def tested_texts(outcome: DiagnoseOutcome) -> Iterator[str]:
    """Yield how far validation recordings test a verdict that they confirm, or that none do."""
    tested, verdict = outcome.tested, outcome.verdict
    if not outcome.after.validation:
        yield (
            "No validation recordings were given: the errors do not show how well the model "
            "predicts other recordings."
        )
    # where training lacks what they ask, that is said instead
    confirmed = verdict in (EXPLAINED, NOTHING_MISSING) and not outcome.undetermined
    if tested is not None and confirmed:
        yield (
            f"The validation recordings test this up to {significant(tested.voltage / 1e3)} kV, "
            f"edges of {significant(tested.rate / 1e3)} kV/s and motion at "
            f"{significant(tested.low, 2)} to {significant(tested.high, 2)} Hz; it is not known "
            f"beyond."
        )
