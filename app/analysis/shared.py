"""Fit of one model to the recordings of a film, some of whose parameters differ between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dearig.analysis.cores import for_simulations
from dearig.analysis.outcomes import Comparison
from dearig.analysis.readings.compare import compare
from dearig.analysis.readings.compatibility import base_model, check_branches
from dearig.analysis.readings.opening import Source
from dearig.analysis.readings.record import read_all, recordings_of
from dearig.errors import InputError
from dearig.model.errors import ModelError
from dearig.model.fitting import Estimate, fit_shared
from dearig.progress import Progress, quiet

__all__ = ["SharedOutcome", "identify_shared"]


@dataclass(frozen=True)
class SharedOutcome:
    """One recording of a film: its estimates, shared and own, and its errors by its model."""

    path: Path
    estimates: tuple[Estimate, ...]
    comparison: Comparison
    converged: bool


@for_simulations()
def identify_shared(
    train: Sequence[Source],
    own: Sequence[str],
    *,
    branches: int = 3,
    spring: str = "gent",
    drive: str = "command",
    ended_early: str = "keep",
    progress: Progress = quiet,
) -> list[SharedOutcome]:
    """Fit one model to the recordings ``train`` of a film; ``own`` parameters differ between them.

    ``own`` are names such as mu_0 and permittivity. Recordings that ``ended_early`` leaves out are
    not in the result. Raises ``InputError`` for recordings and names that cannot be fitted.
    """
    check_branches(branches)
    readings, _ = read_all(train, drive, ended_early)
    base = base_model(recordings_of(readings), branches, spring, None, None)
    records = [each.record for each in readings]
    try:
        fit = fit_shared(records, base, own, progress=progress)
    except ModelError as error:
        raise InputError(f"these recordings cannot be fitted together: {error}") from error
    return [
        SharedOutcome(r.recording.path, estimates, compare(r, model, "train"), fit.converged)
        for r, estimates, model in zip(readings, fit.estimates, fit.models, strict=True)
    ]
