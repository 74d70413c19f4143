"""Validation of a model on recordings: error tables like the thesis's Tables 4 and 5."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dearig.analysis.outcomes import ValidateOutcome
from dearig.analysis.records import compare, open_all
from dearig.config.modelfile import load_model
from dearig.progress import Progress, quiet

__all__ = ["validate_model"]


def validate_model(
    model_path: str | Path,
    paths: Sequence[str | Path],
    *,
    drive: str = "command",
    progress: Progress = quiet,
) -> ValidateOutcome:
    """Compare the model in ``model_path`` with each recording. Raises ``InputError``.

    A recording that the model was fitted to is marked as training data, by its checksum.
    """
    model = load_model(model_path)
    recordings = open_all(paths)
    comparisons = []
    for i, recording in enumerate(recordings):
        role = "train" if recording.sha256 in model.fitted else "validation"
        comparisons.append(compare(recording, model.model, role, drive))
        progress("validation", (i + 1) / len(recordings))
    return ValidateOutcome(
        title=f"{model.name} on {len(recordings)} recording{'s' if len(recordings) > 1 else ''}",
        kind=recordings[0].kind,
        model_name=model.name,
        model_path=str(model_path),
        comparisons=tuple(comparisons),
    )
