"""The callback by which long work reports its progress."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress", "quiet"]

#: Called with the name of a stage and the fraction of it that is done, 0 to 1.
Progress = Callable[[str, float], None]


def quiet(stage: str, fraction: float) -> None:
    """Ignore the progress."""
