"""Validation of a model on recordings: error tables like the thesis's Tables 4 and 5."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dearig.analysis.outcomes import ValidateOutcome
from dearig.analysis.readings.band import with_bands
from dearig.analysis.readings.compare import compare
from dearig.analysis.readings.opening import Source
from dearig.analysis.readings.record import read_all
from dearig.config.modelfile import ModelFile, load_model
from dearig.progress import Progress, quiet

__all__ = ["validate_model"]


def validate_model(
    model: str | Path | ModelFile,
    recordings: Sequence[Source],
    *,
    drive: str = "command",
    progress: Progress = quiet,
) -> ValidateOutcome:
    """Compare ``model``, or the one in the model file of that path, with each recording.

    A recording that the model was fitted to is marked as training data, by its checksum. Raises
    ``InputError``.
    """
    given = model if isinstance(model, ModelFile) else load_model(model)
    opened, _ = read_all(recordings, drive)
    comparisons, used = [], []
    for i, readings in enumerate(opened):
        role = "train" if readings.recording.sha256 in given.fitted else "validation"
        used.append(readings.held() if given.assumes_held_voltage else readings)
        comparisons.append(compare(used[-1], given.model, role))
        progress("validation", (i + 1) / len(opened))
    return ValidateOutcome(
        title=f"{given.name} on {len(opened)} recording{'s' if len(opened) > 1 else ''}",
        kind=opened[0].kind,
        model_name=given.name,
        model_path="" if isinstance(model, ModelFile) else str(model),
        comparisons=with_bands(comparisons, used, given),
    )
